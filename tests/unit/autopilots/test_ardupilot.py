"""ArduPilot's packets: closed forms, closed loops with peers in processes of their own, and peers that make no sense."""

from __future__ import annotations

import contextlib
import json
import math
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from autopilot_peers import LONG, JsonServant, Process, ScrimmageServant, free_ports

from tussle import Block, Mission, Simulation
from tussle.errors import ParameterError, PluginError
from tussle.mission import read_mission
from tussle.scene import Scene
from tussle.stock import ArduPilot, DirectController, FixedWing6DOFRascal, GroundCollision, Multirotor

MOTORS = " ".join(f"[ motor_{i} {i} 1000 2000 346.41 1200 1 ]" for i in range(4))
PLANE = Path(__file__).with_name("plane_peer.py")


def copter(port, count=1, end=10.0, motion=None, block=None, protocol="json", dt=0.01, **values):
    own = {"json_port": port} if protocol == "json" else {}
    autonomy = ArduPilot(
        protocol=protocol, servo_map=MOTORS, **{"timeout": LONG, "resend_period": LONG, **own, **values}
    )
    where = {"position": (3.0, -4.0, 10.0), "heading": "90 deg", **(block or {})}
    return Mission(
        blocks=[
            Block(name="copter", team=1, count=count, autonomy=autonomy, controller=DirectController(),
                  motion=motion or Multirotor(), **where)
        ],
        dt=dt, end=end,
    )  # fmt: skip


def servant_at(protocol, port):
    """A servant for the only vehicle of `copter` or of `by_scrimmage`."""
    return JsonServant(port) if protocol == "json" else ScrimmageServant((port + 1, port))


def by_scrimmage(port, **values):
    """A mission with the ports base and base + 1, for the id 1."""
    return copter(port, protocol="scrimmage", ardupilot_port_base=port, port_instance_multiplier=0, **values)


# -- closed loops -------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("protocol", ["json", "scrimmage"])
def test_a_multirotor_reaches_its_altitude_and_a_thousand_steps_give_the_same_bits_twice(protocol):
    hashes = []
    for _ in range(2):
        port = free_ports(2)
        ports, mission = (
            ((port,), copter(port)) if protocol == "json" else ((port + 1, port), by_scrimmage(port))
        )
        with (
            Process("ardupilot_peer.py", protocol, *ports, 30, "--patience", LONG),
            Simulation(mission) as sim,
        ):
            (result,) = sim.run()
            pos = sim.read("copter.pos")[0][0, 0]
            assert sim.steps.tolist() == [1000]
        assert result.end == "time"
        assert np.abs(pos - (3.0, -4.0, 40.0)).max() < 0.3
        hashes.append(result.state_hash)
    assert hashes[0] == hashes[1]


class StrictPilot:
    """Arms only where it has been at rest on the ground, level, for a second; climbs to 2 m, comes down, and disarms where it rests."""

    def __init__(self):
        self.phase, self.since, self.highest = "start", None, 0.0

    def __call__(self, port, data):
        state = json.loads(data)
        t, (down, fall) = state["timestamp"], (state["position"][2], state["velocity"][2])
        imu = state["imu"]
        is_at_rest = (
            max(map(abs, [*imu["gyro"], *state["velocity"]])) < 1e-3
            and max(abs(a - b) for a, b in zip(imu["accel_body"], (0.0, 0.0, -9.81), strict=True)) < 0.02
        )
        if self.phase in ("start", "descent"):
            self.since = (self.since if self.since is not None else t) if is_at_rest else None
            if self.since is not None and t - self.since > 1.0:
                self.phase = {"start": "climb", "descent": "disarmed"}[self.phase]
                self.since = None
        self.highest = max(self.highest, -down)
        if self.phase == "climb" and -down > 2.0:
            self.phase = "descent"
        rate = {"climb": 1.0, "descent": -0.5}.get(self.phase)
        # Armed motors idle at 1050; what is left of the climb to the wanted rate sets the thrust.
        pulse = 1000 if rate is None else 1557 + 300 * (rate + fall)
        return [round(min(2000, max(1050 if rate is not None else 1000, pulse)))] * 4 + [1000] * 12


