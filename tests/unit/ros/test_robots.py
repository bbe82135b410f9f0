"""Robots that nodes of ROS 1 drive, by a roscore and a node in Debian's own Python."""

from __future__ import annotations

import gc
import itertools
import json
import math
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import needs
import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.errors import MissingExtraError, ParameterError, PluginError, RosError
from tussle.mission import read_mission
from tussle.plugins import stock
from tussle.plugins.links.ros import link as ros_link
from tussle.plugins.links.ros.link import RosLink
from tussle.plugins.links.ros.node import load_rospy
from tussle.plugins.links.ros.steps import StepGate
from tussle.plugins.stock.sensor.ros_altimeter import altitude_type
from tussle.scene import FlatGround, Origin, Scene
from tussle.stock import (
    External,
    FixedWing6DOF,
    FixedWing6DOFControllerROS,
    RayTrace,
    RigidBody6DOF,
    RigidBody6DOFControllerROS,
    ROSAltimeter,
    ROSAutonomy,
    ROSClockServer,
    ROSCompass,
    ROSControl,
    ROSIMUSensor,
    ROSShapeViz,
    SimpleCar,
    SingleIntegrator,
    Still,
    Unicycle,
)

# rospy leaves connections to the master to the garbage collector.
pytestmark = [
    pytest.mark.filterwarnings("ignore:unclosed <socket:ResourceWarning"),
    pytest.mark.filterwarnings(
        "ignore:Exception ignored in. <socket:pytest.PytestUnraisableExceptionWarning"
    ),
]
DT = 0.125
PEER = Path(__file__).with_name("peer.rospy")
NANO = 1_000_000_000


def cars(n=2, has_clock=True, clock=None, **autonomy):
    block = Block(
        name="car", team=1, count=n, position=(10.0, 20.0, 0.0), variance=(50.0, 50.0, 0.0), heading="30 deg",
        autonomy=ROSAutonomy(**autonomy), motion=SimpleCar(),
        sensor=RayTrace(num_rays_horiz=5, angle_res_horiz="45 deg", scan_period=DT),
    )  # fmt: skip
    return Mission(
        blocks=[block], dt=DT, end=100.0, interactions=[ROSClockServer(**(clock or {}))] if has_clock else []
    )


def published(ros, simulation, topic, make):
    """Publish a message until the simulation has heard of it."""
    publisher = ros.rospy.Publisher(f"/{topic}", type(make()), queue_size=1)
    while not publisher.get_num_connections():
        time.sleep(0.01)
    publisher.publish(make())
    return publisher


def twist(ros, **linear):
    command = ros.Twist()
    for name, value in linear.items():
        setattr(command.linear, name, value)
    return command


@pytest.fixture(autouse=True)
def _collected():
    """Connections of rospy end here, not in a test of something else."""
    yield
    gc.collect()


def link_of(simulation) -> RosLink:
    return simulation.state.context.shared["ROS 1"]


