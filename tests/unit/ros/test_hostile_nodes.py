"""Nodes of ROS 1 that die, send garbage, flood, or come twice; and what is left when the user interrupts."""

from __future__ import annotations

import gc
import os
import signal
import socket
import subprocess
import sys
import time
import xmlrpc.client
from contextlib import ExitStack
from pathlib import Path

import needs
import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.errors import PluginError
from tussle.plugins.links.ros.link import RosLink
from tussle.plugins.links.ros.node import DEBIAN, load_rospy
from tussle.stock import ROSAutonomy, SimpleCar

# rospy leaves connections to the master to the garbage collector.
pytestmark = [
    pytest.mark.filterwarnings("ignore:unclosed <socket:ResourceWarning"),
    pytest.mark.filterwarnings(
        "ignore:Exception ignored in. <socket:pytest.PytestUnraisableExceptionWarning"
    ),
]
DT = 0.125
PEER = Path(__file__).with_name("peer.rospy")
MAZE = Path(__file__).parents[3] / "examples" / "ros" / "maze.xml"
N_FLOOD = 20_000
FLOOD = f"""
import rospy
from geometry_msgs.msg import Twist
rospy.init_node("flood", disable_rostime=True)
sender = rospy.Publisher("/entity1/cmd_vel", Twist, queue_size=10)
while not sender.get_num_connections():
    rospy.rostime.wallsleep(0.01)
command = Twist()
command.linear.x = 1.0
for _ in range({N_FLOOD}):
    sender.publish(command)
command.linear.x = 3.0
sender.publish(command)
print("flooded", flush=True)
input()
"""


@pytest.fixture(autouse=True)
def _collected():
    """Connections of rospy end here, not in a test of something else."""
    yield
    gc.collect()


def cars(n, lockstep=0.0):
    block = Block(name="car", count=n, autonomy=ROSAutonomy(lockstep=lockstep), motion=SimpleCar())
    return Mission(blocks=[block], dt=DT, end=1e6)


def inbox_of(simulation):
    return simulation.state.population.groups[0].autonomies[0].plugin.robot[0].inbox