@pytest.mark.parametrize(("dt", "roll"), [(0.0025, 0.0), (0.01, 0.0), (0.0025, 0.1)])
def test_it_arms_at_rest_takes_off_and_lands(dt, roll):
    port, pilot = free_ports(), StrictPilot()
    ground = GroundCollision(enable_startup_collisions=False, remove_on_collision=False)
    block = {"position": (3.0, -4.0, 0.0), "variance": (0, 0, 0), "roll": roll}
    lowest = at_rest = 0.0
    with (
        JsonServant(port, act=pilot),
        Simulation(copter(port, block=block, dt=dt, end=20.0).replace(interactions=[ground])) as sim,
    ):
        while not sim.is_over and at_rest < 1.0:
            sim.step()
            at_rest += dt * (pilot.phase == "disarmed")
            lowest = min(lowest, sim.read("copter.pos")[0][0, 0, 2])
    assert pilot.phase == "disarmed"
    assert pilot.highest > 2.0
    assert lowest > -1e-3


@pytest.mark.slow
def test_a_fixed_wing_climbs_and_holds_its_heading():
    port = free_ports(2)
    plane = Block(
        name="plane", team=1, position=(0.0, 0.0, 100.0), heading="30 deg", speed=20.0,
        autonomy=ArduPilot(to_ardupilot_port=port + 1, from_ardupilot_port=port, timeout=LONG, resend_period=LONG),
        controller=DirectController(), motion=FixedWing6DOFRascal(),
    )  # fmt: skip
    with Process(PLANE, port + 1, port, 120), Simulation(Mission(blocks=[plane], dt=0.01, end=40.0)) as sim:
        assert sim.run()[0].end == "time"
        east, north, up = sim.read("plane.pos")[0][0, 0]
        assert abs(sim.read("plane.vel")[0][0, 0, 2]) < 0.5
    assert abs(up - 120.0) < 3.0
    assert math.degrees(math.atan2(north, east)) == pytest.approx(30.0, abs=2.0)


def test_several_vehicles_and_worlds_have_an_autopilot_each_and_fly_as_alone():
    port = free_ports(6, 10)
    mission = copter(port, count=3, end=2.0, block={"variance": (400.0, 400.0, 0.0)}, world_step=30)
    with contextlib.ExitStack() as stack:
        for k in range(6):
            stack.enter_context(
                Process("ardupilot_peer.py", "json", port + 10 * k, 5 + k, "--patience", LONG)
            )
        with Simulation(mission, seeds=[1, 2]) as sim:
            sim.run()
            stacked = sim.read("copter.pos")[0]
    with contextlib.ExitStack() as stack:
        for k in range(3):
            stack.enter_context(
                Process("ardupilot_peer.py", "json", port + 10 * k, 8 + k, "--patience", LONG)
            )
        with Simulation(mission, seeds=[2]) as sim:
            sim.run()
            assert np.array_equal(sim.read("copter.pos")[0][0], stacked[1])
    assert len(np.unique(stacked[..., 2])) == 6


def test_lost_packets_are_sent_again_and_it_still_reaches_its_altitude():
    port = free_ports()
    mission = copter(port, end=8.0, resend_period=0.05)
    with (
        Relay(port) as relay,
        Process("ardupilot_peer.py", "json", relay.port, 10, "--patience", LONG),
        Simulation(mission) as sim,
    ):
        assert sim.run()[0].end == "time"
        assert abs(sim.read("copter.pos")[0][0, 0, 2] - 20.0) < 0.5
    assert relay.n_lost > 10


