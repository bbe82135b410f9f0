"""PX4's simulator interface: measurements, lockstep, a closed loop with a peer in a process of its own, and peers of no sense."""

from __future__ import annotations

import contextlib
import itertools
import math
import re
import select
import socket
import struct
import sys
import threading
import time

import numpy as np
import pytest
from autopilot_peers import LONG, Process, Thread, example, free_ports

from tussle import Block, Mission, Simulation
from tussle.errors import MissingExtraError, ParameterError, PluginError
from tussle.plugins.stock.autonomy.px4.link import Px4Link
from tussle.scene import Scene
from tussle.stock import PX4, DirectController, Multirotor

pytest.importorskip("pymavlink")
PEER_OF_EXAMPLES = example("px4_peer")
CONTROLS, GPS, SENSOR = PEER_OF_EXAMPLES.CONTROLS, PEER_OF_EXAMPLES.GPS, PEER_OF_EXAMPLES.SENSOR
HIL_CONTROLS, HIL_GPS, HIL_SENSOR, HIL_STATE = (
    getattr(PEER_OF_EXAMPLES, f"HIL_{name}") for name in ("CONTROLS", "GPS", "SENSOR", "STATE")
)
packet, take_messages = PEER_OF_EXAMPLES.packet, PEER_OF_EXAMPLES.take_messages
STATE = struct.Struct("<Q4f3f3i3h2H3h")
QUIET = (0.0, 0.0, 0.0, 0.0)


def tcp_port(n=1):
    return free_ports(n, 1, socket.SOCK_STREAM)


def copter(port, count=1, end=10.0, motion=None, block=None, dt=0.004, **values):
    autonomy = PX4(**{"port": port, "timeout": LONG, "freewheel_period": LONG, **values})
    where = {"position": (3.0, -4.0, 10.0), "heading": "90 deg", **(block or {})}
    scene = Scene(origin=Scene().origin.from_degrees(47.397742, 8.545594, 488.0))
    return Mission(
        blocks=[
            Block(name="copter", team=1, count=count, autonomy=autonomy, controller=DirectController(),
                  motion=motion or Multirotor(), **where)
        ],
        dt=dt, end=end, scene=scene,
    )  # fmt: skip


def controls(time_us, values=(0.5,) * 16, flags=1):
    """HIL_ACTUATOR_CONTROLS."""
    return packet(HIL_CONTROLS, 0, CONTROLS.pack(time_us, flags, *values, 129))


def senders(received):
    """System and component of each complete message of MAVLink 2 in some bytes."""
    found, begin = set(), 0
    while len(received) >= begin + 12 and len(received) >= begin + 12 + received[begin + 1]:
        found.add((received[begin + 5], received[begin + 6]))
        begin += 12 + received[begin + 1]
    return found


class Px4Servant(Thread):
    """Answers each HIL_SENSOR.

    Args:
        port: Port of the simulator.
        act: Returns the bytes to send for the number of a HIL_SENSOR, from 0 on, and its time, or none.
        hello: Bytes to send first.
    """

    def __init__(self, port, act=lambda n, time_us: controls(time_us), hello=b""):
        self.port, self.act, self.hello = port, act, hello
        self.messages, self.n, self.systems = [], 0, set()
        self.socket = None

    def run(self):
        while not self.is_over.is_set() and self.socket is None:
            with contextlib.suppress(ConnectionRefusedError):
                self.socket = socket.create_connection(("127.0.0.1", self.port))
            time.sleep(0.005)
        received = bytearray()
        with contextlib.suppress(OSError):
            self.socket.sendall(self.hello)
            while not self.is_over.is_set():
                if select.select([self.socket], [], [], 0.02)[0]:
                    data = self.socket.recv(65536)
                    if not data:
                        break
                    received += data
                    self.systems |= senders(received)
                    for message in take_messages(received):
                        self.take(*message)

    def take(self, number, payload):
        self.messages.append((number, payload))
        if number == HIL_SENSOR:
            answer = self.act and self.act(self.n, SENSOR.unpack(payload.ljust(SENSOR.size, b"\0"))[0])
            self.n += 1
            if answer is not None and not self.is_quiet:
                self.socket.sendall(answer)

    def read(self, number, layout):
        """The messages with a number, unpacked."""
        return [
            layout.unpack(payload.ljust(layout.size, b"\0")) for n, payload in self.messages if n == number
        ]

    def __exit__(self, *_):
        if self.socket:  # the simulation is closed: all that it has sent is read
            self.thread.join(LONG)
        super().__exit__()

    def close(self):
        if self.socket:
            self.socket.close()


