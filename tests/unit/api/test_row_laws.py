"""Row laws: what an author writes, when it runs in one kernel with the motion model, and what is refused."""

import math

import numpy as np
import pytest
from small_worlds import block

from tussle import Mission, Simulation
from tussle.api import Autonomy, Controller, EntityRef, Input, MotionModel, Output, Param, State, row_law
from tussle.errors import DeclarationError, PluginError
from tussle.numeric.kernel import device
from tussle.numeric.quaternion import quat_from_euler
from tussle.plugins.stock.motion.unicycle.kernels import attitude
from tussle.stock import (
    NoisyState,
    SimpleAircraft,
    SimpleAircraftControllerPID,
    Still,
    Unicycle,
    Unicycle3D,
    UnicyclePID,
)

PLANS = "desired_heading desired_altitude desired_speed"


class Plan(Autonomy):
    """Another heading and altitude for every entity."""

    wanted = Output(PLANS, unit="rad m m/s")
    slope = Output("desired_roll desired_glide_slope", unit="rad")

    def step(self, g):
        self.wanted[:] = np.array([0.7 * g.id, 30.0 * g.id, 20.0 + 0.0 * g.id])
        self.slope[:] = np.array([0.01 * g.id, 0.02 * g.id])


class Steer(Controller):
    """Proportional laws with a memory, one of which nobody reads."""

    gains = Param((0.5, 0.2), fields="turn rise", unit="1/s 1/s")
    flips = Param(False, structural=True)
    desired_heading = Input(unit="rad")
    desired_speed = Input(unit="m/s")
    desired_altitude = Input(unit="m")
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")
    unread = Output(unit="m")
    calls = State("n total")
    lost = State()

    @row_law("speed", "turn_rate", "pitch_rate", "calls")
    @staticmethod
    def steer(
        desired_speed,
        desired_heading,
        desired_altitude,
        yaw,
        climb,
        pos_z,
        gains,
        gains_turn,
        calls,
        flips,
        dt,
    ):
        n, total = calls
        turn = gains_turn * (desired_heading - yaw)
        aim = gains[1] * ((desired_altitude - pos_z) / desired_speed - climb)
        return desired_speed, -turn if flips else turn, aim, (n + 1.0, total + dt)

    @row_law("unread", "lost")
    @staticmethod
    def nobody(pos_z, lost):
        return pos_z, lost + 1.0


def game(controller, motion=None, n=5, **values):
    own = {k: values.pop(k) for k in ("sensor",) if k in values}
    flyer = block(
        count=n, variance=(100.0, 100.0, 4.0), heading_variance=1.0, autonomy=Plan(), controller=controller,
        motion=motion or Unicycle(vel_max=30.0, turn_rate_max=2.0, pitch_rate_max=3.0), **own,
    )  # fmt: skip
    return Mission(blocks=[flyer], dt=0.1, end=9.0, **{"motion_multiplier": 4, **values})


def flown(mission, steps=30, by_substep=False, **options):
    sim = Simulation(mission, on_error="raise", **options)
    if by_substep:
        sim.state.by_substep = True
        sim.state.population.on_new_group()
    sim.step(steps)
    return sim


def calls(sim):
    return [call.label for call in sim.schedule if "control" in call.label or "motion" in call.label]


def test_a_law_is_its_function_called_for_each_row_and_substep():
    sim = flown(game(Steer(), motion_multiplier=1), steps=1)
    reference = Simulation(game(Steer(), motion_multiplier=1))
    body = reference.state.population.bodies.view
    for i in range(5):
        expected = Steer.steer.function(
            20.0, 0.7 * (i + 1), 30.0 * (i + 1), body.yaw[i], body.climb[i], body.pos[2, i], (0.5, 0.2), 0.5, (0.0, 0.0), False, 0.1
        )  # fmt: skip
        for k, name in enumerate(("speed", "turn_rate", "pitch_rate")):
            assert sim.read(f"a.Steer.{name}")[0][0, i] == expected[k]
    twice = flown(game(Steer()), steps=3)
    np.testing.assert_allclose(twice.read("a.Steer.calls")[0][0], [[12.0, 0.3]] * 5)


