"""The launcher of FixedWing6DOF."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.mission import read_mission
from tussle.stock import FixedWing6DOF, FixedWing6DOFControllerPID, GoTo

MISSION = """<runscript>
  <run start="0" end="6" dt="0.01" motion_multiplier="{m}"/>
  <entity>
    <name>a</name> <count>1</count> <z>100</z> <heading>90</heading> <pitch>-30</pitch>
    <autonomy speed="20">GoTo</autonomy>
    <controller>FixedWing6DOFControllerPID</controller>
    <motion_model use_launcher="{on}" launch_accel="50" launch_speed="25" launch_time="2">FixedWing6DOF-Rascal</motion_model>
  </entity>
</runscript>"""


def flight(tmp_path, compat="", m=1, on="true"):
    """Times, positions and velocities of one aircraft."""
    path = tmp_path / "mission.xml"
    path.write_text(MISSION.format(m=m, on=on))
    sim = Simulation(read_mission(path, compat=compat).mission)
    path = []
    while not sim.is_over:
        sim.step()
        path.append([*sim.read("a.pos")[0][0, 0], *sim.read("a.vel")[0][0, 0], *sim.read("a.quat")[0][0, 0]])
    return 0.01 * np.arange(1, len(path) + 1), np.array(path)


@pytest.mark.parametrize(("compat", "m"), [("", 1), ("", 4), ("scrimmage", 1)])
def test_a_catapult_brings_it_to_its_speed_and_releases_it(tmp_path, compat, m):
    """At rest for 2 s, then 50 m/s^2 for 0.5 s along the nose, 30 degrees up; without the launcher it falls at once."""
    t, path = flight(tmp_path, compat, m)
    h = 0.01 / m  # what is written is the launcher's state at the start of a substep
    held, pushed = t <= 2.0, (t > 2.0 + h) & (t < 2.5)
    nose = np.array([0.0, math.cos(math.radians(30)), math.sin(math.radians(30))])
    np.testing.assert_allclose(path[held, :6], [[0.0, 0.0, 100.0, 0.0, 0.0, 0.0]] * held.sum(), atol=1e-9)
    since = (t[pushed] - h - 2.0)[:, None]
    np.testing.assert_allclose(path[pushed, :3] - path[0, :3], 25.0 * since**2 * nose, atol=1e-6)
    np.testing.assert_allclose(path[pushed, 3:6], 50.0 * since * nose, atol=1e-6)
    np.testing.assert_allclose(path[t < 2.5, 6:], [path[0, 6:]] * (t < 2.5).sum(), atol=1e-12)
    free = path[(t > 2.52)]
    assert np.linalg.norm(free[0, 3:6]) == pytest.approx(25.0, rel=0.05)
    assert abs(free[5:, 6:] - path[0, 6:]).max() > 1e-3  # it turns as it flies
    assert flight(tmp_path, compat, m, on="false")[1][50, 2] < 99.5


def test_times_are_those_since_birth():
    late = Block(
        name="a", count=2, rate=1.0, slots=1, first_birth=1.0, position=(0, 0, 50), autonomy=GoTo(),
        controller=FixedWing6DOFControllerPID(), motion=FixedWing6DOF(use_launcher=True, launch_time=0.5, launch_speed=100.0),
    )  # fmt: skip
    sim = Simulation(Mission(blocks=[late], dt=0.1, end=4.0, end_conditions="time"))
    speeds = []
    while not sim.is_over:
        sim.step()
        speeds.append(np.linalg.norm(sim.read("a.vel")[0][0], axis=1))
    first, second = np.array(speeds).T
    n = int((np.nan_to_num(first) < 1e-9).sum()), int((np.nan_to_num(second) < 1e-9).sum())
    assert n[1] - n[0] == 10  # born and launched a second later