# -- a closed loop --------------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_multirotors_reach_their_altitudes_by_their_sensors_and_give_the_same_bits_twice():
    hashes = []
    for _ in range(2):
        port = tcp_port(2)
        mission = copter(port, count=2, block={"variance": (100.0, 100.0, 0.0)}, end=8.0)
        peers = [
            Process("px4_peer.py", port + k, climb, "--patience", LONG) for k, climb in enumerate((20, 10))
        ]
        with peers[0], peers[1], Simulation(mission) as sim:
            before = sim.read("copter.pos")[0][0]
            (result,) = sim.run()
            pos = sim.read("copter.pos")[0][0]
            assert sim.steps.tolist() == [2000]
        assert result.end == "time"
        assert np.abs(pos - before - [(0.0, 0.0, 20.0), (0.0, 0.0, 10.0)]).max() < 0.5
        hashes.append(result.state_hash)
    assert hashes[0] == hashes[1]


# -- messages -------------------------------------------------------------------------------------------------------------------------


def test_pymavlink_and_the_peers_of_the_tests_agree_on_the_messages():
    from pymavlink.dialects.v20 import common

    for number, extra in PEER_OF_EXAMPLES.CRC_EXTRA.items():
        assert common.mavlink_map[number].crc_extra == extra
    layouts = {HIL_SENSOR: SENSOR, HIL_GPS: GPS, HIL_STATE: STATE, HIL_CONTROLS: CONTROLS}
    for number, layout in layouts.items():
        assert common.mavlink_map[number].unpacker.size == layout.size


def test_measurements_have_their_units_frames_and_rates():
    port = tcp_port()
    block = {"heading": "30 deg", "velocity": (3.0, 4.0, 5.0)}
    falls = Multirotor(omega_min=0.0, c_D=0.0)
    field = (0.2, 0.05, 0.4)
    mission = copter(
        port, motion=falls, block=block, noise=QUIET, magnetic_field=field, gps_rate=10.0, slow_rate=50.0
    )
    with Px4Servant(port, act=lambda n, t: controls(t, (0.0,) * 16)) as px4, Simulation(mission) as sim:
        sim.step(100)
    start, first, *more = px4.read(HIL_SENSOR, SENSOR)
    last = more[-1]
    assert [m[0] for m in (start, first, *more)] == list(range(4000, 4000 * 102, 4000))
    yaw = math.radians(60.0)
    north, east, down = field
    body_field = (
        math.cos(yaw) * north + math.sin(yaw) * east,
        math.cos(yaw) * east - math.sin(yaw) * north,
        down,
    )
    assert start[1:] == first[1:14] + start[14:]  # the vehicle stands still while PX4 starts
    assert first[1:7] == pytest.approx((0.0, 0.0, -9.80665, 0.0, 0.0, 0.0), abs=1e-6)
    assert first[7:10] == pytest.approx(body_field, abs=1e-6)
    assert first[10] == pytest.approx(1013.25 * (1.0 - 0.0065 * 498.0 / 288.15) ** 5.25588, rel=1e-5)
    forward = math.cos(yaw) * 4.0 + math.sin(yaw) * 3.0
    density = 1.225 * (1.0 - 0.0065 * 498.0 / 288.15) ** 4.25588
    assert first[11] == pytest.approx(0.5 * density * forward**2 / 100.0, rel=1e-4)
    assert first[12:14] == pytest.approx((498.0, 15.0 - 0.0065 * 498.0), rel=1e-5)
    assert start[14] == 0x1FFF
    assert [m[14] for m in (first, *more[:5])] == [0x3F, 0x3F, 0x3F, 0x3F, 0x1FFF, 0x3F]
    assert last[1:4] == pytest.approx((0.0, 0.0, 9.81 - 9.80665), abs=1e-5)

    fixes = px4.read(HIL_GPS, GPS)
    assert [fix[0] for fix in fixes] == [4000 + 100_000 * k for k in range(5)][: len(fixes)]
    assert len(fixes) == 5 - (fixes[-1][0] < 404_000)
    _, lat, lon, alt, eph, epv, speed, vn, ve, vd, course, fix, satellites, id_, _ = fixes[0]
    assert (alt, speed, vn, ve, vd, fix, id_) == (498_000, 500, 400, 300, -500, 3, 0)
    assert course == round(100.0 * math.degrees(math.atan2(3.0, 4.0)))
    # Radii of curvature of WGS84 at this latitude: 6370.1 km along the meridian, 6389.7 km along the parallel.
    assert lat == pytest.approx(473977420 + 1e7 * math.degrees(-4.0 / 6370.1e3), abs=2)
    assert lon == pytest.approx(
        85455940 + 1e7 * math.degrees(3.0 / (6389.7e3 * math.cos(math.radians(47.3977)))), abs=2
    )
    assert (eph, epv, satellites) == (100, 100, 10)
    assert fixes[-1][9] > 100 * (9.81 * 0.35 - 5.0) - 3

    truth = px4.read(HIL_STATE, STATE)
    assert len(truth) == 101
    assert truth[1][1:5] == pytest.approx((math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)), abs=1e-6)
    assert truth[1][8:16] == (lat, lon, alt, 400, 300, -500, 707, 707)
    assert truth[1][16:] == (0, 0, -1000)


