"""MOOSAutonomy against a MOOSDB that accepts the wire format of MOOS only, and a helm that steers along waypoints."""

from __future__ import annotations

import contextlib
import math
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from moos_database import MoosDatabase, message, packet
from moos_helm import Link, MoosHelm

from tussle import Block, Mission, Simulation
from tussle.errors import ParameterError, PluginError, SnapshotError
from tussle.mission import read_mission
from tussle.plugins import stock
from tussle.stock import (
    MOOSAutonomy,
    SimpleAircraft,
    SimpleAircraftControllerPID,
    SimpleCar,
    SimpleCarControllerHeading,
    Still,
)

FAST = 1000.0
"""A time warp at which nobody waits for the clock."""
LONG = 300.0
"""A wait that ends with what is waited for."""


@pytest.fixture(autouse=True)
def nothing_is_left():
    """After each test no thread of a client runs, and no socket is open that was not before."""
    before = sockets()
    yield
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("MOOS ")]
    assert sockets() == before


def sockets():
    """Open sockets of this process."""
    folder, found = "/proc/self/fd", set()
    for name in os.listdir(folder) if os.path.isdir(folder) else ():  # noqa: PTH208, PTH112
        try:
            target = os.readlink(f"{folder}/{name}")  # noqa: PTH115
        except OSError:  # the descriptor of the folder itself
            continue
        if target.startswith("socket:"):
            found.add(target)
    return found


@pytest.fixture
def database():
    with MoosDatabase(8) as served:
        yield served
        assert served.violations == []


def boat(port=0, count=1, lockstep=True, end=5.0, blocks=(), timeout=LONG, **values):
    autonomy = MOOSAutonomy(moos_port=port, lockstep=lockstep, timeout=timeout, **values)
    motion = {
        "controller": SimpleCarControllerHeading(p_gain=0.5),
        "motion": SimpleCar(length=4.0, max_velocity=3.0),
    }
    spread = {"variance": (100.0, 100.0, 0.0)} if count > 1 else {}
    block = Block(name="boat", team=1, count=count, heading="90 deg", autonomy=autonomy, **motion, **spread)
    return Mission(blocks=[block, *blocks], end=end)


def played(database, worlds=1, count=1, **values):
    """Results, and positions (worlds, count, 3), of vehicles whose helms answer in lockstep."""
    mission = boat(database.port, count, port_step=1, world_step=count, **values)
    ports = range(database.port, database.port + worlds * count)
    with MoosHelm(*ports), Simulation(mission, seeds=range(1, worlds + 1)) as sim:
        results = sim.run()
        return results, sim.read("boat.pos")[0]


# -- the helm steers ----------------------------------------------------------------------------------------------------------------


def test_a_helm_in_lockstep_steers_to_its_points_and_gives_the_same_bits_twice():
    hashes = []
    for _ in range(2):
        with MoosDatabase() as database:
            (result,), pos = played(database, end=100.0)
            assert database.violations == []
            assert database.read_values("MISSION")[-1:] == ["complete"]
            assert database.read_values("TUSSLE_STEP") == [float(k) for k in range(1000)]
        assert result.end == "time"
        assert np.hypot(*(pos[0, 0, :2] - (60.0, -90.0))) < 12.0
        hashes.append(result.state_hash)
    assert hashes[0] == hashes[1]


def test_vehicles_of_a_stack_have_a_community_each_and_are_as_alone(database):
    _, pos = played(database, worlds=2, count=3)
    with MoosDatabase(3) as other:
        _, alone = played(other, count=3)
    assert np.array_equal(pos[0], alone[0])
    assert not np.array_equal(pos[0], pos[1])
    sources = [{entry[2] for entry in c.log if entry[0] == "NAV_X"} for c in database.communities[:6]]
    assert sources == [{"tussle_1"}, {"tussle_2"}, {"tussle_3"}] * 2