class Relay:
    """Passes packets on between an autopilot and a simulator, and loses each 40th from the simulator."""

    def __init__(self, port):
        self.sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2)]
        for each in self.sockets:
            each.bind(("127.0.0.1", 0))
            each.settimeout(0.02)
        self.port, self.to = self.sockets[0].getsockname()[1], port
        self.peer, self.n, self.n_lost = None, 0, 0
        self.is_over = threading.Event()
        self.threads = [threading.Thread(target=work, daemon=True) for work in (self.there, self.back)]

    def there(self):
        while not self.is_over.is_set():
            with contextlib.suppress(TimeoutError):
                data, self.peer = self.sockets[0].recvfrom(4096)
                self.sockets[1].sendto(data, ("127.0.0.1", self.to))

    def back(self):
        while not self.is_over.is_set():
            with contextlib.suppress(TimeoutError):
                data = self.sockets[1].recv(4096)
                self.n += 1
                if self.n % 40 == 0:
                    self.n_lost += 1
                else:
                    self.sockets[0].sendto(data, self.peer)

    def __enter__(self):
        for thread in self.threads:
            thread.start()
        return self

    def __exit__(self, *_):
        self.is_over.set()
        for thread, each in zip(self.threads, self.sockets, strict=True):
            thread.join()
            each.close()


def test_a_mission_in_the_style_of_scrimmage_takes_off(tmp_path):
    """The tags are those of arducopter.xml: it starts on the ground, which bears it, and ends after 1e10 steps."""
    port = free_ports(2)
    file = tmp_path / "arducopter.xml"
    file.write_text(
        f"""<runscript name="Straight flying"><run start="0.0" end="10000000" dt="0.001" time_warp="1" enable_gui="true"/>
        <stream_port>50051</stream_port> <end_condition>all_dead</end_condition> <metrics>SimpleCollisionMetrics</metrics>
        <latitude_origin>${{latitude_origin=32.42553}}</latitude_origin> <longitude_origin>-84.79109</longitude_origin>
        <altitude_origin>75</altitude_origin> <network>LocalNetwork</network> <network>GlobalNetwork</network>
        <entity_interaction>SimpleCollision</entity_interaction>
        <entity_interaction enable_startup_collisions="false" remove_on_collision="false">GroundCollision</entity_interaction>
        <entity> <team_id>1</team_id> <count>1</count> <radius>1</radius> <x>0</x> <y>0</y> <z>0</z> <heading>${{heading=0}}</heading>
          <sensor>RigidBody6DOFStateSensor</sensor>
          <autonomy servo_map = "{MOTORS}" to_ardupilot_port="${{to_ardupilot_port={port + 1}}}" asynchronous_mode="false"
            from_ardupilot_port="${{from_ardupilot_port={port}}}" to_ardupilot_ip="127.0.0.1">ArduPilot</autonomy>
          <motion_model>${{motion_model=Multirotor}}</motion_model> <controller>DirectController</controller>
        </entity></runscript>"""
    )
    loaded = read_mission(file, allow_large=True)
    assert all("kept for the viewer" in note or "asynchronous_mode" in note for note in loaded.notes)
    with (
        Process("ardupilot_peer.py", "scrimmage", port + 1, port, 10, "--patience", LONG),
        Simulation(loaded.mission) as sim,
    ):
        sim.step(2000)
        assert sim.read("team_1.pos")[0][0, 0, 2] == pytest.approx(4.5, abs=0.5)


def test_planes_of_a_mission_in_the_style_of_scrimmage_have_ports_by_their_ids(tmp_path):
    """As arduplane_multiple.xml, with ports that are counted from a base, and with the plane that ships."""
    first = free_ports(12)
    plane = f"""<entity> <team_id>1</team_id> <count>1</count> <radius>1</radius> <x>{{}}</x> <z>0</z> <pitch>-20</pitch>
        <sensor>RigidBody6DOFStateSensor</sensor>
        <autonomy ardupilot_port_base="{first - 10}" port_instance_multiplier="10">ArduPilot</autonomy>
        <controller>DirectController</controller> <motion_model>${{{{motion_model=FixedWing6DOF-Rascal}}}}</motion_model> </entity>"""
    file = tmp_path / "arduplane_multiple.xml"
    file.write_text(f'<runscript><run end="10" dt="0.001"/>{plane.format(0)}{plane.format(10)}</runscript>')
    pairs = [(first + 1, first), (first + 11, first + 10)]
    with ScrimmageServant(*pairs) as servant, Simulation(read_mission(file).mission) as sim:
        sim.step(5)
        for block in ("team_1", "team_1_2"):
            channels = [
                sim.read(f"{block}.ArduPilot.{name}_out")[0].item()
                for name in ("throttle", "elevator", "aileron", "rudder")
            ]
            assert channels == [0.5, 0.0, 0.0, 0.0]
    assert [len(states) for states in servant.states.values()] == [5, 5]


