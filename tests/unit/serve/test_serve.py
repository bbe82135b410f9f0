"""Programs play a served simulation by websocket."""

import asyncio
import base64
import contextlib
import json
import re
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import aiohttp
import needs
import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Metric
from tussle.mission import read_mission
from tussle.serve import Server
from tussle.stock import GoTo, SimpleCollision, SingleIntegrator

CLIENTS = Path(__file__).parents[3] / "examples" / "serve"


def mission(**changes):
    flock = Block(
        name="flock", count=3, position=(0, 0, 10), placement="uniform", half_width=(50, 50, 5), scatter_first=True,
        autonomy=GoTo(waypoints=((99, 0, 10),), speed=4), motion=SingleIntegrator(),
    )  # fmt: skip
    spare = Block(name="spare", count=0, autonomy=GoTo(), motion=SingleIntegrator())
    return Mission(**{"blocks": [flock, spare], "dt": 0.5, "end": 20, "name": "flight", **changes})


@pytest.fixture
def server():
    with Simulation(mission(), seeds=[1, 2]) as simulation, Server(simulation) as server:
        yield server


class Talk:
    """Asks questions one after another; states that come between are kept."""

    def __init__(self, socket):
        self.socket, self.states = socket, []

    async def __call__(self, do, **fields):
        await self.socket.send_json({"do": do, "id": 7, **fields})
        while "id" not in (answer := json.loads((await self.socket.receive()).data)):
            self.states.append(answer)
        assert answer.pop("id") == 7
        return answer


def talk(server, conversation, **headers):
    async def run():
        async with (
            aiohttp.ClientSession() as session,
            session.ws_connect(server.url, headers=headers, max_msg_size=0) as socket,
        ):
            return await conversation(Talk(socket))

    with ThreadPoolExecutor(1) as executor:  # in this thread, a browser of another test may have a loop
        return executor.submit(lambda: asyncio.run(run())).result()


def test_a_game_is_the_same_as_played_here(server):
    async def conversation(ask):
        told = await ask("describe")
        assert [block["name"] for block in told["blocks"]] == ["flock", "spare"]
        assert (told["mission"], told["dt"], told["seeds"]) == ("flight", 0.5, [1, 2])
        assert await ask("step", n=6) == {"t": [3.0, 3.0], "step": [6, 6], "is_over": False}
        listed = await ask("read", path="flock.pos")
        exact = (await ask("read", path="flock.pos", encoding="base64"))["values"]
        return listed, exact, [(await ask("state_hash", world=w))["hash"] for w in (0, 1)]

    listed, exact, hashes = talk(server, conversation)
    with Simulation(mission(), seeds=[1, 2]) as simulation:
        simulation.step(6)
        pos, mask = simulation.read("flock.pos")
        assert hashes == [simulation.state_hash(0), simulation.state_hash(1)]
    assert (listed["values"], listed["mask"]) == (pos.tolist(), mask.tolist())
    assert np.array_equal(
        np.frombuffer(base64.b64decode(exact["base64"]), exact["dtype"]).reshape(exact["shape"]), pos
    )


def test_columns_are_written_and_entities_are_born_and_removed(server):
    async def conversation(ask):
        pos = (await ask("read", path="flock.pos"))["values"]
        pos[1][2] = [5.0, 6.0, 7.0]
        await ask("write", path="flock.pos", values=pos)
        assert (await ask("read", path="flock.pos"))["values"] == pos
        await ask(
            "publish",
            message="SpawnEntity",
            worlds=[1],
            fields={"block": "spare", "pos": [1, 2, 3], "vel": [0, 0, 0], "quat": [1, 0, 0, 0]},
        )
        await ask("step", n=2)
        answer = await ask("read", path="spare.pos")
        assert answer["mask"] == [[False], [True]]
        assert answer["values"][0] == [[None] * 3]
        await ask("publish", message="RemoveEntity", fields={"entity": 1, "why": "tired"})
        await ask("step", n=2)
        return (await ask("result"))["worlds"]

    results = talk(server, conversation)
    assert [sum(each["alive"].values()) for each in results] == [2, 3]


def test_states_come_after_every_so_many_steps(server):
    async def conversation(ask):
        number = (await ask("subscribe", paths=["flock.pos", "flock.vel"], every=2))["subscription"]
        await ask("step", n=5)
        await ask("unsubscribe", subscription=number)
        await ask("step", n=4)
        return ask.states

    states = talk(server, conversation)
    assert [state["step"] for state in states] == [[2, 2], [4, 4]]
    assert all(
        sorted(state["columns"]) == ["flock.pos", "flock.vel"] and state["dropped"] == 0 for state in states
    )


def test_one_client_pauses_what_another_plays(server):
    async def start(ask):
        await ask("play", pace=None)

    async def stop(ask):
        first = await ask("pause")
        await asyncio.sleep(0.05)
        assert await ask("now") == first
        return await ask("reset", worlds=[0], seeds=[9])

    talk(server, start)
    assert talk(server, stop)["t"][0] == 0.0