def test_a_law_whose_outputs_nobody_reads_does_not_run():
    for by_substep in (False, True):
        sim = flown(game(Steer()), by_substep=by_substep)
        assert not sim.read("a.Steer.lost")[0].any()
    assert not flown(game(UnicyclePID())).read("a.UnicyclePID.bank")[0].any()
    rolling = Unicycle3D(speed_max=30.0)
    assert flown(game(UnicyclePID(), rolling)).read("a.UnicyclePID.bank")[0].any()


def test_a_structural_parameter_is_a_constant_of_the_law():
    ahead, flipped = (flown(game(Steer(flips=flips)), 1).read("a.yaw")[0] for flips in (False, True))
    start = flown(game(Steer()), 0).read("a.yaw")[0]
    np.testing.assert_allclose(flipped - start, start - ahead, rtol=0.2)


class Level(Steer):
    """For a unicycle whose pitch is held."""

    velocity_z = Output(unit="m/s")

    @row_law("velocity_z")
    @staticmethod
    def rise(desired_altitude, pos_z):
        return 0.1 * (desired_altitude - pos_z)


LIMITED = {"vel_max": 30.0, "turn_rate_max": 2.0, "pitch_rate_max": 3.0}
PAIRS = {
    "pitched": (UnicyclePID(), Unicycle(**LIMITED)),
    "banked": (UnicyclePID(), Unicycle(**LIMITED, enable_roll=True)),
    "level": (Level(), Unicycle(**LIMITED, use_pitch=False, velocity_z_max=1.0)),
    "own": (Steer(), Unicycle(**LIMITED)),
    "aircraft": (SimpleAircraftControllerPID(), SimpleAircraft()),
    "gliding": (SimpleAircraftControllerPID(use_roll=True, use_glide_slope=True), SimpleAircraft()),
}


@pytest.mark.parametrize("update", ["synchronous", "sequential"])
@pytest.mark.parametrize("name", PAIRS)
def test_one_kernel_over_all_substeps_flies_what_the_substeps_by_themselves_do(name, update):
    mission = game(*PAIRS[name], update=update)
    one, many = flown(mission), flown(mission, by_substep=True)
    assert len(calls(one)) == (1 if update == "synchronous" else 5)
    assert len(calls(many)) == 8 * len(calls(one))
    for column in ("pos", "vel", "quat", "omega", f"{PAIRS[name][0].instance_name}.pitch_rate"):
        np.testing.assert_allclose(one.read(f"a.{column}")[0], many.read(f"a.{column}")[0], atol=1e-10)


def test_what_the_entity_believes_is_held_over_the_substeps():
    believing = game(UnicyclePID(), sensor=NoisyState(pos_noise_2=(3.0, 1.0), orient_noise_2=(0.2, 0.1)))
    one, many = flown(believing), flown(believing, by_substep=True)
    assert len(calls(one)) == 1
    assert one.read("a.pos")[0].tobytes() == many.read("a.pos")[0].tobytes()
    assert np.abs(one.read("a.pos")[0] - flown(game(UnicyclePID())).read("a.pos")[0]).max() > 0.1


def test_controllers_in_a_chain_are_one_kernel_too():
    class Reverse(Controller):
        heading = Input("desired_heading", unit="rad")
        rest = Input("desired_altitude desired_speed", unit="m m/s")
        back = Output("desired_heading", unit="rad")
        handed = Output("desired_altitude desired_speed", unit="m m/s")

        @row_law("back", "handed")
        @staticmethod
        def turn_round(desired_heading, rest):
            return (desired_heading + math.pi,), rest

    mission = game([Reverse(), UnicyclePID()])
    one, many = flown(mission), flown(mission, by_substep=True)
    assert calls(one) == ["control, move a: Reverse, UnicyclePID, Unicycle, 4 substeps in one"]
    np.testing.assert_allclose(one.read("a.pos")[0], many.read("a.pos")[0], atol=1e-10)
    assert np.abs(one.read("a.pos")[0] - flown(game(UnicyclePID())).read("a.pos")[0]).max() > 10.0


