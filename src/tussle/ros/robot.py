"""Topics of one robot: velocity commands, and the messages that a base publishes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tussle.ros.node import checked_namespace
from tussle.ros.steps import NodeLink, Transform

TWIST = "linear.x", "linear.y", "linear.z", "angular.x", "angular.y", "angular.z"
FRAMES = "odom", "base_footprint", "base_link", "base_laser_link"
"""Frames of Stage, below each robot's namespace; each is the parent of the next."""
AT_ORIGIN = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]


class TwistInbox:
    """The newest velocity command of a topic.

    Args:
        link: The link of the simulation.
        topic: Name of the topic, without leading slash.

    Attributes:
        command: Its six components, as named by TWIST; 0 before the first command.
        n_received: Number of commands.
        fault: What is wrong with a command; empty without any.
    """

    def __init__(self, link: NodeLink, topic: str) -> None:
        self.link, self.topic = link, topic
        self.command: tuple[float, ...] = (0.0,) * len(TWIST)
        self.n_received, self.fault = 0, ""
        self.n_seen = 0  # commands at the beginning of the last step
        self.seen_at = -math.inf  # [s] simulated time at which the command was first seen
        self.subscriber = link.twist(topic, self._take)

    def _take(self, values: tuple[float, ...]) -> None:
        wrong = [f"{name} = {v!r}" for name, v in zip(TWIST, values, strict=True) if not math.isfinite(v)]
        with self.link.news:
            if wrong:
                self.fault = (
                    f"/{self.topic}: {', '.join(wrong)} is not allowed; a command takes finite numbers"
                )
            else:
                self.command = values
                self.n_received += 1
            self.link.news.notify_all()

    def at(self, t: float, timeout: float) -> tuple[float, ...]:
        """The command that holds at time t [s]: zero if the last one is older than `timeout` [s], unless that is 0."""
        if self.n_received > self.n_seen:
            self.n_seen, self.seen_at = self.n_received, t
        if timeout and t - self.seen_at > timeout:
            return (0.0,) * len(TWIST)
        return self.command


class RobotTopics:
    """Topics of a robot as those of Stage: cmd_vel; odom, base_pose_ground_truth and base_scan.

    Args:
        link: The link of the simulation.
        namespace: Of the robot.
        publishes: Whether it publishes its state.

    Attributes:
        inbox: Its commands.
        n_before: Number of commands when its state was last published.
        last_scan: Time of the last published scan [s].

    Raises:
        ParameterError: The namespace is no name of ROS.
    """

    def __init__(self, link: NodeLink, namespace: str, publishes: bool) -> None:
        self.link, self.namespace = link, checked_namespace(namespace)
        self.inbox = TwistInbox(link, f"{self.namespace}/cmd_vel")
        self.topics = [f"{self.namespace}/{topic}" for topic in ("odom", "base_pose_ground_truth")]
        self.frames = [f"{self.namespace}/{frame}" for frame in FRAMES]
        self.last_scan, self.n_before = math.nan, 0
        self._publish_scan: Any = None
        if publishes:
            self._publish = [link.odometry(topic, *self.frames[:2]) for topic in self.topics]
            link.transforms()

    def has_peer(self) -> bool:
        """Return True if somebody listens to its odometry and somebody can command it."""
        return bool(self.inbox.subscriber.get_num_connections()) and self.link.has_reader(self.topics)

    def publish_odometry(self, stamp: Any, belief: list[float], truth: list[float]) -> None:
        """Publish states: position, attitude (w, x, y, z), velocity and angular velocity in the body frame, 13 numbers."""
        for publish, state in zip(self._publish, (belief, truth), strict=True):
            publish(stamp, state)

    def transforms(
        self, state: list[float], stamp: Any, laser: tuple[np.ndarray, np.ndarray] | None
    ) -> list[Transform]:
        """Transforms of the robot's frames: of its state, and of its lidar's position and attitude on the body, where it has one."""
        poses = [state[:7], AT_ORIGIN]
        if laser is not None:
            poses.append([*laser[0].tolist(), *laser[1].tolist()])
        frames = self.frames
        return [Transform(frames[k], frames[k + 1], stamp, pose) for k, pose in enumerate(poses)]

    def advertise_scan(self) -> None:
        """Announce base_scan."""
        self._publish_scan = self.link.scan(f"{self.namespace}/base_scan", self.frames[3])

    def publish_scan(self, ranges: np.ndarray, about: Any, stamp: Any) -> None:
        """Publish a scan of a lidar; `about` is its `ScanPattern`."""
        self._publish_scan(stamp, about, ranges)