def test_states_are_kept_and_restored(server):
    async def conversation(ask):
        kept = (await ask("snapshot"))["snapshot"]
        once, again = await ask("step", n=3), (await ask("restore", snapshot=kept), await ask("step", n=3))[1]
        assert once == again
        return await ask("restore", snapshot=99)

    assert "there is no snapshot 99; there are: 1" in talk(server, conversation)["error"]


@pytest.mark.parametrize(
    ("message", "error"),
    [
        ('{"do": "stop"}', "did you mean 'step'"),
        ('{"do": "step", "n": 0}', "n = 0 is not allowed; it takes a whole number"),
        ('{"do": "step", "m": 1}', "step has no field 'm'"),
        ('{"do": "step", "n": 1e9}', "n = 1000000000.0 is not allowed"),
        ('{"do": "read"}', "read needs the field 'path'"),
        ('{"do": "read", "path": "flok.pos"}', "flok"),
        ('{"do": "read", "path": 3}', "error"),
        ('{"do": "read", "path": "flock.pos", "encoding": "xml"}', "encoding = 'xml' is not allowed"),
        ('{"do": "write", "path": "flock.pos", "values": ["a"]}', "error"),
        ('{"do": "publish", "message": "SpawnEntyti", "fields": {}}', "did you mean 'SpawnEntity'"),
        ('{"do": "publish", "message": "RemoveEntity", "fields": {"who": 1}}', "who"),
        ('{"do": "publish", "message": "RemoveEntity", "fields": {"entity": 4}}', "entity = 4 is not allowed; no entity of world 0"),
        ('{"do": "publish", "message": "RemoveEntity", "fields": {}}', "entity = 0 is not allowed; no entity of world 0"),
        ('{"do": "publish", "message": "SpawnEntity", "fields": {"block": "spar"}}', "did you mean 'spare'"),
        ('{"do": "subscribe", "paths": ["flock.po"]}', "flock.po"),
        ('{"do": "subscribe", "paths": []}', "at least one path"),
        ('{"do": "unsubscribe", "subscription": 1}', "there is no subscription 1"),
        ('{"do": "play", "pace": -1}', "pace = -1"),
        ('{"do": "play", "warp": 1}', "play has no field 'warp'; there are: pace"),
        ('{"do": "reset", "worlds": [7]}', "worlds = [7]"),
        (b'{"do": "step"}', "the message is binary"),
        ('{"do": "call", "command": "now", "fields": {}}', "do = 'call' is not allowed"),
        ("[" * 100000, "error"),
        ("nonsense", "the message is no JSON"),
        ("3", "a message is an object"),
    ],
)  # fmt: skip
def test_what_is_not_allowed_is_answered_and_changes_nothing(server, message, error):
    async def conversation(ask):
        await (ask.socket.send_str if isinstance(message, str) else ask.socket.send_bytes)(message)
        answer = json.loads((await ask.socket.receive()).data)
        assert error in json.dumps(answer), answer
        assert (await ask("now"))["step"] == [0, 0]

    talk(server, conversation)


FIELDS = {
    "step": ["n"], "play": ["pace"], "read": ["path", "encoding"], "write": ["path", "values"], "restore": ["snapshot"],
    "publish": ["message", "fields", "worlds", "network", "topic"], "subscribe": ["paths", "every", "encoding"],
    "unsubscribe": ["subscription"], "reset": ["worlds", "seeds"], "state_hash": ["world"],
}  # fmt: skip
SOUND = {
    "path": "flock.pos", "values": 1.0, "message": "SpawnEntity", "fields": {"block": "spare"}, "paths": ["flock.pos"], "snapshot": 1,
    "subscription": 1,
}  # fmt: skip
WRONG = [True, 0, -1, 5, 1.5, 1e300, "", "x", [], ["x"], [None], [[1, [2]]], {}, {"a": 1}, {"id": "x"}]


@pytest.mark.parametrize(("command", "field"), [(c, f) for c, fields in FIELDS.items() for f in fields])
def test_errors_of_values_of_any_type_are_in_the_words_of_the_client(server, command, field):
    async def conversation(ask):
        for wrong in WRONG:
            answer = await ask(
                command, **{**{k: v for k, v in SOUND.items() if k in FIELDS[command]}, field: wrong}
            )
            assert not re.search(
                r"Error|object is|object cannot|argument|NoneType", answer.get("error", "")
            ), (
                wrong,
                answer,
            )
            await ask("pause")

    talk(server, conversation)


def test_the_step_of_a_client_that_is_gone_ends():
    with Simulation(mission(end=1e7), seeds=[1]) as simulation, Server(simulation) as server:

        async def leave(ask):
            await ask.socket.send_json({"do": "step", "n": 10**9})
            while not simulation.steps[0]:
                await asyncio.sleep(0.01)
            ask.socket._response.connection.transport.abort()

        async def stay(ask):
            for _ in range(1000):
                await asyncio.sleep(0.02 * bool(server._clients[1:]))
            assert (await ask("now"))["step"] == (await ask("now"))["step"]

        talk(server, leave)
        talk(server, stay)


