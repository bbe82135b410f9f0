"""Frames, scans and covariances by the definitions of ROS: REP 105 and 120 (frames), 117 (ranges), and those of the messages."""

from __future__ import annotations

import gc
import itertools
import math
import time
from collections import defaultdict
from functools import partial

import needs
import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Output, Sensor
from tussle.numeric.quaternion import quat_multiply, quat_rotate
from tussle.plugins.links.ros.node import load_rospy
from tussle.scene import Cuboid, FlatGround, Scene
from tussle.stock import (
    External,
    NoisyState,
    RayTrace,
    ROS2Autonomy,
    ROS2ClockServer,
    ROS2Compass,
    ROS2IMUSensor,
    ROSAltimeter,
    ROSAutonomy,
    ROSClockServer,
    ROSCompass,
    ROSIMUSensor,
    SimpleCar,
)

DT = 0.125
# rospy leaves connections to the master to the garbage collector.
pytestmark = [
    pytest.mark.filterwarnings("ignore:unclosed <socket:ResourceWarning"),
    pytest.mark.filterwarnings(
        "ignore:Exception ignored in. <socket:pytest.PytestUnraisableExceptionWarning"
    ),
]


class Ros1:
    """A subscriber of ROS 1."""

    autonomy, clock, imu, compass = ROSAutonomy, ROSClockServer, ROSIMUSensor, ROSCompass

    def __init__(self, types):
        self.heard, self.open, ros = defaultdict(list), [], load_rospy()
        for topic, kind in types.items():
            hear = partial(self._hear, topic)
            self.open.append(ros.rospy.Subscriber(f"/{topic}", ros_type(kind), hear, tcp_nodelay=True))

    def _hear(self, topic, message):
        self.heard[topic].append(message)

    def close(self):
        for one in self.open:
            one.unregister()

    def collect(self):
        """Messages come in other threads."""

    def sender(self, topic, kind):
        """What sends a stamped twist."""
        ros = load_rospy()
        publisher = ros.rospy.Publisher(f"/{topic}", ros_type(kind), queue_size=1)
        self.open.append(publisher)

        def send(speed):
            message = ros_type(kind)()
            message.twist.linear.x = speed
            publisher.publish(message)

        return send

    @staticmethod
    def seconds(stamp):
        return stamp.to_sec()


class Ros2:
    """A subscriber of ROS 2, on Cyclone DDS, that reads messages by rosbags."""

    autonomy, clock, imu, compass = ROS2Autonomy, ROS2ClockServer, ROS2IMUSensor, ROS2Compass

    def __init__(self, types):
        from cyclonedds.core import Policy, Qos
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic

        from tussle.plugins.links.ros.domain import opened_participant
        from tussle.plugins.links.ros.messages import message_type

        typesys = pytest.importorskip("rosbags.typesys")
        self.store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
        self.heard, self.node, self.types = defaultdict(list), opened_participant(), types
        quality = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(100))
        self.readers = {
            topic: DataReader(self.node, Topic(self.node, f"rt/{topic}", message_type(kind)), qos=quality)
            for topic, kind in types.items()
        }

    def close(self):
        self.readers.clear()
        del self.node

    def collect(self):
        for topic, reader in self.readers.items():
            for one in reader.take(100):
                package, _, short = self.types[topic].partition("/")
                self.heard[topic].append(self.store.deserialize_cdr(one.data, f"{package}/msg/{short}"))

    def sender(self, topic, kind):
        """What sends a stamped twist."""
        from cyclonedds.core import Policy, Qos
        from cyclonedds.pub import DataWriter
        from cyclonedds.topic import Topic
        from cyclonedds.util import duration

        from tussle.plugins.links.ros.messages import message_type

        reliable = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(1))
        type_ = message_type(kind)
        writer = DataWriter(self.node, Topic(self.node, f"rt/{topic}", type_), qos=reliable)
        types = self.store.types
        vector = types["geometry_msgs/msg/Vector3"]

        def send(speed):
            twist = types["geometry_msgs/msg/Twist"](vector(speed, 0.0, 0.0), vector(0.0, 0.0, 0.0))
            header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](0, 0), "base_link")
            message = types["geometry_msgs/msg/TwistStamped"](header, twist)
            data = bytes(self.store.serialize_cdr(message, "geometry_msgs/msg/TwistStamped"))
            writer.write(type_.deserialize(data))

        return send

    @staticmethod
    def seconds(stamp):
        return stamp.sec + 1e-9 * stamp.nanosec


