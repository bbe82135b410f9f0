"""Topics of one robot: velocity commands, and the messages that a base publishes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tussle.numeric.quaternion import quat_conjugate, quat_from_euler, quat_multiply, quat_to_yaw
from tussle.plugins.links.ros.node import checked_namespace
from tussle.plugins.links.ros.steps import NodeLink, Transform

TWIST = "linear.x", "linear.y", "linear.z", "angular.x", "angular.y", "angular.z"
ROOT = "world"
"""The mission's frame, above all robots'."""
FRAMES = "odom", "base_footprint", "base_link", "base_laser_link"
"""Frames of a robot, below its namespace; each is the parent of the next (REP 105 and 120)."""
AT_ORIGIN = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]


def height_above_floor(scene: Any, pos: np.ndarray) -> np.ndarray:
    """Height [m], (n,), of places, (3, n), above the highest surface of a `Scene` there, or above z = 0 without one."""
    surface = scene.height(pos[0], pos[1])
    return np.asarray(pos[2] - np.where(surface > -np.inf, surface, 0.0))


def on_floor(pos: np.ndarray, quat: np.ndarray, height: np.ndarray) -> tuple[list[list[float]], ...]:
    """Poses, 7 numbers of each body, of base_footprint in the frame of `pos`, and of base_link in base_footprint.

    base_footprint is on the floor below the body, and turned as the body is about the vertical axis only (REP 120).

    Args:
        pos: Positions of the bodies [m], (3, n).
        quat: Their attitudes, (4, n).
        height: Their heights above the floor [m], (n,), as `height_above_floor` has them.
    """
    yaw, zero = quat_to_yaw(quat), np.zeros_like(height)
    level = quat_from_euler(zero, zero, yaw)
    below = np.stack([zero, zero, height])
    footprints = np.concatenate([pos - below, level])
    links = np.concatenate([below, quat_multiply(quat_conjugate(level), quat)])
    return footprints.T.tolist(), links.T.tolist()


class TwistInbox:
    """The newest velocity command of a topic.

    Args:
        link: The link of the simulation.
        topic: Name of the topic, without leading slash.
        is_stamped: Whether commands are TwistStamped; their stamps are not read.

    Attributes:
        command: Its six components, as named by TWIST; 0 before the first command.
        n_received: Number of commands.
        fault: What is wrong with a command; empty without any.
    """

    def __init__(self, link: NodeLink, topic: str, is_stamped: bool = False) -> None:
        self.link, self.topic = link, topic
        self.command: tuple[float, ...] = (0.0,) * len(TWIST)
        self.n_received, self.fault = 0, ""
        self.n_seen = 0  # commands at the beginning of the last step
        self.seen_at = -math.inf  # [s] simulated time at which the command was first seen
        self.subscriber = link.twist(topic, self._take, is_stamped)

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
        is_stamped: Whether its commands are TwistStamped.

    Attributes:
        inbox: Its commands.
        n_before: Number of commands when its state was last published.
        last_scan: Time of the last published scan [s].

    Raises:
        ParameterError: The namespace is no name of ROS.
    """

    def __init__(self, link: NodeLink, namespace: str, publishes: bool, is_stamped: bool) -> None:
        self.link, self.namespace = link, checked_namespace(namespace)
        self.inbox = TwistInbox(link, f"{self.namespace}/cmd_vel", is_stamped)
        self.topics = [f"{self.namespace}/{topic}" for topic in ("odom", "base_pose_ground_truth")]
        self.frames = [f"{self.namespace}/{frame}" for frame in FRAMES]
        self.last_scan, self.n_before = math.nan, 0
        self._publish_scan: Any = None
        if publishes:
            base = self.frames[2]
            self._publish = [
                link.odometry(topic, frame, base)
                for topic, frame in zip(self.topics, (self.frames[0], ROOT), strict=True)
            ]
            link.transforms()

    def has_peer(self) -> bool:
        """Return True if somebody listens to its odometry and somebody can command it."""
        return bool(self.inbox.subscriber.get_num_connections()) and self.link.has_reader(self.topics)

    def publish_odometry(
        self, stamp: Any, odometry: list[float], covariances: np.ndarray | None, truth: list[float]
    ) -> None:
        """Publish odometry and the true state, as those of `NodeLink.odometry`."""
        publish_odometry, publish_truth = self._publish
        publish_odometry(stamp, odometry, covariances)
        publish_truth(stamp, truth, None)

    def transforms(self, poses: list[list[float]], stamp: Any) -> list[Transform]:
        """Transforms of the robot's frames, 7 numbers each: of odom in the root, and so on, to the lidar where it has one."""
        frames = [ROOT, *self.frames]
        return [Transform(frames[k], frames[k + 1], stamp, pose) for k, pose in enumerate(poses)]

    def advertise_scan(self) -> None:
        """Announce base_scan."""
        self._publish_scan = self.link.scan(f"{self.namespace}/base_scan", self.frames[3])

    def publish_scan(self, ranges: np.ndarray, about: Any, stamp: Any) -> None:
        """Publish a scan of a lidar; `about` is its `ScanPattern`."""
        self._publish_scan(stamp, about, ranges)
