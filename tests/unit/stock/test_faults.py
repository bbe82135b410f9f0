"""Faults of sensors and actuators: on all vehicles and sensors that ship, when they begin and end, and what is refused."""

from __future__ import annotations

import inspect

import numpy as np
import pytest
from test_radio_network import hears, is_near, n_heard, talks

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Input, MotionModel, Output, Sensor, State
from tussle.api.channel_map import CHANNEL_UNITS, MEASURED_CHANNELS, MEASURED_LISTS
from tussle.declare.units import split_units
from tussle.errors import ParameterError, WiringError
from tussle.plugins import stock
from tussle.stock import (
    GPS,
    ActuatorFault,
    Boundary,
    ClockOffset,
    FailingRadio,
    GoToWaypoint,
    Hijack,
    NoisyState,
    RigidBody6DOF,
    SensorFault,
    SingleIntegrator,
    Still,
    WaypointDispatcher,
)

CLASSES = {c.__name__: c for c in map(stock.load, stock.manifest()) if not inspect.isabstract(c)}
VEHICLES = {n: c for n, c in CLASSES.items() if issubclass(c, MotionModel) and not n.startswith("JSBSim")}
"""JSBSim's need the files of an aircraft; their channels are in `test_the_tables_have_all_channels`."""
STEERED = [n for n, c in VEHICLES.items() if any(not i.optional for i in c.inputs().values())]
SENSORS = [
    n for n, c in CLASSES.items()
    if issubclass(c, Sensor) and c.grade == "portable" and n != "SensorFault" and any(not o.ragged for o in c.outputs().values())
]  # fmt: skip
LISTS = [
    (n, o) for n, c in CLASSES.items() if issubclass(c, Sensor) and n not in ("SensorFault", "RayTrace")
    for o in c.outputs() if c.outputs()[o].ragged
]  # fmt: skip


def driver(channels, value):
    """An autonomy that writes a number that rises by 1 in each step."""

    def step(self, g):
        for name in channels:
            getattr(self, name)[:] = value + g.step_count

    body = {name: Output(unit=CHANNEL_UNITS[name]) for name in channels}
    return type("Driver", (Autonomy,), {**body, "step": step, "__doc__": "Writes numbers."})()


def reader(channels):
    """An autonomy that reads numbers of sensors."""
    body = {name: Input(unit=MEASURED_CHANNELS[name]) for name in channels}
    return type("Reader", (Autonomy,), {**body, "step": lambda *_: None, "__doc__": "Reads numbers."})()


def flight(*, end=5.0, seeds=1, count=1, **parts):
    """A game of one block."""
    block = Block(name="a", count=count, position=(3, 4, 50), **parts)
    return Simulation(Mission(blocks=[block], dt=0.1, end=end), seeds=seeds)


def test_the_tables_have_all_channels():
    for cls in CLASSES.values():
        if issubclass(cls, (MotionModel, Sensor)) and "Fault" not in cls.__name__:
            columns = cls.inputs() if issubclass(cls, MotionModel) else cls.outputs()
            known = CHANNEL_UNITS if issubclass(cls, MotionModel) else MEASURED_CHANNELS
            for column in columns.values():
                if column.ragged and issubclass(cls, Sensor) and cls.__name__ != "RayTrace":
                    fields, units = MEASURED_LISTS[column.channels[0]]
                    assert column.fields == tuple(fields.split())
                    assert column.units == split_units(units, max(1, len(column.fields)))
                for name, unit in zip(column.channels, column.units, strict=False):
                    assert column.ragged or "ROS" in cls.__name__ or known[name] == unit


@pytest.mark.parametrize("name", STEERED)
def test_actuators_of_all_vehicles(name):
    vehicle = VEHICLES[name]()
    inputs = vehicle.active_inputs()
    channels = [c for k in inputs for c in type(vehicle).inputs()[k].channels]
    fault = ActuatorFault(channels=" ".join(channels), fault="reverse", start_after=0.2, duration=0.2)
    sim = flight(autonomy=driver(channels, 0.01), controller=fault, motion=vehicle)
    seen = []
    for _ in range(5):
        sim.step()
        seen.append([sim.read(f"a.{name}.{k}")[0].ravel() for k in inputs])
    for k in range(len(inputs)):
        assert [float(row[k][0]) for row in seen] == [0.01, 1.01, -2.01, -3.01, 4.01]


