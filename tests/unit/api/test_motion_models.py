"""Motion models that are only their state equation: rollouts, and what is wrong with a declaration."""

from __future__ import annotations

import numpy as np
import pytest
from golden_plugins import Car, Wanderer
from small_worlds import block, mission

from tussle import Simulation
from tussle.api import Input, MotionModel, State
from tussle.errors import DeclarationError, ParameterError, PluginError


def test_rollout_in_a_batch_is_each_alone():
    x0 = np.array([[0.0, 1.0, 2.0], [0.0, 0.0, 5.0], [0.1, 0.2, 0.3], [1.0, 2.0, 3.0]])
    inputs = np.array([[4.0, 0.1], [5.0, -0.2]])
    lag = np.array([0.3, 0.5, 0.9])
    batch = Car().rollout(x0, inputs, 0.1, 2, params={"lag": lag})
    for i in range(3):
        assert np.array_equal(batch[..., i], Car(lag=lag[i]).rollout(x0[:, i], inputs, 0.1, 2))


def test_rollout_refuses_what_does_not_fit():
    with pytest.raises(ParameterError, match=r"x0 is \(3,\).*east, north, yaw, v.*speed, steering"):
        Car().rollout([0.0, 0.0, 0.0], [[1.0, 0.0]], 0.1)
    with pytest.raises(ParameterError, match=r"no parameter 'lagg' \(did you mean 'lag'\?\)"):
        Car().rollout([0.0] * 4, [[1.0, 0.0]], 0.1, params={"lagg": 1.0})


@pytest.mark.parametrize(
    ("x0", "inputs", "params", "text"),
    [
        ([0.0] * 4, {"speed": 1.0}, {}, r"Car.rollout: inputs = \{'speed': 1.0\} is not allowed; it takes numbers"),
        ([0.0] * 4, [[1.0, 0.0], [1.0]], {}, r"Car.rollout: inputs = .* is not allowed; it takes numbers"),
        ({"v": 1.0}, [[1.0, 0.0]], {}, r"Car.rollout: x0 = .* is not allowed; it takes numbers"),
        ([0.0] * 4, [[1.0, 0.0]], {"lag": "short"}, r"Car.rollout: lag = 'short' is not allowed; it takes numbers"),
        ([0.0] * 4, [[1.0, 0.0]], {"lag": [1.0, 2.0]}, r"Car.rollout: lag has shape \(2,\); it takes \(1\)"),
        (np.zeros((4, 3)), [[1.0, 0.0]], {"lag": np.ones((2, 3))}, r"Car.rollout: lag has shape \(2, 3\); it takes \(3\)"),
    ],
)  # fmt: skip
def test_rollout_says_what_it_takes(x0, inputs, params, text):
    with pytest.raises(ParameterError, match=text):
        Car().rollout(x0, inputs, 0.1, params=params)


def test_the_car_obeys_its_lag():
    path = Car(lag=0.5).rollout([0, 0, 0, 0], [[10.0, 0.0]] * 50, 0.02)
    assert path[-1, 3] == pytest.approx(10.0 * (1.0 - np.exp(-1.0 / 0.5)), rel=1e-8)


def test_declarations_of_models_that_mean_nothing_are_refused():
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


def test_a_model_without_from_body_says_so():
    class Half(Car):
        def from_body(self, body, rows):
            return super(Car, self).from_body(body, rows)

    with pytest.raises(PluginError, match=r"Half, a, world 0, step 0: .*Half has no from_body"):
        Simulation(mission(block(autonomy=Wanderer(), motion=Half())))