# -- packets ------------------------------------------------------------------------------------------------------------------------


def test_a_state_in_json_is_in_north_east_down_and_forward_right_down():
    port = free_ports()
    block = {"position": (100.0, 200.0, 50.0), "heading": "30 deg", "velocity": (3.0, 4.0, 5.0)}
    still = Multirotor(omega_min=0.0, c_D=0.0)  # it falls: no pulses
    with (
        JsonServant(port, act=lambda *_: [0] * 16) as servant,
        Simulation(copter(port, motion=still, block=block, dt=0.5)) as sim,
    ):
        sim.step(2)
    first, second = map(json.loads, servant.states[port])
    assert first["timestamp"] == 0.0
    assert second["timestamp"] == 0.5
    assert first["position"] == [200.0, 100.0, -50.0]
    assert first["velocity"] == [4.0, 3.0, -5.0]
    yaw = math.radians(90.0 - 30.0)
    assert first["quaternion"] == pytest.approx(
        [math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)], abs=1e-12
    )
    assert first["attitude"] == pytest.approx([0.0, 0.0, yaw])
    assert first["imu"] == {
        "gyro": pytest.approx([0.0] * 3),
        "accel_body": pytest.approx([0.0, 0.0, -9.80665]),
    }
    assert second["velocity"] == pytest.approx([4.0, 3.0, -5.0 + 9.81 * 0.5])
    assert second["imu"]["accel_body"] == pytest.approx([0.0, 0.0, 9.81 - 9.80665])
    assert second["position"] == pytest.approx(
        [200.0 + 4 * 0.5, 100.0 + 3 * 0.5, -50.0 - 5 * 0.5 + 0.5 * 9.81 * 0.25]
    )
    assert servant.states[port][0][:1] == servant.states[port][0][-1:] == b"\n"


def test_a_state_by_the_protocol_of_scrimmage_has_its_units_and_order():
    port = free_ports(2)
    block = {"position": (100.0, 200.0, 50.0), "heading": "30 deg", "velocity": (3.0, 4.0, 0.0)}
    mission = by_scrimmage(port, motion=Multirotor(omega_min=0.0, c_D=0.0), block=block, dt=0.5)
    mission = mission.replace(scene=Scene(origin=mission.scene.origin.from_degrees(-35.0, 149.0, 584.0)))
    nothing = struct.pack("<16H", *[0] * 16)
    with ScrimmageServant((port + 1, port), act=lambda *_: nothing) as servant, Simulation(mission) as sim:
        sim.step(2)
    first, second = (struct.unpack("<Q17d", data) for data in servant.states[port])
    assert [len(data) for data in servant.states[port]] == [144, 144]
    assert (first[0], second[0]) == (0, 500_000)
    # Radii of curvature of WGS84 at this latitude: 6356.9 km along the meridian, 6385.2 km along the parallel.
    assert first[1] == pytest.approx(-35.0 + math.degrees(200.0 / 6356.9e3), abs=1e-6)
    assert first[2] == pytest.approx(
        149.0 + math.degrees(100.0 / (6385.2e3 * math.cos(math.radians(35.0)))), abs=1e-6
    )
    assert first[3] == pytest.approx(634.0, abs=0.01)
    assert first[4] == pytest.approx(math.radians(60.0))
    assert first[5:8] == (4.0, 3.0, 0.0)
    assert second[8:11] == pytest.approx((0.0, 0.0, 9.81))  # without gravity: the rate of the velocity
    assert first[11:14] == pytest.approx((0.0, 0.0, 0.0))
    assert first[14:17] == pytest.approx((0.0, 0.0, math.radians(60.0)))
    assert first[17] == 5.0


