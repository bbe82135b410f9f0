from __future__ import annotations

import sys

import numpy as np
import pytest
from design_plugins import Chaser, Flock, LaggedCar
from small_worlds import block, mission

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output, Param
from tussle.errors import DeclarationError, ParameterError, PluginError
from tussle.stock import (
    SimpleCapture,
    SimpleCaptureMetrics,
    SingleIntegrator,
    Straight,
    Unicycle,
    UnicyclePID,
)


def hunt(n_prey=6, **values):
    fast = Unicycle(vel_max=35.0, turn_rate_max=2.0, pitch_rate_max=2.0)
    return Mission(
        blocks=[
            Block(
                name="chaser",
                team=2,
                count=2,
                position=(300, 0, 100),
                variance=(400, 400, 0),
                heading="180 deg",
                autonomy=Chaser(capture_range=20.0),
                motion=fast,
            ),
            Block(
                name="prey",
                team=1,
                count=n_prey,
                position=(0, 0, 100),
                variance=(900, 900, 100),
                autonomy=Flock(),
                motion=SingleIntegrator(),
            ),
        ],
        end=40.0,
        end_conditions="time, one_team",
        interactions=[SimpleCapture(capture_range=20.0)],
        metrics=[SimpleCaptureMetrics()],
        **values,
    )


def test_chaser_and_flock_play_the_game_to_its_end():
    result = Simulation(hunt(), seeds=4).run()[0]
    assert result.end == "one_team"
    assert result.alive == {1: 0, 2: 2}
    assert result.scores[2] == 6.0
    assert result.winner == 2


def test_chaser_steers_to_its_prey_by_the_numbers():
    prey = block("prey", team=1, position=(30.0, 40.0, 20.0))
    chaser = block(
        "chaser",
        team=2,
        autonomy=Chaser(max_speed=12.0),
        motion=Unicycle(vel_max=99.0, turn_rate_max=9.0, pitch_rate_max=9.0),
    )
    sim = Simulation(mission(prey, chaser))
    sim.step()
    assert sim.read("chaser.Chaser.speed")[0][0, 0] == 12.0
    assert sim.read("chaser.Chaser.turn_rate")[0][0, 0] == pytest.approx(np.arctan2(40.0, 30.0))
    assert sim.read("chaser.Chaser.pitch_rate")[0][0, 0] == pytest.approx(np.arctan2(20.0, 50.0))
    assert sim.read("chaser.Chaser.target")[0][0, 0] == 1


def test_chaser_keeps_its_target_until_it_is_gone_then_takes_the_next():
    near, far = block("near", team=1, position=(20, 0, 0)), block("far", team=1, position=(400, 0, 0))
    chaser = block("chaser", team=2, autonomy=Chaser(), motion=Unicycle(vel_max=35.0))
    sim = Simulation(mission(near, far, chaser, end=3.0, interactions=[SimpleCapture()]))
    targets = []
    while not sim.is_over:
        sim.step()
        targets.append(int(sim.read("chaser.Chaser.target")[0][0, 0]))
    assert targets[0] == 1
    assert targets[-1] == 2
    assert sorted(set(targets)) == [1, 2]


def test_chaser_without_any_prey_stands_still():
    sim = Simulation(
        mission(block("chaser", team=2, autonomy=Chaser(), motion=Unicycle(vel_max=35.0), speed=3.0))
    )
    sim.run()
    assert sim.read("chaser.pos")[0].tolist() == [[[0.0, 0.0, 0.0]]]


def test_flock_velocity_of_two_by_hand():
    # 10 m apart: push = (1 - 10 / 20) / 10, so 2 * 0.05 * 10 = 1 m/s apart and 1 together, which leaves the alignment.
    pair = [
        block(n, position=(x, 0, 0), velocity=(0, 2, 0), autonomy=Flock())
        for n, x in (("a", 0.0), ("b", 10.0))
    ]
    sim = Simulation(mission(*pair))
    sim.step()
    assert sim.read("a.Flock.velocity")[0][0, 0] == pytest.approx([0.0, 15.0, 0.0])
    assert sim.read("b.Flock.velocity")[0][0, 0] == pytest.approx([0.0, 15.0, 0.0])


class Driver(Autonomy):
    """Drive a wave."""

    gain = Param(0.3)
    speed = Output(unit="m/s")
    steering = Output(unit="rad")

    def step(self, g):
        self.speed[:] = 3.0 + g.step_count % 5
        self.steering[:] = self.gain * (1.0 - 0.25 * (g.step_count % 7))


