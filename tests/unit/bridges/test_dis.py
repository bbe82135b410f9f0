"""DIS: entities are shared with a simulator that uses the package opendis, and with garbage."""

from __future__ import annotations

import json
import math
import random
import socket
import subprocess
import sys
from pathlib import Path

import needs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tussle import Block, Mission, Simulation
from tussle.api import EasyAutonomy, Output, Param
from tussle.errors import MissionError, ParameterError, PluginError, PortError
from tussle.mission import read_mission
from tussle.numeric.quaternion import quat_normalize
from tussle.plugins import stock
from tussle.plugins.stock.interaction.dis import pdu
from tussle.scene import Origin, Scene
from tussle.stock import DIS, External, Unicycle

ORIGIN = Origin.from_degrees(35.721025, -120.767925, 100.0)
DEACTIVATED = 1 << 23


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


class Peer:
    """A process that speaks DIS by opendis."""

    def __init__(self):
        self.process = subprocess.Popen(
            [sys.executable, Path(__file__).with_name("dis_peer.py")], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            text=True,
        )  # fmt: skip
        self.port = json.loads(self.process.stdout.readline())

    def ask(self, **command):
        self.process.stdin.write(json.dumps(command) + "\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())


@pytest.fixture
def peer():
    needs.require("opendis")
    peer = Peer()
    yield peer
    peer.process.stdin.close()
    peer.process.wait()
    peer.process.stdout.close()


def mission(*blocks, end=100.0, **dis):
    blocks = blocks or (Block(name="scout", team=1, count=2, position=(0, 0, 50), motion=External()),)
    guest = Block(name="guest", team=2, count=0, motion=External())
    plugin = DIS(**{"time_warp": 0.0, "port": free_port(), **dis})
    return Mission(
        blocks=[*blocks, guest], dt=0.1, end=end, interactions=[plugin], scene=Scene(origin=ORIGIN), end_conditions=("time",)
    )  # fmt: skip


def listening(**dis):
    port = free_port()
    return port, mission(listen_port=port, remote="guest", **dis)


def guests(sim):
    pos, is_there = sim.read("guest.pos")
    return pos[0][is_there[0]]


def until(sim, condition, steps=2000):
    """Step until something is so; datagrams come when they come."""
    for _ in range(steps):
        sim.step()
        if condition():
            return
    raise AssertionError(f"it has not happened: {sim.result()}")


class Fly(EasyAutonomy):
    """Flies at 10 m/s, straight or in a circle."""

    rate_of_turn = Param(0.0, unit="rad/s")
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")

    def step_one(self, me):
        me.speed, me.turn_rate, me.pitch_rate = 10.0, me.rate_of_turn, 0.0


def flying(name, position=(0, 0, 50), count=1, **values):
    return Block(
        name=name, team=1, count=count, position=position, autonomy=Fly(**values), motion=Unicycle(vel_max=20, turn_rate_max=1),
        placement="uniform", half_width=(5, 5, 5),
    )  # fmt: skip


# -- what is sent -----------------------------------------------------------------------------------------------------------------


def test_opendis_reads_where_entities_are_and_how_they_move(peer):
    scene = mission(port=peer.port, types=((1, 1, 2, 225, 50, 3, 0, 7),), exercise=9, site=11, application=12)
    pos = np.array([[120.0, -340.0, 55.0], [5000.0, 2000.0, 900.0]])
    yaw, pitch, roll = np.array([0.4, -2.5]), np.array([0.3, -0.2]), np.array([0.7, -1.1])
    with Simulation(scene) as sim:
        body = pdu.quat_from_euler(roll, -pitch, yaw)
        for name, value in {"pos": pos, "vel": [[3, 4, 5], [-6, 0, 0]], "quat": body.T}.items():
            sim.write(f"scout.{name}", np.array([value], float))
        sim.write("scout.omega", np.array([[[0.0, 0.0, 0.3], [0.0, 0.0, 0.0]]]))
        sim.step()
        found = peer.ask(receive=2)
    where = ORIGIN.to_geodetic(pos.T)
    for k, got in enumerate(found):
        assert (got["bytes"], got["length"], got["version"], got["type"], got["family"]) == (
            144,
            144,
            7,
            1,
            1,
        )
        assert (got["exercise"], got["id"], got["force"]) == (9, [11, 12, k + 1], 1)
        assert (got["marking"], got["characters"], got["entity"]) == (
            f"scout {k + 1}",
            1,
            [1, 2, 225, 50, 3, 0, 7],
        )
        assert got["timestamp"] == int(0.1 / 3600 * 2**31) << 1
        assert got["algorithm"] == 3
        # Angles are sent as 32-bit numbers. At 5 km from the origin, up and north differ from those there by 1 mrad.
        np.testing.assert_allclose(got["llarpy"][:2], where[:2, k], atol=1e-10)
        assert got["llarpy"][2] == pytest.approx(where[2, k], abs=1e-4)
        heading = math.remainder(math.pi / 2 - yaw[k], 2 * math.pi)
        np.testing.assert_allclose(got["llarpy"][3:], [roll[k], pitch[k], heading], atol=2e-3 if k else 1e-4)
    speed = [np.linalg.norm(got["velocity"]) for got in found]
    np.testing.assert_allclose(speed, [math.sqrt(50.0), 6.0], rtol=1e-6)
    down = np.array(ORIGIN.earth_centred) / -np.linalg.norm(ORIGIN.earth_centred)
    # Geocentric and geodetic latitude differ by 0.2 degrees at most.
    assert np.dot(found[0]["velocity"], -down) == pytest.approx(5.0, abs=0.05)
    assert np.linalg.norm(found[0]["omega"]) == pytest.approx(0.3)
    assert found[0]["omega"][2] < 0  # to the left, about the axis down


def test_location_and_angles_are_those_of_the_worked_example_of_dsto():
    # D. Koks, Using Rotations to Build Aerospace Coordinate Systems, DSTO-TN-0640 (2008), section 4.3: at Adelaide, 34.9 S, 138.5 E,
    # 10 km high, heading south-east, pitch 20 degrees, right wing down by 30: psi = -123.0, theta = 47.8, phi = -29.7 degrees.
    origin = Origin.from_degrees(-34.9, 138.5, 10e3)
    quat = pdu.quat_from_euler(math.radians(30.0), math.radians(-20.0), math.radians(90.0 - 135.0))
    zero = np.zeros((3, 1))
    record = pdu.encode(origin, zero, zero, quat[:, None], zero)[0]
    np.testing.assert_allclose(np.degrees(record["orientation"]), [-123.0, 47.8, -29.7], atol=0.05)
    np.testing.assert_allclose(record["location"], [-3_928_261, 3_475_431, -3_634_495], atol=1.0)


def test_a_body_that_moves_as_reckoned_is_sent_by_heartbeat_only(peer):
    with Simulation(mission(flying("s"), port=peer.port, end=30.0)) as sim:
        (result,) = sim.run()
    # At 0.1 s and every 5 s, and none at the end of the mission, where the entity is still there.
    assert result.metrics["DIS"] == {"sent": 6, "received": 0, "refused": 0}
    got = peer.ask(receive=7)  # the last one is sent when the simulation is closed
    assert [each["timestamp"] for each in got[:6]] == [
        int((0.1 + 5 * k) / 3600 * 2**31) << 1 for k in range(6)
    ]
    assert [each["appearance"] for each in got] == [0] * 6 + [DEACTIVATED]


def test_a_body_that_turns_is_sent_as_often_as_the_thresholds_ask():
    circling = flying("c", rate_of_turn=0.5)
    counts = []
    for position, orientation in ((1.0, 0.05), (10.0, 0.05), (1e9, 0.05)):
        settings = {"position_threshold": position, "orientation_threshold": orientation}
        with Simulation(mission(circling, end=20.0, **settings)) as sim:
            counts.append(sim.run()[0].metrics["DIS"]["sent"])
    # A turn by 0.5 rad/s leaves the tangent by 2.5 m/s^2 t^2, and the mean velocity of a step, which Unicycle has, by 0.25 m/s t more:
    # by 1.05 m after 0.6 s, by 10.5 m after 2 s. The attitude turns as reckoned.
    assert counts == [34, 10, 4]


def test_a_body_that_is_turned_is_sent_when_it_leaves_the_threshold():
    with Simulation(mission()) as sim:
        for degrees, sent in ((0.0, 2), (2.9, 2), (3.1, 3), (0.2, 3), (0.0, 4)):
            turned = pdu.quat_from_euler(0.0, 0.0, math.radians(degrees))
            sim.write("scout.quat", np.array([[turned, [1.0, 0, 0, 0]]]))
            sim.step()
            assert sim.result()[0].metrics["DIS"]["sent"] == sent, degrees


def test_an_entity_that_is_gone_is_said_to_be(peer):
    with Simulation(mission(port=peer.port)) as sim:
        sim.step()
        sim.write("scout.health", np.array([[1.0, 0.0]]))
        sim.step(2)
        got = peer.ask(receive=3)
    assert [(each["id"][2], each["appearance"]) for each in got] == [(1, 0), (2, 0), (2, DEACTIVATED)]


@pytest.mark.parametrize("heading", [0.0, 2.0])
def test_a_removal_has_the_place_of_its_time(peer, heading):
    """An entity that flies a circle at constant speed, or straight on, and is not sent before the removal."""
    flyer = Block(
        name="scout", team=1, motion=External(), position=(0.0, 0.0, 90.0), heading=f"{heading} rad"
    )
    way = np.array([math.cos(heading), math.sin(heading), 0.0])
    with Simulation(mission(flyer, port=peer.port, heartbeat=60.0, position_threshold=1.0)) as sim:
        sim.write("scout.vel", (89.0 * way)[None, None])
        sim.step()
        dt = sim.mission.dt
        for k in range(1, 11):
            sim.write("scout.pos", (np.array([0.0, 0.0, 90.0]) + 89.0 * dt * k * way)[None, None])
            sim.write("scout.vel", (89.0 * way)[None, None])
            sim.step()
        last = sim.read("scout.pos")[0][0, 0]
        sim.write("scout.health", np.array([[0.0]]))
        sim.step(2)
        *_, gone = peer.ask(receive=sim.state.context.shared[DIS, "DIS"].n_sent)
    assert gone["appearance"] == DEACTIVATED
    latitude, longitude, altitude = gone["llarpy"][:3]
    there = ORIGIN.from_geodetic(np.array([latitude, longitude, altitude]))
    assert np.linalg.norm(there - (last + 2 * 89.0 * dt * way)) < 89.0 * dt + 1.0


def test_more_entities_than_dis_has_numbers_for_are_refused():
    many = Block(name="m", team=1, count=65534, motion=External())
    with (
        Simulation(mission(many)) as sim,
        pytest.raises(PluginError, match="DIS has no number for entity 65534; the largest is 65533"),
    ):
        sim.step()


# -- what comes -------------------------------------------------------------------------------------------------------------------


def place(east, north, up):
    return ORIGIN.to_geodetic(np.array([east, north, up], float)).tolist()


def test_an_entity_of_opendis_comes_moves_and_goes(peer):
    port, scene = listening()
    with Simulation(scene) as sim:
        heading = math.radians(30.0)
        north = pdu.quat_rotate(ORIGIN.quat, np.array([0.0, 9.0, 0.0])).tolist()
        guest = {"id": [7, 8, 900], "llarpy": [*place(300, 400, 60), 0.2, 0.1, heading], "velocity": north}
        peer.ask(port=port, send=[guest])
        until(sim, lambda: len(guests(sim)))
        t, first = sim.t[0], guests(sim)[0]
        quat, vel = sim.read("guest.quat")[0][0, -1], sim.read("guest.vel")[0][0, -1]
        np.testing.assert_allclose(first[[0, 2]], [300, 60], atol=1e-3)
        assert 400 < first[1] < 405
        np.testing.assert_allclose(vel, [0, 9, 0], atol=1e-5)
        angles = [float(f(quat)) for f in (pdu.quat_to_roll, pdu.quat_to_pitch, pdu.quat_to_yaw)]
        np.testing.assert_allclose(angles, [0.2, -0.1, math.pi / 2 - heading], atol=2e-4)
        sim.step(50)
        np.testing.assert_allclose(guests(sim)[0], first + np.array([0, 9 * (sim.t[0] - t), 0]), atol=1e-3)
        assert sim.result()[0].alive == {1: 2, 2: 1}
        peer.ask(port=port, send=[guest | {"appearance": DEACTIVATED}])
        until(sim, lambda: not len(guests(sim)))
        assert sim.result()[0].metrics["DIS"]["received"] == 2


def test_a_silent_entity_is_removed_after_twelve_seconds(peer):
    port, scene = listening()
    with Simulation(scene) as sim:
        peer.ask(
            port=port, send=[{"id": [7, 8, k], "llarpy": [*place(0, k, 60), 0, 0, 0]} for k in (1, 2, 3)]
        )
        until(sim, lambda: len(guests(sim)) == 3)
        born = sim.t[0]
        until(sim, lambda: not len(guests(sim)))
        assert 11.7 < sim.t[0] - born < 12.3


def test_forces_are_teams(peer):
    port, scene = listening()
    with Simulation(scene) as sim:
        forces = {1: 1, 2: 2, 3: 2}  # the mission has no team 3, so that of the block is taken
        sent = [{"id": [7, 8, k], "force": k, "llarpy": [*place(0, 9 * k, 60), 0, 0, 0]} for k in forces]
        peer.ask(port=port, send=sent)
        until(sim, lambda: len(guests(sim)) == 3)
        north = np.rint(guests(sim)[:, 1] / 9).astype(int)
        teams = sim.read("guest.team")[0][0][sim.read("guest.team")[1][0]]
        assert dict(zip(north.tolist(), teams.tolist(), strict=True)) == forces


def test_who_is_removed_here_stays_away(peer):
    port, scene = listening()
    with Simulation(scene) as sim:
        guest = {"id": [7, 8, 900], "llarpy": [*place(300, 400, 60), 0, 0, 0]}
        peer.ask(port=port, send=[guest])
        until(sim, lambda: len(guests(sim)))
        saved = sim.snapshot()
        sim.write("guest.health", np.zeros_like(sim.read("guest.health")[0]))
        sim.step(30)
        peer.ask(port=port, send=[guest])
        sim.step(30)
        assert not len(guests(sim))
        sim.restore(saved)
        sim.step(2)
        assert len(guests(sim)) == 1
        sim.reset([0])
        sim.step(3)
        assert len(guests(sim)) == 1  # of the last PDU
        sim.step(130)
        assert not len(guests(sim))


def test_a_snapshot_without_a_guest_gets_it_again(peer):
    port, scene = listening()
    with Simulation(scene) as sim:
        saved = sim.snapshot()
        peer.ask(port=port, send=[{"id": [7, 8, 9], "llarpy": [*place(300, 400, 60), 0, 0, 0]}])
        until(sim, lambda: len(guests(sim)))
        sim.restore(saved)
        assert not len(guests(sim))
        sim.step(3)
        np.testing.assert_allclose(guests(sim), [[300, 400, 60]], atol=1e-3)


@pytest.mark.parametrize("algorithm", range(11))
def test_dead_reckoning_is_the_integral_of_what_is_sent(algorithm):
    rng = np.random.default_rng(algorithm)
    pos, vel, acceleration, omega = rng.normal(size=(4, 3, 1)) * [[[9.0]], [[5.0]], [[0.7]], [[0.8]]]
    quat = pdu.quat_from_euler(*rng.uniform(-1, 1, (3, 1)))
    t = 4.0
    reached = pdu.extrapolate(np.array([algorithm]), pos, vel, acceleration, quat, omega, np.array([t]))
    moves, turns = 2 <= algorithm <= 9, algorithm in (3, 4, 7, 8)
    gains, is_body = algorithm in (4, 5, 8, 9), algorithm in (6, 7, 8, 9)

    def flown(n):
        """The motion as the standard defines it, by n steps of the middle."""
        x, q, h = pos.copy(), quat, t / n
        for k in range(n if moves else 0):
            v = vel + acceleration * (k + 0.5) * h * gains
            step = quat_normalize(np.concatenate([np.ones((1, 1)), omega * h / 4 * turns]))
            middle = pdu.quat_multiply(q, step)
            x = x + h * (pdu.quat_rotate(middle, v) if is_body else v)
            q = pdu.quat_multiply(middle, step)
        return np.concatenate([x, q])

    x, q = np.split(
        (4.0 * flown(800) - flown(400)) / 3.0, [3]
    )  # the error of the middle is one of second order
    np.testing.assert_allclose(reached[0], x, atol=1e-6)
    np.testing.assert_allclose(reached[2], q, atol=1e-6)
    v = (vel + acceleration * t * gains) * moves
    np.testing.assert_allclose(reached[1], pdu.quat_rotate(q, v) if is_body else v, atol=1e-5)


@pytest.mark.parametrize("x", [0.0299, 0.0301])
def test_slow_and_fast_turns_are_reckoned_alike(x):
    w, t = np.array([x / 3.0]), np.array([3.0])
    small = [1 / 2 - x**2 / 24, 1 / 6 - x**2 / 120, 1 / 3 - x**2 / 30, 1 / 8 - x**2 / 144]
    whole = np.array(small) * [t[0] ** 2, t[0] ** 3, t[0] ** 3, t[0] ** 4]
    np.testing.assert_allclose(np.ravel(pdu._integrals(w, t)[1:]), whole, rtol=1e-8)


# -- two simulations --------------------------------------------------------------------------------------------------------------


def test_two_simulations_see_each_other_and_not_themselves():
    ports = free_port(), free_port()
    sims = []
    for k in (0, 1):
        own = flying(f"own{k}", (100 * k, 0, 50), 3, rate_of_turn=0.1 * k)
        sims.append(
            Simulation(
                mission(
                    own, port=ports[1 - k], listen_port=ports[k], remote="guest", application=k + 1, heartbeat=1.0, timeout=3.0
                )
            )
        )  # fmt: skip
    with sims[0] as a, sims[1] as b:
        for _ in range(100):
            a.step()
            b.step()
        for sim, other, k in ((a, b, 1), (b, a, 0)):
            # The threshold, and 10 m/s for a step, which the first one is behind.
            theirs = other.read(f"own{k}.pos")[0][0]
            np.testing.assert_allclose(np.sort(guests(sim), axis=0), np.sort(theirs, axis=0), atol=2.2)
        b.close()
        until(a, lambda: not len(guests(a)), 20)


@pytest.mark.parametrize(
    ("address", "listen_address"), [("239.255.77.3", "127.0.0.1"), ("127.255.255.255", "127.255.255.255")]
)
def test_simulations_of_a_group_or_a_network_share_a_port(address, listen_address):
    port = free_port()
    common = {
        "address": address,
        "port": port,
        "listen_address": listen_address,
        "listen_port": port,
        "remote": "guest",
    }
    with (
        Simulation(mission(application=1, **common)) as a,
        Simulation(mission(application=2, **common)) as b,
    ):
        for _ in range(10):
            a.step()
            b.step()
        assert (len(guests(a)), len(guests(b))) == (2, 2)


# -- determinism ------------------------------------------------------------------------------------------------------------------


def test_without_others_the_game_is_that_without_dis():
    plane = flying("p", count=3, rate_of_turn=0.2)
    with Simulation(mission(plane, end=20.0)) as sim, Simulation(mission(plane, end=20.0)) as again:
        sim.run()
        again.run()
        assert sim.state_hash() == again.state_hash()
        with Simulation(mission(plane, end=20.0).replace(interactions=[])) as alone:
            alone.run()
            np.testing.assert_array_equal(sim.read("p.pos")[0], alone.read("p.pos")[0])


# -- hostile input ----------------------------------------------------------------------------------------------------------------


def good(**fields):
    record = pdu.encode(
        ORIGIN, np.zeros((3, 1)), np.zeros((3, 1)), np.array([[1.0], [0], [0], [0]]), np.zeros((3, 1))
    )
    record["version"], record["exercise"], record["site"], record["application"] = 7, 1, 7, 7
    for name, value in fields.items():
        record[name] = value
    return record[0].tobytes()


BAD = {
    "empty": b"", "one byte": b"\7", "header only": good()[:12], "cut": good()[:143], "text": b"hello " * 100,
    "length 0": good(length=0), "length beyond": good(length=65535), "shorter than itself": good(length=143),
    "articulation without": good(n_articulations=3), "version": good(version=4), "exercise": good(exercise=2),
    "location": good(location=math.nan), "infinite": good(location=math.inf), "huge": good(location=1e308),
    "centre": good(location=0.0), "far": good(location=np.array(ORIGIN.earth_centred) * 1.5),
    "velocity": good(velocity=math.nan), "speed": good(velocity=1e30), "orientation": good(orientation=math.nan),
    "turns": good(orientation=1e30), "rates": good(angular_velocity=-math.inf), "acceleration": good(acceleration=3e38),
    "bundle": good(location=math.nan) + b"\7\1", "zeros": bytes(144),
}  # fmt: skip


def throw(port, datagrams):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for data in datagrams:
            out.sendto(data, ("127.0.0.1", port))


@pytest.mark.parametrize("name", BAD)
def test_bad_datagrams_are_ignored_and_counted(name):
    port, scene = listening()
    with Simulation(scene) as sim:
        throw(port, [BAD[name], good(entity=5)])
        until(sim, lambda: len(guests(sim)) == 1)
        counts = sim.result()[0].metrics["DIS"]
    assert counts["received"] == 1
    assert counts["refused"] == (
        0 if name == "empty" else 2 if name in ("bundle", "shorter than itself") else 1
    )


@given(st.lists(st.binary(max_size=400), max_size=5), st.randoms())
def test_no_bytes_upset_the_reader(datagrams, rand):
    for data in datagrams:
        damaged = bytearray(good() + data)
        for _ in range(rand.randrange(6)):
            damaged[rand.randrange(len(damaged))] = rand.randrange(256)
        for each in (data, bytes(damaged)):
            pdus, n_refused = pdu.split(each, 1)
            assert all(len(found) == 144 for found in pdus)
            assert n_refused >= 0


def test_articulations_and_bundles_are_read():
    arm = good(n_articulations=2, length=176) + bytes(32)
    other = bytearray(good()[:12])
    other[2], other[8:10] = 2, (12).to_bytes(2, "big")  # a Fire PDU
    assert pdu.split(arm + bytes(other) + good(), 1) == ([arm[:144], good()], 0)


def test_a_flood_neither_stops_the_game_nor_fills_it():
    port, scene = listening(most_remote=20, end=1e6)
    code = "import random, socket, sys\nout = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)\nwhile True:\n"
    code += "    data = bytearray.fromhex(sys.argv[2])\n    data[16:18] = random.randbytes(2)\n"
    code += "    out.sendto(data, ('127.0.0.1', int(sys.argv[1])))\n    out.sendto(bytes(300), ('127.0.0.1', int(sys.argv[1])))\n"
    flood = subprocess.Popen([sys.executable, "-c", code, str(port), good().hex()])
    try:
        with Simulation(scene) as sim:
            until(
                sim,
                lambda: len(guests(sim)) == 20 and sim.result()[0].metrics["DIS"]["refused"] > 20_000,
                10**6,
            )
    finally:
        flood.kill()
        flood.wait()


def test_random_entities_come_and_go_without_a_fault():
    port, scene = listening(timeout=0.3)
    rand = random.Random(3)
    with Simulation(scene, on_error="raise") as sim:
        for _ in range(60):
            throw(
                port,
                [good(entity=rand.randrange(9), force=rand.randrange(4), appearance=rand.choice([0, 0, DEACTIVATED]))
                 for _ in range(rand.randrange(9))],
            )  # fmt: skip
            sim.step(rand.randrange(1, 5))
        sim.step(10)
        assert not len(guests(sim))


# -- errors, sockets --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("values", "error", "text"),
    [
        ({"address": "no.such.host.invalid"}, ParameterError, "address = 'no.such.host.invalid' is no known host"),
        ({"types": ((1, 1, 2, 225, 256, 0, 0, 0),)}, ParameterError, "category = 256 of team 1 is not allowed"),
        ({"types": ((1, 1.5, 2, 225, 0, 0, 0, 0),)}, ParameterError, "kind = 1.5 of team 1 is not allowed"),
        ({"listen_port": 4000}, ParameterError, "listen_port = 4000 needs remote"),
        ({"remote": "gest"}, MissionError, "DIS: there is no block 'gest' .did you mean 'guest'"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(values, error, text):
    with pytest.raises((error, PluginError), match=text):
        Simulation(mission(**values))


def test_a_port_that_is_taken_is_named_and_one_that_is_left_is_free():
    port, scene = listening()
    with Simulation(scene) as sim:
        sim.step()
        with pytest.raises(
            (PortError, PluginError),
            match=f"listen_port: 127.0.0.1:{port} cannot be opened: Address already in use",
        ):
            Simulation(scene)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as again:
        again.bind(("127.0.0.1", port))


def test_the_clock_is_waited_for(monkeypatch):
    waits = []
    monkeypatch.setattr("tussle.pacing.time.sleep", waits.append)
    with Simulation(mission(time_warp=1.0)) as sim:
        sim.step(5)
    assert waits


def test_the_example_is_played_from_its_file(tmp_path):
    text = (
        stock.examples()["DIS"]
        .read_text()
        .replace("3001", str(free_port()))
        .replace(">DIS", ' time_warp="0">DIS')
    )
    path = tmp_path / "mission.xml"
    path.write_text(text)
    loaded = read_mission(path)
    assert loaded.notes == ()
    with Simulation(loaded.mission) as sim:
        assert sim.run()[0].metrics["DIS"]["sent"] >= 26


def test_a_default_time_out_of_other_packages_does_not_hold_it():
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(0.01)
    try:
        _, made = listening()
        with Simulation(made) as sim:
            sim.step(3)
    finally:
        socket.setdefaulttimeout(before)