@pytest.mark.parametrize("n", [16, 32])
def test_pulses_are_mapped_linearly_to_channels(n):
    port = free_ports()
    pulses = [1000 + 10 * k for k in range(n)]
    pulses[3] = 0
    servo_map = (
        f"[ motor_0 0 1000 2000 100 200 1 ] [ motor_1 5 1000 2000 0 1000 -2 ] [ motor_2 {n - 1} 1000 +2000 0 1 1 ]"
        "[ motor_3 3 1000 2000 0 500 1 ]"
    )
    autonomy = ArduPilot(
        protocol="json", servo_map=servo_map, json_port=port, timeout=LONG, resend_period=LONG
    )
    block = copter(port).blocks[0].replace(autonomy=[autonomy])
    with JsonServant(port, act=lambda *_: pulses), Simulation(Mission(blocks=[block], dt=0.01)) as sim:
        sim.step()
        got = [sim.read(f"copter.ArduPilot.motor_{k}_out")[0].item() for k in range(4)]
    assert got == [100.0, -100.0, pytest.approx((n - 1) / 100.0), 0.0]


def test_an_output_that_the_autopilot_does_not_have_is_without_pulses():
    port = free_ports()
    block = copter(port).blocks[0]
    map_ = MOTORS.replace("motor_3 3", "motor_3 20")
    autonomy = ArduPilot(protocol="json", servo_map=map_, json_port=port, timeout=LONG)
    with JsonServant(port), Simulation(Mission(blocks=[block.replace(autonomy=[autonomy])], dt=0.01)) as sim:
        sim.step()
        assert sim.read("copter.ArduPilot.motor_3_out")[0].item() == 0.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[ motor_9 0 1000 2000 0 1 1 ]", "there is no channel 'motor_9' (did you mean"),
        ("[ throttle 32 1000 2000 0 1 1 ]", "throttle has the number 32; it takes 0 to 31"),
        ("[ throttle 1.5 1000 2000 0 1 1 ]", "number = 1.5; it takes a whole number from 0 on"),
        ("[ throttle -1 1000 2000 0 1 1 ]", "number = -1; it takes a whole number from 0 on"),
        ("[ throttle 1 1000 1000 0 1 1 ]", "input_min and input_max are equal"),
        ("[ throttle 1 1000 2000 0 1 ]", "has 5 numbers; it takes 6 (number, input_min"),
        ("[ throttle 1 1000 2000 0 1 1 ] [ throttle 2 1000 2000 0 1 1 ]", "names no channel, or one twice"),
        ("", "names no channel, or one twice"),
    ],
)
def test_a_servo_map_that_makes_no_sense_is_refused(text, message):
    with pytest.raises(ParameterError, match=re.escape(message)):
        ArduPilot(servo_map=text)


# -- ports --------------------------------------------------------------------------------------------------------------------------


def error_of(mission, seeds=1):
    """The error that ends a mission."""
    with pytest.raises(PluginError) as raised, Simulation(mission, seeds=seeds) as sim:
        sim.run()
    return str(raised.value)


def test_two_vehicles_have_no_port_in_common():
    port = free_ports()
    mission = copter(port, count=2, block={"variance": (100.0, 100.0, 0.0)}, port_instance_multiplier=0)
    assert (
        f"port {port} is that of entity 1 of world 0; each vehicle has a port of its own: set port_instance_multiplier"
        in error_of(mission)
    )
    own = {"protocol": "scrimmage", "from_ardupilot_port": port, "to_ardupilot_port": port + 1}
    mission = copter(port, count=2, block={"variance": (100.0, 100.0, 0.0)}, **own)
    assert (
        f"port {port + 1} is that of entity 1 of world 0; each vehicle has ports of its own: set ardupilot_port_base"
        in error_of(mission)
    )
    assert "port 65537 is not from 1 to 65535" in error_of(
        copter(65527, count=2, block={"variance": (100.0, 100.0, 0.0)})
    )


def test_a_port_that_is_taken_and_a_host_that_is_none_are_named():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        assert f"json_port: 127.0.0.1:{port} cannot be opened: Address already in use" in error_of(
            copter(port)
        )
    text = error_of(by_scrimmage(free_ports(2), to_ardupilot_ip="255.255.255.255"))
    assert re.search(r"ArduPilot at 255\.255\.255\.255:\d+, .*: no way there: Permission denied", text)
    assert "listen_ip = 'no host' is no host" in error_of(copter(free_ports(), listen_ip="no host"))
    assert "to_ardupilot_ip = '1.2.3.4.5' is no host" in error_of(
        by_scrimmage(free_ports(2), to_ardupilot_ip="1.2.3.4.5")
    )


