"""Channels: who writes what whom reads, and what is said when it does not fit."""

from __future__ import annotations

from math import inf, nan

import numpy as np
import pytest
from small_worlds import VELOCITY, Drift, Wander, alone, block, mission

from tussle import Simulation
from tussle.api import (
    Autonomy,
    Behavior,
    Children,
    Controller,
    Input,
    Interaction,
    Metric,
    Output,
    Param,
    Sensor,
    State,
    service,
)
from tussle.engine.result import WorldResult
from tussle.errors import DeclarationError, ParameterError, PluginError, WiringError
from tussle.stock import (
    DirectController,
    NoisyState,
    SingleIntegratorControllerSimple,
    Still,
    Unicycle,
    UnicyclePID,
)


class Pilot(Autonomy):
    """Wants a heading, an altitude and a speed."""

    desired_heading = Output(unit="rad")
    desired_altitude = Output(unit="m")
    desired_speed = Output(unit="m/s")

    def step(self, g):
        self.desired_speed[:] = 10.0


def test_a_missing_writer_is_told_with_what_is_there_and_what_would_fit():
    with pytest.raises(WiringError) as caught:
        Simulation(mission(block("scouts", autonomy=Pilot(), motion=Unicycle())))
    text = str(caught.value)
    assert text.startswith("block 'scouts': no plugin writes channel 'speed' for Unicycle")
    assert "desired_altitude, desired_heading, desired_speed" in text
    assert text.endswith(": UnicyclePID")


class Looker(Autonomy):
    marks = Output()
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")

    def step(self, g):
        """Do nothing."""


class Reader(Autonomy):
    marks = Input()
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")

    def step(self, g):
        """Do nothing."""


class Steerer(Controller):
    marks = Input()
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")

    def step(self, g):
        """Do nothing."""


@pytest.mark.parametrize(
    ("plugins", "text"),
    [
        (
            {"autonomy": [Looker(), Reader()]},
            "for Reader; .*; Looker writes it, but autonomies read those of sensors",
        ),
        (
            {"autonomy": Looker(), "controller": [Steerer(), Steerer(name="second")]},
            "for second; .*; Looker writes it, but a controller reads those of sensors, and of what stands before it",
        ),
        ({"autonomy": Reader()}, "for Reader; written channels: none$"),
    ],
)
def test_who_writes_a_channel_at_another_place_is_told(plugins, text):
    with pytest.raises(WiringError, match=f"no plugin writes channel 'marks' {text}"):
        Simulation(mission(block(motion=Unicycle(), **plugins)))


def test_a_controller_without_its_input_is_named():
    with pytest.raises(WiringError, match=r"channel 'desired_altitude' for UnicyclePID"):
        Simulation(mission(block(controller=UnicyclePID(), motion=Unicycle())))
    with pytest.raises(WiringError, match="written channels: none"):
        Simulation(mission(block(autonomy=[], motion=Unicycle())))


def test_a_pass_through_that_does_not_pass_what_is_needed():
    with pytest.raises(
        WiringError, match="channel 'speed' for Unicycle through SingleIntegratorControllerSimple"
    ):
        Simulation(mission(block(controller=SingleIntegratorControllerSimple(), motion=Unicycle())))


def test_units_are_checked_at_both_ends():
    class Feet(Autonomy):
        velocity = Output(VELOCITY, unit="m")

        def step(self, g):
            pass

    with pytest.raises(WiringError, match=r"block 'a': Feet.velocity writes channel 'velocity_x' in 'm'"):
        Simulation(mission(block(autonomy=Feet())))

    class Reader(Autonomy):
        level = Input(unit="rad")

        def step(self, g):
            pass

    with pytest.raises(WiringError, match=r"Reader.level reads channel 'level' in 'rad', but .* in 'm'"):
        Simulation(mission(block(autonomy=[Drift(), Reader()], sensor=Gauge())))


class Gauge(Sensor):
    """Measures a level: the number of the step."""

    level = Output(unit="m")

    def step(self, g):
        self.level[:] = g.step_count + 1.0


