"""Time: when plugins with a rate are due, the dt of each call, and the t of what each kind of plugin sees."""

from __future__ import annotations

import numpy as np
import pytest
from small_worlds import VELOCITY, Drift, Note, Talker, block, mission

from tussle import Simulation
from tussle.api import (
    EVERYONE,
    Autonomy,
    Controller,
    EasyAutonomy,
    Handle,
    Input,
    Interaction,
    Metric,
    MotionModel,
    Network,
    Output,
    Sensor,
    State,
    Subscribe,
)
from tussle.errors import MissionError, ParameterError
from tussle.stock import AvoidEntityMS, MotorSchemas, SingleIntegrator, SphereNetwork, Unicycle, UnicyclePID


class Counter(Autonomy):
    """Counts its calls; remembers the last step, its t and dt, and the sum of all dt."""

    n = State(dtype=int)
    last = State(dtype=int, default=-1)
    when = State(unit="s", default=-1.0)
    since = State(unit="s")
    total = State(unit="s")

    def step(self, g):
        self.n[:] += 1
        self.last[:] = g.step_count
        self.when[:] = g.t
        self.since[:] = g.dt
        self.total[:] += g.dt


class Tally(Metric):
    """The same for worlds."""

    n = State(dtype=int, per="world")
    since = State(unit="s", per="world")

    def step(self, w):
        there = np.isin(np.arange(w.n_worlds), w.world)
        self.n[there] += 1
        self.since[there] = w.dt


class Watch(Controller):
    """Hands a velocity on; remembers t and dt of its calls in a step."""

    wanted = Input(VELOCITY, unit="m/s")
    velocity = Output(VELOCITY, unit="m/s")
    n = State(dtype=int)
    when = State("a b c d", unit="s", default=-1.0)
    since = State("a b c d", unit="s")

    def step(self, g):
        self.velocity[:] = self.wanted
        self.when[g.substep] = g.t
        self.since[g.substep] = g.dt
        self.n[:] += 1


def calls(sim, n):
    """Step and dt of each call of a's Counter in world 0 within n steps."""
    found = []
    for step in range(n):
        sim.step()
        if sim.read("a.Counter.last")[0][0, 0] == step:
            found.append((step, float(sim.read("a.Counter.since")[0][0, 0])))
    return found


def counted(rate, **values):
    return Simulation(
        mission(block(autonomy=[Drift(), Counter(rate=rate)]), metrics=[Tally(rate=rate)], **values)
    )


def test_time_is_computed_not_accumulated():
    sim = Simulation(mission(block(), dt=0.1, start=5.0, end=1e9))
    sim.step(2000)
    assert sim.t[0] == 5.0 + 2000 * 0.1
    total = 5.0
    for _ in range(2000):
        total += 0.1
    assert sim.t[0] != total


# -- rates ----------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rate", "due"),
    [
        (None, list(range(12))),
        (10.0, list(range(12))),
        (5.0, [0, 2, 4, 6, 8, 10]),
        (2.5, [0, 4, 8]),
        (3.0, [0, 4, 7, 10]),  # floor(3 k / 10) changes
        (7.0, [0, 2, 3, 5, 6, 8, 9, 10]),
        (0.1, [0]),
    ],
)
def test_due_rule_and_dt(rate, due):
    sim = counted(rate, end=1.2)
    found = calls(sim, 12)
    assert [step for step, _ in found] == due
    first = 0.1 * int(10.0 / (rate or 10.0) + 1e-9)  # of the first call, the whole steps in a period
    assert [dt for _, dt in found] == pytest.approx([first, *(0.1 * np.diff(due))])
    assert sim.read("Tally.n")[0].tolist() == [len(due)]
    assert sim.read("Tally.since")[0].tolist() == pytest.approx([found[-1][1]])


