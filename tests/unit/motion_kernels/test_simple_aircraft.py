import math

import numpy as np
import pytest

from tussle.numeric.quaternion import quat_from_euler, quat_rotate
from tussle.plugins.stock.motion.simple_aircraft import SimpleAircraft, kernels

ADVANCE = SimpleAircraft().advance

RADIUS, V_MIN, V_MAX, ROLL_MAX, PITCH_MAX, ROLL_RATE_MAX, PITCH_RATE_MAX, TARGET, SLOPE = range(9)


def limits(n, **changed):
    p = np.empty((9, n))
    p[:] = np.array([13.0, 5.0, 60.0, 1.2, 1.2, 3.0, 3.0, 50.0, 0.1])[:, None]
    for name, value in changed.items():
        p[globals()[name]] = value
    return p


def published(x, u, p):
    """What is published of states x: position, quaternion, velocity, turn rate, (13, n)."""
    out = np.full((13, x.shape[1]), np.nan)
    bounds = p[ROLL_MAX], p[PITCH_MAX], p[ROLL_RATE_MAX], p[PITCH_RATE_MAX]
    kernels.to_body(x, (u[1], u[2]), bounds, (p[RADIUS], p[SLOPE], p[TARGET]), out, 0)
    return out[[0, 1, 2, 6, 7, 8, 9, 3, 4, 5, 10, 11, 12]]


def rk4(x, u, p, dt, substeps):
    """The textbook method, in NumPy; limits are not looked at."""

    def f(x):
        roll, pitch, yaw, v = x[3:]
        level = v * np.cos(pitch)
        turn = v * np.tan(roll) / (p[RADIUS] + p[SLOPE] * (v - p[TARGET]))
        return np.stack(
            [level * np.cos(yaw), level * np.sin(yaw), v * np.sin(pitch), u[1], u[2], turn, u[0] / 5.0]
        )

    h = dt / substeps
    for _ in range(substeps):
        a = f(x)
        b = f(x + h / 2 * a)
        c = f(x + h / 2 * b)
        x = x + h / 6 * (a + 2 * b + 2 * c + f(x + h * c))
    return x


def many(n, seed=3):
    draw = np.random.default_rng(seed)
    x = draw.normal(size=(7, n))
    x[3:5] = draw.uniform(-0.4, 0.4, (2, n))
    x[6] = draw.uniform(20.0, 40.0, n)
    u = draw.uniform(-0.4, 0.4, (3, n))
    return x, u, limits(n)


@pytest.mark.parametrize("substeps", [1, 3, 12])
def test_equals_rk4_away_from_the_limits(substeps):
    x, u, p = many(70)
    ours, reference = x.copy(), x.copy()
    for k in range(20):
        sign = 1.0 if k % 2 else -1.0
        ADVANCE(ours, sign * u, p, 0.1, substeps)
        reference = rk4(reference, sign * u, p, 0.1, substeps)
    assert np.abs(ours - reference).max() < 1e-10


@pytest.mark.parametrize("substeps", [1, 7])
def test_limits_hold_and_are_reached_exactly(substeps):
    n = 4
    x = np.zeros((7, n))
    x[6] = 20.0
    u = np.array([[500.0, -500.0, 1e9, 0.0], [9.0, -9.0, 0.5, 0.0], [9.0, -9.0, 0.5, 0.0]])
    p = limits(n, ROLL_MAX=0.5, PITCH_MAX=0.3, ROLL_RATE_MAX=1.0, PITCH_RATE_MAX=1.0, V_MIN=15.0, V_MAX=40.0)
    for _ in range(20):
        ADVANCE(x, u, p, 0.1, substeps)
        assert np.all(np.abs(x[3]) <= 0.5)
        assert np.all(np.abs(x[4]) <= 0.3)
        assert np.all((x[6] >= 15.0) & (x[6] <= 40.0))
    assert x[3].tolist() == [0.5, -0.5, 0.5, 0.0]
    assert x[4].tolist() == [0.3, -0.3, 0.3, 0.0]
    assert x[6].tolist() == [40.0, 15.0, 40.0, 20.0]


def test_rates_are_held_within_their_limits():
    x = np.zeros((7, 1))
    x[6] = 20.0
    u = np.array([[1e6], [9.0], [-9.0]])
    ADVANCE(x, u, limits(1, ROLL_RATE_MAX=0.5, PITCH_RATE_MAX=0.25), 0.1, 1)
    assert x[3, 0] == pytest.approx(0.05)
    assert x[4, 0] == pytest.approx(-0.025)
    assert x[6, 0] == pytest.approx(20.0 + 0.1 * 100.0 / 5.0)


def test_steady_bank_flies_a_circle_of_the_turning_radius():
    x = np.zeros((7, 1))
    x[3], x[6] = math.pi / 4, 20.0
    p = limits(1, RADIUS=50.0, TARGET=20.0)
    period = 2.0 * math.pi * 50.0 / 20.0
    ADVANCE(x, np.zeros((3, 1)), p, period / 2, 400)
    assert x[1, 0] == pytest.approx(100.0, abs=1e-6)  # a positive bank turns left: half the circle ends at +y
    ADVANCE(x, np.zeros((3, 1)), p, period / 2, 400)
    assert np.abs(x[:2]).max() < 1e-6


def test_published_velocity_is_that_of_the_path_and_bank_is_right_wing_down():
    x, u, p = many(25)
    out = published(x, u, p)
    y = x.copy()
    ADVANCE(y, 0.0 * u, p, 1e-7, 1)
    assert np.abs((y - x)[:3] / 1e-7 - out[7:10]).max() < 1e-5
    assert np.abs(out[3:7] - quat_from_euler(-x[3], -x[4], x[5])).max() < 1e-15
    nose = quat_rotate(out[3:7], np.array([[1.0], [0.0], [0.0]]) + 0.0 * x[:3])
    assert np.abs(nose * x[6] - out[7:10]).max() < 1e-12


def test_published_turn_rate_is_that_of_the_attitude():
    x, u, p = many(25)
    p[SLOPE] = 0.0
    x[3, :5], u[1, :5] = p[ROLL_MAX, :5], 1.0  # the bank is at its limit and stays there
    x[4, 5:9], u[2, 5:9] = -p[PITCH_MAX, 5:9], -1.0
    before = published(x, u, p)
    h = 1e-6
    ADVANCE(x, u, p, h, 1)
    rate = (published(x, u, p)[3:7] - before[3:7]) / h
    # q' = omega q / 2 with omega in the world frame, so omega is the vector part of 2 q' q*
    w, v = before[3], before[4:7]
    omega = 2.0 * (-rate[0] * v + w * rate[1:] - np.cross(rate[1:], v, axis=0))
    assert np.abs(before[10:]).max() > 0.5
    assert np.abs(omega - before[10:]).max() < 1e-4