class Captain(Autonomy):
    """Reads a level, if there is one."""

    level = Input(unit="m", optional=True, default=-7.0)
    seen = State(unit="m")

    def step(self, g):
        self.seen[:] = self.level


def test_a_sensor_is_read_with_its_value_of_the_last_step():
    sim = Simulation(mission(block(autonomy=[Drift(), Captain()], sensor=Gauge())))
    seen = []
    for _ in range(3):
        sim.step()
        seen.append(float(sim.read("a.Captain.seen")[0][0, 0]))
    assert seen == [0.0, 1.0, 2.0]


def test_an_optional_input_stays_at_its_default():
    assert alone(mission(block(autonomy=[Drift(), Captain()])), 1).read("a.Captain.seen")[0].tolist() == [
        [-7.0]
    ]


def test_an_input_that_is_not_optional_must_be_written():
    class Needy(Autonomy):
        level = Input(unit="m")

        def step(self, g):
            pass

    with pytest.raises(WiringError, match="channel 'level' for Needy; written channels: none"):
        Simulation(mission(block(autonomy=[Drift(), Needy()])))


class Nudge(Autonomy):
    """Overwrite the velocity in some steps only."""

    every = Param(2)
    velocity = Output(VELOCITY, unit="m/s")

    def step(self, g):
        rows = g.step_count % self.every == 0
        self.velocity[0, rows] = 5.0


def test_of_several_writers_the_last_wins_and_values_persist():
    class Once(Autonomy):
        velocity = Output(VELOCITY, unit="m/s")

        def step(self, g):
            self.velocity[0, g.step_count == 0] = 3.0

    sim = Simulation(mission(block(autonomy=[Drift(), Nudge(every=3)])))
    speeds = []
    for _ in range(4):
        sim.step()
        speeds.append(float(sim.read("a.vel")[0][0, 0, 0]))
    assert speeds == [5.0, 1.0, 1.0, 5.0]
    assert "block 'a': channel 'velocity_x' is written by Drift, then Nudge; the last wins" in sim.describe()
    assert alone(mission(block(autonomy=[Once()])), 1).read("a.pos")[0][0, 0, 0] == pytest.approx(3.0)


def test_channels_may_be_grouped_otherwise_at_each_end():
    """The writer's columns are (y, x) and z; the model reads (x, y, z): no slice of one table is both."""

    class Sideways(Autonomy):
        plane = Output("velocity_y velocity_x", unit="m/s")
        up = Output("velocity_z", unit="m/s")
        n = State(dtype=int)

        def step(self, g):
            assert np.array_equal(self.plane[0], np.where(g.step_count == 0, 0.0, 2.0))  # its last values
            self.plane[0] = 2.0
            self.plane[1] = 1.0
            self.up[:] = 3.0

    sim = alone(mission(block(count=3, autonomy=Sideways()), end=0.5), 1)
    assert sim.read("a.pos")[0][0].tolist() == [pytest.approx([0.5, 1.0, 1.5])] * 3
    reader = mission(block(count=2, autonomy=Drift(to=(1.0, 2.0, 3.0)), controller=Swap()), end=0.5)
    assert alone(reader, 1).read("a.pos")[0][0, 1].tolist() == pytest.approx([0.5, 1.0, 1.5])


class Swap(Controller):
    """Reads z, x, y and writes them back in another order."""

    wanted = Input("velocity_z velocity_x velocity_y", unit="m/s")
    passed = Output("velocity_y velocity_z velocity_x", unit="m/s")

    def step(self, g):
        z, x, y = self.wanted
        self.passed[0], self.passed[1], self.passed[2] = y, z, x


def test_controllers_stand_in_a_chain():
    class Half(Controller):
        wanted = Input(VELOCITY, unit="m/s")
        velocity = Output(VELOCITY, unit="m/s")

        def step(self, g):
            self.velocity[:] = 0.5 * self.wanted

    sim = alone(
        mission(
            block(
                autonomy=Drift(to=(8.0, 0, 0)), controller=[Half(), DirectController(), Half(name="Second")]
            )
        ),
        1,
    )
    assert sim.read("a.pos")[0][0, 0, 0] == pytest.approx(2.0)


