"""What a planner needs: the state of its own motion model, and the function that flies it."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from small_worlds import block

from tussle import Mission, Simulation
from tussle.api import Autonomy, EasyAutonomy, Input, MotionModel, Output, Param, State
from tussle.errors import ParameterError
from tussle.numeric import cos, sin
from tussle.plan import Problem, solve
from tussle.stock import Unicycle

MODEL = Unicycle(vel_max=20.0)


class Planner(EasyAutonomy):
    """Turn left, and note where a rollout says that this leads in one step."""

    foreseen = State("x y z yaw pitch", unit="m m m rad rad")
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")

    def step_one(self, me):
        me.speed, me.turn_rate, me.pitch_rate = 10.0, 0.3, 0.1
        me.foreseen = MODEL.rollout(me.motion_state, [[10.0, 0.3, 0.1]], me.dt, substeps=4)[-1]


def test_a_rollout_from_the_motion_state_is_what_is_flown() -> None:
    game = Mission(
        blocks=[block(count=3, variance=(100, 100, 0), autonomy=Planner(), motion=MODEL)],
        dt=0.1,
        end=2.0,
        motion_multiplier=4,
    )
    sim = Simulation(game)
    sim.step(7)
    foreseen, _ = sim.read("a.Planner.foreseen")
    flown, _ = sim.read("a.Unicycle.x")
    assert foreseen.tobytes() == flown.tobytes()
    assert len(np.unique(flown[0, :, 0])) == 3


def test_advance_is_the_function_that_flies_a_model_whoever_wrote_it() -> None:
    class Shared(Unicycle):
        advance = MotionModel.advance

    class Still(Unicycle):
        def advance(x, u, p, dt, substeps):
            """Nothing."""

    x0, u = [0.0, 0.0, 0.0, 0.5, 0.1], [[10.0, 0.3, 0.1]]
    np.testing.assert_allclose(Shared().rollout(x0, u, 0.1, 8), Unicycle().rollout(x0, u, 0.1, 8), atol=1e-9)
    assert Still().rollout(x0, u, 0.1)[1].tolist() == x0
    game = Mission(blocks=[block(count=2, autonomy=Planner(), motion=Still())], dt=0.1, end=1.0)
    sim = Simulation(game)
    sim.step()
    placed = sim.read("a.pos")[0]
    sim.step(3)
    assert sim.read("a.pos")[0].tolist() == placed.tolist()


def test_the_motion_state_is_read_only() -> None:
    class Pushy(Autonomy):
        speed = Output(unit="m/s")
        turn_rate = Output(unit="rad/s")
        pitch_rate = Output(unit="rad/s")

        def step(self, g):
            assert not g.motion_state.flags.writeable

    Simulation(Mission(blocks=[block(autonomy=Pushy(), motion=MODEL)])).step()


def test_a_whole_number_with_a_unit_is_a_real_parameter() -> None:
    class Runner(Autonomy):
        top_speed = Param(35, unit="m/s")
        prey_team = Param(1)

    assert Runner(top_speed=35.5).top_speed == 35.5
    with pytest.raises(ParameterError, match="whole number"):
        Runner(prey_team=1.5)


def test_parameters_are_given_by_name() -> None:
    with pytest.raises(ParameterError, match=r"Unicycle\(5\): .* by name; there are: vel_max"):
        Unicycle(5)


def test_a_list_of_another_length_than_the_stack_is_refused() -> None:
    game = Mission(blocks=[block(autonomy=Planner(), motion=MODEL)])
    with pytest.raises(ParameterError, match=r"'a.Unicycle.vel_max' has 2 values for 3 worlds"):
        Simulation(game, seeds=[1, 2, 3], params={"a.Unicycle.vel_max": [1.0, 2.0]})


class Drifting(Unicycle):
    """A unicycle with a current that nobody has to command."""

    x = State("x y z yaw pitch", unit="m m m rad rad")
    current = Input(unit="m/s", optional=True, default=0.7)

    advance = MotionModel.advance
    row_laws: ClassVar[dict] = {}

    @staticmethod
    def derivative(yaw, speed, turn_rate, current):
        return speed * cos(yaw), speed * sin(yaw) + current, 0.0, turn_rate, 0.0


def test_a_plan_has_the_defaults_of_inputs_that_no_command_sets():
    plan = solve(
        Problem(
            motion=Drifting(vel_max=5.0),
            start={"x": 1.0},
            goal=(20.0, 10.0, 0.0),
            goal_radius=3.0,
            bounds={"x": (0, 40), "y": (-20, 20)},
            commands={"speed": (1.0, 5.0), "turn_rate": (-1.0, 1.0)},
            held={"pitch_rate": 0.0},
            dt=0.1,
        ),
        seed=1,
    )
    assert plan.is_solved

    class Follow(Autonomy):
        speed = Output(unit="m/s")
        turn_rate = Output(unit="rad/s")
        pitch_rate = Output(unit="rad/s")

        def step(self, g):
            self.speed[:], self.turn_rate[:] = plan.inputs[int(g.step_count[0]), :2]

    game = Mission(
        blocks=[block(position=(1, 0, 0), autonomy=Follow(), motion=Drifting(vel_max=5.0))], end=99.0
    )
    with Simulation(game) as simulation:
        simulation.step(len(plan.inputs))
        assert simulation.read("a.Drifting.x")[0][0, 0].tobytes() == plan.path[-1].tobytes()