@pytest.mark.parametrize("name", SENSORS)
def test_measurements_of_all_sensors(name):
    """What an autonomy reads is altered by a bias, and nothing else is."""
    sensor = CLASSES[name]()
    channels = [c for o in type(sensor).outputs().values() if not o.ragged for c in o.channels]
    plain = [c for c in channels if not c.startswith("belief_quat")]
    motion = RigidBody6DOF() if name.startswith("RigidBody") else Still()
    pilot = [driver(["thrust", "elevator", "aileron", "rudder"], 0.1)] if name.startswith("RigidBody") else []
    sensors = [GPS(), sensor] if name == "SimpleINS" else [sensor]
    fault = SensorFault(channels=" ".join(plain), fault="bias", value=2.5, start_after=0.25)
    games = [
        flight(autonomy=[*pilot, reader(plain)], motion=motion, sensor=list_)
        for list_ in (sensors, [*sensors, fault])
    ]
    for _ in range(4):
        for sim in games:
            sim.step()
        added = 0.0 if games[0].t[0] < 0.25 else 2.5
        for channel in plain:
            right, wrong = (float(sim.read(f"a.Reader.{channel}")[0].ravel()[0]) for sim in games)
            assert wrong == right + added, channel
        assert np.array_equal(games[0].read("a.pos")[0], games[1].read("a.pos")[0])


def lists_of(name, output, **fault):
    """Lists of a sensor in eight steps, of all entities side by side, and those with a fault in steps 3 to 5."""
    sensor, found = CLASSES[name](**SMALL.get(name, {})), []
    channel = type(sensor).outputs()[output].channels[0]
    crowd = Block(name="b", count=5, position=(8, 4, 50), variance=(20, 20, 20), motion=Still())
    for faults in ([], [SensorFault(channels=channel, start_after=0.35, duration=0.3, **fault)]):
        mine = Block(
            name="a",
            count=2,
            position=(3, 4, 50),
            variance=(9, 9, 9),
            motion=Still(),
            sensor=[sensor, *faults],
        )
        sim, seen = Simulation(Mission(blocks=[mine, crowd], dt=0.1, end=2.0), seeds=[1, 2]), []
        for _ in range(8):
            sim.step()
            lists = sim.read(f"a.{name}.{output}")[0].ravel()
            seen.append([np.atleast_2d(each).copy() for each in lists])
        found.append(seen)
    return found


SMALL = {"DepthCamera": {"img_width": 4, "img_height": 3}}
"""Parameters of sensors with long lists."""


def same(a, b):
    return all(np.array_equal(x, y, equal_nan=True) for x, y in zip(a, b, strict=True))


@pytest.mark.parametrize(("name", "output"), LISTS)
@pytest.mark.parametrize("fault", ["dropout", "freeze", "delay"])
def test_lists_of_all_sensors(name, output, fault):
    right, wrong = lists_of(name, output, fault=fault, delay=2)
    for k in range(8):
        if not 3 <= k <= 5:
            assert same(wrong[k], right[k]), k
        elif fault == "dropout":
            assert all(each.size == 0 for each in wrong[k])
        else:
            assert same(wrong[k], right[3 if fault == "freeze" else k - 2]), k


@pytest.mark.parametrize(
    ("fault", "altered"),
    [
        ("dropout", lambda x: np.full_like(x, 1.5)),
        ("bias", lambda x: x + 1.5),
        ("saturate", lambda x: np.clip(x, -1.5, 1.5)),
        ("reverse", np.negative),
    ],
)
def test_fields_of_lists(fault, altered):
    right, wrong = lists_of("NoisyContacts", "contacts", fault=fault, value=1.5, fields="x vy")
    for k, (before, after) in enumerate(zip(right, wrong, strict=True)):
        for each in before if 3 <= k <= 5 else ():
            each[[2, 6]] = altered(each[[2, 6]])
        assert same(before, after)
    assert before[0].shape == (12, 6)


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        ("dropout", [0, 1, 7, 7, 7, 5]),
        ("bias", [0, 1, 9, 10, 11, 5]),
        ("freeze", [0, 1, 2, 2, 2, 5]),
        ("delay", [0, 1, 0, 1, 2, 5]),
        ("saturate", [0, 1, 1.5, 1.5, 1.5, 5]),
        ("reverse", [0, 1, -2, -3, -4, 5]),
    ],
)
def test_what_a_fault_does(fault, expected):
    value = 1.5 if fault == "saturate" else 7.0
    broken = ActuatorFault(
        channels="velocity_x", passed="velocity_y, velocity_z", fault=fault, value=value, delay=2, start_after=0.2, duration=0.3
    )  # fmt: skip
    names = ["velocity_x", "velocity_y", "velocity_z"]
    sim = flight(autonomy=driver(names, 0.0), controller=broken, motion=SingleIntegrator())
    seen = []
    for _ in range(6):
        sim.step()
        seen.append([float(sim.read(f"a.ActuatorFault.{n}_out")[0].ravel()[0]) for n in names])
    assert [row[0] for row in seen] == expected
    assert [row[1:] for row in seen] == [[k, k] for k in range(6)]


