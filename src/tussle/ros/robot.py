"""Topics of one robot: velocity commands, and the messages that a base publishes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from tussle.ros.link import RosLink
from tussle.ros.node import checked_namespace

TWIST = "linear.x", "linear.y", "linear.z", "angular.x", "angular.y", "angular.z"
FRAMES = "odom", "base_footprint", "base_link", "base_laser_link"
"""Frames of Stage, below each robot's namespace; each is the parent of the next."""


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

    def __init__(self, link: RosLink, topic: str) -> None:
        self.link, self.topic = link, topic
        self.command: tuple[float, ...] = (0.0,) * len(TWIST)
        self.n_received, self.fault = 0, ""
        self.n_seen = 0  # commands at the beginning of the last step
        self.seen_at = -math.inf  # [s] simulated time at which the command was first seen
        self.subscriber = link.subscribe(topic, link.ros.Twist, self._take, 1)

    def _take(self, message: Any) -> None:
        linear, angular = message.linear, message.angular
        values = linear.x, linear.y, linear.z, angular.x, angular.y, angular.z
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

    def __init__(self, link: RosLink, namespace: str, publishes: bool) -> None:
        self.link, self.namespace = link, checked_namespace(namespace)
        self.inbox = TwistInbox(link, f"{self.namespace}/cmd_vel")
        ros = link.ros
        self.topics = [f"{self.namespace}/{topic}" for topic in ("odom", "base_pose_ground_truth")]
        self.last_scan, self.n_before = math.nan, 0
        if publishes:
            frames = [f"{self.namespace}/{frame}" for frame in FRAMES]
            self._odometry = ros.Odometry(child_frame_id=frames[1])
            self._odometry.header.frame_id = frames[0]
            for topic in self.topics:
                link.advertise(topic, ros.Odometry)
            link.advertise("tf", ros.TFMessage)
            self._transforms = [ros.TransformStamped(child_frame_id=child) for child in frames[1:]]
            for transform, parent in zip(self._transforms, frames, strict=False):
                transform.header.frame_id = parent
                transform.transform.rotation.w = 1.0
            self._scan = ros.LaserScan()
            self._scan.header.frame_id = frames[3]

    def has_peer(self) -> bool:
        """Return True if somebody listens to its odometry and somebody can command it."""
        return bool(self.inbox.subscriber.get_num_connections()) and self.link.has_reader(self.topics)

    def publish_odometry(self, topic: str, state: np.ndarray, stamp: Any) -> None:
        """Publish a state: position, attitude (w, x, y, z), velocity and angular velocity in the body frame, (13,)."""
        message, values = self._odometry, state.tolist()
        message.header.stamp = stamp
        _set(message.pose.pose.position, values[:3])
        _turn(message.pose.pose.orientation, values[3:7])
        _set(message.twist.twist.linear, values[7:10])
        _set(message.twist.twist.angular, values[10:])
        self.link.publish(f"{self.namespace}/{topic}", message)

    def transforms(
        self, state: np.ndarray, stamp: Any, laser: tuple[np.ndarray, np.ndarray] | None
    ) -> list[Any]:
        """Transforms of the robot's frames: of its state, and of its lidar's position and attitude on the body, where it has one."""
        moved = [(state[:3], state[3:7]), None, laser]
        for transform, where in zip(self._transforms, moved, strict=True):
            transform.header.stamp = stamp
            if where is not None:
                _set(transform.transform.translation, where[0].tolist())
                _turn(transform.transform.rotation, where[1].tolist())
        return self._transforms if laser is not None else self._transforms[:2]

    def advertise_scan(self) -> None:
        """Announce base_scan."""
        self.link.advertise(f"{self.namespace}/base_scan", self.link.ros.LaserScan)

    def publish_scan(self, ranges: np.ndarray, about: Any, stamp: Any) -> None:
        """Publish a scan of a lidar; `about` is its `ScanPattern`."""
        scan = self._scan
        scan.header.stamp = stamp
        scan.angle_increment = about.angle_increment
        scan.angle_min = -0.5 * about.angle_increment * (len(ranges) - 1)
        scan.angle_max = -scan.angle_min
        scan.scan_time = about.scan_time
        scan.range_min, scan.range_max = about.range_min, about.range_max
        scan.ranges = ranges.tolist()
        self.link.publish(f"{self.namespace}/base_scan", scan)


def _set(vector: Any, values: Sequence[float]) -> None:
    vector.x, vector.y, vector.z = values


def _turn(quaternion: Any, values: Sequence[float]) -> None:
    quaternion.w, quaternion.x, quaternion.y, quaternion.z = values
