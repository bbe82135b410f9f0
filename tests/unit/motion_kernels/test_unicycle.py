import math

import numpy as np
import pytest

from tussle.numeric.quaternion import quat_from_euler
from tussle.plugins.stock.motion.unicycle import Unicycle, kernels

PITCHED, LEVEL = Unicycle().advance, Unicycle(use_pitch=False).advance


def rk4(x, u, p, dt, substeps, pitches=True):
    """The textbook method, in NumPy."""
    v, w = np.clip(u[0], -p[0], p[0]), np.clip(u[1], -p[1], p[1])
    third = np.clip(u[2], -p[2], p[2]) if pitches else np.clip(u[2], -p[3], p[3])

    def f(x):
        up, rate = (v * np.sin(x[4]), third) if pitches else (third, 0.0 * third)
        level = v * np.cos(x[4])
        return np.stack([level * np.cos(x[3]), level * np.sin(x[3]), up, w, rate])

    h = dt / substeps
    for _ in range(substeps):
        a = f(x)
        b = f(x + h / 2 * a)
        c = f(x + h / 2 * b)
        x = x + h / 6 * (a + 2 * b + 2 * c + f(x + h * c))
    return x


def many(n, seed=1, speed=30.0, rate=1.0):
    draw = np.random.default_rng(seed)
    x = draw.normal(size=(5, n))
    u = np.stack([draw.uniform(-speed, speed, n), draw.uniform(-rate, rate, n), draw.uniform(-rate, rate, n)])
    p = np.empty((4, n))
    p[:] = np.array([0.9 * speed, 0.9 * rate, 0.8 * rate, 0.7 * rate])[:, None]
    return x, u, p


def publish(x, u, p, h, pitches=True, banks=False):
    out = np.full((13, x.shape[1]), np.nan)
    kernels.to_body(
        x, tuple(u), (p[0], p[1], p[2] if pitches else p[3]), (pitches, banks), h, out, 0, (0, len(out[0]))
    )
    return out[:3], out[6:10], out[3:6], out[10:]


@pytest.mark.parametrize("substeps", [1, 2, 3, 12])
@pytest.mark.parametrize(("advance", "pitches"), [(PITCHED, True), (LEVEL, False)])
def test_ten_seconds_equal_rk4(advance, pitches, substeps):
    x, u, p = many(50)
    ours, reference = x.copy(), x.copy()
    for _ in range(100):
        advance(ours, u, p, 0.1, substeps)
        reference = rk4(reference, u, p, 0.1, substeps, pitches)
    assert np.abs(ours - reference).max() < 1e-10


@pytest.mark.parametrize("substeps", [1, 4, 7])
def test_turns_of_many_revolutions_per_substep_equal_rk4(substeps):
    x, u, p = many(500, speed=1.0, rate=900.0)
    u[1, :4] = [0.0, 20.0 * substeps * math.pi, -20.0 * substeps * math.pi, 40.0 * substeps * math.pi]
    u[2, :4] = 0.0
    ours = x.copy()
    PITCHED(ours, u, p, 0.1, substeps)
    assert np.abs(ours - rk4(x, u, p, 0.1, substeps)).max() < 1e-10


def test_commands_are_held_within_limits():
    x = np.zeros((5, 2))
    u = np.array([[9.0, -9.0], [9.0, -9.0], [9.0, -9.0]])
    p = np.array([[2.0, 2.0], [0.5, 0.5], [0.25, 0.25], [0.0, 0.0]])
    PITCHED(x, u, p, 1.0, 1)
    assert x[3].tolist() == [0.5, -0.5]
    assert x[4].tolist() == [0.25, -0.25]
    _, _, vel, omega = publish(x, u, p, 1e-6)
    assert np.allclose(np.linalg.norm(vel, axis=0), 2.0)
    assert np.allclose(np.linalg.norm(omega, axis=0), math.hypot(0.5, 0.25))


