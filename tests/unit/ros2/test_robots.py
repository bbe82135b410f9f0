"""Robots that nodes of ROS 2 drive: one in C++ on Fast DDS, and one in Python with messages of its own."""

from __future__ import annotations

import itertools
import json
import math
import threading
from contextlib import ExitStack

import numpy as np
import pytest
from nodes import DT, cars, inbox_of, link_of, peer, started

from tussle import Block, Mission, Simulation
from tussle.errors import PluginError
from tussle.mission import read_mission
from tussle.plugins import stock
from tussle.plugins.links.ros.domain import opened_participant
from tussle.plugins.links.ros.messages import message_type
from tussle.stock import (
    RayTrace,
    ROS2Autonomy,
    ROS2Compass,
    ROS2IMUSensor,
    SimpleCar,
    SingleIntegrator,
    Still,
    Unicycle,
)

NANO = 1_000_000_000
N_STEPS = 1000


def test_a_node_in_cpp_hears_a_car_and_drives_it(ros_domain, driver):
    states, odoms, scans = [], [], []
    with ExitStack() as stack:
        node = started(stack, [driver, ros_domain, "entity1", 2.0])
        simulation = stack.enter_context(Simulation(cars(1, lockstep=600.0)))
        for _ in range(9):
            states.append(simulation.read("car.pos")[0][0, 0])
            simulation.step()
        while len(odoms) < 9 or not scans:
            kind, *values = node.stdout.readline().split()
            (odoms if kind == "odom" else scans).append(values)
    for k, (pos, (x, y, z, sec, nanosec, *frames)) in enumerate(zip(states, odoms, strict=True)):
        assert [float(x), float(y), float(z)] == pos.tolist()
        assert int(sec) * NANO + int(nanosec) == round(k * DT * NANO)
        assert frames == ["entity1/odom", "entity1/base_link"]
    way = states[-1] - states[0]
    assert way == pytest.approx([8 * DT * 2.0 * math.cos(math.pi / 6), 8 * DT * 2.0 * 0.5, 0.0])
    assert int(scans[0][0]) == 5
    assert float(scans[0][1]) == pytest.approx(-math.pi / 2)
    assert scans[0][3] == "entity1/base_laser_link"


def test_a_thousand_steps_in_lockstep_have_the_same_hash_twice(ros_domain, driver):
    def play():
        with ExitStack() as stack:
            for name, speed in (("entity1", 2.0), ("entity2", 1.0)):
                started(stack, ["sh", "-c", 'exec "$@" > /dev/null', "sh", driver, ros_domain, name, speed])
            simulation = stack.enter_context(Simulation(cars(2, lockstep=600.0), seeds=3))
            start = simulation.read("car.pos")[0][0]
            simulation.step(N_STEPS)
            assert [inbox_of(simulation, row).n_received for row in (0, 1)] == [N_STEPS, N_STEPS]
            way = np.hypot(*(simulation.read("car.pos")[0][0] - start).T[:2])
            assert way == pytest.approx([N_STEPS * DT * 2.0, N_STEPS * DT * 1.0])
            return simulation.state_hash()

    assert play() == play()