class Stepping(Steer):
    """The same as a step of all rows, in NumPy."""

    def step(self, g):
        self.calls[:] += np.array([[1.0], [g.dt]])
        self.speed[:] = self.desired_speed
        self.turn_rate[:] = self.gains[0] * (self.desired_heading - g.yaw)
        aim = (self.desired_altitude - g.pos[2]) / self.desired_speed
        self.pitch_rate[:] = self.gains[1] * (aim - g.climb)


@pytest.mark.parametrize(
    ("controller", "motion"),
    [(Steer(rate=20.0), None), (Stepping(), None), (UnicyclePID(), Unicycle3D(speed_max=30.0))],
    ids=["rate", "step", "model"],
)
def test_what_cannot_be_one_kernel_goes_substep_by_substep(controller, motion):
    sim = flown(game(controller, motion), 5)
    assert len(calls(sim)) == 8
    assert np.isfinite(sim.read("a.pos")[0]).all()


def test_a_step_of_all_rows_beside_it_sees_every_substep():
    mission = game(Steer())
    both = mission.replace(
        blocks=[*mission.blocks, block("b", autonomy=Plan(), controller=Stepping(), motion=Unicycle())]
    )
    assert len(calls(Simulation(both))) == 16


def test_neither_threads_nor_stacks_change_a_bit():
    mission = game(UnicyclePID(), n=9000)
    one, many = (flown(mission, 2, threads=threads) for threads in (1, 3))
    assert one.state_hash(0) == many.state_hash(0)
    small = game(UnicyclePID(), n=131)
    alone = [flown(small, 3, seeds=[seed]).state_hash(0) for seed in (5, 6)]
    stack = flown(small, 3, seeds=[6, 7, 5])
    assert [stack.state_hash(2), stack.state_hash(0)] == alone


def test_a_unicycle_that_loops_shows_the_attitude_of_its_quaternion():
    angles = np.random.default_rng(3).uniform(-9.0, 9.0, (3, 500))
    yaw, pitch, bank = angles
    shown = np.array([attitude.py_func(*row) for row in angles.T]).T
    quat = quat_from_euler(bank, -pitch, yaw)
    again = quat_from_euler(shown[2], -shown[1], shown[0])
    assert np.minimum(np.abs(again - quat), np.abs(again + quat)).max() < 1e-14
    assert np.abs(shown[1]).max() <= math.pi / 2
    assert np.abs(shown).max() <= math.pi


def test_a_model_may_be_written_as_a_row_law():
    class Falling(MotionModel):
        """A stone in the air."""

        drag = Param(0.1, unit="1/s")
        x = State("z v", unit="m m/s")
        lift = Input("acceleration_z", unit="m/s^2")

        @row_law("x", "pos_z")
        @staticmethod
        def fall(z, v, acceleration_z, drag, mass, dt):
            faster = v + dt * (acceleration_z / mass - drag * v)
            return (z + dt * faster, faster), z + dt * faster

        def from_body(self, body, rows):
            self.x[0, rows] = body.pos[2, rows]

        def to_body(self, body):
            body.pos[2], body.vel[2] = self.x

    path = Falling(drag=0.0).rollout([0.0, 0.0], [[6.0, 2.0]], dt=1.0, substeps=2)
    assert path[1].tolist() == [0.5 * 1.5 + 0.5 * 3.0, 3.0]
    assert Falling().body_inputs() == ["mass"]

    class Hold(Controller):
        wanted = Input("desired_altitude", unit="m")
        lift = Output("acceleration_z", unit="m/s^2")

        @row_law("acceleration_z")
        @staticmethod
        def hold(desired_altitude, pos_z):
            return desired_altitude - pos_z

    one, many = flown(game(Hold(), Falling())), flown(game(Hold(), Falling()), by_substep=True)
    assert len(calls(one)) == 1
    assert one.read("a.pos")[0].tobytes() == many.read("a.pos")[0].tobytes()


