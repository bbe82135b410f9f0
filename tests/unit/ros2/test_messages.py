"""Bytes of messages: equal to those that rosbags, which is independent of Cyclone DDS, writes from the definitions of ROS 2."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import needs
import numpy as np
import pytest

from tussle.errors import MissingExtraError
from tussle.plugins.links.ros.messages import (
    DEFINITIONS,
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
from tussle.plugins.links.ros.steps import Transform

STAMP = 12, 345_678_901
STATE = [1.0, -2.0, 3.5, 0.5, -0.5, 0.25, 0.75, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]
NAMES = ["a/odom", "robot1/odom", "robot12/odom", "robot123/odom", "robot1234/odom"]
"""Of all lengths modulo 4, and so of all paddings."""


@pytest.fixture(scope="module")
def store():
    typesys = pytest.importorskip("rosbags.typesys")
    return typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)


def named(store, name):
    package, _, short = name.partition("/")
    return store.types[f"{package}/msg/{short}"]


def header(store, frame):
    return named(store, "std_msgs/Header")(named(store, "builtin_interfaces/Time")(*STAMP), frame)


def pose(store, values, position="geometry_msgs/Point"):
    x, y, z, qw, qx, qy, qz = values
    return named(store, position)(x, y, z), named(store, "geometry_msgs/Quaternion")(qx, qy, qz, qw)


@pytest.mark.parametrize("frame", NAMES)
@pytest.mark.parametrize("child", NAMES)
def test_bytes_of_an_odometry(store, frame, child):
    vector, covariances = named(store, "geometry_msgs/Vector3"), np.arange(72.0).reshape(2, 36)
    at = named(store, "geometry_msgs/Pose")(*pose(store, STATE[:7]))
    moving = named(store, "geometry_msgs/Twist")(vector(*STATE[7:10]), vector(*STATE[10:]))
    message = named(store, "nav_msgs/Odometry")(
        header(store, frame),
        child,
        named(store, "geometry_msgs/PoseWithCovariance")(at, covariances[0]),
        named(store, "geometry_msgs/TwistWithCovariance")(moving, covariances[1]),
    )
    packed = odometry_bytes(frame, child)(STAMP, STATE, covariances)
    assert packed == bytes(store.serialize_cdr(message, "nav_msgs/msg/Odometry"))


def test_bytes_of_transforms(store):
    given = [
        Transform(a, b, STAMP, [k + one for one in STATE[:7]])
        for k, (a, b) in enumerate(zip(NAMES, NAMES[::-1], strict=True))
    ]
    make = named(store, "geometry_msgs/TransformStamped")
    turned = named(store, "geometry_msgs/Transform")
    expected = [
        make(header(store, a), b, turned(*pose(store, at, "geometry_msgs/Vector3"))) for a, b, _, at in given
    ]
    message = named(store, "tf2_msgs/TFMessage")(expected)
    assert transforms_bytes(given) == bytes(store.serialize_cdr(message, "tf2_msgs/msg/TFMessage"))


@pytest.mark.parametrize("frame", NAMES)
@pytest.mark.parametrize("n", [0, 1, 5])
def test_bytes_of_a_scan(store, frame, n):
    about = SimpleNamespace(angle_increment=0.5, scan_time=0.25, range_min=0.125, range_max=30.0)
    ranges = np.linspace(1.0, 2.0, n)
    end = 0.25 * (n - 1)
    message = named(store, "sensor_msgs/LaserScan")(
        header(store, frame), -end, end, 0.5, 0.0, 0.25, 0.125, 30.0, ranges.astype(np.float32), np.zeros(0, np.float32)
    )  # fmt: skip
    packed = scan_bytes(frame)(STAMP, about, ranges)
    assert packed == bytes(store.serialize_cdr(message, "sensor_msgs/msg/LaserScan"))


@pytest.mark.parametrize("frame", NAMES)
def test_bytes_of_an_imu_and_a_compass(store, frame):
    vector, zero = named(store, "geometry_msgs/Vector3"), np.zeros(9)
    attitude = named(store, "geometry_msgs/Quaternion")(-0.5, 0.25, 0.75, 0.5)
    imu = named(store, "sensor_msgs/Imu")(
        header(store, frame), attitude, zero, vector(*STATE[7:10]), 0.25 * np.eye(3).ravel(), vector(*STATE[10:]), 4.0 * np.eye(3).ravel()
    )  # fmt: skip
    packed = imu_bytes(frame)(STAMP, STATE[3:7], STATE[7:10], STATE[10:], [0.25, 4.0])
    assert packed == bytes(store.serialize_cdr(imu, "sensor_msgs/msg/Imu"))
    field = named(store, "sensor_msgs/MagneticField")(header(store, frame), vector(*STATE[:3]), zero)
    packed = compass_bytes(frame)(STAMP, STATE[:3])
    assert packed == bytes(store.serialize_cdr(field, "sensor_msgs/msg/MagneticField"))


def test_bytes_of_a_clock(store):
    message = named(store, "rosgraph_msgs/Clock")(named(store, "builtin_interfaces/Time")(*STAMP))
    assert clock_bytes(STAMP) == bytes(store.serialize_cdr(message, "rosgraph_msgs/msg/Clock"))


@pytest.mark.parametrize("is_little", [True, False])
def test_a_twist_is_read_in_both_byte_orders(store, is_little):
    vector = named(store, "geometry_msgs/Vector3")
    message = named(store, "geometry_msgs/Twist")(vector(1.0, 2.0, 3.0), vector(4.0, 5.0, 6.0))
    data = bytes(store.serialize_cdr(message, "geometry_msgs/msg/Twist", little_endian=is_little))
    assert twist_values(data) == (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)


@pytest.mark.parametrize("is_little", [True, False])
@pytest.mark.parametrize("frame", ["", *NAMES])
def test_a_stamped_twist_is_read_whatever_its_frame(store, is_little, frame):
    vector = named(store, "geometry_msgs/Vector3")
    twist = named(store, "geometry_msgs/Twist")(vector(1.0, 2.0, 3.0), vector(4.0, 5.0, 6.0))
    message = named(store, "geometry_msgs/TwistStamped")(header(store, frame), twist)
    data = bytes(store.serialize_cdr(message, "geometry_msgs/msg/TwistStamped", little_endian=is_little))
    assert twist_values(data, is_stamped=True) == (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)


@pytest.mark.parametrize("name", DEFINITIONS)
def test_fields_and_hashes_are_those_of_ros_2(store, name):
    needs.require("cyclonedds")
    package, _, short = name.partition("/")
    fields = store.fielddefs[f"{package}/msg/{short}"][1]
    assert list(message_type(name).__dataclass_fields__) == [field for field, _ in fields]
    if name in TYPE_HASHES:
        assert store.hash_rihs01(f"{package}/msg/{short}") == TYPE_HASHES[name]


def test_without_cyclone_dds_the_error_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "cyclonedds.idl", None)
    with pytest.raises(MissingExtraError, match=r"ROS 2 needs Cyclone DDS: pip install 'tussle\[ros2\]'"):
        message_type.__wrapped__("std_msgs/Bool")