# -- peers that make no sense ---------------------------------------------------------------------------------------------------------


def test_an_autopilot_that_never_comes_is_missed():
    port = free_ports(2)
    text = error_of(copter(port, timeout=0.2))
    assert f"ArduPilot that sends to 127.0.0.1:{port}: no servo packet within 0.2 s" in text
    text = error_of(by_scrimmage(port, timeout=0.3))
    assert (
        f"ArduPilot at 127.0.0.1:{port + 1}, servo packets at port {port}: no servo packet at port {port} within 0.3 s"
        in text
    )


def test_a_state_that_nobody_heard_is_sent_again_as_soon_as_somebody_listens():
    port = free_ports(2)
    done = []

    def start():
        servant = ScrimmageServant((port + 1, port))
        done.append(servant.__enter__())

    timer = threading.Timer(0.5, start)
    timer.start()
    with Simulation(by_scrimmage(port)) as sim:  # whose states are sent again after 300 s, unless refused
        sim.step(3)
    done[0].__exit__()
    assert len(done[0].states[port]) == 3


def test_who_waits_for_an_autopilot_leaves_the_processor_to_others():
    port = free_ports(2)
    with Simulation(by_scrimmage(port, timeout=2.0)) as sim:
        with ScrimmageServant((port + 1, port)):
            sim.step()
        before = time.thread_time()
        with pytest.raises(PluginError, match="within 2 s"):
            sim.step()
        assert time.thread_time() - before < 0.5


@pytest.mark.parametrize("protocol", ["json", "scrimmage"])
def test_garbage_changes_nothing_and_is_told_when_nothing_else_comes(protocol):
    hashes = []
    for garbage in (False, True):
        port = free_ports(2)
        mission = copter(port, end=1.0) if protocol == "json" else by_scrimmage(port, end=1.0)
        servant = servant_at(protocol, port)
        with servant, Noise(port) if garbage else contextlib.nullcontext(), Simulation(mission) as sim:
            hashes.append(sim.run()[0].state_hash)
    assert hashes[0] == hashes[1]
    port = free_ports(2)
    mission = copter(port, timeout=0.5) if protocol == "json" else by_scrimmage(port, timeout=0.5)
    with Noise(port) as noise:
        text = error_of(mission)
    sizes = "18458 with 40 bytes or 29569 with 72 bytes" if protocol == "json" else "servo packets have 32"
    assert "within 0.5 s" in text
    assert sizes in text
    assert f"from 127.0.0.1:{noise.own}" in text


class Noise:
    """Sends packets of no sense to a port."""

    PACKETS = (
        b"",
        b"x",
        b"\x1a" * 33,
        struct.pack("<HHI16H", 18459, 1, 1, *range(16)),
        struct.pack("<H", 29569) + b"y" * 38,
    )

    def __init__(self, port, packets=PACKETS, pause=0.01):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.own = self.socket.getsockname()[1]
        self.to, self.packets, self.pause = ("127.0.0.1", port), packets, pause
        self.is_over = threading.Event()
        self.thread = threading.Thread(target=self.run, daemon=True)

    def run(self):
        while not self.is_over.is_set():
            for packet in self.packets:
                self.socket.sendto(packet, self.to)
            if self.pause:
                time.sleep(self.pause)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.is_over.set()
        self.thread.join()
        self.socket.close()


@pytest.mark.parametrize("protocol", ["json", "scrimmage"])
def test_a_flood_ends_the_world_of_its_vehicle_and_no_other(protocol, monkeypatch):
    monkeypatch.setattr("tussle.plugins.stock.autonomy.ardupilot.links.MAX_PACKETS", 50)
    first = free_ports(4)
    if protocol == "json":
        mission, servant = copter(first, world_step=1, end=1.0), JsonServant(first + 1)
    else:
        mission, servant = (
            by_scrimmage(first, world_step=2, end=1.0),
            ScrimmageServant((first + 3, first + 2)),
        )
    with servant, Noise(first, pause=0.0) as noise, Simulation(mission, seeds=[1, 2]) as sim:
        flooded, other = sim.run()
    assert "more than 50 packets in one step, the last from 127.0.0.1:" in str(flooded.error)
    assert str(noise.own) in str(flooded.error)
    assert other.end == "time"


