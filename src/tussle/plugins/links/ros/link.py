"""Topics of one simulation on the ROS 1 node of this process."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from tussle.plugins.links.ros.node import MASTER_TIMEOUT, master_fault, master_uri, started_node
from tussle.plugins.links.ros.steps import NodeLink, Transform, of_equal_axes

QUEUE = 10
"""Messages that wait for a slow subscriber; older ones are dropped, so that it does not delay the simulation."""
WATCH_PERIOD = 1.0  # [s] between two questions to the master


class RosLink(NodeLink):
    """The topics, services and parameters of one simulation in ROS 1.

    Attributes:
        ros: rospy and message types.

    Raises:
        MissingExtraError: rospy is not installed.
        RosError: The master does not answer.
    """

    system = "ROS 1"

    def __init__(self) -> None:
        super().__init__()
        self.ros = started_node()
        self.is_sim_time = bool(self.ros.rospy.get_param("/use_sim_time", False))
        self._open: list[Callable[[], Any]] = []
        self._frames: dict[str, Any] = {}  # child -> its transform
        self._is_over = threading.Event()
        self._watch = threading.Thread(target=self._watch_master, name="ROS master", daemon=True)
        self._watch.start()

    def publish(self, topic: str, message: Any) -> None:
        """Publish a message; its topic is advertised before the first one, or by `advertise`."""
        (self._topics.get(topic) or self.advertise(topic, type(message))).publish(message)

    def advertise(self, topic: str, type_: Any) -> Any:
        """Announce a topic, so that subscribers can connect before its first message."""
        if topic not in self._topics:
            publisher = self.ros.rospy.Publisher(f"/{topic}", type_, queue_size=QUEUE)
            self._topics[topic] = publisher
            self._open.append(publisher.unregister)
        return self._topics[topic]

    def subscribe(self, topic: str, type_: Any, callback: Callable[[Any], None], queue: int = QUEUE) -> Any:
        """Call callback(message), in another thread, for each message. Returns the subscriber."""
        # Without tcp_nodelay, a small message such as a command may wait for 40 ms.
        subscriber = self.ros.rospy.Subscriber(
            f"/{topic}", type_, callback, queue_size=queue, tcp_nodelay=True
        )
        self._open.append(subscriber.unregister)
        return subscriber

    def offer(self, service: str, type_: Any, handler: Callable[[Any], Any]) -> None:
        """Offer a service of ROS; handler(request) is called in another thread."""
        self._open.append(self.ros.rospy.Service(f"/{service}", type_, handler).shutdown)

    def use_sim_time(self) -> None:
        """Stamp with simulated time, and tell all nodes that start from now on. The parameter is as before after the simulation."""
        self.is_sim_time = True
        before = self.ros.rospy.get_param("/use_sim_time", False)
        self.ros.rospy.set_param("/use_sim_time", True)
        self._open.append(lambda: self.ros.rospy.set_param("/use_sim_time", before))

    def time_of(self, seconds: int, nanoseconds: int) -> Any:
        """Return a time as messages hold it."""
        return self.ros.Time(seconds, nanoseconds)

    def odometry(
        self, topic: str, frame: str, child: str
    ) -> Callable[[Any, list[float], np.ndarray | None], None]:
        """Announce odometry; returns publish(stamp, state, covariances)."""
        message = self.ros.Odometry(child_frame_id=child)
        message.header.frame_id = frame
        publisher = self.advertise(topic, self.ros.Odometry)

        def publish(stamp: Any, state: list[float], covariances: np.ndarray | None) -> None:
            message.header.stamp = stamp
            if covariances is not None:
                message.pose.covariance, message.twist.covariance = covariances
            _set(message.pose.pose.position, state[:3])
            _turn(message.pose.pose.orientation, state[3:7])
            _set(message.twist.twist.linear, state[7:10])
            _set(message.twist.twist.angular, state[10:])
            publisher.publish(message)

        return publish

    def scan(self, topic: str, frame: str) -> Callable[[Any, Any, np.ndarray], None]:
        """Announce scans; returns publish(stamp, about, ranges)."""
        scan = self.ros.LaserScan()
        scan.header.frame_id = frame
        publisher = self.advertise(topic, self.ros.LaserScan)

        def publish(stamp: Any, about: Any, ranges: np.ndarray) -> None:
            scan.header.stamp = stamp
            scan.angle_increment = about.angle_increment
            scan.angle_min = -0.5 * about.angle_increment * (len(ranges) - 1)
            scan.angle_max = -scan.angle_min
            scan.scan_time = about.scan_time
            scan.range_min, scan.range_max = about.range_min, about.range_max
            scan.ranges = ranges.tolist()
            publisher.publish(scan)

        return publish

    def transforms(self) -> Callable[[list[Transform]], None]:
        """Announce tf; returns publish(transforms)."""
        self.advertise("tf", self.ros.TFMessage)
        return self._publish_transforms

    def _publish_transforms(self, transforms: list[Transform]) -> None:
        messages = []
        for parent, child, stamp, pose in transforms:
            message = self._frames.get(child)
            if message is None:
                message = self._frames[child] = self.ros.TransformStamped(child_frame_id=child)
                message.header.frame_id = parent
            message.header.stamp = stamp
            _set(message.transform.translation, pose[:3])
            _turn(message.transform.rotation, pose[3:])
            messages.append(message)
        self.publish("tf", self.ros.TFMessage(messages))

    def imu(self, topic: str, frame: str) -> Callable[..., None]:
        """Announce imu; returns publish(stamp, quat, rate, force, variances)."""
        message = self.ros.Imu()
        message.header.frame_id = frame
        publisher = self.advertise(topic, self.ros.Imu)

        def publish(
            stamp: Any, quat: list[float], rate: list[float], force: list[float], variances: list[float]
        ) -> None:
            message.header.stamp = stamp
            _turn(message.orientation, quat)
            _set(message.angular_velocity, rate)
            _set(message.linear_acceleration, force)
            message.angular_velocity_covariance, message.linear_acceleration_covariance = map(
                of_equal_axes, variances
            )
            publisher.publish(message)

        return publish

    def compass(self, topic: str, frame: str) -> Callable[[Any, list[float]], None]:
        """Announce compass; returns publish(stamp, field)."""
        message = self.ros.MagneticField()
        message.header.frame_id = frame
        publisher = self.advertise(topic, self.ros.MagneticField)

        def publish(stamp: Any, field: list[float]) -> None:
            message.header.stamp = stamp
            _set(message.magnetic_field, field)
            publisher.publish(message)

        return publish

    def clock(self) -> Callable[[Any], None]:
        """Announce clock; returns publish(stamp)."""
        publisher = self.advertise("clock", self.ros.Clock)
        return lambda stamp: publisher.publish(self.ros.Clock(stamp))

    def twist(self, topic: str, take: Callable[[tuple[float, ...]], None], is_stamped: bool) -> Any:
        """Call take(values), in another thread, for each command. Returns the subscriber."""

        def hear(message: Any) -> None:
            command = message.twist if is_stamped else message
            linear, angular = command.linear, command.angular
            take((linear.x, linear.y, linear.z, angular.x, angular.y, angular.z))

        return self.subscribe(topic, self.ros.TwistStamped if is_stamped else self.ros.Twist, hear, 1)

    def unsubscribe(self, subscriber: Any) -> None:
        """Do nothing: all subscriptions are withdrawn at the end, if the master is still there."""

    def collect(self) -> None:
        """Do nothing: messages come in other threads."""

    def end(self) -> None:
        """Withdraw topics, services and parameters; called when the simulation is closed."""
        self._is_over.set()
        self.gate.close()
        self._watch.join(2.0 * MASTER_TIMEOUT)
        if not (self.lost or master_fault()):
            for withdraw in reversed(self._open):
                withdraw()

    def _watch_master(self) -> None:
        while not self._is_over.wait(WATCH_PERIOD):
            if fault := master_fault():
                self.lost = f"the ROS master at {master_uri()} is gone ({fault})"
                return


def _set(vector: Any, values: Sequence[float]) -> None:
    vector.x, vector.y, vector.z = values


def _turn(quaternion: Any, values: Sequence[float]) -> None:
    quaternion.w, quaternion.x, quaternion.y, quaternion.z = values