def test_a_node_hears_of_the_cars_in_each_step_and_its_commands_move_them(ros_domain):
    heard, states = [], []
    with ExitStack() as stack:
        node = peer(stack, ros_domain, "answer")
        simulation = stack.enter_context(Simulation(cars(lockstep=600.0)))
        for _ in range(8):
            states.append([simulation.read(f"car.{name}")[0][0] for name in ("pos", "quat", "vel", "omega")])
            simulation.step()
        last_stamp = round(7 * DT * NANO)
        while sum(one["kind"] in ("odom", "tf") and one["stamp"] == last_stamp for one in heard) < 2 + 8:
            heard.append(json.loads(node.stdout.readline()))
    for number, name in enumerate(("entity1", "entity2")):
        odoms = [one for one in heard if one["kind"] == "odom" and one["name"] == name]
        assert [one["stamp"] for one in odoms] == [round(k * DT * NANO) for k in range(8)]
        truths = [one for one in heard if one["kind"] == "base_pose_ground_truth" and one["name"] == name]
        assert truths
        assert all({**one, "kind": "odom", "frames": odoms[0]["frames"]} in odoms for one in truths)
        assert truths[0]["frames"] == ["world", f"{name}/base_link"]
        for one, (pos, quat, vel, omega) in zip(odoms, states, strict=True):
            assert one["frames"] == [f"{name}/odom", f"{name}/base_link"]
            assert one["state"][:7] == [*pos[number], *quat[number]]
            assert one["state"][7:10] == pytest.approx([np.hypot(*vel[number][:2]), 0.0, 0.0], abs=1e-12)
            assert one["state"][10:] == pytest.approx([0.0, 0.0, omega[number][2]], abs=1e-12)
            assert one["covariances"] == [0.0] * 72
    # Each command holds in the step whose odom it answers.
    first = states[-1][0][0] - states[0][0][0]
    assert np.hypot(*first[:2]) == pytest.approx(7 * DT * 2.0)
    turned = 7 * DT * 1.0 * math.tan(0.2) / 2.62
    yaw = [2.0 * math.atan2(quat[1][3], quat[1][0]) for _, quat, *_ in states]
    assert yaw[-1] - yaw[0] == pytest.approx(turned)
    scan = next(one for one in heard if one["kind"] == "scan")
    assert scan["frame"] == "entity1/base_laser_link"
    assert len(scan["ranges"]) == 5
    assert scan["limits"][:3] == pytest.approx([-math.pi / 2, math.pi / 2, math.pi / 4])
    chain = ["odom", "base_footprint", "base_link", "base_laser_link"]
    links = [
        list(pair)
        for name in ("entity1", "entity2")
        for pair in itertools.pairwise(["world", *(f"{name}/{frame}" for frame in chain)])
    ]
    last = [one for one in heard if one["kind"] == "tf" and one["stamp"] == last_stamp]
    assert [one["frames"] for one in last] == links
    assert last[0]["pose"] == last[2]["pose"] == [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    assert last[1]["pose"] == pytest.approx([*states[7][0][0], *states[7][1][0]], abs=1e-15)
    clocks = [one["stamp"] for one in heard if one["kind"] == "clock"]
    assert clocks == sorted(clocks)
    assert set(clocks) & {round(k * DT * NANO) for k in range(1, 9)}


def test_a_robot_without_commands_stands_still_and_one_stops_after_the_watchdogs_time(ros_domain):
    block = Block(
        name="drone", heading="90 deg", autonomy=ROS2Autonomy(watchdog_timeout=2.5 * DT), motion=SingleIntegrator()
    )  # fmt: skip
    with ExitStack() as stack:
        simulation = stack.enter_context(Simulation(Mission(blocks=[block], dt=DT, end=1e6)))
        inbox, start = inbox_of(simulation), simulation.read("drone.pos")[0][0, 0]
        simulation.step(4)
        assert simulation.read("drone.pos")[0][0, 0].tolist() == start.tolist()
        node = peer(stack, ros_domain, "repeat", 1.0)
        while not inbox.n_received:
            link_of(simulation).collect()
        node.communicate()
        while inbox.subscriber.get_num_connections():
            link_of(simulation).collect()
        simulation.step(8)
        way = simulation.read("drone.pos")[0][0, 0] - start
    assert way == pytest.approx([0.0, 1.0 * 3 * DT, 0.0])


def test_topics_pause_the_game_and_make_single_steps(ros_domain):
    with ExitStack() as stack:
        simulation = stack.enter_context(Simulation(cars(clock={"start_paused": True})))
        node = peer(stack, ros_domain, "control")
        gate = link_of(simulation).gate
        game = threading.Thread(target=simulation.run, args=(6 * DT,))
        game.start()
        assert json.loads(node.stdout.readline()) == {"kind": "ready"}

        def say(line):
            node.stdin.write(f"{line}\n")
            node.stdin.flush()

        for k in range(3):
            assert gate.is_paused
            say("step")
            while simulation.steps[0] == k:
                assert game.is_alive()
            assert simulation.steps[0] == k + 1
        say("go")
        game.join()
        assert simulation.steps[0] == 6


def test_an_imu_and_a_compass_are_heard_with_the_quality_of_sensors(ros_domain):
    from cyclonedds.core import Policy, Qos
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic

    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    block = Block(
        name="car", heading="30 deg", motion=Still(),
        sensor=[ROS2IMUSensor(vehicle_name="tug"), ROS2Compass(vehicle_name="tug")],
    )  # fmt: skip
    quality = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(1))
    node, heard = opened_participant(), {}
    readers = {
        f"sensor_msgs/msg/{short}": DataReader(
            node, Topic(node, f"rt/tug/{topic}", message_type(f"sensor_msgs/{short}")), qos=quality
        )
        for topic, short in (("imu", "Imu"), ("compass", "MagneticField"))
    }
    with Simulation(Mission(blocks=[block], dt=DT, end=1e6)) as simulation:
        while len(heard) < 2:
            simulation.step()
            for name, reader in readers.items():
                for one in reader.take(1):
                    heard[name] = store.deserialize_cdr(one.data, name)
    imu, compass = heard["sensor_msgs/msg/Imu"], heard["sensor_msgs/msg/MagneticField"]
    q, force, field = imu.orientation, imu.linear_acceleration, compass.magnetic_field
    assert [q.w, q.x, q.y, q.z] == pytest.approx([math.cos(math.pi / 12), 0.0, 0.0, math.sin(math.pi / 12)])
    assert [force.x, force.y, force.z] == pytest.approx([0.0, 0.0, 9.80665])
    assert [field.x, field.y, field.z] == pytest.approx([0.5, math.sqrt(0.75), 0.0])
    assert imu.header.frame_id == compass.header.frame_id == "tug/base_link"