def test_a_pass_through_is_no_call():
    plain = Simulation(mission(block()))
    direct = Simulation(mission(block(controller=DirectController())))
    simple = Simulation(mission(block(controller=SingleIntegratorControllerSimple())))
    assert plain.describe() == direct.describe() == simple.describe()
    assert "DirectController" not in direct.describe()
    plain.run()
    direct.run()
    assert np.array_equal(plain.read("a.pos")[0], direct.read("a.pos")[0])
    working = Simulation(mission(block(controller=Swap()), motion_multiplier=3))
    assert [line for line in working.describe().splitlines() if "Swap" in line] == [
        line
        for line in working.describe().splitlines()
        if line.strip().split(maxsplit=1)[-1].startswith("controller")
    ]
    assert working.describe().count("Swap (") == 3


def test_describe_prints_the_step_and_the_grade():
    game = mission(block(autonomy=[Wander(), Pilot(rate=2.0)], sensor=NoisyState()), name="demo")
    text = Simulation(game).describe()
    order = [
        "autonomy     a: Wander",
        "autonomy     a: Pilot at 2 Hz",
        "motion       a: SingleIntegrator",
        "sensor       a: NoisyState",
        "deliver",
    ]
    assert sorted(order, key=text.index) == order
    assert text.startswith("demo: 1 world(s), dt 0.1 s, update synchronous")
    assert text.endswith("grade: machine")
    assert Simulation(mission(block(autonomy=Wander()))).describe().endswith("grade: portable")


def test_wired_tells_which_outputs_have_a_reader():
    seen = []

    class Chatty(Autonomy):
        velocity = Output(VELOCITY, unit="m/s")
        unheard = Output(unit="m")

        def step(self, g):
            seen.append(self.wired)
            self.unheard[:] = 1.0

    sim = Simulation(mission(block(autonomy=Chatty())))
    sim.step()
    assert seen == [frozenset({"velocity"})]
    assert sim.read("a.Chatty.unheard")[0].tolist() == [[1.0]]


@pytest.mark.parametrize("ask", [lambda w: "unheard" in w, lambda w: not w.isdisjoint(["unheard"])])
def test_an_output_that_is_left_out_cannot_be_read(ask):
    class Thrifty(Autonomy):
        velocity = Output(VELOCITY, unit="m/s")
        unheard = Output(unit="m")

        def step(self, g):
            if ask(self.wired):
                self.unheard[:] = 1.0
            assert "velocity" in self.wired
            assert not self.wired.isdisjoint(["velocity", "unheard"])

    sim = Simulation(mission(block(autonomy=Thrifty())))
    sim.step()
    assert sim.read("a.Thrifty.velocity")[1].all()
    with pytest.raises(ParameterError, match=r"'a.Thrifty.unheard' is not computed: Thrifty leaves out"):
        sim.read("a.Thrifty.unheard")


# -- belief -----------------------------------------------------------------------------------------------------------------------


class Shifted(Sensor):
    """Believes to be 100 m further East, and to fly North."""

    belief_pos = Output("bx by bz", unit="m")
    belief_vel = Output("ba bb bc", unit="m/s")
    belief_quat = Output("qw qx qy qz")

    def step(self, g):
        self.belief_pos[:] = g.pos
        self.belief_pos[0] += 100.0
        self.belief_vel[:] = np.array([[0.0], [9.0], [0.0]])
        self.belief_quat[:] = np.sqrt(0.5) * np.array([[1.0], [0.0], [0.0], [1.0]])


class Look(Autonomy):
    me_x = State()
    me_yaw = State()
    me_vy = State()
    other_x = State(default=-1.0)

    def step(self, g):
        self.me_x[:] = g.pos[0]
        self.me_yaw[:] = g.yaw
        self.me_vy[:] = g.vel[1]
        near = g.near(1e9)
        self.other_x[near.row] = near.pos[0]


class Truth(Metric):
    x = State(per="entity")

    def step(self, w):
        self.x[:] = w.pos[0]


