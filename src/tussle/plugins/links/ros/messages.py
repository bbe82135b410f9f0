"""Messages of ROS 2: their types for Cyclone DDS, and their bytes."""

from __future__ import annotations

import importlib
import struct
import sys
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np

from tussle.errors import MissingExtraError
from tussle.plugins.links.ros.steps import Transform, of_equal_axes

DEFINITIONS = {
    "builtin_interfaces/Time": "int32 sec, uint32 nanosec",
    "std_msgs/Bool": "bool data",
    "std_msgs/Empty": "uint8 structure_needs_at_least_one_member",
    "std_msgs/Header": "builtin_interfaces/Time stamp, string frame_id",
    "geometry_msgs/Point": "float64 x, float64 y, float64 z",
    "geometry_msgs/Vector3": "float64 x, float64 y, float64 z",
    "geometry_msgs/Quaternion": "float64 x, float64 y, float64 z, float64 w",
    "geometry_msgs/Pose": "geometry_msgs/Point position, geometry_msgs/Quaternion orientation",
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose, float64[36] covariance",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear, geometry_msgs/Vector3 angular",
    "geometry_msgs/TwistStamped": "std_msgs/Header header, geometry_msgs/Twist twist",
    "geometry_msgs/TwistWithCovariance": "geometry_msgs/Twist twist, float64[36] covariance",
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation, geometry_msgs/Quaternion rotation",
    "geometry_msgs/TransformStamped": "std_msgs/Header header, string child_frame_id, geometry_msgs/Transform transform",
    "nav_msgs/Odometry": "std_msgs/Header header, string child_frame_id, geometry_msgs/PoseWithCovariance pose, "
    "geometry_msgs/TwistWithCovariance twist",
    "rosgraph_msgs/Clock": "builtin_interfaces/Time clock",
    "sensor_msgs/Imu": "std_msgs/Header header, geometry_msgs/Quaternion orientation, float64[9] orientation_covariance, "
    "geometry_msgs/Vector3 angular_velocity, float64[9] angular_velocity_covariance, "
    "geometry_msgs/Vector3 linear_acceleration, float64[9] linear_acceleration_covariance",
    "sensor_msgs/LaserScan": "std_msgs/Header header, float32 angle_min, float32 angle_max, float32 angle_increment, "
    "float32 time_increment, float32 scan_time, float32 range_min, float32 range_max, float32[] ranges, float32[] intensities",
    "sensor_msgs/MagneticField": "std_msgs/Header header, geometry_msgs/Vector3 magnetic_field, "
    "float64[9] magnetic_field_covariance",
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms",
}
"""Fields of each message, in the order of its definition in ROS 2 (https://docs.ros.org/en/rolling/p/)."""
TYPE_HASHES = {
    "std_msgs/Bool": "RIHS01_feb91e995ff9ebd09c0cb3d2aed18b11077585839fb5db80193b62d74528f6c9",
    "std_msgs/Empty": "RIHS01_20b625256f32d5dbc0d04fee44f43c41e51c70d3502f84b4a08e7a9c26a96312",
    "geometry_msgs/TwistStamped": "RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
    "geometry_msgs/Twist": "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
    "nav_msgs/Odometry": "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    "rosgraph_msgs/Clock": "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
    "sensor_msgs/Imu": "RIHS01_7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b",
    "sensor_msgs/LaserScan": "RIHS01_64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828",
    "sensor_msgs/MagneticField": "RIHS01_e80f32f56a20486c9923008fc1a1db07bbb273cbbf6a5b3bfa00835ee00e4dff",
    "tf2_msgs/TFMessage": "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
}
"""Hashes of the definitions, which ROS 2 from Iron on expects with each topic (REP 2011)."""
ENCAPSULATION = b"\x00\x01\x00\x00" if sys.byteorder == "little" else b"\x00\x00\x00\x00"
"""CDR of version 1, in the byte order of this machine (DDSI-RTPS 2.5, 10.2)."""
Stamp = tuple[int, int]
"""Seconds and nanoseconds."""


@cache
def message_type(name: str) -> Any:
    """The type of a message as Cyclone DDS takes it, with the names that ROS 2 gives to it and its fields.

    A message has its bytes, with the encapsulation, as `data`; fields are not set, since packing them one by one is slow.

    Raises:
        MissingExtraError: Cyclone DDS is not installed.
    """
    try:
        idl, types = (importlib.import_module(f"cyclonedds.{name}") for name in ("idl", "idl.types"))
    except ImportError:
        raise MissingExtraError("ROS 2 needs Cyclone DDS: pip install 'tussle[ros2]'") from None
    fields: dict[str, Any] = {}
    for kind, field in map(str.split, DEFINITIONS[name].split(", ")):
        element, is_list, size = kind.rstrip("]").partition("[")
        plain = {"string": str, "bool": bool}.get(element)
        type_: Any = message_type(element) if "/" in element else plain or getattr(types, element)
        if is_list:
            type_ = types.array[type_, int(size)] if size else types.sequence[type_]
        fields[field] = type_
    package, _, short = name.partition("/")
    message: Any = idl.make_idl_struct(short, f"{package}::msg::dds_::{short}_", fields)

    def deserialize(data: bytes, **_: Any) -> Any:
        made = message.__new__(message)
        made.data = data
        return made

    message.serialize = lambda made, **_: made.data
    message.deserialize = message.deserialize_key = deserialize
    return message


