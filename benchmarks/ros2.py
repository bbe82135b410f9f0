"""Two hundred robots over ROS 2: steps per second, and the time from a command to the step that takes it.

Their odom is heard, and their cmd_vel sent, by a node on Cyclone DDS in a process of its own.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import struct
import subprocess
import sys
import time

import numpy as np

from tussle import Block, Mission, Simulation
from tussle.plugins.links.ros.dds import Ros2Link
from tussle.plugins.links.ros.messages import ENCAPSULATION
from tussle.stock import ROS2Autonomy, ROS2ClockServer, SimpleCar

PERIOD = 0.1  # [s]


def drive(n: int) -> None:
    """The other node: each odom is answered with a command whose linear.y is the time at which it was sent."""
    link = Ros2Link()
    for i in range(1, n + 1):
        sender = link.advertise(f"entity{i}/cmd_vel", "geometry_msgs/Twist")

        def answer(_, sender=sender):
            sender.publish(ENCAPSULATION + struct.pack("@6d", 1.0, time.monotonic(), 0.0, 0.0, 0.0, 0.0))

        link.subscribe(f"entity{i}/odom", "nav_msgs/Odometry", answer)
    is_over: list[bool] = []
    with contextlib.suppress(BrokenPipeError):
        os.set_blocking(sys.stdin.fileno(), False)
        while not is_over:
            link.wait_for(lambda: False, 0.5, lambda: False)
            if sys.stdin.buffer.read(1) == b"":
                is_over.append(True)
    link.end()


def play(n: int, lockstep: float, steps: int) -> None:
    """Play a game and print its figures."""
    block = Block(
        name="car",
        count=n,
        variance=(1e4, 1e4, 0.0),
        autonomy=ROS2Autonomy(lockstep=lockstep),
        motion=SimpleCar(),
    )
    mission = Mission(blocks=[block], dt=PERIOD, end=1e6, interactions=[ROS2ClockServer()])
    driver = subprocess.Popen(
        [sys.executable, __file__, "--drive", "--robots", str(n)], stdin=subprocess.PIPE
    )
    with Simulation(mission) as simulation:
        robots = list(simulation.state.population.groups[0].autonomies[0].plugin.robot)
        while not all(robot.has_peer() for robot in robots):
            time.sleep(0.05)
        simulation.step(2)
        delays, walls = [], []
        began, cpu = time.perf_counter(), time.process_time()
        for k in range(1, steps + 1):
            if not lockstep:
                time.sleep(max(began + k * PERIOD - time.perf_counter(), 0.0))
            before, start = [robot.inbox.n_received for robot in robots], time.perf_counter()
            simulation.step()
            walls.append(time.perf_counter() - start)
            now = time.monotonic()
            delays += [
                now - robot.inbox.command[1]
                for robot, n_received in zip(robots, before, strict=True)
                if robot.inbox.n_received > n_received
            ]
        wall, cpu = time.perf_counter() - began, time.process_time() - cpu
    driver.communicate()
    low, high = 1e3 * np.percentile(delays, [50.0, 99.0])
    kind = "lockstep" if lockstep else "real time"
    print(
        f"{n} robots, {kind}: {steps / wall:6.1f} steps/s, a step takes {1e3 * np.median(walls):5.1f} ms "
        f"(99 %: {1e3 * np.percentile(walls, 99.0):5.1f} ms), {1e3 * cpu / steps:5.2f} CPU ms, "
        f"{len(delays) / steps / n:4.2f} commands per robot and step, "
        f"from a command to the end of the step that takes it {low:5.1f} ms (median), {high:5.1f} ms (99 %)"
    )


def main() -> None:
    """Measure in the domain of the environment."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=200)
    parser.add_argument("--steps", type=int, default=100)
    parser.add_argument("--drive", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.drive:
        drive(options.robots)
        return
    play(options.robots, 0.0, options.steps)
    play(options.robots, 10.0, options.steps)


if __name__ == "__main__":
    main()
