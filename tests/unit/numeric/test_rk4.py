"""The integrator: order of convergence, rows that do not know of each other, and what it refuses."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tussle.errors import DeclarationError
from tussle.numeric import cos, sin
from tussle.numeric.rk4 import compile_derivative, rk4

NONE = np.empty((0, 1))


def oscillator(speed, place, stiffness):
    return speed, -stiffness * place


def decay(x):
    return -x


def error_after_one_second(substeps):
    states = np.array([[1.0], [0.0]])
    rk4(
        compile_derivative(oscillator, ["place", "speed"], [], ["stiffness"]),
        states,
        NONE,
        np.ones((1, 1)),
        1.0,
        substeps,
    )
    return max(abs(states[0, 0] - math.cos(1.0)), abs(states[1, 0] + math.sin(1.0)))


def test_error_falls_with_the_fourth_power_of_the_step():
    ratio = error_after_one_second(8) / error_after_one_second(16)
    assert 3.8 < math.log2(ratio) < 4.2


def test_one_step_is_the_fourth_order_taylor_sum():
    states = np.array([[1.0]])
    rk4(compile_derivative(decay, ["x"], [], []), states, NONE, NONE, 0.5)
    assert states[0, 0] == pytest.approx(1.0 - 0.5 + 0.125 - 0.5**3 / 6 + 0.5**4 / 24, rel=1e-15)


def test_substeps_are_steps():
    derivative = compile_derivative(oscillator, ["place", "speed"], [], ["stiffness"])
    whole, parts = np.array([[1.0], [0.5]]), np.array([[1.0], [0.5]])
    rk4(derivative, whole, NONE, np.ones((1, 1)), 1.0, 4)
    for _ in range(4):
        rk4(derivative, parts, NONE, np.ones((1, 1)), 0.25)
    np.testing.assert_array_equal(whole, parts)


def test_a_row_does_not_depend_on_the_others():
    def car(yaw, v, command, turn, lag):
        return v * cos(yaw), v * sin(yaw), turn, (command - v) / lag

    derivative = compile_derivative(car, ["east", "north", "yaw", "v"], ["command", "turn"], ["lag"])
    draw = np.random.default_rng(0)
    states, inputs, params = (
        draw.normal(size=(4, 33)),
        draw.normal(size=(2, 33)),
        draw.uniform(0.5, 2.0, size=(1, 33)),
    )
    whole = states.copy()
    rk4(derivative, whole, inputs, params, 0.1, 5)
    for first, n in ((0, 1), (7, 1), (5, 3), (20, 13)):
        part, rows = states[:, first : first + n].copy(), slice(first, first + n)
        rk4(derivative, part, inputs[:, rows].copy(), params[:, rows].copy(), 0.1, 5)
        np.testing.assert_array_equal(part, whole[:, rows])


def test_the_machine_library_may_be_used():
    def swing(angle, speed):
        return speed, -9.81 * math.sin(angle)

    states = np.array([[0.1], [0.0]])
    rk4(compile_derivative(swing, ["angle", "speed"], [], []), states, NONE, NONE, 0.01)
    assert states[1, 0] == pytest.approx(-9.81 * math.sin(0.1) * 0.01, rel=1e-3)


def test_unknown_argument_is_named_with_its_place_and_the_nearest_name():
    def wrong(speed, stifness):
        return -stifness * speed

    with pytest.raises(
        DeclarationError,
        match=r"test_rk4.py:\d+: .*wrong: argument 'stifness' .*did you mean 'stiffness'.*speed, stiffness",
    ):
        compile_derivative(wrong, ["speed"], [], ["stiffness"])


def test_name_declared_twice_is_refused():
    with pytest.raises(DeclarationError, match="'x' is declared twice"):
        compile_derivative(decay, ["x"], ["x"], [])


def test_rows_that_do_not_match_and_no_substeps_are_refused():
    derivative = compile_derivative(decay, ["x"], [], [])
    with pytest.raises(ValueError, match=r"states \(1, 2\), inputs .* columns"):
        rk4(derivative, np.ones((1, 2)), NONE, np.empty((0, 2)), 1.0)
    with pytest.raises(ValueError, match="at least 1, not 0"):
        rk4(derivative, np.ones((1, 1)), NONE, NONE, 1.0, 0)


def test_a_derivative_of_another_length_is_told():
    def car(x, v):
        return v

    with pytest.raises(
        DeclarationError, match=r"test_rk4.py:\d+: .*car returns 1 derivatives.* 2 states: x, v"
    ):
        rk4(compile_derivative(car, ["x", "v"], [], []), np.ones((2, 1)), NONE, NONE, 1.0)


def test_a_derivative_that_does_not_compile_is_told():
    def strange(x):
        return {"x": x}["x"].hex()

    with pytest.raises(DeclarationError, match=r"test_rk4.py:\d+: .*strange cannot be compiled: "):
        rk4(compile_derivative(strange, ["x"], [], []), np.ones((1, 1)), NONE, NONE, 1.0)