def test_a_community_is_told_where_all_are_in_its_units_and_frames(database):
    contact = Block(name="ship", team=2, position=(10.0, 20.0, -3.0), heading="180 deg", motion=Still())
    played(database, end=0.1, blocks=[contact])
    first = {key: values[0] for key in ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED", "NAV_DEPTH", "DEPLOY", "RETURN",
             "MOOS_MANUAL_OVERRIDE", "NODE_REPORT_LOCAL", "NODE_REPORT") if (values := database.read_values(key))}  # fmt: skip
    assert first.pop("NODE_REPORT") == (
        "NAME=2,X=10.000,Y=20.000,SPD=0.000,HDG=270.000,DEP=3.000,TYPE=KAYAK,GROUP=team_2,MODE=none,TIME=0.000"
    )
    assert first.pop("NODE_REPORT_LOCAL").startswith("NAME=1,X=0.000,Y=0.000,SPD=0.000,HDG=0.000,DEP=0.000,")
    assert first.pop("NAV_HEADING") == pytest.approx(0.0, abs=1e-9)
    assert first == {"NAV_X": 0.0, "NAV_Y": 0.0, "NAV_SPEED": 0.0, "NAV_DEPTH": 0.0, "DEPLOY": "true", "RETURN": "false",
                     "MOOS_MANUAL_OVERRIDE": "false"}  # fmt: skip


def test_contacts_are_reported_as_often_as_is_wanted(database):
    contact = Block(name="ship", team=2, motion=Still())
    played(database, end=1.0, blocks=[contact], contact_period=0.5)
    assert len(database.read_values("NODE_REPORT")) == 2
    assert len(database.read_values("NODE_REPORT_LOCAL")) == 10


@pytest.mark.parametrize(
    ("heading", "yaw"), [(0.0, 90.0), (90.0, 0.0), (225.0, -135.0), (270.0, -180.0), (359.0, 91.0)]
)
def test_what_a_helm_desires_comes_in_the_frames_of_the_channels(database, heading, yaw):
    with Manual(database) as helm, Simulation(boat(database.port, end=1.0)) as sim:
        helm.answer = {"DESIRED_HEADING": heading, "DESIRED_SPEED": 2.5, "DESIRED_DEPTH": 7.0}
        sim.step()
        desired = {
            k: sim.read(f"boat.MOOSAutonomy.desired_{k}")[0].item() for k in ("heading", "speed", "altitude")
        }
    assert math.remainder(math.degrees(desired["heading"]) - yaw, 360.0) == pytest.approx(0.0, abs=1e-9)
    assert (desired["speed"], desired["altitude"]) == (2.5, -7.0)


class Manual:
    """A helm that answers with what the test says; `link` is its connection."""

    def __init__(self, database, community=0, name="pHelmIvP"):
        self.link = Link(database.port + community, name, (), 0.0, 0.0)
        self.answer, self.is_mute = {}, False
        self.link.post(IVPHELM_STATE="DRIVE")
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self):
        try:
            while True:
                for messages in self.link.receive():
                    for _, key, value, *_ in messages:
                        if key == "TUSSLE_STEP" and not self.is_mute:
                            self.link.post(**self.answer, TUSSLE_STEP_DONE=value)
        except OSError:
            pass

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.link.socket.shutdown(socket.SHUT_RDWR)
        self.thread.join()
        self.link.socket.close()


def test_until_a_helm_desires_something_heading_and_altitude_are_held(database):
    fly = {"controller": SimpleAircraftControllerPID(), "motion": SimpleAircraft()}
    block = Block(
        name="boat",
        position=(0.0, 0.0, 50.0),
        heading="30 deg",
        autonomy=boat(database.port).blocks[0].autonomy,
        **fly,
    )
    with Manual(database), Simulation(Mission(blocks=[block], end=1.0)) as sim:
        sim.step(3)
        desired = [
            sim.read(f"boat.MOOSAutonomy.desired_{k}")[0].item() for k in ("heading", "altitude", "speed")
        ]
    assert desired == [pytest.approx(math.radians(30.0)), 50.0, 0.0]


def test_without_lockstep_a_simulation_runs_at_the_pace_of_mooss_time(database):
    with MoosHelm(database.port):
        with Simulation(boat(database.port, lockstep=False, moos_time_warp=20.0, end=8.0)) as sim:
            begun = time.monotonic()
            (result,) = sim.run()
            took = time.monotonic() - begun
        assert took >= (8.0 - 0.1) / 20.0 - 0.2  # the lag that is caught up with
        assert result.end == "time"
        assert database.read_values("TUSSLE_STEP") == []
        (first, *_, last) = (entry[3] for entry in database.communities[0].log if entry[0] == "NAV_X")
        assert last - first >= 7.9 - 4.0
        assert first > 20.0 * 1.6e9  # the time warp counts from 1970 on


