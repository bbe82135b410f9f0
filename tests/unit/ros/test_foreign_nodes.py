"""Robots that foreign nodes of ROS 1 drive: the navigation client of the examples, and a node in C++."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import needs
import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.mission import read_mission
from tussle.plugins.links.ros.node import DEBIAN
from tussle.stock import RayTrace, ROSAutonomy, ROSClockServer, SimpleCar

# rospy leaves connections to the master to the garbage collector.
pytestmark = [
    pytest.mark.filterwarnings("ignore:unclosed <socket:ResourceWarning"),
    pytest.mark.filterwarnings(
        "ignore:Exception ignored in. <socket:pytest.PytestUnraisableExceptionWarning"
    ),
]
EXAMPLES = Path(__file__).parents[3] / "examples" / "ros"
GOALS = {"entity1": (0.0, 60.0), "entity2": (0.0, -60.0)}
"""One robot -> its goal, on the other side of a wall that reaches to 66 m from the border."""
# A child with the packages of Debian behind those of the tests, as the client finds numpy and rospy.
AS_MAIN = (
    f"import runpy, sys; sys.path.append({DEBIAN!r}); runpy.run_path(sys.argv.pop(1), run_name='__main__')"
)
LIBRARIES = "roscpp rostime rosconsole roscpp_serialization boost_system pthread"
DT = 0.125


def started(stack: ExitStack, command: list[str], **options) -> subprocess.Popen:
    """A process with its output as text, which is ended with the stack."""
    process = stack.enter_context(subprocess.Popen(command, stdout=subprocess.PIPE, text=True, **options))
    stack.callback(process.kill)
    return process


def test_cars_find_their_way_through_a_maze_by_lidar(roscore):
    mission = read_mission(EXAMPLES / "maze.xml", {"west": 1, "east": 1, "lockstep": 600}).mission
    with ExitStack() as stack:
        for name, goal in GOALS.items():
            script = str(EXAMPLES / "navigate.py")
            arguments = [f"__ns:=/{name}", f"_goals:=[{list(goal)}]"]
            started(stack, [sys.executable, "-c", AS_MAIN, script, *arguments])
        simulation = stack.enter_context(Simulation(mission))
        path = []
        while not simulation.is_over and not _all_there(path):
            simulation.step()
            path.append([simulation.read(f"{name}.pos")[0][0, 0] for name in ("west", "east")])
    assert _all_there(path)
    # They drove around the walls, not through them, and were too far apart to be there by chance.
    xy = np.array(path)[:, :, :2]
    inside = [np.abs(xy[..., 0] + 34) < 1, np.abs(xy[..., 0] - 34) < 1]
    assert (xy[inside[0]][:, 1] > 32).all()
    assert (xy[inside[1]][:, 1] < -32).all()
    assert (np.abs(xy).max(axis=-1) > 8.0).all()
    assert (xy[0, :, 0] * [-1, 1] > 34).all()


def _all_there(path) -> bool:
    return bool(path) and all(
        math.dist(pos[:2], goal) < 5.0 for pos, goal in zip(path[-1], GOALS.values(), strict=True)
    )


@pytest.fixture(scope="module")
def driver(tmp_path_factory):
    """The node in C++, compiled."""
    needs.require("roscpp")
    program = tmp_path_factory.mktemp("roscpp") / "driver"
    source = Path(__file__).with_name("driver.cpp")
    command = ["g++", "-O0", str(source), "-o", str(program)]
    subprocess.run([*command, *(f"-l{name}" for name in LIBRARIES.split())], check=True)
    return program


def test_a_node_in_cpp_hears_a_car_and_drives_it(roscore, driver):
    block = Block(
        name="car", heading="90 deg", motion=SimpleCar(), autonomy=ROSAutonomy(lockstep=600.0),
        sensor=RayTrace(num_rays_horiz=5, angle_res_horiz="45 deg", scan_period=DT),
    )  # fmt: skip
    mission = Mission(blocks=[block], dt=DT, end=100.0, interactions=[ROSClockServer()])
    with ExitStack() as stack:
        environment = {**os.environ, "ROS_NAMESPACE": "entity1"}
        node = started(stack, [str(driver)], env=environment)
        simulation = stack.enter_context(Simulation(mission))
        states = [simulation.read("car.pos")[0][0, 0].tolist()]
        for _ in range(8):
            simulation.step()
            states.append(simulation.read("car.pos")[0][0, 0].tolist())
        odoms, scans = [], []
        while len(odoms) < 8 or not scans:
            kind, *values = node.stdout.readline().split()
            (odoms if kind == "odom" else scans).append([float(value) for value in values])
    assert odoms[:8] == [[*pos, k * DT] for k, pos in enumerate(states[:8])]
    assert scans[0] == [5.0]
    assert states[-1] == pytest.approx([0.0, 8 * DT * 2.0, 0.0])
