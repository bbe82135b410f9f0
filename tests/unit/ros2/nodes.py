"""What tests of ROS 2 share: games, and nodes as processes."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

from tussle import Block, Mission
from tussle.plugins.links.ros.dds import Ros2Link
from tussle.stock import RayTrace, ROS2Autonomy, ROS2ClockServer, SimpleCar

DT = 0.125
PEER = Path(__file__).with_name("peer.py")


def cars(n=2, has_clock=True, clock=None, **autonomy):
    block = Block(
        name="car", team=1, count=n, position=(10.0, 20.0, 0.0), variance=(50.0, 50.0, 0.0), heading="30 deg",
        autonomy=ROS2Autonomy(**autonomy), motion=SimpleCar(),
        sensor=RayTrace(num_rays_horiz=5, angle_res_horiz="45 deg", scan_period=DT),
    )  # fmt: skip
    return Mission(
        blocks=[block], dt=DT, end=1e6, interactions=[ROS2ClockServer(**(clock or {}))] if has_clock else []
    )


def link_of(simulation) -> Ros2Link:
    return simulation.state.context.shared["ROS 2"]


def inbox_of(simulation, row=0):
    return simulation.state.population.groups[0].autonomies[0].plugin.robot[row].inbox


def started(stack, command, **options):
    """A process with pipes, which is ended with the stack."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    process = stack.enter_context(subprocess.Popen(list(map(str, command)), **pipes, **options))
    stack.callback(process.kill)
    return process


def peer(stack, domain, mode, *arguments):
    """The node in Python."""
    return started(stack, [sys.executable, PEER, domain, mode, *arguments])


def steps_until(simulation, is_there):
    """Play until something holds."""
    while not is_there():
        simulation.step()
        time.sleep(0.005)