def ros_type(kind):
    """A message of ROS 1 by its name."""
    if kind == "mavros_msgs/Altitude":
        from tussle.plugins.stock.sensor.ros_altimeter import altitude_type

        return altitude_type()
    return getattr(load_rospy(), kind.partition("/")[2])


@pytest.fixture(params=[Ros1, Ros2])
def ros(request):
    if request.param is Ros1:
        needs.require("roscore", "rospy")
    request.getfixturevalue("roscore" if request.param is Ros1 else "ros_domain")
    made = []

    class Node(request.param):
        """One that is closed after the test."""

        def __init__(self, types):
            super().__init__(types)
            made.append(self)

    yield Node
    for one in made:
        one.close()
    gc.collect()


def played(node, mission, topics, n=12, beliefs=(), each=lambda simulation: None):
    """Play until messages of n times have come on each topic; returns what each step's state was, by time."""
    states = {}
    with Simulation(mission) as simulation:
        while min(len(node.heard[topic]) for topic in topics) < n:
            each(simulation)
            at = round(float(simulation.t[0]), 6)
            states[at] = {
                name: simulation.read(f"car.{name}")[0][0, 0] for name in ("pos", "quat", "vel", "omega")
            }
            for name in beliefs:
                states[at][name] = simulation.read(f"car.NoisyState.{name}")[0][0, 0]
            simulation.step()
            time.sleep(0.005)
            node.collect()
    return states


def xyz(vector):
    return np.array([vector.x, vector.y, vector.z])


def wxyz(q):
    return np.array([q.w, q.x, q.y, q.z])


def chain_of(message, frame):
    """Transforms from the root to a frame."""
    by_child = {one.child_frame_id: one for one in message.transforms}
    assert len(by_child) == len(message.transforms)  # one parent each
    chain = []
    while frame in by_child:
        chain.append(by_child[frame])
        frame = chain[-1].header.frame_id
    assert frame == "world"
    return chain[::-1]


def composed(chain):
    """Position and attitude of the last frame of a chain in the first one."""
    pos, quat = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    for one in chain:
        pos = pos + quat_rotate(quat, xyz(one.transform.translation))
        quat = quat_multiply(quat, wxyz(one.transform.rotation))
    return pos, quat


def test_ranges_tell_nothing_there_too_near_and_lost(ros):
    near, far = Cuboid((0.0, 0.6, 0.0), (4.0, 0.2, 4.0)), Cuboid((5.0, 0.0, 0.0), (2.0, 1.0, 4.0))
    block = Block(
        name="car", autonomy=ros.autonomy(), motion=SimpleCar(), position=(0.0, 0.0, 0.0),
        sensor=RayTrace(num_rays_horiz=3, angle_res_horiz="90 deg", min_range=1.0, max_range=9.0, scan_period=DT, dropout=0.2),
    )  # fmt: skip
    node = ros({"entity1/base_scan": "sensor_msgs/LaserScan"})
    mission = Mission(
        blocks=[block], dt=DT, end=1e6, interactions=[ros.clock()], scene=Scene(walls=[near, far])
    )
    played(node, mission, ["entity1/base_scan"], n=40)
    scans = np.array([list(one.ranges) for one in node.heard["entity1/base_scan"]])
    lost = np.isnan(scans)
    assert 0.05 < lost.mean() < 0.4
    right, ahead, left = (column[~np.isnan(column)] for column in scans.T)
    assert set(right) == {math.inf}  # nothing within the largest range
    assert ahead == pytest.approx(4.0)
    assert set(left) == {-math.inf}  # nearer than the smallest range
    one = node.heard["entity1/base_scan"][0]
    assert (one.range_min, one.range_max) == (1.0, 9.0)