def test_autonomies_and_controllers_see_the_belief_and_everybody_else_the_truth():
    class Feel(Controller):
        wanted = Input(VELOCITY, unit="m/s")
        velocity = Output(VELOCITY, unit="m/s")
        x = State()

        def step(self, g):
            self.x[:] = g.pos[0]
            self.velocity[:] = self.wanted

    sim = Simulation(
        mission(
            block("a", autonomy=[Drift(), Look()], controller=Feel(), sensor=Shifted()),
            block("b", autonomy=[Drift(), Look()]),
        )
    )
    sim.step()
    # Before the sensor's first call the belief is the truth of the placement.
    assert sim.read("a.Look.me_x")[0].tolist() == [[0.0]]
    assert sim.read("a.Look.me_yaw")[0].tolist() == [[0.0]]
    sim.step()
    assert sim.read("a.pos")[0][0, 0, 0] == pytest.approx(0.2)
    assert sim.read("a.Look.me_x")[0][0, 0] == pytest.approx(100.1)
    assert sim.read("a.Look.me_vy")[0][0, 0] == 9.0
    assert sim.read("a.Look.me_yaw")[0][0, 0] == pytest.approx(np.pi / 2)
    assert sim.read("a.Feel.x")[0][0, 0] == pytest.approx(100.1)
    assert sim.read("b.Look.other_x")[0][0, 0] == pytest.approx(0.1)
    assert sim.read("b.Look.me_x")[0][0, 0] == pytest.approx(0.1)


def test_neighbours_are_sought_from_where_one_believes_to_be():
    class Near(Autonomy):
        n = State(dtype=int)

        def step(self, g):
            self.n[:] = g.near(5.0).count

    sim = Simulation(
        mission(
            block("a", autonomy=[Drift(to=(0, 0, 0)), Near()], sensor=Shifted()),
            block("b", position=(102, 0, 0), autonomy=Drift(to=(0, 0, 0))),
        )
    )
    sim.step(2)
    assert sim.read("a.Near.n")[0].tolist() == [[1]]


def test_a_belief_of_another_size_is_refused():
    class Flat(Sensor):
        belief_pos = Output("bx by", unit="m")

        def step(self, g):
            pass

    with pytest.raises(WiringError, match=r"Flat\.belief_pos has 2 channels.* 3"):
        Simulation(mission(block(sensor=Flat())))


# -- plugins inside plugins -----------------------------------------------------------------------------------------------------


class Push(Behavior):
    """Wish a constant."""

    to = Param((1.0, 0.0, 0.0), fields="x y z", unit="m/s")
    n = State(dtype=int)

    def step(self, g):
        self.n[:] += 1
        self.desired_velocity[:] = self.to * g.call("factor")


class Sum(Autonomy):
    """Adds up what its parts wish."""

    parts = Children(Behavior)
    velocity = Output(VELOCITY, unit="m/s")

    def step(self, g):
        self.velocity[:] = 0.0
        for part in self.parts:
            part.step(g)
            self.velocity += part.gain * part.desired_velocity

    @service
    def factor(self, g):
        return 2.0


def test_children_have_columns_and_channels_of_their_own():
    parts = [Push(gain=1.0), Push(to=(0, 3, 0), gain=0.5, name="North"), Push(to=(0, 0, 1), name="Up")]
    sim = Simulation(
        mission(block(count=2, autonomy=Sum(parts=parts))),
        seeds=[1, 2],
        params={"a.Sum.North.gain": [0.5, 1.0]},
    )
    sim.run()
    assert sim.read("a.vel")[0].tolist() == [[[2.0, 3.0, 2.0]] * 2, [[2.0, 6.0, 2.0]] * 2]
    assert sim.read("a.Sum.North.desired_velocity")[0][0, 0].tolist() == [0.0, 6.0, 0.0]
    assert sim.read("a.Sum.Up.n")[0].tolist() == [[10, 10], [10, 10]]


def test_children_of_the_wrong_kind_or_of_one_name_are_refused():
    with pytest.raises(ParameterError, match=r"Sum.parts: Drift\(\) is no Behavior"):
        Sum(parts=[Drift()])
    with pytest.raises(ParameterError, match=r"Sum.parts: two plugins are called 'Push'"):
        Sum(parts=[Push(), Push()])