def test_a_reset_leaves_one_subscriber_of_each_robot(ros_domain):
    with Simulation(cars(2, clock={})) as simulation:
        link = link_of(simulation)
        n_readers, n_topics = len(link._readers), len(link._topics)
        for _ in range(5):
            simulation.step()
            simulation.reset([0])
        assert (len(link._readers), len(link._topics)) == (n_readers, n_topics)
        simulation.step()


def test_stamps_are_the_wall_clocks_without_simulated_time(ros_domain):
    with Simulation(cars(1, has_clock=False)) as simulation:
        link = link_of(simulation)
        assert link.stamp(3.0)[0] > 1e9
        link.is_sim_time = True
        assert link.stamp(3.5) == (3, 500_000_000)


def test_a_lidar_of_several_elevations_is_refused(ros_domain):
    block = Block(name="car", autonomy=ROS2Autonomy(), motion=Unicycle(), sensor=RayTrace(num_rays_vert=2))
    with (
        Simulation(Mission(blocks=[block], dt=DT, end=9.0)) as simulation,
        pytest.raises(PluginError, match="base_scan takes one elevation; RayTrace has num_rays_vert = 2"),
    ):
        simulation.run()


def test_several_worlds_are_refused(ros_domain):
    block = Block(name="car", autonomy=ROS2Autonomy(), motion=SimpleCar())
    with pytest.raises(Exception, match="supports at most 1 worlds"):
        Simulation(Mission(blocks=[block]), seeds=[1, 2])


@pytest.mark.parametrize("name", ["ROS2Autonomy", "ROS2ClockServer", "ROS2Compass", "ROS2IMUSensor"])
def test_the_example_of_a_plugin_plays(ros_domain, name):
    loaded = read_mission(stock.examples()[name])
    assert loaded.notes == ()
    with Simulation(loaded.mission) as simulation:
        simulation.step(3)
        assert simulation.result()[0].error is None