@pytest.mark.parametrize(
    ("rate", "dt", "every"),
    [(10.0, 1 / 120, 12), (1 / 30, 1 / 60, 1800), (100.0, 1 / 300, 3), (1 / 3, 1 / 3, 9)],
)
def test_rates_that_neither_decimals_nor_floats_hold_are_kept_to_the_step(rate, dt, every):
    sim = counted(rate, dt=dt, end=1e9)
    found = calls(sim, 2 * every + 2)
    assert [step for step, _ in found] == [0, every, 2 * every]
    assert [since for _, since in found] == pytest.approx([every * dt] * 3)


def test_calls_after_ten_thousand_steps():
    sim = counted(0.7, end=1000.0)
    sim.step(10_000)
    assert sim.read("a.Counter.n")[0][0, 0] == 700
    assert sim.read("a.Counter.total")[0][0, 0] == pytest.approx(1000.0, abs=0.7)  # the last step is not due


def test_worlds_at_other_phases_of_a_rate_get_the_dt_of_their_own():
    """3 Hz under 0.1 s: gaps of four, three and three steps. Worlds 0 and 2 are due together, once with the same dt and once not."""
    sim = Simulation(
        mission(block(autonomy=[Drift(), Counter(rate=3.0)]), metrics=[Tally(rate=3.0)], end=50.0),
        seeds=[1, 2, 3],
    )
    lone = counted(3.0, end=50.0)
    expected = dict(calls(lone, 30))
    sim.step(3)
    sim.reset([1])
    sim.step(3)
    sim.reset([2])
    for _ in range(15):
        before = sim.steps
        sim.step()
        last, since = sim.read("a.Counter.last")[0][:, 0], sim.read("a.Counter.since")[0][:, 0]
        tally = sim.read("Tally.since")[0]
        for world, step in enumerate(before):
            if step in expected:
                assert (last[world], since[world], tally[world]) == (step, expected[step], expected[step])
            else:
                assert last[world] < step
    assert sim.steps.tolist() == [21, 18, 15]
    assert sim.read("a.Counter.n")[0][:, 0].tolist() == [7, 6, 5]
    assert sim.read("Tally.n")[0].tolist() == [7, 6, 5]


@pytest.mark.parametrize(
    ("rate", "due"),
    [
        (None, dict.fromkeys(range(12), 1)),
        (40.0, dict.fromkeys(range(12), 1)),
        (20.0, dict.fromkeys(range(0, 12, 2), 2)),
        (16.0, {0: 2, 3: 3, 5: 2, 8: 3, 10: 2}),
        (10.0, {0: 4, 4: 4, 8: 4}),
        (5.0, {0: 8, 8: 8}),
    ],
)
def test_a_controller_is_due_on_the_grid_of_substeps(rate, due):
    sim = Simulation(mission(block(controller=Watch(rate=rate)), motion_multiplier=4))
    seen = {}
    for step in range(3):
        sim.write("a.Watch.when", -1.0)
        sim.step()
        when, since = sim.read("a.Watch.when")[0][0, 0], sim.read("a.Watch.since")[0][0, 0]
        for s in np.flatnonzero(when >= 0.0):
            assert when[s] == pytest.approx(0.1 * step + 0.025 * s)
            seen[4 * step + int(s)] = since[s] / 0.025
    assert seen == pytest.approx(due)
    assert sim.read("a.pos")[0][0, 0, 0] == pytest.approx(0.3)  # what it wrote last holds in between


def test_a_pid_with_a_rate_integrates_over_its_period():
    class Ahead(Autonomy):
        altitude = Output("desired_altitude", unit="m")
        speed = Output("desired_speed", unit="m/s")
        heading = Output("desired_heading", unit="rad")

        def step(self, g):
            self.heading[:] = 0.5

    for rate in (None, 10.0):
        motion = Unicycle(turn_rate_max=0.0)  # the error stays
        game = mission(
            block(autonomy=Ahead(), controller=UnicyclePID(rate=rate), motion=motion), dt=0.01, end=9.0
        )
        sim = Simulation(game)
        sim.step(100)
        assert sim.read("a.UnicyclePID.heading")[0][0, 0, 0] == pytest.approx(0.5)