@pytest.mark.parametrize("lockstep", [True, False])
def test_an_autopilot_that_is_missed_ends_its_world_and_no_other(lockstep):
    port = free_ports(2)
    mission = copter(port, world_step=1, timeout=2.0, lockstep=lockstep, time_warp=10.0, end=1.0)
    with JsonServant(port + 1), Simulation(mission, seeds=[1, 2]) as sim:
        missed, other = sim.run()
    assert f"ArduPilot that sends to 127.0.0.1:{port}: no servo packet within 2 s" in str(missed.error)
    assert other.end == "time"


def test_an_autopilot_that_dies_on_the_way_is_missed():
    port = free_ports()
    with (
        Process("ardupilot_peer.py", "json", port, 10, "--patience", LONG) as peer,
        Simulation(copter(port)) as sim,
    ):
        sim.step(100)
        peer.process.kill()
        peer.process.wait()
        link = sim.state.population.groups[0].autonomies[0].plugin.link[0]
        link.timeout = 1.0  # not before: a process may need longer to start
        with pytest.raises(
            PluginError, match=rf"ArduPilot that sends to 127\.0\.0\.1:{port}: no servo packet within 1 s"
        ) as raised:
            sim.run()
    assert raised.value.step == 100


def test_frames_that_count_from_one_again_are_told():
    port, done = free_ports(), []

    def act(_, data):
        done.append(data)
        return None if len(done) == 5 else [1500] * 16

    servant = JsonServant(port, act=act, first=500)
    with servant, Simulation(copter(port)) as sim:
        sim.step(4)

        def restart():
            while len(done) < 5:
                time.sleep(0.01)
            servant.frames[port] = servant.frame(1, [1000] * 16)

        threading.Thread(target=restart, daemon=True).start()
        with pytest.raises(PluginError, match="it has started anew: its frame 1 came after 504"):
            sim.step()


def test_an_autopilot_that_is_started_again_finds_its_vehicle_where_it_began():
    """A process is killed on the way, and another one at another port of its own flies the vehicle of two from the start on."""
    port = free_ports(2, step=10)
    block = {"variance": (100.0, 100.0, 0.0), "velocity": (0.0, 0.0, 1.0)}
    mission = copter(port, count=2, block=block, on_restart="reset", end=LONG)
    again = ("ardupilot_peer.py", "json", port, 20, "--patience", LONG)
    with JsonServant(port + 10), Simulation(mission) as sim:
        start = sim.read("copter.pos")[0]
        with Process(*again):
            sim.step(300)
        assert sim.read("copter.pos")[0][0, 0, 2] > start[0, 0, 2] + 1.0
        with Process(*again):
            while not sim.read("copter.ArduPilot.restarts")[0].any():
                sim.step()
            assert sim.read("copter.ArduPilot.restarts")[0].tolist() == [[1, 0]]
            moved = sim.read("copter.pos")[0][0, 0] - start[0, 0]
            assert np.abs(moved).max() < 0.05  # it has moved for one step
            sim.step(1000)
            climb = sim.read("copter.pos")[0][0, 0, 2] - start[0, 0, 2]
            assert climb == pytest.approx(20.0, abs=1.0)
            assert sim.read("copter.ArduPilot.restarts")[0].tolist() == [[1, 0]]


def test_two_autopilots_at_a_port_are_told_also_where_one_may_start_again():
    port = free_ports()
    with JsonServant(port, first=500), Simulation(copter(port, on_restart="reset")) as sim:
        sim.step(5)
        with (
            Noise(port, packets=(JsonServant.frame(7, [1100] * 16),)),
            pytest.raises(PluginError, match="a second autopilot, at"),
        ):
            sim.run()