def test_noise_is_drawn_by_the_seed_and_no_value_comes_twice_while_px4_starts():
    spreads = []
    for seed in (1, 1, 2):
        port = tcp_port()
        deviations = (0.5, 0.1, 0.01, 50.0)
        mission = copter(port, noise=deviations, freewheel_period=0.001)
        with (
            Px4Servant(port, act=lambda n, t: controls(t) if n >= 3 else None) as px4,
            Simulation(mission, seeds=seed) as sim,
        ):
            sim.step(300)
        messages = px4.read(HIL_SENSOR, SENSOR)
        assert all(a[1:10] != b[1:10] for a, b in itertools.pairwise(messages))
        flown = np.array(messages[-300:])
        spreads.append(flown[:, 4:7])
        assert np.std(flown[:, 4:7]) == pytest.approx(0.1, rel=0.15)
        assert np.std(np.diff(flown[:, 1])) == pytest.approx(0.5 * math.sqrt(2.0), rel=0.2)
    assert np.array_equal(spreads[0], spreads[1])
    assert not np.array_equal(spreads[0], spreads[2])


def test_controls_are_mapped_linearly_to_channels():
    port = tcp_port()
    values = [k / 16.0 for k in range(16)]
    values[1] = math.nan
    control_map = "[ motor_0 4 0 1 100 300 1 ] [ motor_1 15 -1 1 -0.5 0.5 -1 ] [ motor_2 0 0 1 0 1 1 ] [ motor_3 1 0 1 5 1 1 ]"
    with (
        Px4Servant(port, act=lambda n, t: controls(t, values)),
        Simulation(copter(port, control_map=control_map)) as sim,
    ):
        sim.step()
        got = [sim.read(f"copter.PX4.motor_{k}_out")[0].item() for k in range(4)]
    assert got == [150.0, -0.5 * (15.0 / 16.0), 0.0, 0.0]
    with pytest.raises(ParameterError, match="motor_0 has the number 16; it takes 0 to 15"):
        PX4(control_map="[ motor_0 16 0 1 0 1 1 ]")


# -- lockstep -------------------------------------------------------------------------------------------------------------------------


def test_an_answer_to_older_measurements_is_none():
    """PX4 stamps its answer with the time of the measurements; each is preceded here by a stale one."""
    port = tcp_port()
    stale = controls(1, (0.9,) * 16)
    with (
        Px4Servant(port, act=lambda n, t: stale + controls(t, (0.25,) * 16)) as px4,
        Simulation(copter(port)) as sim,
    ):
        for k in range(5):
            sim.step()
            assert px4.n == k + 2
            assert sim.read("copter.PX4.motor_0_out")[0].item() == 300.0


@pytest.mark.parametrize("phase", [0, 1, 2])
def test_a_px4_that_answers_each_third_message_flies_and_the_steps_without_an_answer_are_counted(
    phase, monkeypatch
):
    """As one whose controllers are slower than the measurements come: at first the steps wait, then only each third one."""
    port = tcp_port()

    def act(n, time_us):
        return controls(time_us, ((n % 50) / 100.0,) * 16) if n == 0 or n % 3 == phase else None

    mission = copter(port, dt=0.002, end=LONG, patience=0.2)
    with Px4Servant(port, act=act), Simulation(mission) as sim:
        with pytest.warns(
            RuntimeWarning, match=r"no HIL_ACTUATOR_CONTROLS within 0\.2 s for the measurements of t = "
        ):
            sim.step(9)
        got = []
        # It does not wait any more for what does not come.
        monkeypatch.setattr(Px4Link, "_go_on", lambda self: self.fail("a step has waited"))
        for _ in range(300):
            sim.step()
            got.append(sim.read("copter.PX4.motor_0_out")[0].item())
        assert sim.read("copter.PX4.unanswered")[0].item() == pytest.approx(309 * 2 / 3, abs=3)
        # In each step the newest controls hold: those for one of the last three measurements.
        assert len(set(got)) > 10
        assert max(abs(a - b) for a, b in itertools.pairwise(got) if a < b) == pytest.approx(12.0 * 3)