def test_only_who_knows_the_address_is_served_and_no_page(server):
    async def conversation(ask):
        return await ask("now")

    for headers in ({"Origin": "http://evil.example"}, {"Host": "evil.example"}):
        with pytest.raises(aiohttp.WSServerHandshakeError, match="403"):
            talk(server, conversation, **headers)
    server.url = server.url[:-1] + ("0" if server.url[-1] != "0" else "1")
    with pytest.raises(aiohttp.WSServerHandshakeError, match="403"):
        talk(server, conversation)


def test_a_client_that_reads_nothing_costs_no_memory(server):
    async def conversation(ask):
        await ask("subscribe", paths="flock.pos")
        await ask.socket.send_json({"do": "play", "pace": None})
        deaf = server._clients[0]
        while not server._simulation.is_over:
            assert deaf.waiting.qsize() <= 64
            await asyncio.sleep(0.001)

    talk(server, conversation)


def test_a_client_that_crashes_while_answers_wait_leaves_its_place(server):
    async def ask_on(ask):
        while True:
            await ask.socket.send_json({"do": "now", "id": "x" * 100_000})

    async def conversation(ask):
        asking = asyncio.create_task(ask_on(ask))
        while not (server._clients and server._clients[0].waiting.full()):
            await asyncio.sleep(0.01)
        await asyncio.sleep(0.3)  # until the next answer waits for a place
        asking.cancel()
        ask.socket._response.connection.transport.abort()
        for _ in range(1000):
            await asyncio.sleep(0.02 * bool(server._clients))
        assert not server._clients

    talk(server, conversation)


class Unknown(Metric):
    def result(self, w):
        return {"time": np.full(w.n_worlds, np.nan), "range": np.full(w.n_worlds, np.inf)}


def test_all_that_is_sent_is_json():
    def refuse(name):
        raise AssertionError(f"{name} is no JSON")

    async def conversation(ask):
        answers = []
        for text in ('{"do": "result"}', '{"do": "now", "id": NaN}', '{"do": "now", "id": [1e999]}'):
            await ask.socket.send_str(text)
            answers.append(json.loads((await ask.socket.receive()).data, parse_constant=refuse))
        return answers

    with Simulation(mission(metrics=[Unknown()])) as simulation, Server(simulation) as server:
        result, *now = talk(server, conversation)
    assert result["worlds"][0]["metrics"] == {"Unknown": {"time": None, "range": None}}
    assert [each["id"] for each in now] == [None, [None]]


@pytest.mark.filterwarnings("error")
def test_garbage_is_refused_in_silence(server, capfd):
    port = int(server.url.split(":")[2].split("/")[0])
    for garbage in (
        b"\x1b]0;x\x07\x1b[31mEVIL " + b"a" * 7000 + b"\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: x\r\n" + b"\x1b[31mX: " + b"a" * 99_999,
    ):
        # It may be closed before all is sent.
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)) as connection:
            connection.sendall(garbage)
            connection.shutdown(socket.SHUT_WR)
            while connection.recv(4096):
                pass
    assert capfd.readouterr() == ("", "")
    assert "blocks" in talk(server, lambda ask: ask("describe"))


def test_a_set_up_that_fails_is_raised(monkeypatch):
    async def fails(self):
        raise OSError("no more sockets")

    monkeypatch.setattr(aiohttp.web.SockSite, "start", fails)
    with Simulation(mission(), seeds=[1]) as simulation, pytest.raises(OSError, match="no more sockets"):
        Server(simulation)


def test_the_error_of_a_plugin_is_answered_and_the_server_goes_on():
    broken = mission(interactions=[SimpleCollision()])
    with Simulation(broken) as simulation, Server(simulation) as server:
        simulation.step = lambda *_: 1 / 0

        async def conversation(ask):
            return await ask("step"), await ask("now")

        failed, now = talk(server, conversation)
    assert (failed["error"], now["step"]) == ("ZeroDivisionError: division by zero", [0])


def test_nothing_is_left_behind():
    before = set(threading.enumerate())
    with Simulation(mission()) as simulation:
        for _ in range(3):
            server = Server(simulation)
            server.stop()
            server.stop()
    time.sleep(0.05)
    assert set(threading.enumerate()) <= before


def test_clients_in_python_and_c_plus_plus(tmp_path):
    with Simulation(read_mission("predator_prey").mission, 1) as simulation, Server(simulation) as server:
        done = subprocess.run(
            [sys.executable, CLIENTS / "client.py", server.url], capture_output=True, text=True, check=True
        )
        name, *lines = done.stdout.splitlines()
        assert name.startswith("Predators and prey")
        assert [line.split(":")[0] for line in lines] == ["10 s", "20 s", "30 s"]
        needs.require("g++")
        subprocess.run(
            ["g++", "-std=c++17", "-Wall", "-Werror", CLIENTS / "client.cpp", "-o", tmp_path / "client"],
            check=True,
        )
        port, token = server.url.rpartition(":")[2].split("/")
        done = subprocess.run([tmp_path / "client", port, token], capture_output=True, text=True, check=True)
        now, state = map(json.loads, done.stdout.splitlines())
        assert now["step"] == [400]
        assert state["hash"] == simulation.state_hash()