def test_easy_mode_has_the_dt_of_its_period():
    class Easy(EasyAutonomy):
        total = State(unit="s")

        def step_one(self, me):
            me.total = me.total + me.dt

    sim = Simulation(mission(block(autonomy=[Drift(), Easy(rate=5.0)])))
    sim.run()
    assert sim.read("a.Easy.total")[0].tolist() == [[pytest.approx(1.0)]]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: mission(block(autonomy=[Drift(), Counter(rate=10.5)])),
            r"block 'a': Counter: rate = 10.5 Hz.*10 Hz",
        ),
        (lambda: mission(block(sensor=Blank(rate=11.0))), r"block 'a': Blank: rate = 11.0 Hz.*10 Hz"),
        (
            lambda: mission(block(controller=Watch(rate=41.0)), motion_multiplier=4),
            r"Watch: rate = 41.0 Hz is too high",
        ),
        (lambda: mission(metrics=[Tally(rate=50)]), r"mission: Tally: rate = 50.0 Hz is too high.*10 Hz"),
        (
            lambda: mission(metrics=[Tally(rate=1e30)], dt=10, end=20),
            r"rate = 1e\+30 Hz is too high.*0.1 Hz",
        ),
        (lambda: mission(metrics=[Tally(rate=1e-6)]), r"is too low; .* 1e-05 Hz"),
        (
            lambda: mission(block(motion=SingleIntegrator(rate=5.0))),
            r"block 'a': SingleIntegrator has rate = 5.0, but it is integrated over every step",
        ),
        (lambda: mission(networks=[SphereNetwork(rate=5.0)]), r"mission: SphereNetwork has rate = 5.0"),
        (
            lambda: MotorSchemas(behaviors=[AvoidEntityMS(rate=5.0)]),
            r"MotorSchemas.behaviors: AvoidEntityMS\(rate=5.0\) .* rate of MotorSchemas",
        ),
    ],
)
def test_rates_that_cannot_be_honoured_are_refused_when_the_mission_is_built(make, message):
    with pytest.raises((MissionError, ParameterError), match=message):
        make()


def test_a_shorter_step_honours_a_higher_rate():
    slow = mission(metrics=[Tally(rate=10.0)])
    with pytest.raises(MissionError, match=r"is too high; .* 5 Hz"):
        slow.replace(dt=0.2)
    assert slow.replace(dt=0.05).metrics == slow.metrics


# -- t --------------------------------------------------------------------------------------------------------------------------


class Blank(Sensor):
    seen = Output()
    when = State(unit="s", default=-1.0)

    def step(self, g):
        self.when[:] = g.t


class Times(dict):
    """Who was called -> times of world 0 that it saw, in order; shared by the plugins below, for one test."""

    def note(self, who, t):
        self.setdefault(who, []).append(round(float(t[0]) / 0.025, 6))  # [quarters of a step]


@pytest.fixture
def seen(monkeypatch):
    """Missions of one entity with a plugin of each kind: what each saw."""
    times = Times()
    for kind, hooks in KINDS.items():
        for hook, view_at in hooks.items():
            own = kind.__dict__[hook]

            def noted(self, *args, own=own, name=f"{kind.__name__}.{hook}", view_at=view_at):
                times.note(name, args[view_at].t)
                return own(self, *args)

            monkeypatch.setattr(kind, hook, noted)
    return times


class Think(Autonomy):
    notes = Subscribe(Note, network="Carrier")
    link = Handle()

    def open_one(self, row):
        return row.dt

    def spawn(self, g, rows):
        pass

    def ready(self, g):
        return True

    def step(self, g):
        pass


class Steer(Controller):
    wanted = Input(VELOCITY, unit="m/s")
    velocity = Output(VELOCITY, unit="m/s")

    def step(self, g):
        self.velocity[:] = self.wanted