def odometry_bytes(frame: str, child: str) -> Callable[[Stamp, Sequence[float], np.ndarray | None], bytes]:
    """What packs nav_msgs/Odometry: pack(stamp, state, covariances), which are those of `NodeLink.odometry`."""
    (frame_text, frame_name), (child_text, child_name) = _text(frame), _text(child)
    # Fields with native alignment are aligned as in CDR.
    pack = struct.Struct(f"@2i{frame_text}{child_text}7d288s6d288s").pack

    def packed(stamp: Stamp, state: Sequence[float], covariances: np.ndarray | None) -> bytes:
        x, y, z, qw, qx, qy, qz, *twist = state
        of_pose, of_twist = (b"", b"") if covariances is None else (each.tobytes() for each in covariances)
        values = x, y, z, qx, qy, qz, qw, of_pose, *twist, of_twist
        return ENCAPSULATION + pack(*stamp, *frame_name, *child_name, *values)

    return packed


def transforms_bytes(transforms: Sequence[Transform]) -> bytes:
    """tf2_msgs/TFMessage of transforms with stamps of seconds and nanoseconds."""
    pack, names = _transforms_layout(tuple((parent, child) for parent, child, _, _ in transforms))
    values: list[Any] = [len(transforms)]
    for name, (_, _, stamp, (x, y, z, qw, qx, qy, qz)) in zip(names, transforms, strict=True):
        values += (*stamp, *name, x, y, z, qx, qy, qz, qw)
    return ENCAPSULATION + pack(*values)


def scan_bytes(frame: str) -> Callable[[Stamp, Any, np.ndarray], bytes]:
    """What packs sensor_msgs/LaserScan: pack(stamp, about, ranges), where `about` is the `ScanPattern`."""
    text, names = _text(frame)
    pack, no_intensities = struct.Struct(f"@2i{text}7fI").pack, bytes(4)

    def packed(stamp: Stamp, about: Any, ranges: np.ndarray) -> bytes:
        end = 0.5 * about.angle_increment * (len(ranges) - 1)
        limits = -end, end, about.angle_increment, 0.0, about.scan_time, about.range_min, about.range_max
        first = pack(*stamp, *names, *limits, len(ranges))
        return ENCAPSULATION + first + ranges.astype(np.float32).tobytes() + no_intensities

    return packed


def imu_bytes(frame: str) -> Callable[..., bytes]:
    """What packs sensor_msgs/Imu: pack(stamp, quat, rate, force, variances), which are those of `NodeLink.imu`."""
    text, name = _text(frame)
    pack = struct.Struct(f"@2i{text}4d72x3d9d3d9d").pack

    def packed(
        stamp: Stamp,
        quat: Sequence[float],
        rate: Sequence[float],
        force: Sequence[float],
        variances: Sequence[float],
    ) -> bytes:
        w, x, y, z = quat
        of_rate, of_force = map(of_equal_axes, variances)
        return ENCAPSULATION + pack(*stamp, *name, x, y, z, w, *rate, *of_rate, *force, *of_force)

    return packed


def compass_bytes(frame: str) -> Callable[[Stamp, Sequence[float]], bytes]:
    """What packs sensor_msgs/MagneticField: pack(stamp, field)."""
    text, name = _text(frame)
    pack = struct.Struct(f"@2i{text}3d72x").pack
    return lambda stamp, field: ENCAPSULATION + pack(*stamp, *name, *field)


def clock_bytes(stamp: Stamp) -> bytes:
    """rosgraph_msgs/Clock."""
    return ENCAPSULATION + struct.pack("@2i", *stamp)


def twist_values(data: bytes, is_stamped: bool = False) -> tuple[float, ...]:
    """Six numbers of geometry_msgs/Twist or TwistStamped. Cyclone DDS itself drops what is none, and warns of it."""
    order, begin = "<" if data[1] & 1 else ">", len(ENCAPSULATION)
    if is_stamped:
        n_before = (
            12 + struct.unpack_from(f"{order}I", data, begin + 8)[0]
        )  # time, length and text of the frame
        begin += n_before + -n_before % 8
    return struct.unpack_from(f"{order}6d", data, begin)


def _text(text: str) -> tuple[str, tuple[int, bytes]]:
    """Layout and values of a string."""
    data = text.encode() + b"\x00"
    return f"I{len(data)}s", (len(data), data)


@cache
def _transforms_layout(
    frames: tuple[tuple[str, str], ...],
) -> tuple[Callable[..., bytes], list[tuple[Any, ...]]]:
    """What packs transforms of these frames, and the values of each one's names."""
    texts = [(_text(parent), _text(child)) for parent, child in frames]
    layout = "".join(f"2i{parent}{child}7d" for (parent, _), (child, _) in texts)
    return struct.Struct(f"@I{layout}").pack, [(*parent, *child) for (_, parent), (_, child) in texts]