def declared(function, *results):
    class Bad(Controller):
        gains = Param((1.0, 2.0), fields="kp ki")
        turn_rate = Output(unit="rad/s")
        speed = Output(unit="m/s")
        pitch_rate = Output(unit="rad/s")
        law = row_law(*results)(function)

    return Bad


def test_names_that_mean_nothing_are_refused():
    text = r"test_row_laws.py:\d+: .*Bad.law: 'yew' is no argument of a row law .did you mean 'yaw'"
    with pytest.raises(DeclarationError, match=text):
        declared(lambda yew: yew, "turn_rate")
    with pytest.raises(
        DeclarationError, match=r"'turnrate' is no result of a row law .did you mean 'turn_rate'"
    ):
        declared(lambda yaw: yaw, "turnrate")
    own = {
        "n": State(dtype=int),
        "on": State(dtype=bool),
        "items": State(ragged=True),
        "other": EntityRef(),
        "k": Param(1.0),
    }
    kinds = {
        "n": "State of int",
        "on": "State of bool",
        "items": "State of lists",
        "other": "EntityRef of int",
        "k": "Param of float",
    }
    for name in own:
        with pytest.raises(
            DeclarationError, match=f"'{name}' is no result of a row law, as a {kinds[name]}; "
        ):
            type("Bad", (Controller,), {**own, "law": row_law(name)(staticmethod(lambda yaw: yaw))})
    with pytest.raises(DeclarationError, match="'gains' is no result of a row law"):
        declared(lambda yaw: yaw, "gains")
    with pytest.raises(DeclarationError, match=r"name the results, such as @row_law\('turn_rate'\)"):
        row_law()(lambda yaw: yaw)


def test_results_that_do_not_fit_are_refused_when_it_first_runs():
    with pytest.raises(PluginError, match=r"returns \(a number, a number\); its results are a number"):
        flown(game(declared(lambda yaw: (yaw, yaw), "turn_rate")(), DRIFTING), 1)
    with pytest.raises(PluginError, match=r"<lambda> cannot be compiled: "):
        flown(game(declared(lambda yaw: sorted(str(yaw)), "turn_rate")(), DRIFTING), 1)


DRIFTING = Unicycle()


def test_a_law_may_be_a_device():
    @device
    def back(yaw):
        return -yaw

    bad = declared(back, "turn_rate")
    sim = flown(game(bad(), DRIFTING, motion_multiplier=1), 1)
    start = flown(game(bad(), DRIFTING, motion_multiplier=1), 0)
    np.testing.assert_array_equal(sim.read("a.Bad.turn_rate")[0], -start.read("a.yaw")[0])


class Constant(Controller):
    """Reads nothing at all."""

    speed = Output(unit="m/s")
    rates = Output("turn_rate pitch_rate", unit="rad/s")

    @row_law("speed")
    @staticmethod
    def constant(dt):
        return 3.0 + 0.0 * dt


def test_a_controller_whose_results_nobody_reads_does_nothing():
    sim = Simulation(Mission(blocks=[block(autonomy=Plan(), controller=UnicyclePID(), motion=Still())]))
    sim.step(3)
    assert sim.read("a.UnicyclePID.heading")[0].max() == 0.0


@pytest.mark.parametrize("rate", [None, 10.0])
def test_a_law_may_read_nothing(rate):
    sim = Simulation(Mission(blocks=[block(controller=Constant(rate=rate), motion=Unicycle(vel_max=9.0))]))
    sim.step()
    assert sim.read("a.Constant.speed")[0].max() == 3.0
