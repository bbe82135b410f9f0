"""An autonomy in a node of ROS 1, without a simulator: states from odom, commands to cmd_vel."""

from __future__ import annotations

import queue
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from tussle.api import Autonomy
from tussle.engine.simulation import Simulation
from tussle.engine.wiring import written_channels
from tussle.errors import ParameterError, RosError
from tussle.mission import Block, Mission
from tussle.numeric.quaternion import quat_from_euler, quat_rotate, quat_rotate_inverse, quat_to_yaw
from tussle.pacing import POLL_PERIOD
from tussle.plugins.links.ros.link import RosLink
from tussle.plugins.links.ros.node import checked_namespace
from tussle.plugins.stock import External

DRIVES = "speed", "velocity_x"
"""Channels of which an autonomy writes one."""


class AutonomyHost:
    """One robot's autonomy, called with states from outside; it does what it does in a simulation in these states.

    Args:
        plugin: The autonomy.
        dt: Time between two calls [s].
        seed: Seed of its random numbers.
        team: Team of the robot.

    Raises:
        TussleError: It cannot work alone.
        ParameterError: It writes no channel that moves a robot.
    """

    def __init__(self, plugin: Autonomy, dt: float, seed: int = 1, team: int = 1) -> None:
        block = Block(name="robot", team=team, autonomy=plugin, motion=External())
        mission = Mission(blocks=[block], dt=dt, end_conditions=("none",))
        self.simulation = Simulation(mission, seed)
        self._paths = {
            channel: (f"robot.{plugin.instance_name}.{name}", i if len(column.channels) > 1 else None)
            for name, column in written_channels(plugin).items()
            for i, channel in enumerate(column.channels)
        }
        if not set(DRIVES) & set(self._paths):
            raise ParameterError(
                f"{plugin.instance_name} writes {', '.join(self._paths) or 'no channel'}; it needs {' or '.join(DRIVES)}"
            )

    def step(self, state: Mapping[str, np.ndarray]) -> dict[str, float]:
        """Call the autonomy in a state.

        Args:
            state: pos [m], vel [m/s], omega [rad/s], (3,), world frame, and quat, (4,).

        Returns:
            Channel -> value.
        """
        for name, value in state.items():
            self.simulation.write(f"robot.{name}", np.asarray(value)[None, None])
        self.simulation.step()
        values = {channel: self.simulation.read(path)[0][0, 0] for channel, (path, _) in self._paths.items()}
        return {c: float(v if self._paths[c][1] is None else v[self._paths[c][1]]) for c, v in values.items()}


def state_of(odometry: Any) -> dict[str, np.ndarray]:
    """State of a message nav_msgs/Odometry, for `AutonomyHost.step`.

    Raises:
        RosError: A number is not finite, or the attitude is no unit quaternion.
    """
    pose, twist = odometry.pose.pose, odometry.twist.twist
    q = pose.orientation
    pos, linear, angular = (np.array([v.x, v.y, v.z]) for v in (pose.position, twist.linear, twist.angular))
    quat = np.array([q.w, q.x, q.y, q.z])
    if not (np.isfinite([*pos, *linear, *angular]).all() and abs(float(quat @ quat) - 1.0) < 1e-3):
        raise RosError(
            f"odom: position {pos}, attitude {quat}, twist {linear}, {angular} is no state of a body"
        )
    columns = quat[:, None]
    vel, omega = (quat_rotate(columns, vector[:, None])[:, 0] for vector in (linear, angular))
    return {"pos": pos, "vel": vel, "quat": quat, "omega": omega}


def set_twist(twist: Any, outputs: Mapping[str, float], quat: np.ndarray) -> None:
    """Write channels to a message geometry_msgs/Twist, as `ROSAutonomy` reads it; `quat` is the robot's attitude, (4,)."""
    linear = np.array([outputs.get("speed", 0.0), 0.0, 0.0])
    if "velocity_x" in outputs:
        velocity = np.array([[outputs.get(f"velocity_{axis}", 0.0)] for axis in "xyz"])
        yaw = quat_to_yaw(quat[:, None])
        linear = quat_rotate_inverse(quat_from_euler(0.0 * yaw, 0.0 * yaw, yaw), velocity)[:, 0]
    twist.linear.x, twist.linear.y, twist.linear.z = linear.tolist()
    twist.angular.x, twist.angular.y = outputs.get("roll_rate", 0.0), -outputs.get("pitch_rate", 0.0)
    twist.angular.z = outputs.get("turn_rate", outputs.get("steering", 0.0))


def serve(host: AutonomyHost, namespace: str, is_interrupted: Callable[[], bool]) -> int:
    """Answer each odom of a namespace with a cmd_vel, until the user interrupts.

    Returns:
        Number of answers.

    Raises:
        RosError: The master is not there or has gone, or an odom is no state.
    """
    name, link = checked_namespace(namespace), RosLink()
    news: queue.Queue[Any] = queue.Queue()
    n_answers = 0
    try:
        link.advertise(f"{name}/cmd_vel", link.ros.Twist)
        link.subscribe(f"{name}/odom", link.ros.Odometry, news.put)
        while not is_interrupted():
            if link.lost:
                raise RosError(link.lost)
            try:
                message = news.get(timeout=POLL_PERIOD)
            except queue.Empty:
                continue
            state = state_of(message)
            twist = link.ros.Twist()
            set_twist(twist, host.step(state), state["quat"])
            link.publish(f"{name}/cmd_vel", twist)
            n_answers += 1
    finally:
        link.end()
        host.simulation.close()
    return n_answers