def test_a_child_with_an_input_is_refused():
    class Needy(Behavior):
        level = Input(unit="m")

        def step(self, g):
            pass

    with pytest.raises(WiringError, match=r"Sum\.Needy\.level: .*'level'"):
        Simulation(mission(block(autonomy=Sum(parts=[Needy()]))))


def test_world_plugins_have_no_channels():
    class Judge(Interaction):
        speed = Output(unit="m/s")

    with pytest.raises(DeclarationError, match=r"Judge.speed: a world plugin has no Output columns"):
        Simulation(mission(interactions=[Judge()]))


def test_columns_of_teams_and_worlds_for_world_plugins():
    class Score(Metric):
        points = State(dtype=int, per="team")
        pair = State("a b", per="world")

        def step(self, w):
            np.add.at(self.points, (w.team_numbers(w.team), w.world), 1)
            self.pair[0] += w.t

        def result(self, w):
            return {"score": 1.0 * self.points}

    game = mission(block("a", team=7, count=2), block("b", team=3), metrics=[Score()])
    sim = Simulation(game, seeds=[1, 2])
    results = sim.run()
    assert results[1].scores == {3: 10.0, 7: 20.0}
    assert results[1].winner == 7
    assert sim.read("Score.points")[0].tolist() == [[10, 20], [10, 20]]
    assert sim.read("Score.pair")[0].shape == (2, 2)
    sim.reset([0])
    assert sim.read("Score.points")[0].tolist() == [[0, 0], [10, 20]]


@pytest.mark.parametrize("wrong", [0, 4, 8, -1, np.array([3, 5, 7]), np.array([2**40])])
def test_rows_of_teams_that_the_mission_does_not_have_are_refused(wrong):
    class Asks(Metric):
        def step(self, w):
            assert w.team_numbers(7) == 1
            assert w.team_numbers([7, 3, 7]).tolist() == [1, 0, 1]
            assert w.team_numbers(w.team[:0]).tolist() == []
            w.team_numbers(wrong)

    sim = Simulation(mission(block("a", team=7), block("b", team=3), metrics=[Asks()]))
    with pytest.raises(
        PluginError, match=r"w.team_numbers: team = \S+ is not allowed; the mission has teams 3, 7"
    ):
        sim.run()


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("east", lambda w: w.pos[0], r"Odd.result: 'east' has the shape \(10,\); it takes \(2,\), one per world or \(2, 2\)"),
        ("n", lambda w: w.n, r"'n' has the shape \(\)"),
        ("score", lambda w: np.zeros(w.n_worlds), r"'score' has the shape \(2,\); it takes \(2, 2\), one per team and world"),
        ("lists", lambda w: [[1], [1, 2]], r"Odd.result: 'lists' = \[1\] is not allowed; it takes numbers"),
        ("texts", lambda w: np.array(["a", "b"]), r"'texts' = .*'a'\)? is not allowed; it takes numbers"),
        ("complex", lambda w: np.array([1j, 2.0]), r"'complex' = .*1j\)? is not allowed"),
        ("objects", lambda w: [None, {}], r"'objects' = None is not allowed"),
        ("dates", lambda w: np.array(["2020-01-01"] * 2, "M8[D]"), r"'dates' = .*2020-01-01'\)? is not allowed"),
        ("large", lambda w: [10**400, 1], r"'large' is a whole number of 1,329 bits"),
        (7, lambda w: np.zeros(2), r"Odd.result: 7 is not a name; it takes a text"),
        (None, lambda w: None, r"Odd.result returns None; it takes a dict"),
    ],
)  # fmt: skip
def test_a_result_has_one_value_per_world_or_team(name, value, text):
    class Odd(Metric):
        def result(self, w):
            return {name: value(w)} if name else value(w)

    game = mission(block("a", team=7, count=2), block("b", team=3, count=3), metrics=[Odd()])
    with pytest.raises(PluginError, match=text):
        Simulation(game, seeds=[1, 2]).run()