@pytest.mark.parametrize("fault", ["bias", "reverse", "delay"])
def test_a_measurement_that_is_kept_is_altered_once(fault):
    """Without a fix, GPS keeps what it wrote last."""
    fence = Boundary(boundary_id=1, center=(0, 0, 0), lengths=(100, 100, 100))
    fault = SensorFault(
        channels="gps_fix gps_altitude gps_time",
        fault=fault,
        value=5.0,
        delay=2,
        start_after=0.45,
        duration=0.3,
    )
    seen = []
    for faults in ([], [fault]):
        block = Block(name="a", position=(47, 0, 10), autonomy=driver(["velocity_x", "velocity_y", "velocity_z"], 0.0),
                      motion=SingleIntegrator(), sensor=[GPS(gps_denied_ids="1", noise=(0, 0, 0)), *faults])  # fmt: skip
        sim = Simulation(Mission(blocks=[block], interactions=[fence], dt=0.1, end=2), 1)
        found = []
        for _ in range(12):
            sim.step()
            found.append(
                [sim.read("a.GPS.coordinates")[0][0, 0, 2], sim.read("a.GPS.gps_time")[0].ravel()[0]]
            )
        seen.append(np.array(found))
    right, wrong = seen
    assert len(set(right[:, 1])) > 2
    assert (right[1:4, 1] == right[0, 1]).all()
    faulty = slice(4, 7)
    expected = right.copy()
    kind = fault.values["fault"]
    expected[faulty] = {"bias": right[faulty] + 5.0, "reverse": -right[faulty], "delay": right[2:5]}[kind]
    assert np.array_equal(wrong, expected)


def test_a_belief_that_is_late():
    """The attitude can be late with the position; the truth goes on."""
    belief = " ".join(c for c in MEASURED_CHANNELS if c.startswith("belief"))
    exact = {f"{kind}_noise_{i}": (0, 0) for kind in ("pos", "vel") for i in range(3)}
    sensors = [NoisyState(**exact), SensorFault(channels=belief, fault="delay", delay=3)]
    names = ["velocity_x", "velocity_y", "velocity_z"]
    sim = flight(autonomy=driver(names, 1.0), motion=SingleIntegrator(), sensor=sensors)
    true, believed = [], []
    for _ in range(8):
        sim.step()
        true.append(sim.read("a.pos")[0].ravel().copy())
        believed.append(sim.read("a.NoisyState.belief_pos")[0].ravel().copy())
    assert np.array_equal(believed[3:], true[:5])
    assert not np.array_equal(believed[-1], true[-1])


def test_faults_begin_at_random_at_their_rate():
    broken = ActuatorFault(start_after="inf", failure_rate=0.5, duration=0.1)
    names = ["velocity_x", "velocity_y", "velocity_z"]
    parts = {"autonomy": driver(names, 1.0), "controller": broken, "motion": SingleIntegrator()}
    sim, n = flight(count=500, seeds=[1, 2], **parts), 0
    for _ in range(40):
        sim.step()
        n += int(sim.read("a.ActuatorFault.is_faulty")[0].sum())
    mean = 2 * 500 * 40 * -np.expm1(-0.5 * 0.1)
    assert abs(n - mean) < 4.0 * np.sqrt(mean)


def test_some_entities_have_the_fault():
    broken = ActuatorFault(probability=0.3, start_after=0.1)
    names = ["velocity_x", "velocity_y", "velocity_z"]
    sim = flight(count=1000, autonomy=driver(names, 1.0), controller=broken, motion=SingleIntegrator())
    counts = []
    for _ in range(3):
        sim.step()
        counts.append(int(sim.read("a.ActuatorFault.is_faulty")[0].sum()))
    assert counts[0] == 0
    assert abs(counts[1] - 300) < 4.0 * np.sqrt(1000 * 0.3 * 0.7)
    assert counts[2] == counts[1]