# -- mission files ------------------------------------------------------------------------------------------------------------------


def test_the_example_sails_to_its_first_point(database):
    loaded = read_mission(stock.examples()["MOOSAutonomy"])
    assert loaded.notes == ()
    file = loaded.mission.blocks[0].autonomy[0].values["moos_mission_file"]
    mission = loaded.mission.blocks[0].replace(
        autonomy=[MOOSAutonomy(moos_mission_file=file, moos_port=database.port, lockstep=True, timeout=LONG)]
    )
    with (
        MoosHelm(database.port),
        Simulation(loaded.mission.replace(blocks=[mission, loaded.mission.blocks[1]])) as sim,
    ):
        sim.step(300)
        assert np.hypot(*(sim.read("boat.pos")[0][0, 0, :2] - (60.0, -40.0))) < 20.0
    assert len(database.read_values("NODE_REPORT")) == 300


def test_missions_in_the_style_of_scrimmage_play(database, tmp_path):
    for k, name in enumerate(("targ_henry", "targ_gilda")):
        (tmp_path / f"{name}.moos").write_text(
            f'// a comment\nserverport = {database.port + k} // of the DB\nCOMMUNITY = "alpha{k * f"_{k}"}"\n'
            "ProcessConfig = uXMS\n{\n  ServerPort = 1\n  Community = wrong\n}\nMOOSTimeWarp = 1000\n"
        )
    car = "<controller>SimpleCarControllerHeading</controller><motion_model length='4' max_velocity='2.5'>SimpleCar</motion_model>"
    boats = "".join(
        f"""<entity><team_id>{k + 1}</team_id><x>{80 * k}</x>{car}<visual_model>sea-angler</visual_model><autonomy
        moos_mission_file="{tmp_path}/{name}.moos" moos_app_name="scrimmage" moos_script="launch.sh">MOOSAutonomy</autonomy></entity>"""
        for k, name in enumerate(("targ_henry", "targ_gilda"))
    )
    file = tmp_path / "moos-ex2.xml"
    file.write_text(
        f"""<runscript><run start="0.0" end="2" dt="0.1" time_warp="8"/><entity_interaction>SimpleCollision</entity_interaction>{boats}
        <entity><team_id>3</team_id><count>6</count><variance_x>80</variance_x><variance_y>80</variance_y><x>-200</x>{car}
        <autonomy speed="2">Straight</autonomy></entity></runscript>"""
    )
    loaded = read_mission(file)
    with MoosHelm(database.port, database.port + 1), Simulation(loaded.mission) as sim:
        assert sim.run()[0].end == "time"
    for k in range(2):
        assert {entry[2] for entry in database.communities[k].log} == {"pHelmIvP", f"scrimmage_{k + 1}"}
        assert len(database.read_values("NODE_REPORT", k)) == 20 * 7


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("ServerPort = 70000\n", "ServerPort = '70000' is not allowed; it takes a number from 1 to 65535"),
        ("MOOSTimeWarp = fast\n", "MOOSTimeWarp = 'fast' is not allowed"),
        (None, "alpha.moos: cannot be read: No such file"),
    ],
)
def test_a_mission_file_of_moos_that_makes_no_sense(tmp_path, text, message):
    file = tmp_path / "alpha.moos"
    if text:
        file.write_text(text)
    with (
        pytest.raises(PluginError, match=re.escape(message)),
        Simulation(boat(moos_mission_file=str(file))) as sim,
    ):
        sim.step()


# -- what goes wrong ----------------------------------------------------------------------------------------------------------------


def test_two_vehicles_have_no_community_in_common(database):
    text = f"port {database.port} of 127.0.0.1 is the community of entity 1 of world 0; each vehicle has a community of its own"
    with (
        pytest.raises(PluginError, match=text),
        Simulation(boat(database.port, count=2, moos_host="LocalHost")) as sim,
    ):
        sim.step()
    with pytest.raises(PluginError, match=r"port 65536 of 127\.0\.0\.1 is above 65535"):
        Simulation(boat(65535, count=2, port_step=1)).step()
    with pytest.raises(ParameterError, match="moos_port = 70000 is not allowed"):
        MOOSAutonomy(moos_port=70000)


def test_a_snapshot_is_refused(database):
    with MoosHelm(database.port), Simulation(boat(database.port)) as sim:
        sim.step()
        with pytest.raises(SnapshotError, match=r"MOOSAutonomy .* has no method save_one"):
            sim.snapshot()