@pytest.mark.parametrize(
    ("scores", "winner"),
    [({1: nan, 2: 5.0}, None), ({1: 5.0, 2: nan}, None), ({1: -inf, 2: inf}, 2), ({1: inf, 2: inf}, None), ({4: 0.0}, 4), ({4: nan}, None)],
)  # fmt: skip
def test_nobody_wins_against_a_score_that_is_no_number(scores, winner):
    assert WorldResult(0, 1, "time", 1, 0.1, {}, scores=scores).winner == winner


def test_a_model_with_a_switched_off_input_reads_the_other_one():
    class Climber(Autonomy):
        speed = Output(unit="m/s")
        turn_rate = Output(unit="rad/s")
        velocity_z = Output(unit="m/s")

        def step(self, g):
            self.speed[:] = 1.0
            self.velocity_z[:] = 2.0

    level = Unicycle(use_pitch=False, vel_max=9.0, velocity_z_max=9.0)
    assert alone(mission(block(autonomy=Climber(), motion=level)), 1).read("a.pos")[0][
        0, 0
    ].tolist() == pytest.approx([1.0, 0.0, 2.0])
    with pytest.raises(WiringError, match="no plugin writes channel 'pitch_rate' for Unicycle"):
        Simulation(mission(block(autonomy=Climber(), motion=Unicycle())))


def test_forces_are_summed_by_interactions_and_consumed_by_the_motion_model():
    from tussle.api import MotionModel

    class Ball(MotionModel):
        x = State("x y z vx vy vz", unit="m m m m/s m/s m/s")

        @staticmethod
        def derivative(vx, vy, vz, force_x, force_y, force_z, mass):
            return vx, vy, vz, force_x / mass, force_y / mass, force_z / mass

        def from_body(self, body, rows):
            self.x[:3, rows] = body.pos[:, rows]
            self.x[3:, rows] = body.vel[:, rows]

        def to_body(self, body):
            body.pos[:] = self.x[:3]
            body.vel[:] = self.x[3:]

    class Gravity(Interaction):
        g = Param(-9.81)

        def step(self, w):
            w.bodies.force[2] += self.g[w.world] * w.mass

    game = mission(
        block(autonomy=[], motion=Ball(), mass=4.0),
        interactions=[Gravity(), Gravity(g=1.81, name="Buoyancy")],
        end=1.0,
    )
    sim = alone(game, 1)
    # The first step is free of force, since interactions come after motion; nine steps at -8 m/s^2.
    assert sim.read("a.vel")[0][0, 0].tolist() == pytest.approx([0.0, 0.0, -8.0 * 0.9])


@pytest.mark.parametrize("worlds", [[0, 1], [1]], ids=["together", "with different clocks"])
def test_forces_and_torques_last_until_the_next_step(worlds):
    """In every way to write them: by an interaction, by one with a rate in some worlds only, and from outside."""

    class Push(Interaction):
        at = State(dtype=int, per="world")

        def start(self, w):
            self.at[:] = 0

        def step(self, w):
            self.at += 1
            w.bodies.force[0] += self.at[w.world] == 2
            w.bodies.torque[1] += self.at[w.world] == 2

    pushes = [Push(name="every"), Push(name="slow", rate=5.0)]
    sim = Simulation(mission(block(autonomy=[], motion=Still()), interactions=pushes, end=2.0), [1, 2])
    sim.step(3)
    sim.reset(worlds)
    found = []
    for _ in range(6):
        sim.step(1)
        found.append({name: tuple(sim.read(name)[0][1, 0, :2]) for name in ("a.force", "a.torque")})
    forces, torques = ([each[name] for each in found] for name in ("a.force", "a.torque"))
    pushed = [0.0, 1.0, 1.0, 0.0, 0.0, 0.0]  # `slow` is called second in the third step
    assert [force[0] for force in forces] == pushed
    assert [torque[1] for torque in torques] == pushed
    sim.write("a.force", 3.0)
    assert sim.read("a.force")[0].any()
    sim.step(1)
    assert not sim.read("a.force")[0].any()