def test_controls_of_a_px4_that_is_late_are_not_lost():
    """Its first answers come when the next measurements have been sent."""
    port = tcp_port()

    def act(n, time_us):
        time.sleep(0.3 if n == 3 else 0.0)
        return controls(time_us, ((n + 1) / 100.0,) * 16)

    with Px4Servant(port, act=act) as px4, Simulation(copter(port, patience=0.1)) as sim:
        with pytest.warns(RuntimeWarning, match="`unanswered` counts them"):
            sim.step(10)
        assert 1 <= sim.read("copter.PX4.unanswered")[0].item() <= 4
        sim.step(5)
        assert sim.read("copter.PX4.motor_0_out")[0].item() == pytest.approx(12.0 * px4.n)


@pytest.mark.parametrize(("given", "system"), [({}, 1), ({"system_id": 7}, 7)])
def test_messages_are_of_a_system_and_the_sensors_come_first_in_a_step(given, system):
    port = tcp_port()
    with Px4Servant(port) as px4, Simulation(copter(port, gps_rate=250.0, **given)) as sim:
        sim.step(3)
    steps = [number for number, _ in px4.messages]
    assert steps == [HIL_SENSOR, HIL_STATE, HIL_GPS] * 4
    assert px4.systems == {(system, 1)}


def test_a_px4_that_is_slower_than_its_measurements_come_starts():
    """It answers each after 50 ms, while a new one comes every 10 ms: its first answer is to an old one."""
    port = tcp_port()

    def act(n, time_us):
        time.sleep(0.05)
        return controls(time_us, ((n + 1) / 100.0,) * 16)

    with (
        Px4Servant(port, act=act) as px4,
        Simulation(copter(port, freewheel_period=0.01, timeout=20.0)) as sim,
    ):
        sim.step(3)
        assert sim.read("copter.PX4.motor_0_out")[0].item() == pytest.approx(12.0 * px4.n)
    assert px4.n > 4


def test_messages_that_pymavlink_does_not_know_are_ignored():
    port = tcp_port()
    unknown = bytearray(packet(HIL_CONTROLS, 0, b"\1\2\3"))
    unknown[7:10] = (60_000).to_bytes(3, "little")
    with Px4Servant(port, act=lambda n, t: bytes(unknown) + controls(t)), Simulation(copter(port)) as sim:
        sim.step(3)
        assert sim.read("copter.PX4.motor_0_out")[0].item() == 600.0


def test_without_px4s_lockstep_the_stamp_is_that_of_another_clock():
    port = tcp_port()
    with Px4Servant(port, act=lambda n, t: controls(0, flags=0)), Simulation(copter(port)) as sim:
        sim.step(5)
        assert sim.read("copter.PX4.motor_0_out")[0].item() == 600.0


def test_px4_gets_time_until_it_has_started():
    port = tcp_port()
    mission = copter(port, freewheel_period=0.001)
    with (
        Px4Servant(port, act=lambda n, t: controls(t) if n >= 200 else None) as px4,
        Simulation(mission) as sim,
    ):
        sim.step()
        assert sim.read("copter.PX4.motor_0_out")[0].item() == 600.0
    stamps = [message[0] for message in px4.read(HIL_SENSOR, SENSOR)]
    assert stamps == list(range(4000, 4000 * (len(stamps) + 1), 4000))
    assert len(stamps) >= 202
    assert len(px4.read(HIL_GPS, GPS)) >= 8


def test_without_lockstep_it_runs_at_the_pace_of_the_clock():
    port = tcp_port()
    with Px4Servant(port) as px4, Simulation(copter(port, lockstep=False, time_warp=2.0, end=2.0)) as sim:
        begun = time.monotonic()
        assert sim.run()[0].end == "time"
        assert time.monotonic() - begun >= (2.0 - 0.1) / 2.0 - 0.2  # the lag that is caught up with
        assert sim.read("copter.PX4.motor_0_out")[0].item() == 600.0
    assert px4.n > 400


