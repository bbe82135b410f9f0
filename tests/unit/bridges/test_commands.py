"""GRPCCommandString: a program with code that protoc generated changes the states of robots."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from actor_process import actor_server

from tussle import Simulation
from tussle.errors import MissingExtraError, ParameterError, PluginError
from tussle.mission import read_mission
from tussle.plugins import stock
from tussle.plugins.links.rpc import load_grpc, message_types

MISSION = """<runscript><run dt="0.1" end="50"/>
<entity_interaction ip="127.0.0.1" port="{port}">GRPCCommandString</entity_interaction>
<entity><name>a</name><count>2</count>
<autonomy relays="[ GlobalNetwork Event LocalNetwork ]">CommandStringRelay</autonomy>
<autonomy graphviz_fsm="digraph {{ qi -&gt; b [label=go]; b -&gt; c [label=on] }}">GraphvizFSM</autonomy></entity></runscript>"""


@pytest.fixture(autouse=True)
def _is_installed():
    for name in ("grpc", "google.protobuf", "grpc_tools"):
        try:
            is_there = find_spec(name)
        except ModuleNotFoundError:
            is_there = None
        if not is_there:
            assert "CI" not in os.environ, f"{name} is not installed"
            pytest.skip(f"{name} is not installed")


@pytest.fixture
def port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


@pytest.fixture
def game(tmp_path, port):
    path = tmp_path / "m.xml"
    path.write_text(MISSION.format(port=port))
    return read_mission(path).mission


@pytest.fixture
def send(tmp_path, port):
    """A function that sends commands (network, topic, text) from another process and returns the answers."""

    def run(*commands):
        words = [word for command in commands for word in command]
        client = Path(__file__).with_name("command_client.py")
        address = f"127.0.0.1:{port}"
        done = subprocess.run(
            [sys.executable, client, tmp_path, address, *words], capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines()

    return run


def test_commands_reach_the_entities_that_they_are_for(game, send):
    with Simulation(game, seeds=[1, 2]) as sim:
        assert send(("GlobalNetwork", "/2/Event", "go")) == ["1"]
        sim.step(5)
        assert sim.read("a.GraphvizFSM.node")[0].tolist() == [[0, 1], [0, 1]]
        assert send(("", "Event", "go"), ("GlobalNetwork", "/1/Event", "on")) == ["1", "1"]
        sim.step(5)
        nodes = sim.read("a.GraphvizFSM.node")[0].tolist()
        assert nodes[0] == nodes[1]
        assert nodes[0][1] == 1


def test_commands_that_nobody_hears_are_told_so(game, send):
    with Simulation(game) as sim:
        answers = send(
            ("GlobalNetwork", "Evnt", "go"), ("Nowhere", "/1/Event", "go"), ("GlobalNetwork", "", ""), ("GlobalNetwork", "/9/Event", "go"),
            ("GlobalNetwork", "/0/Event", "go"), ("GlobalNetwork", "/2/Event", "x"),
        )  # fmt: skip
        sim.step(5)
        assert sim.read("a.GraphvizFSM.node")[0].tolist() == [[0, 0]]
    assert answers[0].startswith(
        "INVALID_ARGUMENT no plugin listens to texts on network 'GlobalNetwork', topic 'Evnt' (did you mean 'GlobalNetwork Event'?)"
    )
    assert answers[1].startswith("INVALID_ARGUMENT")
    assert answers[2].startswith("INVALID_ARGUMENT")
    for answer, topic, number in ((answers[3], "/9/Event", 9), (answers[4], "/0/Event", 0)):
        assert (
            answer == f"INVALID_ARGUMENT topic '{topic}': no entity has had the id {number}; ids are 1 to 2"
        )
    assert answers[5] == "1"


def test_it_is_no_error_that_an_entity_is_gone(game, send):
    with Simulation(game) as sim:
        sim.write("a.health", [[1.0, 0.0]])
        sim.step(2)
        assert sim.state.population.bodies.id.tolist() == [1]
        assert send(("GlobalNetwork", "/2/Event", "go")) == ["1"]
        sim.step(2)
        assert sim.read("a.GraphvizFSM.node")[0][0, 0] == 0


def test_more_commands_than_a_step_takes_are_refused(game, send, monkeypatch):
    monkeypatch.setattr("tussle.plugins.stock.interaction.grpc_command_string.MAX_WAITING", 2)
    with Simulation(game):
        answers = send(*[("GlobalNetwork", "Event", "go")] * 3)
    assert answers == ["1", "1", "RESOURCE_EXHAUSTED 2 commands wait for the next step"]


def test_garbage_does_not_upset_the_server(game, send, port):
    import grpc

    method = "/scrimmage_msgs.ScrimmageMsgService/SendCommandString"
    with Simulation(game) as sim:
        with socket.create_connection(("127.0.0.1", port)) as raw:
            raw.sendall(b"GET / HTTP/1.1\r\n\r\n" * 100)
        with grpc.insecure_channel(f"127.0.0.1:{port}") as channel:
            for name, data in ((method, b"\xff" * 99), (method, bytes(2 * 1024 * 1024)), (method + "s", b"")):
                with pytest.raises(grpc.RpcError):
                    channel.unary_unary(name)(data, timeout=60)
        sim.step(3)
        assert send(("GlobalNetwork", "Event", "go")) == ["1"]


def test_the_port_is_taken_by_one_and_free_after_it(game, port):
    with (
        Simulation(game),
        pytest.raises(
            (ParameterError, PluginError),
            match=f"port: 127.0.0.1:{port} cannot be opened: Address already in use",
        ),
    ):
        Simulation(game)
    with socket.create_server(("127.0.0.1", port)):
        pass


def test_the_example_is_played(tmp_path, port, send):
    path = tmp_path / "mission.xml"
    path.write_text(
        stock.examples()["GRPCCommandString"].read_text().replace('"60000"', f'"{port}" ip="127.0.0.1"')
    )
    loaded = read_mission(path)
    assert loaded.notes == ()
    with Simulation(loaded.mission) as sim:
        assert send(("GlobalNetwork", "/2/State", "out")) == ["1"]
        sim.step(900)
        distance = np.linalg.norm(sim.read("robot.pos")[0][0] - [200, 0, 50], axis=1)
        assert (distance < 25).tolist() == [False, True, False], distance


def test_messages_are_those_that_protobuf_writes():
    types = message_types(
        "p",
        Point="double x, double y",
        Path="string name, repeated Point points, repeated int32 marks, bool done",
    )
    path = types["Path"](name="a", points=[types["Point"](x=1.0)], marks=[3, 270], done=True)
    # The wire format: tag, then length or value; packed numbers.
    assert (
        path.SerializeToString()
        == b"\x0a\x01a" + b"\x12\x09\x09\0\0\0\0\0\0\xf0\x3f" + b"\x1a\x03\x03\x8e\x02" + b"\x20\x01"
    )


def test_without_grpcio_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "grpc", None)
    with pytest.raises(MissingExtraError, match=r"X needs grpcio and protobuf: pip install 'tussle\[grpc\]'"):
        load_grpc("X")


# -- actors -----------------------------------------------------------------------------------------------------------------------

ROBOT = """<runscript><run end="8" dt="1"/>
<entity><team_id>1</team_id><x>{x}</x><motion_model>SingleIntegrator</motion_model>
<controller>SingleIntegratorControllerSimple</controller><sensor>RLSimpleSensor</sensor>
<autonomy ctrl_y="true" module="my_module" grpc_mode="true" grpc_address="127.0.0.1" port="{port}">RLSimple</autonomy>
</entity></runscript>"""


@pytest.fixture
def actors(tmp_path, port):
    with actor_server(tmp_path, port) as process:
        yield process


def robot(tmp_path, port, x=6):
    path = tmp_path / "robot.xml"
    path.write_text(ROBOT.format(port=port, x=x))
    return read_mission(path).mission


def test_a_server_of_actors_moves_the_robot(actors, tmp_path, port):
    with Simulation(robot(tmp_path, port)) as sim:
        sim.step(3)
        saved = sim.snapshot()
        sim.run()
        pos = sim.read(f"{sim.mission.blocks[0].name}.pos")[0][0, 0]
        # x = 6, 5, ..., 0, -1, then 0; north by 3 m/s, which the server chose.
        np.testing.assert_allclose(pos, [0.0, 24.0, 0.0])
        sim.restore(saved)
        sim.run()
        np.testing.assert_allclose(sim.read(f"{sim.mission.blocks[0].name}.pos")[0][0, 0], pos)
    told, _ = actors.communicate()
    # Once, and again after the snapshot is restored.
    assert told == 2 * "[2] [(-10.0, 10.0)] [(-inf, inf), (-inf, inf)] -inf inf 10.0\n"


def test_an_error_of_the_server_is_told(actors, tmp_path, port):
    with (
        Simulation(robot(tmp_path, port, 2000)) as sim,
        pytest.raises(
            PluginError,
            match=f"server of actors at 127.0.0.1:{port} .grpc_address, port. has no answer to GetAction .*INTERNAL too far",
        ),
    ):
        sim.run()


def test_a_server_that_is_not_there_is_named(tmp_path, port, monkeypatch):
    monkeypatch.setattr("tussle.plugins.stock.autonomy.rl_simple.actors.TIMEOUT", 0.2)
    with (
        Simulation(robot(tmp_path, port)) as sim,
        pytest.raises(
            PluginError, match=f"127.0.0.1:{port} .* has no answer to SendEnvironment after 0.2 s: "
        ),
    ):
        sim.run()


def test_actions_that_do_not_fit_end_the_game(tmp_path, port):
    with (
        actor_server(tmp_path, port, "wrong"),
        Simulation(robot(tmp_path, port)) as sim,
        pytest.raises(PluginError, match="an action has 2 finite numbers"),
    ):
        sim.run()