@pytest.fixture
def peer(roscore):
    process = subprocess.Popen(
        ["/usr/bin/python3", str(PEER)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    yield process
    process.communicate()


def test_a_node_hears_of_the_cars_in_each_step_and_its_commands_move_them(peer):
    heard, states = [], []
    with Simulation(cars(lockstep=60.0)) as simulation:
        for _ in range(8):
            states.append([simulation.read(f"car.{name}")[0][0] for name in ("pos", "quat", "vel", "omega")])
            simulation.step()
        while sum(one["kind"] == "odom" for one in heard) < 16:
            heard.append(json.loads(peer.stdout.readline()))
        while not {"scan", "tf"} <= {one["kind"] for one in heard}:  # a busy node may connect to these later
            simulation.step()
            heard.append(json.loads(peer.stdout.readline()))
    for number, name in enumerate(("entity1", "entity2")):
        odoms = [one for one in heard if one["kind"] == "odom" and one["name"] == name][:8]
        assert [one["stamp"] for one in odoms] == [round(k * DT * NANO) for k in range(8)]
        assert all(one["frames"] == [f"{name}/odom", f"{name}/base_link"] for one in odoms)
        for one, (pos, quat, vel, omega) in zip(odoms, states, strict=True):
            assert one["state"][:7] == [*pos[number], *quat[number]]
            assert one["state"][7:10] == pytest.approx([np.hypot(*vel[number][:2]), 0.0, 0.0], abs=1e-12)
            assert one["state"][10:] == pytest.approx([0.0, 0.0, omega[number][2]], abs=1e-12)
    # Each command holds in the step whose odom it answers.
    first = states[-1][0][0] - states[0][0][0]
    assert np.hypot(*first[:2]) == pytest.approx(7 * DT * 2.0)
    assert math.atan2(first[1], first[0]) == pytest.approx(math.radians(30.0))
    turned = 7 * DT * 1.0 * math.tan(0.2) / 2.62
    yaw = [2.0 * math.atan2(quat[1][3], quat[1][0]) for _, quat, *_ in states]
    assert yaw[-1] - yaw[0] == pytest.approx(turned)
    scans = [one for one in heard if one["kind"] == "scan"]
    assert scans
    assert scans[0]["frame"] == "entity1/base_laser_link"
    assert len(scans[0]["ranges"]) == 5
    assert scans[0]["angles"] == pytest.approx([-math.pi / 2, math.pi / 2])
    chain = ["odom", "base_footprint", "base_link", "base_laser_link"]
    links = [
        list(pair)
        for name in ("entity1", "entity2")
        for pair in itertools.pairwise(["world", *(f"{name}/{frame}" for frame in chain)])
    ]
    assert [one["frames"] for one in heard if one["kind"] == "tf"][-1] == links


def test_a_robot_without_commands_stands_still_and_one_stops_after_the_watchdogs_time(roscore):
    ros = load_rospy()
    block = Block(
        name="drone",
        count=2,
        heading="90 deg",
        autonomy=ROSControl(watchdog_timeout=2.5 * DT),
        motion=SingleIntegrator(),
    )
    with Simulation(Mission(blocks=[block], dt=DT, end=100.0)) as simulation:
        publisher = published(ros, simulation, "robot2/cmd_vel", lambda: twist(ros, x=1.0, z=3.0))
        inbox = simulation.state.population.groups[0].autonomies[0].plugin.robot[1].inbox
        while not inbox.n_received:
            time.sleep(0.01)
        start = simulation.read("drone.pos")[0][0]
        simulation.step(8)
        pos = simulation.read("drone.pos")[0][0] - start
        publisher.unregister()
    assert pos[0].tolist() == [0.0, 0.0, 0.0]
    assert pos[1] == pytest.approx([0.0, 1.0 * 3 * DT, 3.0 * 3 * DT])


def test_a_command_that_is_not_finite_ends_the_game_and_the_error_names_its_topic(roscore):
    ros = load_rospy()
    with Simulation(cars()) as simulation:
        publisher = published(ros, simulation, "entity2/cmd_vel", lambda: twist(ros, x=math.nan))
        with pytest.raises(PluginError, match=r"car 2.*/entity2/cmd_vel: linear\.x = nan is not allowed"):
            simulation.run()
        publisher.unregister()


def test_without_a_master_the_error_says_so(monkeypatch):
    needs.require("rospy")
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    with pytest.raises(
        PluginError, match=r"no ROS master answers at http://127\.0\.0\.1:1 \(.*\); start roscore"
    ) as error:
        Simulation(cars(has_clock=False)).step()
    assert isinstance(error.value.__cause__ or error.value, PluginError | RosError)


def test_without_rospy_the_error_tells_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "rospy", None)
    before = list(sys.path)
    with pytest.raises(MissingExtraError, match="apt-get install python3-rospy"):
        load_rospy.__wrapped__()
    assert sys.path == before


def test_a_master_that_dies_ends_the_game(roscore, monkeypatch):
    monkeypatch.setattr(ros_link, "WATCH_PERIOD", 0.05)
    with Simulation(cars()) as simulation:
        simulation.step()
        monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
        with pytest.raises(PluginError, match=r"the ROS master at http://127\.0\.0\.1:1 is gone"):
            simulation.run_until(lambda _: time.sleep(0.01))
        monkeypatch.setenv("ROS_MASTER_URI", roscore)  # so that its topics are withdrawn
        link_of(simulation).lost = ""


def test_a_name_that_ros_does_not_take_is_refused(roscore):
    with pytest.raises(PluginError, match="'my robot1' is no name of ROS") as error:
        Simulation(cars(namespace_prefix="my robot")).step()
    assert ParameterError.__name__ in repr(error.value.__cause__) or error.value.__cause__ is None


def test_lockstep_without_a_node_ends_the_game(roscore):
    with (
        Simulation(cars(lockstep=0.1)) as simulation,
        pytest.raises(
            PluginError,
            match=r"nobody has subscribed to /entity1/odom and publishes /entity1/cmd_vel within 0\.1 s",
        ),
    ):
        simulation.step()


def test_several_worlds_are_refused(roscore):
    with pytest.raises(Exception, match="supports at most 1 worlds"):
        Simulation(cars(), seeds=[1, 2])


def test_services_pause_the_game_and_make_single_steps(roscore):
    ros = load_rospy()
    get = ros.rospy.get_param
    before = get("/use_sim_time", False)
    with Simulation(cars(clock={"start_paused": True})) as simulation:
        assert get("/use_sim_time") is True
        step = ros.rospy.ServiceProxy("/tussle/step", ros.Trigger)
        pause = ros.rospy.ServiceProxy("/tussle/pause", ros.SetBool)
        game = threading.Thread(target=simulation.run, args=(5 * DT,))
        game.start()
        for k in range(3):
            assert step().success
            assert simulation.steps[0] in (k, k + 1)  # it waits at the beginning of the next step
        assert game.is_alive()
        assert pause(False).success
        game.join()
        assert simulation.steps[0] == 5
        assert not step().success
    assert get("/use_sim_time") == before


def test_an_interrupted_game_does_not_wait_at_the_gate():
    gate = StepGate()
    gate.set_paused(True)
    gate.enter(lambda: True)
    gate.close()
    assert not gate.step()


def test_stamps_are_the_wall_clocks_without_simulated_time(roscore):
    with Simulation(cars(1, has_clock=False)) as simulation:
        assert abs(link_of(simulation).stamp(3.0).to_sec() - time.time()) < 3600.0
        link_of(simulation).is_sim_time = True
        assert link_of(simulation).stamp(3.5).to_nsec() == 3_500_000_000


def test_a_lidar_of_several_elevations_is_refused(roscore):
    block = Block(name="car", autonomy=ROSAutonomy(), motion=Unicycle(), sensor=RayTrace(num_rays_vert=2))
    with (
        Simulation(Mission(blocks=[block], dt=DT, end=9.0)) as simulation,
        pytest.raises(PluginError, match="base_scan takes one elevation; RayTrace has num_rays_vert = 2"),
    ):
        simulation.run()


def test_commands_set_thrust_and_surfaces(roscore):
    ros = load_rospy()
    blocks = [
        Block(name="body", controller=RigidBody6DOFControllerROS(), motion=RigidBody6DOF()),
        Block(
            name="wing",
            controller=FixedWing6DOFControllerROS(namespace_prefix="wing"),
            motion=FixedWing6DOF(),
        ),
    ]

    def command():
        message = twist(ros, x=2.0)
        message.angular.x, message.angular.y, message.angular.z = 0.1, 0.2, 0.3
        return message

    with Simulation(Mission(blocks=blocks, dt=DT, end=100.0)) as simulation:
        publishers = [published(ros, simulation, topic, command) for topic in ("cmd_vel", "wing2/cmd_vel")]
        inboxes = [group.controllers[0].plugin.inbox[0] for group in simulation.state.population.groups]
        while not all(inbox.n_received for inbox in inboxes):
            time.sleep(0.01)
        simulation.step()
        for path, push in (
            ("body.RigidBody6DOFControllerROS", "thrust"),
            ("wing.FixedWing6DOFControllerROS", "throttle"),
        ):
            values = [
                simulation.read(f"{path}.{name}")[0][0, 0] for name in (push, "aileron", "elevator", "rudder")
            ]
            assert values == [2.0, 0.1, 0.2, 0.3]
        assert simulation.read("body.vel")[0][0, 0][0] > 0.0
        for publisher in publishers:
            publisher.unregister()


def test_a_compass_shows_north_in_the_body_frame(roscore):
    ros = load_rospy()
    heard = queue.Queue()
    subscriber = ros.rospy.Subscriber("/tug/compass", ros.MagneticField, heard.put)
    block = Block(name="car", heading="30 deg", motion=Still(), sensor=ROSCompass(vehicle_name="tug"))
    with Simulation(Mission(blocks=[block], dt=DT, end=1e6)) as simulation:
        while heard.empty():
            simulation.step()
            time.sleep(0.01)
    message = heard.get()
    subscriber.unregister()
    field = message.magnetic_field
    assert [field.x, field.y, field.z] == pytest.approx([0.5, math.sqrt(0.75), 0.0])
    assert message.header.frame_id == "tug/base_link"


@pytest.mark.parametrize("errors", [{}, {"bias": 50.0, "noise": 0.5}])
def test_an_altimeter_measures_altitudes_with_its_errors(roscore, errors):
    ros, heard, n = load_rospy(), queue.Queue(), 30
    assert altitude_type()._md5sum == "1296a05dc5b6160be0ae04ba9ed3a3fa"  # so MAVROS's own nodes take it
    subscriber = ros.rospy.Subscriber("/tug/altimeter", altitude_type(), heard.put)
    block = Block(
        name="kite",
        position=(0.0, 0.0, 20.0),
        motion=External(),
        sensor=ROSAltimeter(vehicle_name="tug", **errors),
    )
    scene = Scene(ground=FlatGround(5.0), origin=Origin(latitude=0.5, altitude=300.0))
    with Simulation(Mission(blocks=[block], dt=DT, end=1e6, scene=scene)) as simulation:
        topic = link_of(simulation).advertise("tug/altimeter", altitude_type())
        while not topic.get_num_connections():
            time.sleep(0.01)
        found = []
        for k in range(1, n + 1):
            simulation.write("kite.pos", [[[0.0, 0.0, 20.0 + k]]])
            simulation.step()
            message = heard.get()
            assert message.header.frame_id == "tug/base_link"
            assert message.monotonic == pytest.approx(320.0, abs=1e-3)
            now = [message.amsl, message.local, message.relative, message.terrain, message.bottom_clearance]
            found.append(np.array(now) - k)
    subscriber.unregister()
    wrong = np.array(found) - [320.0, 20.0, 0.0, 15.0, 15.0]
    assert np.ptp(wrong, axis=1).max() < 1e-3  # the same error in all fields
    if errors:
        assert 0.25 < wrong[:, 0].std() < 1.0
        assert 0.1 < abs(wrong.mean()) < 250.0
    else:
        assert np.abs(wrong).max() < 1e-3


def test_markers_are_drawn_until_they_are_deleted_and_entities_are_published(roscore):
    ros, heard, drawn = load_rospy(), queue.Queue(), []

    def marker(action=0, x=3.0):
        message = ros.Marker(ns="a", id=1, type=2, action=action)
        message.pose.position.x, message.scale.x, message.color.r = x, 4.0, 1.0
        return message

    subscriber = ros.rospy.Subscriber("/tussle/markers", ros.MarkerArray, heard.put)
    block = Block(name="car", count=2, motion=Still())
    with Simulation(Mission(blocks=[block], dt=DT, end=1e6, interactions=[ROSShapeViz()])) as simulation:
        expected = simulation.read("car.pos")[0][0]
        simulation.state.context.draw.sinks.append(lambda kind, shape: drawn.append((kind, shape)))
        publisher = published(ros, simulation, "shapes", marker)
        while not drawn or heard.empty():
            simulation.step()
            time.sleep(0.01)
        kind, shape = drawn[-1]
        assert kind == "sphere"
        assert shape["pos"].ravel().tolist() == [3.0, 0.0, 0.0]
        assert shape["radius"] == 2.0
        assert shape["colour"] == (255.0, 0.0, 0.0)
        publisher.publish(marker(action=2))
        while drawn:
            drawn.clear()
            simulation.step()
            time.sleep(0.01)
        publisher.publish(marker(x=math.nan))
        with pytest.raises(PluginError, match=r"/shapes: marker \('a', 1\) has a number that is not finite"):
            simulation.run_until(lambda _: time.sleep(0.01))
        publisher.unregister()
    places = [one.pose.position for one in heard.get().markers]
    subscriber.unregister()
    assert [[p.x, p.y, p.z] for p in places] == expected.tolist()


@pytest.mark.parametrize(
    "errors", [{}, {"acceleration_bias": 0.5, "rate_bias": 0.1, "acceleration_noise": 0.2, "rate_noise": 0.3}]
)
def test_an_imu_measures_specific_force_and_rates_with_its_errors(roscore, errors):
    ros, heard, n = load_rospy(), queue.Queue(), 30
    subscriber = ros.rospy.Subscriber("/tug/imu", ros.Imu, heard.put)
    block = Block(
        name="car", heading="90 deg", motion=External(), sensor=ROSIMUSensor(vehicle_name="tug", **errors)
    )
    with Simulation(Mission(blocks=[block], dt=DT, end=1e6)) as simulation:
        topic = simulation.state.context.shared["ROS 1"].advertise("tug/imu", ros.Imu)
        while not topic.get_num_connections():
            time.sleep(0.01)
        found = []
        for k in range(1, n + 1):
            simulation.write("car.vel", [[[0.0, 2.0 * DT * k, 0.0]]])
            simulation.write("car.omega", [[[0.0, 0.5, 0.25]]])
            simulation.step()
            message = heard.get()
            force, rate = message.linear_acceleration, message.angular_velocity
            found.append([force.x, force.y, force.z, rate.x, rate.y, rate.z])
    subscriber.unregister()
    wrong = np.array(found) - [2.0, 0.0, 9.80665, 0.5, 0.0, 0.25]
    if errors:
        assert np.abs(wrong.mean(axis=0)).max() < 1.6
        assert wrong[:, :3].std() > 0.1
        assert 0.2 < wrong[:, 3:].std(axis=0).mean() < 0.4
    else:
        assert np.abs(wrong).max() < 1e-9


@pytest.mark.parametrize("name", sorted(n for n in stock.manifest() if "ROS" in n))
def test_the_example_of_a_plugin_plays(roscore, name):
    loaded = read_mission(stock.examples()[name])
    assert loaded.notes == ()
    with Simulation(loaded.mission) as simulation:
        simulation.step(3)
        assert simulation.result()[0].error is None


DRIVER = """
from tussle.api import EasyAutonomy, Output


class Driver(EasyAutonomy):
    \"\"\"Drives on.\"\"\"

    speed = Output(unit="m/s")

    def step_one(self, me):
        me.speed = 2.0 + me.step_count
"""


def test_tussle_ros_node_drives_a_car_of_a_simulation(roscore, tmp_path):
    (tmp_path / "driver.py").write_text(DRIVER)
    command = [sys.executable, "-m", "tussle.cli", "ros-node", "--plugin", "driver.py", "--dt", str(DT)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    node = subprocess.Popen(command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True)
    with Simulation(cars(1, lockstep=60.0)) as simulation:
        start = simulation.read("car.pos")[0][0, 0]
        simulation.step(4)
        way = simulation.read("car.pos")[0][0, 0] - start
    node.send_signal(signal.SIGTERM)
    assert node.communicate()[0] == "answered 4 odoms\n"
    assert node.returncode == 143
    assert np.hypot(*way[:2]) == pytest.approx(DT * (2 + 3 + 4 + 5))