def test_all_frames_are_in_one_tree_also_those_of_sensors(ros):
    sensors = [
        RayTrace(num_rays_horiz=3, xyz=(0.5, 0.0, 0.25), scan_period=DT),
        ros.imu(rate_noise=0.5, rate_bias=0.25, acceleration_noise=2.0),
        ros.compass(vehicle_name="tug"),
    ]
    topics = {"tf": "tf2_msgs/TFMessage", "entity2/base_scan": "sensor_msgs/LaserScan"}
    topics |= {"robot2/imu": "sensor_msgs/Imu", "tug/compass": "sensor_msgs/MagneticField"}
    topics |= {f"entity2/{name}": "nav_msgs/Odometry" for name in ("odom", "base_pose_ground_truth")}
    if issubclass(ros, Ros1):
        sensors.append(ROSAltimeter())
        topics["robot2/altimeter"] = "mavros_msgs/Altitude"
    blocks = [
        Block(name="other", autonomy=ros.autonomy(), motion=SimpleCar()),
        Block(
            name="car", autonomy=ros.autonomy(), motion=External(), sensor=sensors, position=(3.0, 4.0, 20.0)
        ),
    ]
    node = ros(topics)
    attitude = np.array([0.5, 0.5, 0.5, -0.5]) * [1.2, 0.8, 0.6, 1.0]
    attitude /= np.sqrt(attitude @ attitude)

    def turn(simulation):
        simulation.write("car.quat", [[attitude]])

    mission = Mission(
        blocks=blocks, dt=DT, end=1e6, interactions=[ros.clock()], scene=Scene(ground=FlatGround(5.0))
    )
    played(node, mission, list(topics), each=turn)
    heard = {topic: messages[-1] for topic, messages in node.heard.items()}
    frames = {topic: one.header.frame_id for topic, one in heard.items() if topic != "tf"}
    assert {frames.pop(f"entity2/{name}") for name in ("odom", "base_pose_ground_truth")} == {
        "entity2/odom", "world"
    }  # fmt: skip
    assert frames.pop("entity2/base_scan") == "entity2/base_laser_link"
    assert set(frames.values()) == {"entity2/base_link"}
    assert heard["entity2/odom"].child_frame_id == "entity2/base_link"
    for frame in {*frames.values(), "entity2/base_laser_link", "entity1/base_link"}:
        assert chain_of(heard["tf"], frame)
    # base_footprint is on the floor, level, and turned as the body is about the vertical axis (REP 120).
    odom, footprint, base, laser = chain_of(heard["tf"], "entity2/base_laser_link")
    assert composed([odom])[1].tolist() == [1.0, 0.0, 0.0, 0.0]
    assert xyz(footprint.transform.translation) == pytest.approx([3.0, 4.0, 5.0])
    assert wxyz(footprint.transform.rotation)[1:3].tolist() == [0.0, 0.0]
    ahead, level = (quat_rotate(q, np.array([1.0, 0.0, 0.0])) for q in (attitude, composed([footprint])[1]))
    assert math.atan2(ahead[1], ahead[0]) == pytest.approx(math.atan2(level[1], level[0]))
    pos, quat = composed([odom, footprint, base])
    assert pos == pytest.approx([3.0, 4.0, 20.0])
    assert abs(quat @ attitude) == pytest.approx(1.0)
    assert xyz(laser.transform.translation).tolist() == [0.5, 0.0, 0.25]
    imu = heard["robot2/imu"]
    assert np.reshape(imu.angular_velocity_covariance, (3, 3)).tolist() == (0.3125 * np.eye(3)).tolist()
    assert np.reshape(imu.linear_acceleration_covariance, (3, 3)).tolist() == (4.0 * np.eye(3)).tolist()