class Move(MotionModel):
    x = State("x y z", unit="m")
    velocity = Input(VELOCITY, unit="m/s")

    @staticmethod
    def derivative(velocity_x, velocity_y, velocity_z):
        return velocity_x, velocity_y, velocity_z

    def from_body(self, body, rows):
        self.x[:, rows] = body.pos[:, rows]

    def to_body(self, body):
        body.pos[:] = self.x


class Feel(Sensor):
    felt = Output()

    def spawn(self, g, rows):
        pass

    def step(self, g):
        pass


class Judge(Interaction):
    def rejects(self, w, world, pos, taken):
        return False

    def start(self, w):
        pass

    def step(self, w):
        w.move(w.id == 1, pos=w.pos[:, w.id == 1])

    def result(self, w):
        return {}


class Count(Metric):
    def step(self, w):
        pass


class Carrier(Network):
    def route(self, w, messages):
        return EVERYONE


KINDS = {
    Think: {"spawn": 0, "ready": 0, "step": 0},
    Steer: {"step": 0},
    Move: {"from_body": 0, "to_body": 0},
    Feel: {"spawn": 0, "step": 0},
    Judge: {"rejects": 0, "start": 0, "step": 0, "result": 0},
    Count: {"step": 0},
    Carrier: {"route": 0},
}
EXPECTED = {
    "Think.spawn": [0],
    "Think.ready": [0, 4, 8],
    "Think.step": [0, 4, 8],
    "Steer.step": [0, 2, 4, 6, 8, 10],
    "Move.from_body": [0, 4, 8, 12],  # as it is placed; and of where the judge has moved it
    "Move.to_body": [0, 2, 4, 6, 8, 10],  # what it sees before it writes
    "Feel.spawn": [0],
    "Feel.step": [4, 8, 12],
    "Judge.rejects": [0],
    "Judge.start": [0],
    "Judge.step": [4, 8, 12],
    "Judge.result": [12],
    "Count.step": [4, 8, 12],
    "Carrier.route": [4, 8, 12],
}


def test_t_is_the_time_of_what_a_plugin_sees_also_after_a_reset(seen):
    everything = mission(
        block(
            autonomy=[Drift(), Think(), Talker(network="Carrier")],
            controller=Steer(),
            motion=Move(),
            sensor=Feel(),
        ),
        interactions=[Judge()],
        metrics=[Count()],
        networks=[Carrier()],
        motion_multiplier=2,
        end=0.3,
    )
    sim = Simulation(everything)
    sim.run()
    assert seen == EXPECTED
    seen.clear()
    sim.reset([0])
    sim.run()
    assert seen == EXPECTED


def test_the_end_of_a_step_is_exactly_the_beginning_of_the_next():
    sim = Simulation(
        mission(block(autonomy=[Drift(), Counter()], sensor=Blank()), start=2.0, dt=0.3, end=900.0)
    )
    for _ in range(1000):
        sim.step()
        assert sim.read("a.Blank.when")[0][0, 0] == sim.t[0]
    ended = sim.t[0]
    sim.step()
    assert sim.read("a.Counter.when")[0][0, 0] == ended


def test_what_is_born_late_is_told_the_length_of_a_step_and_the_time():
    """Not what the plugin that was called last before it had, be it one with a rate or one that sees the step's end."""

    class Late(Autonomy):
        link = Handle()
        born = State("t dt", unit="s")

        def open_one(self, row):
            return row.dt

        def spawn(self, g, rows):
            self.born[:, rows] = np.array([g.t[rows], [self.link[r] for r in rows]])

        def step(self, g):
            pass

    late = block(rate=5.0, count=3, autonomy=[Drift(), Late(), Counter(rate=2.0)], sensor=Blank())
    sim = Simulation(mission(late))
    sim.step(6)
    assert sim.read("a.Late.born")[0][0] == pytest.approx(np.array([[0.0, 0.1], [0.2, 0.1], [0.4, 0.1]]))
