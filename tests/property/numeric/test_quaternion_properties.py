"""The algebra of rotations by its axioms, over shapes; and the conventions of angles."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tussle.numeric.kernel import kernel
from tussle.numeric.quaternion import (
    quat_conjugate,
    quat_from_euler,
    quat_multiply,
    quat_normalize,
    quat_rotate,
    quat_rotate_inverse,
    quat_to_pitch,
    quat_to_roll,
    quat_to_yaw,
)

relaxed = settings(max_examples=60)
angle = st.floats(-3.1, 3.1)
steepness = st.floats(-1.57, 1.57)
quaternions = st.builds(quat_from_euler, angle, steepness, angle)
vectors = st.tuples(*[st.floats(-100.0, 100.0)] * 3).map(np.array)


def close(a, b, tolerance=1e-12):
    np.testing.assert_allclose(a, b, atol=tolerance, rtol=0)


@relaxed
@given(a=quaternions, b=quaternions, v=vectors)
def test_product_rotates_one_after_the_other(a, b, v):
    close(quat_rotate(quat_multiply(a, b), v), quat_rotate(a, quat_rotate(b, v)), 1e-12 * (1.0 + 100.0))


@relaxed
@given(a=quaternions, b=quaternions, c=quaternions)
def test_product_is_associative(a, b, c):
    close(quat_multiply(quat_multiply(a, b), c), quat_multiply(a, quat_multiply(b, c)))


@relaxed
@given(q=quaternions, v=vectors)
def test_inverse_undoes_and_lengths_stay(q, v):
    close(quat_rotate_inverse(q, quat_rotate(q, v)), v, 1e-11)
    close(quat_rotate(quat_conjugate(q), v), quat_rotate_inverse(q, v), 0.0)
    close(quat_multiply(q, quat_conjugate(q)), [1.0, 0.0, 0.0, 0.0])
    assert math.sqrt(sum(quat_rotate(q, v) ** 2)) == pytest.approx(math.sqrt(sum(v**2)), rel=1e-12)


@relaxed
@given(roll=angle, pitch=steepness, yaw=angle)
def test_angles_come_back(roll, pitch, yaw):
    q = quat_from_euler(roll, pitch, yaw)
    close(quat_to_pitch(q), pitch, 1e-12)
    if abs(pitch) < 1.5:
        close(quat_to_yaw(q), yaw, 1e-12)
        close(quat_to_roll(q), roll, 1e-12)


def test_positive_pitch_points_the_nose_down_and_yaw_turns_from_east_to_north():
    close(quat_rotate(quat_from_euler(0.0, 0.3, 0.0), [1.0, 0.0, 0.0]), [math.cos(0.3), 0.0, -math.sin(0.3)])
    close(quat_rotate(quat_from_euler(0.0, 0.0, math.pi / 2), [1.0, 0.0, 0.0]), [0.0, 1.0, 0.0])
    close(quat_rotate(quat_from_euler(math.pi / 2, 0.0, 0.0), [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0])


def test_normalize_scales_to_one_and_makes_zero_the_identity():
    q = np.array([[2.0, 0.0], [0.0, 0.0], [0.0, 0.0], [1.0, 0.0]])
    close(quat_normalize(q), [[2 / 5**0.5, 1.0], [0.0, 0.0], [0.0, 0.0], [1 / 5**0.5, 0.0]])


@relaxed
@given(n=st.integers(1, 20), seed=st.integers(0, 1000))
def test_batched_equals_single(n, seed):
    draw = np.random.default_rng(seed)
    angles, v = draw.uniform(-1.5, 1.5, size=(3, n)), draw.normal(size=(3, n))
    q = quat_from_euler(*angles)
    results = [
        quat_rotate(q, v),
        quat_rotate_inverse(q, v),
        quat_multiply(q, q[:, ::-1]),
        quat_to_yaw(q),
        quat_normalize(2.0 * q),
    ]
    for i in range(n):
        one = quat_from_euler(*(float(a) for a in angles[:, i]))
        single = [
            quat_rotate(one, v[:, i]),
            quat_rotate_inverse(one, v[:, i]),
            quat_multiply(one, q[:, n - 1 - i]),
        ]
        single += [quat_to_yaw(one), quat_normalize(2.0 * one)]
        for whole, alone in zip(results, single, strict=True):
            np.testing.assert_array_equal(whole[..., i], alone)


def test_one_quaternion_serves_many_vectors():
    q, v = quat_from_euler(0.1, 0.2, 0.3), np.random.default_rng(1).normal(size=(3, 4, 5))
    assert quat_rotate(q, v).shape == (3, 4, 5)
    np.testing.assert_array_equal(quat_rotate(q, v)[:, 2, 3], quat_rotate(q, v[:, 2, 3]))


def test_components_in_jitted_code():
    @kernel("F F Fw")
    def rotate_one(q, v, out):
        out[0], out[1], out[2] = quat_rotate(q[0], q[1], q[2], q[3], v[0], v[1], v[2])

    q, v, out = quat_from_euler(0.4, -0.2, 2.0), np.array([1.0, 2.0, 3.0]), np.empty(3)
    rotate_one(q, v, out)
    np.testing.assert_array_equal(out, quat_rotate(q, v))


def test_wrong_shapes_are_named():
    with pytest.raises(TypeError, match=r"rotate: argument 1 has shape \(4,\); expected \(3,\) or \(3, n\)"):
        quat_rotate(np.ones(4), np.ones(4))
    with pytest.raises(TypeError, match="takes 2 arrays, not 1"):
        quat_rotate(np.ones(4))