def test_by_the_protocol_of_scrimmage_a_restart_is_a_packet_from_another_port():
    port = free_ports(2)
    mission = by_scrimmage(port, on_restart="reset", timeout=20.0, resend_period=0.1, end=LONG)
    with Simulation(mission) as sim:
        start = sim.read("copter.pos")[0][0, 0]
        with servant_at("scrimmage", port):
            sim.step(50)
        assert abs(sim.read("copter.pos")[0][0, 0, 2] - start[2]) > 0.1
        packet = struct.pack("<16H", *[1500] * 16)
        with Noise(port, packets=(packet,)):
            while not sim.read("copter.ArduPilot.restarts")[0].any():
                sim.step()
            assert np.abs(sim.read("copter.pos")[0][0, 0] - start).max() < 0.05
            sim.step(20)
        assert sim.read("copter.ArduPilot.restarts")[0].tolist() == [[1]]


@pytest.mark.parametrize("protocol", ["json", "scrimmage"])
def test_a_second_autopilot_at_the_port_of_the_first_is_told(protocol):
    port = free_ports(2)
    mission = copter(port) if protocol == "json" else by_scrimmage(port)
    servant = servant_at(protocol, port)
    packet = JsonServant.frame(7, [1100] * 16) if protocol == "json" else struct.pack("<16H", *[1100] * 16)
    with servant, Simulation(mission) as sim:
        sim.step(5)
        with Noise(port, packets=(packet,)) as noise, pytest.raises(PluginError) as raised:
            sim.run()
    assert f"a second autopilot, at 127.0.0.1:{noise.own}, sends to the port of the one at 127.0.0.1:" in str(
        raised.value
    )


def test_a_stranger_is_refused_where_the_place_of_the_autopilot_is_known():
    port = free_ports(2)
    with Noise(port, packets=(struct.pack("<16H", *[1100] * 16),)):
        text = error_of(by_scrimmage(port, to_ardupilot_ip="127.0.0.2", timeout=0.5))
    assert "ArduPilot at 127.0.0.2" in text
    assert "(a packet from 127.0.0.1:" in text


# -- without lockstep -----------------------------------------------------------------------------------------------------------------


def test_without_lockstep_it_runs_at_the_pace_of_the_clock_and_takes_the_newest_pulses():
    port = free_ports()
    mission = copter(port, lockstep=False, time_warp=4.0, end=4.0)
    with JsonServant(port) as servant, Simulation(mission) as sim:
        begun = time.monotonic()
        assert sim.run()[0].end == "time"
        assert time.monotonic() - begun >= (4.0 - 0.1) / 4.0 - 0.2  # the lag that is caught up with
        assert sim.read("copter.ArduPilot.motor_0_out")[0].item() == pytest.approx((346.41 + 1200.0) / 2.0)
    assert len(servant.states[port]) > 10  # a servant that has no processor may lose some


@pytest.mark.parametrize("protocol", ["json", "scrimmage"])
def test_without_lockstep_an_autopilot_that_falls_silent_is_missed(protocol):
    port = free_ports(2)
    own = {"lockstep": False, "timeout": 1.0, "end": LONG}
    mission = copter(port, **own) if protocol == "json" else by_scrimmage(port, **own)
    with servant_at(protocol, port) as servant, Simulation(mission) as sim:
        sim.step(20)
        servant.is_quiet = True
        with pytest.raises(PluginError, match="silent for 1 s"):
            sim.run()


# -- whole commands -------------------------------------------------------------------------------------------------------------------


def test_ctrl_c_ends_the_wait_for_an_autopilot(tmp_path):
    port = free_ports()
    file = tmp_path / "copter.xml"
    file.write_text(
        f"""<runscript><run end="10" dt="0.01"/><entity><z>10</z>
        <autonomy protocol="json" json_port="{port}" timeout="{LONG}" servo_map="{MOTORS}">ArduPilot</autonomy>
        <controller>DirectController</controller><motion_model>Multirotor</motion_model></entity></runscript>"""
    )
    call = [sys.executable, "-m", "tussle.cli", "run", str(file), "--out", str(tmp_path / "run")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    with subprocess.Popen(
        call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    ) as process:
        while process.poll() is None and not is_taken(port):
            time.sleep(0.05)
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        printed, errors = process.communicate()
    assert process.returncode == 130, printed + errors


def is_taken(port):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asks:
        try:
            asks.bind(("127.0.0.1", port))
        except OSError:
            return True
    return False