def counter(channels, value):
    """An autonomy that writes a number that rises by 1 with each of its steps, in its memory."""

    def step(self, g):
        for name in channels:
            getattr(self, name)[:] = value + self.n
        self.n += 1

    body = {name: Output(unit=CHANNEL_UNITS[name]) for name in channels}
    return type("Counter", (Autonomy,), {**body, "n": State(), "step": step, "__doc__": "Counts."})()


def test_a_hijacked_robot_is_flown_by_the_adversary_until_it_is_given_back():
    names = ["velocity_x", "velocity_y", "velocity_z"]
    own, adversary = counter(names, 1.0), counter(names[:1], -50.0)
    taken = Hijack(autonomies=[own], adversary=[adversary], start_after=0.3, duration=0.2, probability=0.5)
    sim, seen, hijacked = flight(count=40, autonomy=taken, motion=SingleIntegrator(max_speed=1e3)), [], []
    for _ in range(8):
        sim.step()
        seen.append(sim.read("a.vel")[0][0, :, :].T)
        hijacked.append(sim.read("a.Hijack.is_faulty")[0][0].copy())
    is_taken = hijacked[3]
    assert 5 < is_taken.sum() < 35
    assert [h.tolist() for h in hijacked] == [(is_taken & (k in (3, 4))).tolist() for k in range(8)]
    x = np.array([v[0] for v in seen])
    assert x[:, ~is_taken].T.tolist() == [[1, 2, 3, 4, 5, 6, 7, 8]] * (~is_taken).sum()
    assert x[:, is_taken].T.tolist() == [[1, 2, 3, -50, -49, 1, 2, 3]] * is_taken.sum()
    y = np.array([v[1] for v in seen])
    assert y[:, is_taken].T.tolist() == [[1, 2, 3, 3, 3, 1, 2, 3]] * is_taken.sum(), (
        "it keeps what nobody commands"
    )


class Watch(Autonomy):
    """Writes the time that it reads."""

    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.velocity[0] = g.t


@pytest.mark.parametrize(
    "holder", [lambda *inside: inside, lambda *inside: [Hijack(autonomies=inside, start_after="inf")]]
)
def test_a_clock_is_off_by_what_was_drawn_as_the_fault_began(holder):
    wrong = ClockOffset(
        autonomies=holder(Watch()), offset=-3.0, offset_sd=0.5, start_after=0.3, duration=0.2, probability=0.7
    )
    sim = flight(count=60, autonomy=wrong, motion=SingleIntegrator(max_speed=1e3))
    seen, faulty = [], []
    for k in range(8):
        sim.step()
        seen.append(sim.read("a.vel")[0][0, :, 0] - 0.1 * k)
        faulty.append(sim.read("a.ClockOffset.is_faulty")[0][0].copy())
    has_fault = faulty[3]
    assert 20 < has_fault.sum() < 55
    assert [f.tolist() for f in faulty] == [(has_fault & (k in (3, 4))).tolist() for k in range(8)]
    error = np.array(seen)
    assert np.abs(error[~np.array(faulty)]).max() < 1e-12
    assert error[3, has_fault] == pytest.approx(error[4, has_fault], abs=1e-12)
    assert error[3, has_fault].mean() == pytest.approx(-3.0, abs=4 * 0.5 / has_fault.sum() ** 0.5)
    assert 0.3 < error[3, has_fault].std() < 0.7


def test_a_robot_with_a_slow_clock_acts_late():
    """It goes to its waypoint of 1 s as its clock shows that."""
    go = GoToWaypoint(waypoint="XYZ 1 X Y 60 0 0 0 5 -1")
    slow = ClockOffset(autonomies=[go], offset=-0.7)
    for autonomy, step in ((go, 10), (slow, 17)):
        sim = flight(
            autonomy=[autonomy, WaypointDispatcher(waypointlist_network="LocalNetwork")], motion=Still()
        )
        path = "a.GoToWaypoint.is_told" if autonomy is go else "a.ClockOffset.GoToWaypoint.is_told"
        told = []
        for _ in range(20):
            sim.step()
            told.append(bool(sim.read(path)[0].ravel()[0]))
        assert told.index(True) == step


