"""Topics of one simulation in ROS 2, by Cyclone DDS."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.errors import RosError
from tussle.plugins.links.ros.domain import opened_participant
from tussle.plugins.links.ros.messages import (
    TYPE_HASHES,
    clock_bytes,
    compass_bytes,
    imu_bytes,
    message_type,
    odometry_bytes,
    scan_bytes,
    transforms_bytes,
    twist_values,
)
from tussle.plugins.links.ros.steps import NANO, NodeLink, Transform

QUEUE = 10
"""Messages that wait for a slow subscriber; older ones are dropped, so that it does not delay the simulation."""
TF_QUEUE, SENSOR_QUEUE = 100, 5
"""The same for tf, as of tf2_ros, and for sensors, as of the profile for sensor data."""
MAX_SECONDS = 0.01
"""Longest time for which a subscriber that has stopped can delay a message [s]."""


class TopicWriter:
    """Sends messages of one topic.

    Args:
        writer: That of Cyclone DDS.
        message: Type of the messages.
    """

    def __init__(self, writer: Any, message: Any) -> None:
        from cyclonedds.core import DDSException

        self._writer, self._message, self._error = writer, message.deserialize(b""), DDSException

    def get_num_connections(self) -> int:
        """Return the number of subscribers."""
        return len(self._writer.get_matched_subscriptions())

    def close(self) -> None:
        """Withdraw the topic."""
        self._writer = None

    def publish(self, data: bytes) -> None:
        """Send a message, given as bytes; it is dropped if subscribers do not take the ones before it.

        Raises:
            RosError: It cannot be sent.
        """
        self._message.data = data
        try:
            self._writer.write(self._message)
        except self._error as error:
            if error.code != self._error.DDS_RETCODE_TIMEOUT:
                raise RosError(f"/{self._writer.topic.name[3:]}: {error}") from None


class TopicReader:
    """Receives messages of one topic.

    Args:
        reader: That of Cyclone DDS.
        condition: For which the link waits.
        take: Called with the bytes of each message.
    """

    def __init__(self, reader: Any, condition: Any, take: Callable[[bytes], None]) -> None:
        self._reader, self.condition, self._take = reader, condition, take

    def get_num_connections(self) -> int:
        """Return the number of publishers."""
        return len(self._reader.get_matched_publications())

    def close(self) -> None:
        """Take no more messages."""
        self._reader = self.condition = None

    def collect(self) -> None:
        """Take the messages that have come."""
        for message in self._reader.take(QUEUE):
            if message.sample_info.valid_data:  # otherwise a publisher has gone
                self._take(message.data)


class Ros2Link(NodeLink):
    """The topics of one simulation in ROS 2.

    It has a participant of its own in the domain ROS_DOMAIN_ID, which nobody outside this machine can reach unless CYCLONEDDS_URI says so.
    Messages are taken in the thread of the simulation.

    Raises:
        MissingExtraError: Cyclone DDS is not installed.
        RosError: The domain cannot be joined.
    """

    system = "ROS 2"

    def __init__(self) -> None:
        super().__init__(self._wait)
        message_type("rosgraph_msgs/Clock")  # raises if Cyclone DDS is not installed
        from cyclonedds.core import WaitSet

        self._participant = opened_participant()
        self._waitset = WaitSet(self._participant)
        self._readers: list[TopicReader] = []

    def time_of(self, seconds: int, nanoseconds: int) -> Any:
        """Return a time as messages hold it."""
        return seconds, nanoseconds

    def odometry(
        self, topic: str, frame: str, child: str
    ) -> Callable[[Any, list[float], np.ndarray | None], None]:
        """Announce odometry; returns publish(stamp, state, covariances)."""
        writer, pack = self.advertise(topic, "nav_msgs/Odometry"), odometry_bytes(frame, child)
        return lambda stamp, state, covariances: writer.publish(pack(stamp, state, covariances))

    def scan(self, topic: str, frame: str) -> Callable[[Any, Any, np.ndarray], None]:
        """Announce scans; returns publish(stamp, about, ranges)."""
        writer = self.advertise(topic, "sensor_msgs/LaserScan", SENSOR_QUEUE, is_reliable=False)
        pack = scan_bytes(frame)
        return lambda stamp, about, ranges: writer.publish(pack(stamp, about, ranges))

    def transforms(self) -> Callable[[list[Transform]], None]:
        """Announce tf; returns publish(transforms)."""
        writer = self.advertise("tf", "tf2_msgs/TFMessage", TF_QUEUE)
        return lambda transforms: writer.publish(transforms_bytes(transforms))

    def imu(self, topic: str, frame: str) -> Callable[..., None]:
        """Announce imu; returns publish(stamp, quat, rate, force, variances)."""
        writer, pack = (
            self.advertise(topic, "sensor_msgs/Imu", SENSOR_QUEUE, is_reliable=False),
            imu_bytes(frame),
        )
        return lambda *measured: writer.publish(pack(*measured))

    def compass(self, topic: str, frame: str) -> Callable[[Any, list[float]], None]:
        """Announce compass; returns publish(stamp, field)."""
        writer = self.advertise(topic, "sensor_msgs/MagneticField", SENSOR_QUEUE, is_reliable=False)
        pack = compass_bytes(frame)
        return lambda stamp, field: writer.publish(pack(stamp, field))

    def clock(self) -> Callable[[Any], None]:
        """Announce clock; returns publish(stamp)."""
        writer = self.advertise("clock", "rosgraph_msgs/Clock")
        return lambda stamp: writer.publish(clock_bytes(stamp))

    def twist(self, topic: str, take: Callable[[tuple[float, ...]], None], is_stamped: bool) -> Any:
        """Call take(values) for each command, six numbers. Returns the subscriber."""
        type_ = "geometry_msgs/TwistStamped" if is_stamped else "geometry_msgs/Twist"
        return self.subscribe(topic, type_, lambda data: take(twist_values(data, is_stamped)))

    def advertise(self, topic: str, type_: str, depth: int = QUEUE, is_reliable: bool = True) -> TopicWriter:
        """Announce a topic."""
        if topic not in self._topics:
            from cyclonedds.pub import DataWriter

            made, quality = self._topic(topic, type_), _quality(type_, depth, is_reliable)
            writer = DataWriter(self._participant, made, qos=quality)
            self._topics[topic] = TopicWriter(writer, message_type(type_))
        found: TopicWriter = self._topics[topic]
        return found

    def subscribe(self, topic: str, type_: str, take: Callable[[bytes], None]) -> TopicReader:
        """Call take(data), in the thread of the simulation, for each message. Returns the subscriber."""
        from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState
        from cyclonedds.sub import DataReader

        reader = DataReader(
            self._participant, self._topic(topic, type_), qos=_quality(type_, QUEUE, is_reliable=True)
        )
        condition = ReadCondition(reader, SampleState.Any | ViewState.Any | InstanceState.Any)
        self._waitset.attach(condition)
        self._readers.append(TopicReader(reader, condition, take))
        return self._readers[-1]

    def unsubscribe(self, subscriber: TopicReader) -> None:
        """Take no more messages for a subscriber."""
        self._readers.remove(subscriber)
        self._waitset.detach(subscriber.condition)
        subscriber.close()

    def collect(self) -> None:
        """Take the messages that have come."""
        for reader in self._readers:
            reader.collect()

    def end(self) -> None:
        """Leave the domain; called when the simulation is closed."""
        self.gate.close()
        # An entity of Cyclone DDS is deleted with the last reference to it; those of the participant hold it.
        del self._waitset
        for one in (*self._topics.values(), *self._readers):
            one.close()
        del self._participant

    def _topic(self, topic: str, type_: str) -> Any:
        from cyclonedds.topic import Topic

        return Topic(self._participant, f"rt/{topic}", message_type(type_))

    def _wait(self, seconds: float) -> None:
        self._waitset.wait(max(round(seconds * NANO), 1))
        self.collect()


def _quality(type_: str, depth: int, is_reliable: bool) -> Any:
    """Quality of service, with the message as ROS 2 writes it: CDR of version 1, and the hash of its definition."""
    from cyclonedds.core import Policy, Qos
    from cyclonedds.util import duration

    return Qos(
        Policy.Reliability.Reliable(duration(seconds=MAX_SECONDS))
        if is_reliable
        else Policy.Reliability.BestEffort,
        Policy.History.KeepLast(depth),
        Policy.Durability.Volatile,
        Policy.DataRepresentation(use_cdrv0_representation=True),
        Policy.Userdata(f"typehash={TYPE_HASHES[type_]};".encode()),
    )
