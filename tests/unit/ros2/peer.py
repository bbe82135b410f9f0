"""A node of ROS 2 that knows nothing of tussle: messages as dataclasses of Cyclone DDS, written from the definitions of ROS 2.

Usage: peer.py DOMAIN MODE. Modes: answer (each odom with a command, and prints what it heard), and those of `main`.
"""

import json
import math
import os
import select
import sys
import time
from dataclasses import dataclass

os.environ[
    "CYCLONEDDS_URI"
] = """<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""

from cyclonedds.core import InstanceState, Policy, Qos, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float32, float64, int32, sequence, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

GEOMETRY = "geometry_msgs::msg::dds_::"
RELIABLE = Qos(
    Policy.Reliability.Reliable(duration(seconds=10)), Policy.History.KeepLast(10), Policy.Durability.Volatile
)
SENSOR = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(5), Policy.Durability.Volatile)
COMMANDS = {"entity1": (2.0, 0.0), "entity2": (1.0, 0.2)}
N_FLOOD, FLOOD_RATE = 20_000, 10_000


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Vector3(IdlStruct, typename=f"{GEOMETRY}Vector3_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
class Point(IdlStruct, typename=f"{GEOMETRY}Point_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename=f"{GEOMETRY}Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Pose(IdlStruct, typename=f"{GEOMETRY}Pose_"):
    position: Point
    orientation: Quaternion


@dataclass
class Twist(IdlStruct, typename=f"{GEOMETRY}Twist_"):
    linear: Vector3
    angular: Vector3


@dataclass
class PoseWithCovariance(IdlStruct, typename=f"{GEOMETRY}PoseWithCovariance_"):
    pose: Pose
    covariance: array[float64, 36]


@dataclass
class TwistWithCovariance(IdlStruct, typename=f"{GEOMETRY}TwistWithCovariance_"):
    twist: Twist
    covariance: array[float64, 36]


@dataclass
class Odometry(IdlStruct, typename="nav_msgs::msg::dds_::Odometry_"):
    header: Header
    child_frame_id: str
    pose: PoseWithCovariance
    twist: TwistWithCovariance


@dataclass
class LaserScan(IdlStruct, typename="sensor_msgs::msg::dds_::LaserScan_"):
    header: Header
    angle_min: float32
    angle_max: float32
    angle_increment: float32
    time_increment: float32
    scan_time: float32
    range_min: float32
    range_max: float32
    ranges: sequence[float32]
    intensities: sequence[float32]


@dataclass
class Transform(IdlStruct, typename=f"{GEOMETRY}Transform_"):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename=f"{GEOMETRY}TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[TransformStamped]


@dataclass
class Clock(IdlStruct, typename="rosgraph_msgs::msg::dds_::Clock_"):
    clock: Time


@dataclass
class Bool(IdlStruct, typename="std_msgs::msg::dds_::Bool_"):
    data: bool


@dataclass
class Empty(IdlStruct, typename="std_msgs::msg::dds_::Empty_"):
    structure_needs_at_least_one_member: uint8 = 0


def tell(kind, **values):
    print(json.dumps({"kind": kind, **values}), flush=True)


def nanoseconds(stamp):
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def xyz(vector):
    return [vector.x, vector.y, vector.z]


def pose(position, orientation):
    return [*xyz(position), orientation.w, *xyz(orientation)]


class Node:
    def __init__(self, domain):
        self.participant = DomainParticipant(domain)
        self.waitset = WaitSet(self.participant)
        self.hearers = []

    def topic(self, name, type_):
        return Topic(self.participant, f"rt/{name}", type_)

    def writer(self, name, type_):
        return DataWriter(self.participant, self.topic(name, type_), qos=RELIABLE)

    def hear(self, name, type_, take, qos=RELIABLE):
        reader = DataReader(self.participant, self.topic(name, type_), qos=qos)
        self.waitset.attach(ReadCondition(reader, SampleState.Any | ViewState.Any | InstanceState.Any))
        self.hearers.append((reader, take))

    def spin(self):
        while True:
            self.waitset.wait(duration(seconds=1))
            for reader, take in self.hearers:
                for message in reader.take(100):
                    if message.sample_info.valid_data:
                        take(message)


def answer(node):
    senders = {name: node.writer(f"{name}/cmd_vel", Twist) for name in COMMANDS}

    def on_odom(message, name, kind):
        at, moving = message.pose.pose, message.twist.twist
        tell(
            kind, name=name, stamp=nanoseconds(message.header.stamp), frames=[message.header.frame_id, message.child_frame_id],
            state=[*pose(at.position, at.orientation), *xyz(moving.linear), *xyz(moving.angular)],
            covariances=[*message.pose.covariance, *message.twist.covariance],
        )  # fmt: skip
        if kind == "odom":
            speed, turn = COMMANDS[name]
            senders[name].write(Twist(Vector3(x=speed), Vector3(z=turn)))

    def on_scan(message):
        limits = [message.angle_min, message.angle_max, message.angle_increment, message.scan_time]
        tell(
            "scan", frame=message.header.frame_id, stamp=nanoseconds(message.header.stamp), limits=limits,
            ranges=list(message.ranges), between=[message.range_min, message.range_max],
        )  # fmt: skip

    def on_tf(message):
        for one in message.transforms:
            tell(
                "tf", frames=[one.header.frame_id, one.child_frame_id], stamp=nanoseconds(one.header.stamp),
                pose=pose(one.transform.translation, one.transform.rotation),
            )  # fmt: skip

    for name in COMMANDS:
        for kind in ("odom", "base_pose_ground_truth"):
            node.hear(f"{name}/{kind}", Odometry, lambda message, n=name, k=kind: on_odom(message, n, k))
    node.hear("entity1/base_scan", LaserScan, on_scan, SENSOR)
    node.hear("tf", TFMessage, on_tf)
    node.hear("clock", Clock, lambda message: tell("clock", stamp=nanoseconds(message.clock)))
    node.spin()


def matched(writer):
    while not writer.get_matched_subscriptions():
        time.sleep(0.01)
    time.sleep(0.5)  # the other side knows of the writer too
    return writer


def main():
    domain, mode = int(sys.argv[1]), sys.argv[2]
    node = Node(domain)
    if mode == "answer":
        answer(node)
    elif mode == "nan":
        matched(node.writer("entity2/cmd_vel", Twist)).write(Twist(Vector3(x=math.nan), Vector3()))
    elif mode == "flood":
        writer, begun = matched(node.writer("entity1/cmd_vel", Twist)), time.monotonic()
        for k in range(N_FLOOD):
            writer.write(Twist(Vector3(x=1.0), Vector3()))
            time.sleep(max(begun + k / FLOOD_RATE - time.monotonic(), 0.0))
        writer.write(Twist(Vector3(x=3.0), Vector3()))
        print("flooded", flush=True)
    elif mode == "repeat":  # a speed, 50 times a second
        writer = node.writer("entity1/cmd_vel", Twist)
        while not select.select([sys.stdin], [], [], 0.02)[0]:
            writer.write(Twist(Vector3(x=float(sys.argv[3])), Vector3()))
    elif mode == "control":  # a line of input for each message
        pause, step = (matched(node.writer(f"tussle/{n}", t)) for n, t in (("pause", Bool), ("step", Empty)))
        tell("ready")
        for line in sys.stdin:
            if line == "step\n":
                step.write(Empty())
            else:
                pause.write(Bool(line == "pause\n"))
    sys.stdin.read()


main()