def test_level_model_climbs_with_velocity_z_and_keeps_its_pitch():
    x = np.array([[0.0], [0.0], [0.0], [0.0], [0.5]])
    u = np.array([[2.0], [0.0], [9.0]])
    p = np.array([[5.0], [1.0], [1.0], [3.0]])
    LEVEL(x, u, p, 2.0, 3)
    assert np.allclose(x[:, 0], [4.0 * math.cos(0.5), 0.0, 6.0, 0.0, 0.5])
    _, _, vel, omega = publish(x, u, p, 0.1, pitches=False)
    assert np.allclose(vel[:, 0], [2.0 * math.cos(0.5), 0.0, 3.0])
    assert np.all(omega == 0.0)


def test_pitch_up_climbs_and_shows_nose_up():
    x = np.zeros((5, 1))
    u = np.array([[10.0], [0.0], [0.5]])
    p = np.array([[20.0], [1.0], [1.0], [0.0]])
    for _ in range(10):
        PITCHED(x, u, p, 0.1, 2)
    pos, quat, vel, _ = publish(x, u, p, 0.05)
    assert pos[2, 0] > 0.0
    assert vel[2, 0] > 0.0
    assert np.allclose(quat[:, 0], quat_from_euler(0.0, -0.5, 0.0), atol=1e-15)


def test_circle_closes():
    x = np.zeros((5, 1))
    u = np.array([[30.0], [0.5], [0.0]])
    p = np.array([[40.0], [1.0], [1.0], [0.0]])
    steps = 200
    dt = 2.0 * math.pi / 0.5 / steps
    radius_seen = []
    for _ in range(steps):
        PITCHED(x, u, p, dt, 12)
        radius_seen.append(math.hypot(x[0, 0], x[1, 0] - 60.0))
    assert np.abs(x[:3]).max() < 1e-9
    assert np.ptp(radius_seen) < 1e-9


def test_bank_is_that_of_a_coordinated_turn():
    x = np.array([[0.0], [0.0], [0.0], [0.3], [0.0]])
    u = np.array([[20.0], [0.4], [0.0]])
    p = np.array([[50.0], [1.0], [1.0], [0.0]])
    _, quat, _, omega = publish(x, u, p, 0.1, banks=True)
    # A turn to the left (positive turn rate) lowers the left wing: a negative roll about the forward axis.
    assert np.allclose(quat[:, 0], quat_from_euler(-math.atan2(8.0, 9.81), 0.0, 0.3), atol=1e-15)
    assert omega[:, 0].tolist() == [0.0, 0.0, 0.4]
    _, level, _, _ = publish(x, u, p, 0.1)
    assert np.allclose(level[:, 0], quat_from_euler(0.0, 0.0, 0.3), atol=1e-15)


def test_turn_rate_vector_turns_the_quaternion():
    x, u, p = many(30)
    h = 1e-6
    _, before, _, omega = publish(x, u, p, h)
    PITCHED(x, u, p, h, 1)
    _, after, _, _ = publish(x, u, p, h)
    wx, wy, wz = omega
    w, a, b, c = before
    rate = 0.5 * np.stack(
        [
            -wx * a - wy * b - wz * c,
            wx * w + wy * c - wz * b,
            wy * w + wz * a - wx * c,
            wz * w + wx * b - wy * a,
        ]
    )
    assert np.abs((after - before) / h - rate).max() < 1e-5


def test_rollout_takes_the_third_input_of_its_variant():
    inputs = [[1.0, 0.0, 0.3]] * 10
    pitched = Unicycle(vel_max=2.0).rollout([0.0] * 5, inputs, 0.1, 3)
    level = Unicycle(vel_max=2.0, use_pitch=False, velocity_z_max=0.2).rollout([0.0] * 5, inputs, 0.1, 3)
    assert pitched[-1, 4] == pytest.approx(0.3)
    assert level[-1, 4] == 0.0
    assert level[-1, 2] == pytest.approx(0.2)
    assert Unicycle(use_pitch=False).input_channels() == ["speed", "turn_rate", "velocity_z"]
