"""UUV6DOF as in SCRIMMAGE."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.api import MotionBody, State
from tussle.numeric import clip
from tussle.plugins.historic.integration import (
    advance_by,
    normalized,
    quat_rates,
    rk4_step,
    rotated,
    solved,
    unrotated,
)
from tussle.plugins.stock.motion import uuv_6dof

THRUST = (-2.0, 3.6936)
PROPELLER_MOMENT, FIN_MAX = 0.543, 0.2373648
FLIP = np.array([[1.0], [-1.0], [-1.0]])
"""Between the axes forward, left, up and forward, right, down."""
MASS = {
    (0, 0): -0.93, (1, 1): -35.5, (1, 5): 1.93, (2, 2): -35.5, (2, 4): -1.93, (3, 3): -0.0141,
    (4, 2): -1.93, (4, 4): -4.88, (5, 1): 1.93, (5, 5): -4.88,
}  # fmt: skip
"""Added mass, by row and column."""
BELOW = 2.220446049250313e-16


class UUV6DOF(uuv_6dof.UUV6DOF):
    """UUV6DOF in which added mass acts twice, the forces of inertia of the rigid body are missing, and the surface is a wall.

    Added mass times the accelerations of the last step is among the forces, and in the matrix too. Weight and buoyancy are those of
    the attitude at the start of each step. The velocity in the world is integrated from force over mass, beside the velocity of the
    body, which the position follows. Throttle 0 gives thrust; damping in roll and by the yaw rate is that of misprinted coefficients, and
    Yrr is constant. The velocity starts with the entity's along East only. In tussle the equations are Prestero's.
    """

    grade = "machine"
    rigid_body = State(
        "x y z vx vy vz qw qx qy qz u v w p q r au av aw ap aq ar",
        unit="m m m m/s m/s m/s 1 1 1 1 m/s m/s m/s rad/s rad/s rad/s m/s^2 m/s^2 m/s^2 rad/s^2 rad/s^2 rad/s^2",
        doc="Position, velocity, quaternion, of world axes; velocity, rates and accelerations of the last step, forward, right, down.",
    )

    @property
    def advance(self) -> Callable[..., None]:
        """RK4."""
        return advance_by(self, _step)

    def body_inputs(self) -> list[str]:
        """Return no inputs: external forces have no effect."""
        return []

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position and attitude, and the velocity along East, as that along the nose."""
        x = self.rigid_body
        x[:, rows] = 0.0
        x[:3, rows], x[6:10, rows] = body.pos[:, rows], body.quat[:, rows]
        x[3, rows] = x[10, rows] = body.vel[0, rows]

    def to_body(self, body: MotionBody) -> None:
        """Write position, velocity, attitude and angular velocity."""
        x = self.rigid_body
        body.pos[:], body.vel[:] = x[:3], x[3:6]
        body.quat[:] = normalized(x[6:10])
        body.omega[:] = rotated(x[6:10], FLIP * x[13:16])


def _step(x: np.ndarray, u: dict[str, np.ndarray], p: dict[str, Any], h: float) -> None:
    power, planes, rudder = (clip(u[name], -1.0, 1.0) for name in ("throttle", "elevator", "rudder"))
    share = 0.5 * (power + 1.0)
    driven = THRUST[0] + share * (THRUST[1] - THRUST[0]), -PROPELLER_MOMENT * power
    weight, lift = p["mass"] * p["gravity_magnitude"], p["buoyancy"]
    down = FLIP * unrotated(x[6:10], [0.0 * lift, 0.0 * lift, -1.0 + 0.0 * lift])
    held = (
        (weight - lift) * down,
        np.cross(p["c_g"], weight * down, axis=0) - np.cross(p["c_b"], lift * down, axis=0),
    )
    matrix, last = _mass_matrix(p), x[16:]

    def f(s: np.ndarray) -> np.ndarray:
        own, rates = s[10:13], s[13:16]
        loads = _loads(own, rates, last, (FIN_MAX * planes, FIN_MAX * rudder), p)
        loads[:3] += held[0]
        loads[3:] += held[1]
        loads[0] += driven[0]
        loads[3] += driven[1]
        attitude = s[6:10]
        return np.concatenate(
            [
                rotated(attitude, FLIP * own),
                rotated(attitude, FLIP * (loads[:3] / p["mass"])),
                quat_rates(attitude, FLIP * rates),
                solved(matrix, loads),
            ]
        )

    s = rk4_step(f, x[:16], h)
    rises = s[2] >= p["surface_height"]
    s[2] = np.where(rises, p["surface_height"] - BELOW, s[2])
    s[14] = np.where(rises & (s[14] > 0.0), 0.9 * s[14], s[14])
    x[16:] = (s[10:] - x[10:16]) / h
    x[:16] = s


def _mass_matrix(p: dict[str, Any]) -> np.ndarray:
    """Mass matrix with added mass, row by row, (36, n)."""
    mass, zero = p["mass"], 0.0 * p["mass"]
    mx, my, mz = mass * p["c_g"]
    inertia = p["inertia_matrix"]
    rows = [
        [mass, zero, zero, zero, mz, -my],
        [zero, mass, zero, -mz, zero, mx],
        [zero, zero, mass, my, -mx, zero],
        [zero, -mz, my, inertia[0], zero, zero],
        [mz, zero, -mx, zero, inertia[4], zero],
        [-my, mx, zero, zero, zero, inertia[8]],
    ]
    matrix = np.array(rows)
    for place, added in MASS.items():
        matrix[place] -= added
    return matrix.reshape(36, -1)


def _loads(
    velocity: np.ndarray, rates: np.ndarray, last: np.ndarray, fins: tuple[Any, Any], p: dict[str, Any]
) -> np.ndarray:
    """Force [N] and moment [N m], (6, n), of damping, lift, fins and added mass, in axes forward, right, down."""
    (u, v, w), (turn, dive, yaw) = velocity, rates
    au, av, aw, ap, aq, ar = last
    planes, rudder = fins
    q, r = dive, yaw
    return np.array([
        p["Xuu"] * u * np.abs(u) - 0.93 * au - 35.5 * w * q - 1.93 * q * q + 35.5 * v * r - 1.93 * r * r,
        p["Yvv"] * v * np.abs(v) + 0.632 * r * np.abs(r) - 35.5 * av + 1.93 * ar + 5.22 * u * r + 35.5 * w * turn + 1.93 * turn * q
        - 28.6 * u * v + 9.64 * u * u * rudder,
        p["Zww"] * w * np.abs(w) - 0.632 * q * np.abs(q) - 35.5 * aw - 1.93 * aq - 5.22 * u * q - 35.5 * v * turn + 1.93 * r * turn
        - 28.6 * u * w - 9.64 * u * u * planes,
        -0.0013 * turn * np.abs(turn) - 0.0141 * ap,
        p["Mww"] * w * np.abs(w) + p["Mqq"] * q * np.abs(q) - 1.93 * aw - 4.88 * aq - 2.0 * u * q - 1.93 * v * turn + 4.86 * r * turn
        + 24.0 * u * w - 6.15 * u * u * planes,
        -3.18 * v * np.abs(v) - 9.4 * r * np.abs(r) + 1.93 * av - 4.88 * ar - 2.0 * u * r - 1.93 * w * turn - 4.86 * turn * q
        - 24.0 * u * v - 6.15 * u * u * rudder,
    ])  # fmt: skip