def test_what_is_refused():
    with pytest.raises(ParameterError, match=r"there is no channel 'sped' \(did you mean 'speed'\?\)"):
        ActuatorFault(channels="sped")
    with pytest.raises(ParameterError, match="channel 'speed' is written twice"):
        ActuatorFault(channels="speed, speed")
    with pytest.raises(ParameterError, match="names no channel"):
        SensorFault(channels="")
    with pytest.raises(ParameterError, match=r"an attitude is the channels .* and takes freeze or delay"):
        SensorFault(channels="belief_quat_w belief_quat_x belief_quat_y belief_quat_z", fault="bias")
    for values, says in {
        "contacts seen": "has several lists; give each a SensorFault of its own",
        "contacts:fields=xx": r"has no field 'xx' that can be altered \(did you mean 'x'",
        "contacts:fields=qw": "has no field 'qw' that can be altered",
        "gps_time:fields=x": "has no field 'x' that can be altered",
        "contacts:fields=x:fault=delay": "takes no fields; it is of the whole list",
        "contacts:fault=bias": "needs fields; ",
        "segmentation_image:fault=reverse": "needs fields",
        "raytrace": "there is no channel 'raytrace'",
    }.items():
        channels, *others = values.split(":")
        with pytest.raises(ParameterError, match=says):
            SensorFault(channels=channels, **dict(each.split("=") for each in others))
    with pytest.raises(WiringError, match="alters channel 'contacts', which no sensor before it writes"):
        flight(motion=Still(), sensor=[SensorFault(channels="contacts"), NoisyState()])
    with pytest.raises(WiringError, match="alters channel 'belief_pos_x', which no sensor before it writes"):
        flight(motion=Still(), sensor=[SensorFault(), NoisyState()])
    with pytest.raises(
        WiringError, match="in every step, but NoisyState writes it at 5 Hz; give both the same rate"
    ):
        flight(motion=Still(), sensor=[NoisyState(rate=5), SensorFault()])
    pilot, broken = driver(["velocity_x"], 0.0), ActuatorFault(channels="velocity_x")
    with pytest.raises(WiringError, match="no plugin writes channel 'velocity_y' for SingleIntegrator"):
        flight(autonomy=pilot, controller=broken, motion=SingleIntegrator())


def radio_game(n, last=10**6, **radio):
    """Worlds of two entities, of which one sends, at their end."""
    blocks = [talks("a", 0.0, network="FailingRadio", last=last), hears("b", 50.0, network="FailingRadio")]
    mission = Mission(blocks=blocks, networks=[FailingRadio(**radio)], end=1.0, dt=0.1)
    sim = Simulation(mission, seeds=range(1, n + 1))
    return sim, [each.metrics["FailingRadio"] for each in sim.run()]


def test_radios_are_out_in_bursts():
    """The chance that both of two messages arrive is that of Gilbert's model, for two radios that are out half of the time."""
    n, both = 800, (0.5 * (0.5 + 0.5 * np.exp(-2.0 * 0.1))) ** 2
    sim, found = radio_game(n, last=2, failure_rate=1.0, outage=1.0)
    heard = np.array([each["delivered"] for each in found])
    assert is_near(heard.sum(), 0.25, 2 * n)
    assert is_near((heard == 2).sum(), both, n)
    assert n_heard(sim, "b") == heard.sum()
    assert (sum(each["lost_outage"] for each in found)) == 2 * n - heard.sum()


def test_jamming_silences_a_world_for_some_time():
    _, (found,) = radio_game(1, failure_rate=0.0, jam_start=0.35, jam_duration=0.4)
    assert (found["delivered"], found["lost_jammed"]) == (6, 4)
    assert radio_game(1, failure_rate=0.0)[1][0]["delivered"] == 10
    assert radio_game(1, failure_rate=0.0, range=49.0)[1][0]["sent"] == 0


def test_a_radio_does_not_depend_on_who_sends_in_other_worlds():
    """Worlds of a stack send at different times: what is drawn for a world when only others send would change it."""
    blocks = [talks("a", 0.0, network="FailingRadio"), hears("b", 50.0, network="FailingRadio")]
    mission = Mission(blocks=blocks, networks=[FailingRadio(failure_rate=1.0)], end=2.0, dt=0.1)
    with Simulation(mission, [5]) as alone, Simulation(mission, [5, 6]) as stack:
        alone.step(2)
        stack.step(2)
        for sim in (alone, stack):  # in world 0, the sender is gone for some steps: nobody sends there
            sim.write("a.health", [[0.0]] if sim is alone else [[0.0], [1.0]])
        alone.step(5)
        stack.step(5)
        assert alone.state_hash() == stack.state_hash(0)
