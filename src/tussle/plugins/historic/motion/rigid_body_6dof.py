"""RigidBody6DOF as in SCRIMMAGE."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.api import MotionBody, State
from tussle.numeric import clip
from tussle.numeric.quaternion import quat_conjugate, quat_multiply
from tussle.plugins.historic.integration import advance_by, normalized, quat_rates, rk4_step, rotated
from tussle.plugins.stock.motion import rigid_body_6dof

MAX_TURN = 0.001
"""Largest rate that a step begins with [rad/s]."""


class RigidBody6DOF(rigid_body_6dof.RigidBody6DOF):
    """RigidBody6DOF of which each step begins with the rates clamp(u, -0.001, 0.001), u being the speed forwards, about all three axes.

    So it hardly turns. Mass and inertia are 1; the velocity of the entity is never written. In tussle the rates are states.
    """

    grade = "machine"
    rigid_body = State(
        "x y z u v w qw qx qy qz sw sx sy sz",
        unit="m m m m/s m/s m/s 1 1 1 1 1 1 1 1",
        doc="Position, velocity along the body axes, quaternion body to world, that of the start.",
    )

    @property
    def advance(self) -> Callable[..., None]:
        """RK4 from clamped rates."""
        return advance_by(self, _step)

    def body_inputs(self) -> list[str]:
        """Return no inputs: external forces have no effect."""
        return []

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position, speed and attitude."""
        x = self.rigid_body
        x[:3, rows], x[6:10, rows], x[10:, rows] = body.pos[:, rows], body.quat[:, rows], body.quat[:, rows]
        x[3, rows], x[4:6, rows] = body.forward_speed[rows], 0.0

    def to_body(self, body: MotionBody) -> None:
        """Write position and attitude."""
        body.pos[:], body.quat[:] = self.rigid_body[:3], self.rigid_body[6:10]


def _step(x: np.ndarray, u: dict[str, np.ndarray], p: dict[str, Any], h: float) -> None:
    start = x[10:]
    x[3] = clip(x[3], p["min_velocity"], p["max_velocity"])
    turn = clip(x[3], -MAX_TURN, MAX_TURN)
    spin = np.array([u["aileron"], u["elevator"], u["rudder"]])

    def f(s: np.ndarray) -> np.ndarray:
        own, rates, local = s[3:6], s[6:9], s[9:]
        push = own[1] * rates[2] - own[2] * rates[1] + u["thrust"]
        moved = rotated(np.asarray(quat_multiply(start, local)), own)
        return np.concatenate([moved, [push], 0.0 * own[1:], spin, quat_rates(local, rates)])

    local = np.asarray(quat_multiply(quat_conjugate(start), x[6:10]))
    s = rk4_step(f, np.concatenate([x[:6], [turn, turn, turn], local]), h)
    x[:6] = s[:6]
    x[6:10] = normalized(quat_multiply(start, normalized(s[9:])))
