"""Prints one hash of what every portable function gives for fixed inputs. Run in subprocesses by test_portability."""

from __future__ import annotations

import hashlib

import numpy as np

from tussle.numeric import acos, asin, atan2, cos, exp, log, quaternion, rng, sin, sincos, tan, wrap
from tussle.numeric.arrays import matmul, unit
from tussle.numeric.rk4 import compile_derivative, rk4

N = 1003


def car(yaw, v, speed, turn, lag):
    return v * cos(yaw), v * sin(yaw), turn + 0.1 * atan2(v, yaw), exp(-lag) * (speed - v)


def values():
    """Arrays of results, in a fixed order."""
    u = rng.uniform(5, rng.stream_key("values"), np.arange(N), 0, 0, 12)
    z = rng.normal(6, rng.stream_key("values"), np.arange(N), 0, 0, 12)
    yield from (u, z)
    for function in (sin, cos, tan, wrap):
        for scale in (1.0, 100.0, 1e5, 1e12):
            yield function(scale * z[0])
    yield from sincos(z[1])
    yield from (
        asin(2.0 * u[0] - 1.0),
        acos(2.0 * u[1] - 1.0),
        exp(700.0 * u[2]),
        exp(-745.0 * u[3]),
        exp(z[2]),
        log(u[4]),
        log(1.0 + 1e-3 * u[5]),
    )
    yield from (atan2(z[0], z[1]), atan2(1e-300 * z[0], z[1]), atan2(z[0], -1e9 * u[0]))
    yield np.array([sin(float(x)) + atan2(float(x), 2.0) + exp(float(x)) for x in z[3, :50]])
    q = quaternion.quat_from_euler(z[0], asin(u[0]), z[1])
    yield from (
        q,
        quaternion.quat_multiply(q, q[:, ::-1]),
        quaternion.quat_normalize(2.0 * q),
        quaternion.quat_conjugate(q),
    )
    yield from (quaternion.quat_rotate(q, z[:3]), quaternion.quat_rotate_inverse(q, z[:3]))
    yield from (quaternion.quat_to_yaw(q), quaternion.quat_to_pitch(q), quaternion.quat_to_roll(q))
    yield from (matmul(z[:, :12], z), unit(z[:3]))
    states = z[:4].copy()
    rk4(
        compile_derivative(car, ["east", "north", "yaw", "v"], ["speed", "turn"], ["lag"]),
        states,
        z[4:6].copy(),
        u[:1].copy(),
        0.1,
        4,
    )
    yield states


if __name__ == "__main__":
    digest = hashlib.blake2b(digest_size=16)
    for array in values():
        digest.update(np.ascontiguousarray(array).tobytes())
    print(digest.hexdigest())
