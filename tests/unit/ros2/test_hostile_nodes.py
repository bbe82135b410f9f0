"""Nodes of ROS 2 that send garbage, die, stop, flood, or come twice; wrong settings; and what is left after a game."""

from __future__ import annotations

import os
import signal
import socket
import sys
import time
from contextlib import ExitStack

import numpy as np
import psutil
import pytest
from nodes import DT, cars, inbox_of, peer, started, steps_until

from tussle import Simulation
from tussle.errors import PluginError
from tussle.plugins.links.ros.dds import Ros2Link
from tussle.plugins.links.ros.domain import domain_id

N_FLOOD = 20_000
NOWHERE = "<CycloneDDS><Nonsense/></CycloneDDS>"
GAME = """
<runscript name="cars">
  <run end="1000000" dt="0.1"/>
  <entity><count>2</count><autonomy lockstep="600">ROS2Autonomy</autonomy><motion_model>SimpleCar</motion_model></entity>
</runscript>
"""


def opened() -> tuple[set[int], int, int]:
    """Ports of UDP sockets, number of files, and number of threads of this process."""
    process = psutil.Process()
    ports = {one.laddr.port for one in process.net_connections("udp")}
    return ports, process.num_fds(), process.num_threads()


def first_port(domain) -> int:
    """That of a participant in a domain is 10 higher (DDSI-RTPS 2.5, 9.6.2.3)."""
    return 7400 + 250 * domain


def devices() -> list[tuple[str, bytes]]:
    """Address and interface of each UDP socket of this process."""
    found = []
    for one in psutil.Process().net_connections("udp"):
        is_blocking = os.get_blocking(one.fd)
        with socket.socket(fileno=os.dup(one.fd)) as udp:
            device = udp.getsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, 16)
            found.append((udp.getsockname()[0], device))
        os.set_blocking(one.fd, is_blocking)
    return found


def test_a_command_that_is_not_finite_ends_the_game_and_the_error_names_its_topic(ros_domain):
    with ExitStack() as stack:
        simulation = stack.enter_context(Simulation(cars()))
        peer(stack, ros_domain, "nan")
        with pytest.raises(PluginError, match=r"car 2.*/entity2/cmd_vel: linear\.x = nan is not allowed"):
            simulation.run_until(lambda _: time.sleep(0.005))


def test_torn_commands_leave_the_game_as_it_is(ros_domain, driver, capfd):
    with ExitStack() as stack:
        simulation = stack.enter_context(Simulation(cars(1)))
        torn = started(stack, [driver, ros_domain, "entity1", 1.0, "torn"])
        warning = "deserialization rt/entity1/cmd_vel"
        steps_until(simulation, lambda: warning in capfd.readouterr().err)
        assert inbox_of(simulation).n_received == 0
        torn.kill()
        started(stack, [driver, ros_domain, "entity1", 1.0])
        steps_until(simulation, lambda: inbox_of(simulation).n_received)


def test_packets_that_are_no_dds_leave_the_game_as_it_is(ros_domain):
    with ExitStack() as stack:
        simulation = stack.enter_context(Simulation(cars(1)))
        ports = {
            port
            for port in opened()[0]
            if port in range(first_port(ros_domain), first_port(ros_domain) + 250)
        }
        assert ports
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            for text in (b"\xff" * 4096, b"GET / HTTP/1.1\r\n\r\n", b"RTPS\x02\x01" + b"\x15" * 500, b""):
                for port in ports:
                    stranger.sendto(text, ("127.0.0.1", port))
                simulation.step()
        assert inbox_of(simulation).n_received == 0
        # A sound node is heard afterwards.
        peer(stack, ros_domain, "repeat", 1.0)
        steps_until(simulation, lambda: inbox_of(simulation).n_received)


def test_a_node_that_dies_ends_a_game_in_lockstep_and_the_error_names_its_robot(ros_domain, monkeypatch):
    with ExitStack() as stack:
        node = peer(stack, ros_domain, "answer")
        simulation = stack.enter_context(Simulation(cars(2, lockstep=600.0)))
        simulation.step(3)
        node.kill()
        node.wait()
        wait = Ros2Link.wait_for
        monkeypatch.setattr(Ros2Link, "wait_for", lambda link, there, _, stop: wait(link, there, 0.2, stop))
        with pytest.raises(PluginError, match=r"car 1.*no message on /entity1/cmd_vel within 600 s"):
            simulation.run_until(lambda _: None)


def test_lockstep_without_a_node_ends_the_game(ros_domain):
    with (
        Simulation(cars(lockstep=0.1)) as simulation,
        pytest.raises(
            PluginError,
            match=r"nobody has subscribed to /entity1/odom and publishes /entity1/cmd_vel within 0\.1 s",
        ),
    ):
        simulation.step()


def test_a_flood_of_commands_does_not_stop_the_game_and_the_newest_holds(ros_domain):
    with ExitStack() as stack:
        simulation = stack.enter_context(Simulation(cars(1)))
        inbox, began = inbox_of(simulation), None
        flood = peer(stack, ros_domain, "flood")
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


