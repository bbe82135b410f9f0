"""Vehicles in mission files of SCRIMMAGE: names and units of their attributes."""

from __future__ import annotations

import math

import pytest

from tussle.mission import read_mission

VEHICLES = {
    "a": """<controller yaw_pid="0.2, 0.01, 0.001, 18">DoubleIntegratorControllerVelYaw</controller>
        <motion_model max_vel="7" sim_copter_orientation="true" sim_copter_max_roll="20">DoubleIntegrator</motion_model>""",
    "b": """<controller p_gain="0.3" i_lim="2">SimpleCarControllerHeading</controller>
        <motion_model mass="9" length="2">SimpleCar</motion_model>""",
    "c": """<controller vel_p_gain="2" vel_i_lim="3" max_vel="9">SimpleQuadrotorControllerLQR</controller>
        <motion_model max_pitch="20">SimpleQuadrotor</motion_model>""",
    "d": """<motion_model write_csv="true" pitch_max="40" roll_min="-50">DubinsAirplane</motion_model>""",
    "e": """<controller gain="3, 4">DoubleIntegratorControllerWaypoint</controller><motion_model>DoubleIntegrator</motion_model>""",
    "f": """<controller l="2" gain="0.2">UnicycleControllerPoint</controller><motion_model>Unicycle</motion_model>""",
    "g": """<autonomy waypoints="[1 2 3] [4 5 6]" mode="reverse">GoTo</autonomy>
        <controller>SingleIntegratorControllerWaypoint</controller><motion_model>SingleIntegrator</motion_model>""",
}


def test_attributes_have_the_existing_systems_names_and_units(tmp_path):
    entities = "\n".join(f"<entity><name>{name}</name>{text}</entity>" for name, text in VEHICLES.items())
    file = tmp_path / "mission.xml"
    file.write_text(f"<runscript>\n<run end='1' dt='0.1'/>\n{entities}\n</runscript>\n")
    loaded = read_mission(file)
    block = {b.name: b for b in loaded.mission.blocks}

    def value(name, kind):
        plugins = getattr(block[name], kind)
        return (plugins if kind == "motion" else plugins[0]).values

    assert value("a", "motion")["sim_copter_max_roll"] == pytest.approx(math.radians(20))
    assert value("a", "motion")["sim_copter_orientation"] is True
    assert value("a", "controller")["yaw_pid"] == pytest.approx((0.2, 0.01, 0.001, math.radians(18)))
    assert value("b", "controller")["i_lim"] == 2.0
    assert value("b", "motion") == {"length": 2.0, "max_velocity": 20.0, "enable_gravity": False}
    assert value("c", "controller")["vel_p_gain"] == 2.0
    assert value("c", "motion")["max_pitch"] == pytest.approx(math.radians(20))
    assert value("d", "motion")["roll_min"] == pytest.approx(math.radians(-50))
    assert value("e", "controller")["gain"] == (3.0, 4.0)
    assert value("f", "controller") == {"l": 2.0, "gain": 0.2}
    assert value("g", "autonomy")["waypoints"] == ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))
    assert [note for note in map(str, loaded.notes) if "mass" in note and "SimpleCar" in note]
