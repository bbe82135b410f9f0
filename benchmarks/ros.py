"""Fifty robots over ROS 1: steps per second, and the time from a command to the step that takes it.

Needs roscore. The robots' odom and tf are heard, and their cmd_vel sent, by a node in a process of its own.
"""

from __future__ import annotations

import argparse
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time

import numpy as np

from tussle import Block, Mission, Simulation
from tussle.plugins.links.ros.node import load_rospy, master_fault
from tussle.stock import ROSAutonomy, ROSClockServer, SimpleCar

PERIOD = 0.1  # [s]


def drive(n: int) -> None:
    """The other node: each odom is answered with a command whose linear.y is the time at which it was sent."""
    ros = load_rospy()
    ros.rospy.init_node("driver", disable_rostime=True)
    senders = {}

    def answer(message, i):
        command = ros.Twist()
        command.linear.x, command.linear.y = 1.0, time.monotonic()
        senders[i].publish(command)

    for i in range(1, n + 1):
        senders[i] = ros.rospy.Publisher(f"/entity{i}/cmd_vel", ros.Twist, queue_size=1, tcp_nodelay=True)
        ros.rospy.Subscriber(f"/entity{i}/odom", ros.Odometry, answer, i, tcp_nodelay=True)
    sys.stdin.read()


def play(n: int, lockstep: float, steps: int) -> None:
    """Play a game and print its figures."""
    block = Block(
        name="car",
        count=n,
        variance=(1e4, 1e4, 0.0),
        autonomy=ROSAutonomy(lockstep=lockstep),
        motion=SimpleCar(),
    )
    mission = Mission(blocks=[block], dt=PERIOD, end=1e6, interactions=[ROSClockServer()])
    driver = subprocess.Popen(
        [sys.executable, __file__, "--drive", "--robots", str(n)], stdin=subprocess.PIPE
    )
    with Simulation(mission) as simulation:
        robots = list(simulation.state.population.groups[0].autonomies[0].plugin.robot)
        while not all(robot.has_peer() for robot in robots):
            time.sleep(0.05)
        simulation.step()
        delays = []
        began, cpu = time.perf_counter(), time.process_time()
        for k in range(1, steps + 1):
            if not lockstep:
                time.sleep(max(began + k * PERIOD - time.perf_counter(), 0.0))
            seen = [robot.inbox.n_received for robot in robots]
            now = time.monotonic()
            simulation.step()
            if lockstep:
                now = time.monotonic()
            delays += [
                now - robot.inbox.command[1]
                for robot, n_received in zip(robots, seen, strict=True)
                if lockstep or n_received == robot.inbox.n_received
            ]
        wall, cpu = time.perf_counter() - began, time.process_time() - cpu
    driver.communicate()
    low, high = 1e3 * np.percentile(delays, [50.0, 99.0])
    kind = "lockstep" if lockstep else "real time"
    print(
        f"{n} robots, {kind}: {steps / wall:6.1f} steps/s, {1e3 * cpu / steps:5.2f} CPU ms a step, "
        f"from a command to the step that has taken it {low:5.1f} ms (median), {high:5.1f} ms (99 %)"
    )


def main() -> None:
    """Measure with a roscore of its own."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=50)
    parser.add_argument("--steps", type=int, default=100)
    parser.add_argument("--drive", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.drive:
        drive(options.robots)
        return
    if shutil.which("roscore") is None:
        sys.exit("roscore is not installed")
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    with tempfile.TemporaryDirectory() as folder:
        os.environ |= {
            "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
            "ROS_IP": "127.0.0.1",
            "ROS_LOG_DIR": folder,
        }
        core = subprocess.Popen(
            ["roscore", "-p", str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        try:
            while master_fault():
                time.sleep(0.05)
            play(options.robots, 0.0, options.steps)
            play(options.robots, 10.0, options.steps)
        finally:
            core.terminate()
            core.wait()


if __name__ == "__main__":
    main()