def test_two_nodes_command_a_robot_until_the_last_has_gone(ros_domain):
    with ExitStack() as stack:
        simulation = stack.enter_context(Simulation(cars(1)))
        inbox = inbox_of(simulation)
        nodes = [peer(stack, ros_domain, "repeat", speed) for speed in (1.0, 2.0)]
        for speed in (1.0, 2.0, 1.0, 2.0):  # both are heard, in turn
            steps_until(simulation, lambda speed=speed: inbox.command[0] == speed)
        nodes[0].kill()
        nodes[0].wait()
        steps_until(simulation, lambda: inbox.subscriber.get_num_connections() == 1)
        before = inbox.n_received
        steps_until(simulation, lambda: inbox.n_received > before + 2)
        assert inbox.command[0] == 2.0


def test_a_node_that_stops_to_listen_does_not_stop_the_game(ros_domain):
    with ExitStack() as stack:
        simulation = stack.enter_context(Simulation(cars(2)))
        node = peer(stack, ros_domain, "answer")
        steps_until(simulation, lambda: inbox_of(simulation).n_received)
        node.send_signal(signal.SIGSTOP)
        before = int(simulation.steps[0])
        simulation.step(1000)
        assert simulation.steps[0] == before + 1000


def test_nothing_is_left_after_a_game(ros_domain):
    with Simulation(cars()) as simulation:  # what starts once in a process
        simulation.step()
    before = opened()
    with Simulation(cars()) as simulation:
        simulation.step()
        assert len(opened()[0] - before[0]) >= 2
        assert opened()[2] > before[2]
        simulation.step()
    assert opened() == before
    assert "CYCLONEDDS_URI" not in os.environ


def test_sockets_take_packets_of_this_machine_only(ros_domain):
    with Simulation(cars()), Simulation(cars()):
        found = devices()
    assert [address for address, _ in found].count("0.0.0.0") == 2
    assert all(address == "127.0.0.1" or device == b"lo\x00" for address, device in found)


def test_sockets_of_others_are_left_alone(ros_domain):
    before = socket.getdefaulttimeout()
    try:
        socket.setdefaulttimeout(None)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
            other.bind(("", 0))
            socket.setdefaulttimeout(60.0)  # as rospy does; a new socket of Python then does not block
            with Simulation(cars()):
                numbers = {one.laddr.port: one.fd for one in psutil.Process().net_connections("udp")}
                assert os.get_blocking(numbers[first_port(ros_domain) + 10])
            assert os.get_blocking(other.fileno())
            assert other.getsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, 16) == b""
    finally:
        socket.setdefaulttimeout(before)


def test_where_the_sockets_cannot_be_bound_the_error_says_so(ros_domain, monkeypatch):
    monkeypatch.setattr(socket, "SO_BINDTODEVICE", 10_000)
    with pytest.raises(
        PluginError, match=r"cannot be bound to the loopback interface: .*; set CYCLONEDDS_URI"
    ):
        Simulation(cars()).step()


def test_the_users_configuration_wins(ros_domain, monkeypatch):
    monkeypatch.setenv("CYCLONEDDS_URI", NOWHERE)
    with pytest.raises(
        PluginError, match=rf"the domain {ros_domain} .* as CYCLONEDDS_URI = '<CycloneDDS><Nons"
    ):
        Simulation(cars()).step()
    config = '<CycloneDDS><Domain id="any"><Discovery><Tag>of tests</Tag></Discovery></Domain></CycloneDDS>'
    monkeypatch.setenv("CYCLONEDDS_URI", config)
    with Simulation(cars()) as simulation:
        simulation.step()
        assert {device for _, device in devices()} == {b""}
    assert os.environ["CYCLONEDDS_URI"] == config


@pytest.mark.needs("cyclonedds")
@pytest.mark.parametrize("text", ["a", "-1", "233", "1.0", "²"])
def test_a_domain_that_does_not_exist_is_refused(monkeypatch, text):
    monkeypatch.setenv("ROS_DOMAIN_ID", text)
    with pytest.raises(PluginError, match=rf"ROS_DOMAIN_ID = '{text}' .* a whole number from 0 to 232"):
        Simulation(cars()).step()


def test_the_domain_is_0_by_default(monkeypatch):
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    assert domain_id() == 0


def test_a_name_that_ros_does_not_take_is_refused(ros_domain):
    with pytest.raises(PluginError, match="'my robot1' is no name of ROS"):
        Simulation(cars(namespace_prefix="my robot")).step()


def test_ctrl_c_ends_a_game_that_waits_for_a_node(ros_domain, tmp_path):
    (tmp_path / "game.xml").write_text(GAME)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    command = [sys.executable, "-m", "tussle.cli", "run", tmp_path / "game.xml", "--no-log"]
    with ExitStack() as stack:
        game = started(stack, command, env=environment)
        process = psutil.Process(game.pid)
        while len(process.net_connections("udp")) < 3:
            assert game.poll() is None
            time.sleep(0.05)
        time.sleep(1.0)
        game.send_signal(signal.SIGINT)
        game.communicate()
        assert game.returncode == 130