def test_worlds_that_are_reset_connect_anew(database):
    mission = boat(database.port, port_step=1, world_step=1)
    with MoosHelm(*range(database.port, database.port + 2)), Simulation(mission, seeds=[1, 2]) as sim:
        sim.step(3)
        sim.reset([1])
        sim.step(3)
        assert sim.steps.tolist() == [6, 3]
    assert [database.read_values("TUSSLE_STEP", k) for k in (0, 1)] == [
        [0, 1, 2, 3, 4, 5],
        [0, 1, 2, 0, 1, 2],
    ]


class Listener:
    """Listens to a port and does to whoever connects what a test says."""

    def __init__(self, act):
        self.act = act
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.port = self.socket.getsockname()[1]
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self):
        try:
            while True:
                connection, _ = self.socket.accept()
                with connection:
                    self.act(connection)
        except OSError:
            pass

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.shutdown(socket.SHUT_RDWR)
        self.thread.join()
        self.socket.close()


def welcome(connection, then):
    """Greet a client, and send bytes."""
    connection.recv(4096)
    connection.sendall(packet(message("W", "", "asynchronous", "", "alpha")) + then)
    while connection.recv(4096):
        pass


def test_nobody_is_there():
    closed = socket.create_server(("127.0.0.1", 0))
    port = closed.getsockname()[1]
    closed.close()
    text = rf"boat 1, world 0, step 0: MOOSDB at 127.0.0.1:{port} \(community 'henry'\): no connection within 1 s \(Connection refused"
    with (
        pytest.raises(PluginError, match=text),
        Simulation(boat(port, timeout=1.0, moos_community="henry")) as sim,
    ):
        sim.step()