def started(stack, command, **options):
    """A process with pipes, which is ended with the stack."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    process = stack.enter_context(subprocess.Popen(command, **pipes, **options))
    stack.callback(process.kill)
    return process


def steps_until(simulation, is_there):
    """Play until something holds."""
    while not is_there():
        simulation.step()
        time.sleep(0.005)


def registered(uri):
    """Topics and services that the master knows, apart from its own."""
    with xmlrpc.client.ServerProxy(uri) as master:
        _, _, (publishers, subscribers, services) = master.getSystemState("/test")
    return {name for part in (publishers, subscribers, services) for name, _ in part if "rosout" not in name}


def test_a_node_that_dies_ends_a_game_in_lockstep_and_the_error_names_its_robot(roscore, monkeypatch):
    with ExitStack() as stack:
        node = started(stack, ["/usr/bin/python3", str(PEER)], stderr=subprocess.DEVNULL)
        simulation = stack.enter_context(Simulation(cars(2, lockstep=600.0)))
        simulation.step(3)
        node.kill()
        node.wait()
        wait = RosLink.wait_for
        monkeypatch.setattr(RosLink, "wait_for", lambda link, there, _, stop: wait(link, there, 0.2, stop))
        with pytest.raises(PluginError, match=r"car 1.*no message on /entity1/cmd_vel within 600 s"):
            simulation.run_until(lambda _: None)


def test_garbage_leaves_the_game_as_it_is(roscore):
    ros = load_rospy()
    with ExitStack() as stack:
        simulation = stack.enter_context(Simulation(cars(1)))
        with xmlrpc.client.ServerProxy(ros.rospy.get_node_uri()) as node:
            _, _, (_, host, port) = node.requestTopic("/test", "/entity1/odom", [["TCPROS"]])
        for text in (b"\xff" * 4096, b"GET / HTTP/1.1\r\n\r\n", b"\x08\x00\x00\x00\xff\xff\xff\x7fabcd", b""):
            with socket.create_connection((host, port)) as stranger:
                stranger.sendall(text)
            simulation.step()

        class Torn(ros.rospy.AnyMsg):
            _type, _md5sum = ros.Twist._type, ros.Twist._md5sum
            _full_text = ros.Twist._full_text

        sender = ros.rospy.Publisher("/entity1/cmd_vel", Torn, queue_size=1)
        steps_until(simulation, sender.get_num_connections)
        torn = Torn()
        torn._buff = b"torn"
        sender.publish(torn)
        simulation.step(5)
        sender.unregister()
        assert inbox_of(simulation).n_received == 0
        # A sound node is heard afterwards.
        flood = started(stack, [sys.executable, "-c", f"import sys; sys.path.append({DEBIAN!r}){FLOOD}"])
        steps_until(simulation, lambda: inbox_of(simulation).n_received)
        flood.kill()


def test_a_flood_of_commands_does_not_stop_the_game_and_the_newest_holds(roscore):
    with ExitStack() as stack:
        simulation = stack.enter_context(Simulation(cars(1)))
        inbox = inbox_of(simulation)
        flood = started(stack, [sys.executable, "-c", f"import sys; sys.path.append({DEBIAN!r}){FLOOD}"])
        began = None
        while inbox.command[0] != 3.0:
            if inbox.n_received and began is None:
                began = int(simulation.steps[0])
            simulation.step()
        assert flood.stdout.readline() == "flooded\n"
        assert simulation.steps[0] > began
        assert 0 < inbox.n_received <= N_FLOOD + 1
        before = simulation.read("car.pos")[0][0, 0]
        simulation.step()
        assert np.hypot(*(simulation.read("car.pos")[0][0, 0] - before)[:2]) == pytest.approx(3.0 * DT)


def test_two_nodes_command_a_robot_until_the_last_has_gone(roscore):
    needs.require("rostopic")
    command = ["rostopic", "pub", "-r", "50", "/entity1/cmd_vel", "geometry_msgs/Twist"]
    with ExitStack() as stack:
        simulation = stack.enter_context(Simulation(cars(1)))
        inbox = inbox_of(simulation)
        nodes = [
            started(stack, [*command, f"{{linear: {{x: {x}}}}}"], stderr=subprocess.DEVNULL)
            for x in (1.0, 2.0)
        ]
        for x in (1.0, 2.0, 1.0, 2.0):  # both are heard, in turn
            steps_until(simulation, lambda x=x: inbox.command[0] == x)
        nodes[0].kill()
        nodes[0].wait()
        steps_until(simulation, lambda: inbox.subscriber.get_num_connections() == 1)
        before = inbox.n_received
        steps_until(simulation, lambda: inbox.n_received > before + 2)
        assert inbox.command[0] == 2.0


def test_rosbag_records_what_a_robot_publishes(roscore, tmp_path):
    needs.require("rosbag")
    bag = tmp_path / "odom.bag"
    with ExitStack() as stack:
        simulation = stack.enter_context(Simulation(cars(1)))
        command = ["rosbag", "record", "--limit", "5", "-O", str(bag), "/entity1/odom"]
        recorder = started(stack, command, stderr=subprocess.DEVNULL)
        steps_until(simulation, lambda: recorder.poll() is not None)
    assert recorder.returncode == 0
    shown = subprocess.run(
        ["rosbag", "info", "-y", str(bag)], check=True, capture_output=True, text=True
    ).stdout
    assert "topic: /entity1/odom" in shown
    assert "type: nav_msgs/Odometry" in shown
    assert "messages: 5" in shown


def test_ctrl_c_ends_a_game_that_waits_for_a_node_and_nothing_is_left(roscore):
    before = registered(roscore)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    command = [sys.executable, "-m", "tussle.cli", "run", str(MAZE), "lockstep=600", "--no-log"]
    with ExitStack() as stack:
        game = started(stack, command, env=environment, stderr=subprocess.DEVNULL)
        while not {"/entity4/cmd_vel", "/entity4/odom", "/tussle/step"} <= registered(roscore):
            assert game.poll() is None
            time.sleep(0.05)
        game.send_signal(signal.SIGINT)
        game.communicate()
        assert game.returncode == 130
    assert registered(roscore) == before