# -- ports, and peers that make no sense ------------------------------------------------------------------------------------------------


def error_of(mission):
    """The error that ends a mission."""
    with pytest.raises(PluginError) as raised, Simulation(mission) as sim:
        sim.run()
    return str(raised.value)


def test_ports_are_one_each():
    port = tcp_port()
    spread = {"variance": (100.0, 100.0, 0.0)}
    text = error_of(copter(port, count=2, block=spread, port_step=0))
    assert (
        f"port {port} is that of entity 1 of world 0; each vehicle has a port of its own: set port_step"
        in text
    )
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        assert f"port: 127.0.0.1:{port} cannot be opened: Address already in use" in error_of(copter(port))


def test_px4_that_never_comes_is_missed():
    port = tcp_port()
    assert f"PX4 at port {port}: no connection within 0.2 s" in error_of(copter(port, timeout=0.2))


PEER = r"PX4 at 127\.0\.0\.1:\d+, port \d+: "


@pytest.mark.parametrize(
    ("hello", "act", "message"),
    [
        (b"GET / HTTP/1.1\r\n\r\n", None, PEER + r"this is not MAVLink: 'GET / "),
        (b"\xfd" * 4000, None, PEER + r"this is not MAVLink: "),
        (b"", lambda n, t: None, PEER + r"no HIL_ACTUATOR_CONTROLS within 1 s"),
        (b"", lambda n, t: controls(t) if n < 5 else None, PEER + r"no HIL_ACTUATOR_CONTROLS within 1 s"),
        (b"", lambda n, t: controls(t, (math.inf,) * 16), PEER + r"HIL_ACTUATOR_CONTROLS has infinite numbers"),
        (b"", lambda n, t: controls(t)[:-1] + b"?" if n else controls(t), PEER + r"this is not MAVLink: "),
        (b"", lambda n, t: controls(1) * 16_000, PEER + r"more than 1048576 bytes in one step"),
    ],
)  # fmt: skip
def test_peers_of_no_sense(hello, act, message):
    port = tcp_port()
    with Px4Servant(port, act=act, hello=hello):
        assert re.search(message, error_of(copter(port, timeout=1.0)))


def test_px4_that_dies_on_the_way_is_told():
    port = tcp_port()
    with Process("px4_peer.py", port, 10) as peer, Simulation(copter(port)) as sim:
        sim.step(100)
        peer.process.kill()
        peer.process.wait()
        with pytest.raises(
            PluginError, match=PEER + r"(the connection was closed|Connection reset|nothing can be sent)"
        ) as raised:
            sim.run()
    assert raised.value.step == 100


def test_without_lockstep_px4_that_falls_silent_is_missed():
    port = tcp_port()
    with Px4Servant(port) as px4, Simulation(copter(port, lockstep=False, timeout=1.0, end=LONG)) as sim:
        sim.step(5)
        px4.is_quiet = True
        with pytest.raises(PluginError, match=PEER + "silent for 1 s"):
            sim.run()


def test_a_second_px4_finds_nobody_and_the_first_flies_on():
    port = tcp_port()
    with Px4Servant(port), Simulation(copter(port)) as sim:
        sim.step(5)
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.1", port))
        sim.step(5)


def test_a_px4_that_reads_nothing_is_told(monkeypatch):
    monkeypatch.setattr("tussle.plugins.stock.autonomy.px4.link.MAX_BYTES", 4096)
    port = tcp_port()
    mission = copter(port, lockstep=False, time_warp=1000.0, dt=0.01, end=1e6)
    stop = threading.Event()

    def flood():
        while not stop.is_set():
            connection = socket.socket()
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
            if not connection.connect_ex(("127.0.0.1", port)):
                break
            connection.close()
            time.sleep(0.01)
        with connection, contextlib.suppress(OSError):
            while not stop.is_set():
                connection.sendall(controls(0))
                time.sleep(0.05)

    thread = threading.Thread(target=flood, daemon=True)
    thread.start()
    try:
        assert re.search(PEER + "it does not read what is sent", error_of(mission))
    finally:
        stop.set()
        thread.join()


def test_a_missing_pymavlink_is_told(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymavlink.dialects.v20", None)
    with pytest.raises(
        (MissingExtraError, PluginError), match=r"PX4 needs pymavlink: pip install 'tussle\[autopilot\]'"
    ):
        Simulation(copter(tcp_port())).run()
