"""FlightGearMultiplayer: a process that decodes the packets field by field sees where the aircraft are."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.errors import ParameterError, PluginError
from tussle.mission import read_mission
from tussle.numeric.quaternion import quat_from_euler, quat_rotate
from tussle.plugins import stock
from tussle.scene import Origin, Scene
from tussle.stock import External, FlightGearMultiplayer

ORIGIN = Origin.from_degrees(37.6188, -122.375, 4.0)


def mission(count=2, **values):
    block = Block(
        name="scout", team=1, count=count, autonomy=FlightGearMultiplayer(**values), motion=External()
    )
    return Mission(blocks=[block], dt=0.1, end=1.0, scene=Scene(origin=ORIGIN))


@pytest.fixture
def flightgear():
    """A function that starts a listener for n packets and returns its port and a function that waits for them."""
    processes = []

    def start(n):
        process = subprocess.Popen(
            [sys.executable, Path(__file__).with_name("flightgear_peer.py"), str(n)],
            stdout=subprocess.PIPE,
            text=True,
        )
        processes.append(process)
        return int(process.stdout.readline()), lambda: json.loads(process.stdout.readline())

    yield start
    for process in processes:
        process.kill()
        process.wait()
        process.stdout.close()


def ned(vector):
    return [vector[1], vector[0], -vector[2]]


def test_a_listener_sees_the_aircraft_where_they_are(flightgear):
    port, wait = flightgear(2)
    pos = np.array([[0.0, 0.0, 296.0], [900.0, -400.0, 50.0]])
    quat = quat_from_euler(np.array([0.3, -2.9]), np.array([-0.2, 0.1]), np.array([0.5, 2.8]))
    vel, omega = np.array([[30.0, 16.0, 6.0], [0.0, -5.0, 0.0]]), np.array([[0.0, 0.1, 0.4], [0.0, 0.0, 0.0]])
    with Simulation(mission(server_port=port, callsign="eagles")) as sim:
        for name, value in {"pos": pos, "vel": vel, "quat": quat.T, "omega": omega}.items():
            sim.write(f"scout.{name}", value[None])
        sim.step()
        found = wait()
    geodetic = ORIGIN.to_geodetic(pos.T)
    for k, got in enumerate(found):
        assert (got["bytes"], got["length"], got["rest"], got["padding"]) == (232, 232, 0, 0)
        assert (got["magic"], got["version"], got["message"]) == (0x46474653, 0x00010001, 7)
        assert (got["callsign"], got["model"]) == (
            ("eagles", "eagles2")[k],
            "Aircraft/c172p/Models/c172p.xml",
        )
        assert (got["time"], got["lag"], got["accelerations"]) == (0.0, 0.0, [[0.0] * 3] * 2)
        np.testing.assert_allclose(got["where"][:2], np.degrees(geodetic[:2, k]), atol=1e-9)
        assert got["where"][2] == pytest.approx(geodetic[2, k], abs=1e-4)
        tolerance = 2e-4 if k else 1e-6  # north and up 1 km away differ by 1.5e-4 rad
        for name, vector in {"forward": (1, 0, 0), "right": (0, -1, 0)}.items():
            expected = ned(quat_rotate(quat[:, k], np.array(vector, float)))
            np.testing.assert_allclose(got[name], expected, atol=tolerance)
        np.testing.assert_allclose(got["velocity"], ned(vel[k]), atol=40 * tolerance)
        np.testing.assert_allclose(got["omega"], ned(omega[k]), atol=tolerance)


def test_packets_come_at_the_rate_and_of_the_first_world_only(flightgear):
    port, wait = flightgear(5)
    with Simulation(mission(1, server_port=port, rate=5), seeds=[1, 2]) as sim:
        sim.run()
    np.testing.assert_allclose([got["time"] for got in wait()], [0.0, 0.2, 0.4, 0.6, 0.8])


def test_callsigns_of_many_have_ids_that_fit(flightgear):
    port, wait = flightgear(120)
    with Simulation(mission(120, server_port=port, callsign="predato")) as sim:
        sim.step()
    found = [got["callsign"] for got in wait()]
    assert found[0] == "predato"
    assert (found[1], found[98], found[119]) == ("predat2", "preda99", "pred120")
    assert len(set(found)) == 120


@pytest.mark.parametrize(
    ("name", "value", "most"), [("callsign", "eagles12", 7), ("callsign", "", 7), ("aircraft_model", "m" * 96, 95)]
)  # fmt: skip
def test_texts_that_do_not_fit_are_refused(name, value, most):
    with pytest.raises(
        ParameterError, match=f"{name} = '{value}' is not allowed; it takes 1 to {most} characters"
    ):
        FlightGearMultiplayer(**{name: value})


def test_unknown_hosts_are_refused():
    unknown = r"'no\.such\.host\.invalid' is no known host"
    with (
        Simulation(mission(server_ip="no.such.host.invalid")) as sim,
        pytest.raises((ParameterError, PluginError), match=unknown),
    ):
        sim.step()


def test_blocks_with_one_callsign_have_different_ones(flightgear):
    port, wait = flightgear(8)
    one = mission(server_port=port).blocks[0]
    with Simulation(mission().replace(blocks=[one, one.replace(name="other")])) as sim:
        sim.step(2)
    assert [got["callsign"] for got in wait()] == ["syllo", "syllo2", "syllo3", "syllo4"] * 2


def test_one_server_by_two_names_has_no_callsign_twice(flightgear):
    port, wait = flightgear(4)
    one = mission(server_port=port).blocks[0]
    other = mission(server_port=port, server_ip="localhost").blocks[0].replace(name="other")
    with Simulation(mission().replace(blocks=[one, other])) as sim:
        sim.step()
    assert [got["callsign"] for got in wait()] == ["syllo", "syllo2", "syllo3", "syllo4"]


def test_callsigns_of_blocks_are_different_also_when_they_are_cut(flightgear):
    port, wait = flightgear(46)
    names = ["eagle1", "eagle12", "eagles", "eagles5", "eaglesx"]
    counts = [24, 6, 6, 1, 9]
    blocks = [
        mission(n, server_port=port, callsign=callsign).blocks[0].replace(name=callsign)
        for callsign, n in zip(names, counts, strict=True)
    ]
    with Simulation(mission().replace(blocks=blocks)) as sim:
        sim.step()
        first = [got["callsign"] for got in wait()]
    assert len(set(first)) == 46
    assert all(0 < len(each) <= 7 for each in first)
    assert first[0] == "eagle1"
    assert first[1] == "eagle12"  # the second entity of the first block
    assert first[24] != "eagle12"


def test_the_example_is_played(flightgear, tmp_path):
    port, wait = flightgear(20)
    path = tmp_path / "mission.xml"
    path.write_text(stock.examples()["FlightGearMultiplayer"].read_text().replace('"5000"', f'"{port}"'))
    loaded = read_mission(path)
    assert loaded.notes == ()
    with Simulation(loaded.mission) as sim:
        sim.step(10)
    assert {got["callsign"] for got in wait()} == {"tussle", "tussle2"}
