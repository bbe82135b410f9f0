"""Vehicles with six degrees of freedom in mission files of SCRIMMAGE."""

from __future__ import annotations

import math

import pytest

from tussle import Simulation
from tussle.mission import read_mission

FILE = """<runscript>
  <run start="0" end="5" dt="0.01"/>
  <entity>
    <name>a</name> <team_id>1</team_id> <count>1</count> <x>0</x> <y>0</y> <z>100</z> <heading>0</heading> <speed>20</speed>
    <autonomy speed="20">Straight</autonomy>
    <controller>{controller}</controller>
    <motion_model write_csv="true" {values}>{motion}</motion_model>
  </entity>
</runscript>"""


def read(tmp_path, motion, values="", controller="AircraftPIDController"):
    path = tmp_path / "mission.xml"
    path.write_text(FILE.format(motion=motion, values=values, controller=controller))
    return read_mission(path)


def test_variants_are_chosen_by_name_and_coefficients_by_their_own_attributes(tmp_path):
    values = 'C_L_alpha="4.5" C_MQ="-9" wind_N="3" draw_vel="1" inertia_matrix_slug_ft_sq="[1 0 0] [0 2 0] [0 0 3]"'
    loaded = read(tmp_path, "FixedWing6DOF-Rascal", values)
    motion = loaded.mission.blocks[0].motion
    assert motion.values["mass"] == 5.91
    assert motion.values["lift"] == (0.25, 4.5, 0.0, 0.0, 0.2)
    assert motion.values["pitch_moment"][2] == -9.0
    assert motion.values["wind"] == (0.0, 3.0, 0.0)
    assert motion.values["inertia_matrix_slug_ft_sq"][4] == pytest.approx(2.0 * 1.3558179)
    assert any("draw_vel of FixedWing6DOF-Rascal has no effect" in note for note in loaded.notes)
    assert read(tmp_path, "FixedWing6DOF-A-4D").mission.blocks[0].motion.values["mass"] == 7973.2467
    sim = Simulation(
        loaded.mission.replace(
            blocks=[loaded.mission.blocks[0].replace(motion=motion.replace(wind=(0.0, 0.0, 0.0)))]
        )
    )
    sim.run()
    assert sim.read("a.pos")[0][0, 0] == pytest.approx([100.0, 0.0, 100.0], abs=5.0)


def test_rotors_are_read_with_directions_and_degrees(tmp_path):
    values = 'rotor_config="[CCW +0.1 -0.2 0 0 0 90 ] [ CW +0.1 +0.2 0.05 0 0 0]" inertia_matrix="[ 0.1 0 0 ] [ 0 0.1 0 ] [ 0 0 0.2 ]"'
    motion = read(tmp_path, "Multirotor", values, "MultirotorControllerPID").mission.blocks[0].motion
    assert motion.values["rotor_config"] == (
        (-1.0, 0.1, -0.2, 0.0, 0.0, 0.0, math.pi / 2),
        (1.0, 0.1, 0.2, 0.05, 0.0, 0.0, 0.0),
    )
    assert motion.values["inertia_matrix"][8] == 0.2