def test_odometry_of_a_measured_state_does_not_jump_and_the_root_holds_the_belief(ros):
    noise = {f"vel_noise_{k}": (0.0, sd) for k, sd in enumerate((0.5, 0.25, 0.125))}
    noise |= {f"pos_noise_{k}": (0.0, 5.0) for k in range(3)} | {"orient_noise_2": (0.0, 0.3)}
    block = Block(
        name="car", heading="90 deg", autonomy=ros.autonomy(), motion=SimpleCar(), sensor=NoisyState(**noise)
    )
    topics = {"tf": "tf2_msgs/TFMessage", "entity1/odom": "nav_msgs/Odometry"}
    topics["entity1/base_pose_ground_truth"] = "nav_msgs/Odometry"
    node = ros(topics)
    mission = Mission(blocks=[block], dt=DT, end=1e6, interactions=[ros.clock()])
    states = played(node, mission, list(topics), n=60, beliefs=("belief_pos", "belief_vel", "belief_quat"))

    def at(message):
        return round(node.seconds(message.header.stamp), 6)

    odoms = {at(one): one for one in node.heard["entity1/odom"]}
    times = sorted(odoms)
    pairs = [(a, b) for a, b in itertools.pairwise(times) if b - a == pytest.approx(DT)]
    assert len(pairs) > 40
    position = {t: xyz(odoms[t].pose.pose.position) for t in times}
    for a, b in pairs:  # it moves by the measured velocity, here that of a car at rest
        assert position[b] - position[a] == pytest.approx(DT * states[b]["belief_vel"], abs=1e-9)
    # The body's x axis is North: the standard deviation along it is that of the velocity's y.
    covariance = np.reshape(odoms[times[-1]].twist.covariance, (6, 6))
    assert np.diag(covariance) == pytest.approx([0.25**2, 0.5**2, 0.125**2, 0.0, 0.0, 0.0])
    assert covariance - np.diag(np.diag(covariance)) == pytest.approx(np.zeros((6, 6)), abs=1e-12)
    variance = np.diag(np.reshape(odoms[times[-1]].pose.covariance, (6, 6)))
    n_steps = round(times[-1] / DT)
    assert variance[:3] == pytest.approx(n_steps * DT**2 * np.square([0.5, 0.25, 0.125]))
    drift = position[times[-1]] - states[times[-1]]["pos"]
    assert np.abs(drift).max() > 0.0
    assert (np.abs(drift) < 5.0 * np.sqrt(variance[:3])).all()
    truth = node.heard["entity1/base_pose_ground_truth"][-1]
    assert xyz(truth.pose.pose.position).tolist() == states[at(truth)]["pos"].tolist()
    assert not np.any(truth.pose.covariance)
    for message in node.heard["tf"]:
        chain = chain_of(message, "entity1/base_link")
        pos, quat = composed(chain)
        now = states[at(chain[0])]
        assert pos == pytest.approx(now["belief_pos"], abs=1e-9)
        assert abs(quat @ now["belief_quat"]) == pytest.approx(1.0)


def test_a_measurement_that_is_held_lets_the_variance_grow_with_the_square_of_its_time(ros):
    block = Block(
        name="car", autonomy=ros.autonomy(), motion=SimpleCar(),
        sensor=NoisyState(rate=0.25 / DT, vel_noise_0=(0.0, 1.0)),
    )  # fmt: skip
    node = ros({"entity1/odom": "nav_msgs/Odometry"})
    mission = Mission(blocks=[block], dt=DT, end=1e6, interactions=[ros.clock()])
    played(node, mission, ["entity1/odom"], n=20)
    last = node.heard["entity1/odom"][-1]
    n_steps = node.seconds(last.header.stamp) / DT
    assert last.pose.covariance[0] == pytest.approx(n_steps / 4 * (4 * DT) ** 2, rel=0.5)


class OwnBelief(Sensor):
    """A belief of an author's own, of which nobody knows the noise."""

    belief_pos = Output("belief_pos_x belief_pos_y belief_pos_z", unit="m", doc="Believed position.")

    def step(self, g):
        """Believe to be a metre further."""
        self.belief_pos[:] = g.pos + 1.0


def test_a_sensor_of_ones_own_moves_the_root_only(ros):
    block = Block(name="car", autonomy=ros.autonomy(), motion=SimpleCar(), sensor=OwnBelief())
    node = ros({"entity1/odom": "nav_msgs/Odometry", "tf": "tf2_msgs/TFMessage"})
    mission = Mission(blocks=[block], dt=DT, end=1e6, interactions=[ros.clock()])
    played(node, mission, ["entity1/odom", "tf"])
    odom = node.heard["entity1/odom"][-1]
    assert xyz(odom.pose.pose.position).tolist() == [0.0, 0.0, 0.0]
    assert not np.any(odom.pose.covariance)
    assert composed(chain_of(node.heard["tf"][-1], "entity1/base_link"))[0].tolist() == [1.0, 1.0, 1.0]


def test_stamped_commands_move_a_robot(ros):
    block = Block(name="car", autonomy=ros.autonomy(stamped_commands=True), motion=SimpleCar())
    node = ros({"entity1/odom": "nav_msgs/Odometry"})
    send = node.sender("entity1/cmd_vel", "geometry_msgs/TwistStamped")
    with Simulation(Mission(blocks=[block], dt=DT, end=1e6, interactions=[ros.clock()])) as simulation:
        while not simulation.read("car.pos")[0][0, 0, 0] > 1.0:
            send(2.0)
            simulation.step()
            time.sleep(0.005)
        assert simulation.read("car.vel")[0][0, 0] == pytest.approx([2.0, 0.0, 0.0])