@pytest.mark.parametrize(
    ("act", "text"),
    [
        (lambda c: c.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n" + bytes(99)), "this is not the protocol of MOOS: a packet of"),
        (lambda c: c.recv(4096) and c.sendall(packet(message("N", "X", 1.0))), "this is not the protocol of MOOS: no welcome"),
        (lambda c: welcome(c, b"\xff" * 99), "not the protocol of MOOS: a packet of -1 bytes"),
        (lambda c: welcome(c, packet(message("N", "X", 1.0)[:-4])), "not the protocol of MOOS: a "),
        (lambda c: welcome(c, packet(message("N", "DESIRED_SPEED", math.nan, "p"))), "p says DESIRED_SPEED = nan"),
        (lambda c: welcome(c, packet(message("N", "DESIRED_SPEED", "fast", "p"))), "p says DESIRED_SPEED = 'fast'"),
        (lambda c: welcome(c, 10_000 * packet(message("N", "DESIRED_SPEED", 1.0))), "more than 2000 messages per second"),
        (lambda c: c.recv(4096) and c.sendall(packet(message("W", "", "a", "", "gilda"))), "its community is 'gilda'"),
    ],
)  # fmt: skip
def test_a_peer_that_makes_no_sense_ends_its_world_and_no_other(database, act, text):
    with Listener(act) as listener:
        first, second = sorted((listener.port, database.port))
        mission = boat(first, world_step=second - first, end=1.0, moos_community="alpha")
        bad = int(listener.port == second)
        with Manual(database), Simulation(mission, seeds=[1, 2], on_error="record") as sim:
            results = sim.run()
    assert [results[1 - bad].end, results[bad].end] == ["time", "error"], results
    assert re.search(
        f"world {bad}, step 0: MOOSDB at 127.0.0.1:{listener.port} .*{text}", str(results[bad].error)
    )


@pytest.mark.parametrize(
    ("act", "text"),
    [
        (lambda c: c.recv(4096) and None, r"unknown\): no connection within 1 s \((the connection was closed|Connection reset by peer)\)"),
        (lambda c: [None for _ in iter(lambda: c.recv(4096), b"")], r"unknown\): no connection within 1 s \(no answer\)"),
        (lambda c: welcome(c, b""), r"'alpha'\): no helm has been heard within 1 s"),
        (lambda c: c.recv(4096) and c.sendall(packet(message("K", "", "a name\n that is taken"))),
         r"no connection within 1 s \(it refuses the name tussle_1: 'a name that is taken'\)"),
    ],
)  # fmt: skip
def test_a_peer_that_says_nothing_is_missed(act, text):
    with (
        Listener(act) as listener,
        pytest.raises(PluginError, match=text),
        Simulation(boat(listener.port, timeout=1.0)) as sim,
    ):
        sim.step()


def ends(database, cause, text):
    """A world ends with an error after its third step, in which something happens to the first of two communities."""
    mission = boat(database.port, world_step=1, end=1.0)
    with (
        Manual(database) as helm,
        Manual(database, 1),
        Simulation(mission, seeds=[1, 2], on_error="record") as sim,
    ):
        sim.step(3)
        cause(helm)
        results = sim.run()
    assert [result.end for result in results] == ["error", "time"], results
    place = rf"boat 1, world 0, step \d+: MOOSDB at 127.0.0.1:{database.port} \(community 'alpha'\): "
    assert re.search(place + text, str(results[0].error))


def test_a_helm_that_dies_on_the_way_is_missed(database):
    with Manual(database) as helm, Simulation(boat(database.port, timeout=2.0)) as sim:
        sim.step(3)
        helm.is_mute = True
        text = r"the helm has not answered the step 3 \(TUSSLE_STEP\) with TUSSLE_STEP_DONE within 2 s; its state is 'DRIVE'"
        with pytest.raises(PluginError, match=text):
            sim.run()


def test_without_lockstep_a_helm_that_falls_silent_is_missed(database):
    mission = boat(database.port, lockstep=False, moos_time_warp=10.0, end=1e4, timeout=1.0)
    with Manual(database) as helm, Simulation(mission) as sim:
        helm.link.post(IVPHELM_STATE="MALCONFIG")
        with pytest.raises(PluginError, match="the helm has been silent for 1 s; its state is 'MALCONFIG'"):
            sim.run()


def test_a_database_that_dies_on_the_way_is_missed(database):
    def kill(helm):
        with database.lock:
            for client in list(database.communities[0].clients.values()):
                database.drop(client)

    ends(database, kill, "(the connection was closed|Connection reset by peer|nothing can be sent: .*)")


def restarted(sim, first):
    """Another MOOSDB and helm at the place of the first, which has ended."""
    first.close()
    assert first.violations == []
    link = sim.state.population.groups[0].autonomies[0].plugin.vessel[0]
    while not link.client.trouble:
        time.sleep(0.01)
    return MoosDatabase(port=first.port), link


@pytest.mark.parametrize("lockstep", [True, False])
def test_a_game_waits_for_a_database_that_comes_back(lockstep):
    """It is ended in the middle of a way; the helm that comes back with it is deployed anew, and steers on."""
    first = MoosDatabase()
    warp = {} if lockstep else {"moos_time_warp": 20.0}
    mission = boat(first.port, lockstep=lockstep, end=1e4, on_loss="wait", **warp)
    with Simulation(mission) as sim:
        with MoosHelm(first.port):
            sim.step(100)
        second, vessel = restarted(sim, first)
        began, moved = float(sim.t[0]), []

        def play():
            sim.step(100)
            moved.append(sim.read("boat.pos")[0][0, 0])

        thread = threading.Thread(target=play)
        thread.start()
        with second:
            while not second.communities[0].clients:  # tussle is back
                time.sleep(0.01)
            time.sleep(0.2)
            assert sim.t[0] <= began + 0.2  # no step goes on without a helm
            with MoosHelm(first.port, points=((-60.0, 0.0),)):
                thread.join()
                assert second.read_values("DEPLOY") == ["true"]
                assert sim.read("boat.MOOSAutonomy.losses")[0].tolist() == [[1]]
                sim.step(300)
            assert second.violations == []
        assert sim.read("boat.pos")[0][0, 0, 0] < moved[0][0]  # to the new point, in the West
        assert vessel.failure == ""


@pytest.mark.parametrize("lockstep", [True, False])
def test_a_game_goes_on_without_its_database_and_obeys_it_again(lockstep):
    first = MoosDatabase()
    warp = {} if lockstep else {"moos_time_warp": 100.0}
    mission = boat(first.port, lockstep=lockstep, end=1e4, on_loss="go_on", timeout=5.0, **warp)
    with Simulation(mission) as sim:
        with MoosHelm(first.port, points=((1e6, 0.0),)):
            sim.step(100)
            while sim.read("boat.vel")[0][0, 0, 0] < 2.9:  # on a busy machine the helm answers late
                sim.step(10)
        second, _ = restarted(sim, first)
        before = sim.read("boat.pos")[0][0, 0]
        sim.step(50)
        way = sim.read("boat.pos")[0][0, 0] - before
        assert way[0] == pytest.approx(3.0 * 5.0, rel=0.05)  # heading and speed are held
        with second, MoosHelm(first.port, points=((-1e6, 0.0),)):
            while not second.read_values("DESIRED_HEADING"):
                sim.step()
            sim.step(400)
            before = sim.read("boat.pos")[0][0, 0]
            sim.step(20)
            assert sim.read("boat.pos")[0][0, 0, 0] < before[0] - 1.0
            assert second.violations == []


def test_a_database_that_does_not_come_back_is_missed():
    first = MoosDatabase()
    with Simulation(boat(first.port, on_loss="wait", timeout=2.0, end=1e4)) as sim:
        with MoosHelm(first.port):
            sim.step(10)
        first.close()
        with pytest.raises(
            PluginError, match=r"community 'alpha'\): no connection within 2 s \(Connection refused\)"
        ):
            sim.run()


def test_a_database_of_another_name_is_not_the_one_that_is_waited_for():
    first = MoosDatabase()
    with Simulation(boat(first.port, on_loss="wait", end=1e4)) as sim:
        with MoosHelm(first.port):
            sim.step(10)
        first.close()
        with (
            MoosDatabase(port=first.port, name="gilda"),
            pytest.raises(PluginError, match="its community is 'gilda'"),
        ):
            sim.run()


def test_two_helms_do_not_steer_together(database):
    def meddle(helm):
        helm.answer = {"DESIRED_SPEED": 1.0}
        with Manual(database, name="second") as other:
            for _ in range(3):
                for link in (helm.link, other.link):
                    n = len(database.read_values("DESIRED_SPEED"))
                    link.post(DESIRED_SPEED=2.0)
                    while len(database.read_values("DESIRED_SPEED")) == n:
                        time.sleep(0.01)

    ends(database, meddle, "(second and pHelmIvP|pHelmIvP and second) both set DESIRED_SPEED")


def test_a_client_of_the_same_name_is_there(database):
    with Manual(database), Manual(database, name="tussle_1"):
        text = r"no connection within 1 s \(it refuses the name tussle_1: 'A client of this name \(\"tussle_1\"\) already exists'\)"
        with pytest.raises(PluginError, match=text), Simulation(boat(database.port, timeout=1.0)) as sim:
            sim.step()


def test_a_flood_for_seconds_ends_its_world(database):
    """10,000 messages per second, in small packets."""
    is_over = threading.Event()

    def flood(helm):
        def run():
            with contextlib.suppress(OSError):  # the helm is gone
                while not is_over.is_set():
                    helm.link.socket.sendall(
                        packet(
                            *(message("N", "IVPHELM_STATE", "DRIVE", "pHelmIvP", "alpha") for _ in range(100))
                        )
                    )
                    time.sleep(0.01)

        helm.is_mute = True
        threads.append(threading.Thread(target=run, daemon=True))
        threads[0].start()

    threads = []
    try:
        ends(database, flood, "more than 2000 messages per second")
    finally:
        is_over.set()
        threads[0].join()


@pytest.mark.slow
def test_ctrl_c_ends_a_run_that_waits_for_its_helm(database, tmp_path):
    file = tmp_path / "boat.xml"
    file.write_text(
        f"""<runscript><run end="10" dt="0.1"/><entity><team_id>1</team_id><motion_model>SimpleCar</motion_model>
        <controller>SimpleCarControllerHeading</controller>
        <autonomy moos_port="{database.port}" timeout="100000">MOOSAutonomy</autonomy></entity></runscript>"""
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    process = subprocess.Popen(
        [sys.executable, "-m", "tussle.cli", "run", str(file), "--out", str(tmp_path / "out")],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=environment,
    )
    try:
        while not (tmp_path / "out").exists():  # it is made when Ctrl-C is handled
            assert process.poll() is None, process.stdout.read()
            time.sleep(0.02)
        for _ in range(2):  # the second one ends the step
            process.send_signal(signal.SIGINT)
            time.sleep(0.5)
        assert process.wait(300) == 130, process.stdout.read()
    finally:
        process.kill()
        process.communicate()
    while database.clients:
        time.sleep(0.01)