def drive(multiplier):
    car = Block(
        name="car", autonomy=Driver(), motion=LaggedCar(lag=0.7), heading=0.4, speed=1.5, variance=(0, 0, 0)
    )
    return Mission(blocks=[car], end=3.0, motion_multiplier=multiplier)


def test_rollout_in_a_batch_is_each_alone():
    x0 = np.array([[0.0, 1.0, 2.0], [0.0, 0.0, 5.0], [0.1, 0.2, 0.3], [1.0, 2.0, 3.0]])
    inputs = np.array([[4.0, 0.1], [5.0, -0.2]])
    lag = np.array([0.3, 0.5, 0.9])
    batch = LaggedCar().rollout(x0, inputs, 0.1, 2, params={"lag": lag})
    for i in range(3):
        assert np.array_equal(batch[..., i], LaggedCar(lag=lag[i]).rollout(x0[:, i], inputs, 0.1, 2))


def test_rollout_refuses_what_does_not_fit():
    with pytest.raises(ParameterError, match=r"x0 is \(3,\).*east, north, yaw, v.*speed, steering"):
        LaggedCar().rollout([0.0, 0.0, 0.0], [[1.0, 0.0]], 0.1)
    with pytest.raises(ParameterError, match=r"no parameter 'lagg' \(did you mean 'lag'\?\)"):
        LaggedCar().rollout([0.0] * 4, [[1.0, 0.0]], 0.1, params={"lagg": 1.0})


def test_the_car_obeys_its_lag():
    path = LaggedCar(lag=0.5).rollout([0, 0, 0, 0], [[10.0, 0.0]] * 50, 0.02)
    assert path[-1, 3] == pytest.approx(10.0 * (1.0 - np.exp(-1.0 / 0.5)), rel=1e-8)


def test_a_car_that_someone_moves_goes_on_from_there():
    sim = Simulation(drive(1))
    sim.step()
    sim.write("car.pos", [100.0, 200.0, 0.0])
    assert sim.read("car.LaggedCar.x")[0][0, 0, :2].tolist() == [100.0, 200.0]


def test_step_one_is_called_as_plain_python_in_the_authors_file():
    """What a debugger needs: a frame of step_one, called by frames that can be walked up to the test."""
    seen = []

    class Watched(Chaser):
        def step_one(self, me):
            frame = sys._getframe()
            callers = []
            while frame is not None:
                callers.append((frame.f_code.co_filename, frame.f_code.co_name))
                frame = frame.f_back
            seen.append((me.id, callers))
            super().step_one(me)

    chaser = block("chaser", team=2, count=3, autonomy=Watched(), motion=Unicycle(), variance=(100, 100, 0))
    Simulation(mission(chaser, block("prey", team=1))).step()
    assert [entity for entity, _ in seen] == [1, 2, 3]
    callers = seen[0][1]
    assert callers[0] == (__file__, "step_one")
    assert (__file__, "test_step_one_is_called_as_plain_python_in_the_authors_file") in callers


def test_a_model_without_from_body_says_so():
    class Half(MotionModelWithState):
        pass

    with pytest.raises(PluginError, match=r"Half, a, world 0, step 0: .*Half has no from_body"):
        Simulation(mission(block(motion=Half(), autonomy=Driver())))


class MotionModelWithState(LaggedCar):
    """LaggedCar without its way in."""

    def from_body(self, body, rows):
        return super(LaggedCar, self).from_body(body, rows)


def test_declarations_of_models_that_mean_nothing_are_refused():
    from tussle.api import Input, MotionModel, State

    with pytest.raises(DeclarationError, match=r"argument 'sped' \(did you mean 'speed'\?\)"):

        class Misspelt(MotionModel):
            x = State("east v", unit="m m/s")
            speed = Input(unit="m/s")

            @staticmethod
            def derivative(v, sped):
                return v, sped - v

    with pytest.raises(DeclarationError, match="declares 2 states with fields"):

        class Two(MotionModel):
            x = State("east v", unit="m m/s")
            y = State("a b")

            @staticmethod
            def derivative(v):
                return v, v


def test_no_controller_is_needed_where_channels_fit_and_one_is_advised_where_not():
    fits = Simulation(
        mission(
            block(autonomy=Straight(), controller=UnicyclePID(), motion=Unicycle(vel_max=30.0), speed=21.0)
        )
    )
    fits.run()
    assert fits.read("a.pos")[0][0, 0, 0] == pytest.approx(21.0, abs=1.0)
