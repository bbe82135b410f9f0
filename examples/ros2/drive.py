"""A node of ROS 2 without ROS 2, on Cyclone DDS: drives a robot, and tells its speed when odom shows that it moves.

Usage: python drive.py NAMESPACE SPEED
"""

import os
import sys
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, int32, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

LOOPBACK = """<CycloneDDS><Domain id="any">
<General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces><AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""
PERIOD = 0.1  # [s] between commands
GEOMETRY = "geometry_msgs::msg::dds_::"


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    """A stamp."""

    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    """Time and frame."""

    stamp: Time
    frame_id: str


@dataclass
class Point(IdlStruct, typename=f"{GEOMETRY}Point_"):
    """A position [m]."""

    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename=f"{GEOMETRY}Quaternion_"):
    """An attitude."""

    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Vector3(IdlStruct, typename=f"{GEOMETRY}Vector3_"):
    """A velocity [m/s] or rotation [rad/s]."""

    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
class Pose(IdlStruct, typename=f"{GEOMETRY}Pose_"):
    """Position and attitude."""

    position: Point
    orientation: Quaternion


@dataclass
class Twist(IdlStruct, typename=f"{GEOMETRY}Twist_"):
    """Velocity and rotation."""

    linear: Vector3
    angular: Vector3


@dataclass
class PoseWithCovariance(IdlStruct, typename=f"{GEOMETRY}PoseWithCovariance_"):
    """A pose."""

    pose: Pose
    covariance: array[float64, 36]


@dataclass
class TwistWithCovariance(IdlStruct, typename=f"{GEOMETRY}TwistWithCovariance_"):
    """A twist."""

    twist: Twist
    covariance: array[float64, 36]


@dataclass
class Odometry(IdlStruct, typename="nav_msgs::msg::dds_::Odometry_"):
    """The state of a robot."""

    header: Header
    child_frame_id: str
    pose: PoseWithCovariance
    twist: TwistWithCovariance


def main() -> None:
    """Command the speed until the robot has it."""
    namespace, speed = sys.argv[1].strip("/"), float(sys.argv[2])
    os.environ.setdefault("CYCLONEDDS_URI", LOOPBACK)
    node = DomainParticipant(int(os.environ.get("ROS_DOMAIN_ID", "0")))
    # The topics of ROS 2 begin with rt in DDS.
    reliable = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(10))
    commands = DataWriter(node, Topic(node, f"rt/{namespace}/cmd_vel", Twist), qos=reliable)
    states = DataReader(node, Topic(node, f"rt/{namespace}/odom", Odometry), qos=reliable)
    while True:
        commands.write(Twist(Vector3(x=speed), Vector3()))
        for state in states.take_iter(timeout=duration(seconds=PERIOD)):
            if state.twist.twist.linear.x == speed:
                print(f"/{namespace}/odom: {speed} m/s along {state.child_frame_id}")
                return


if __name__ == "__main__":
    main()
