"""Multirotor as in SCRIMMAGE."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.api import MotionBody, State
from tussle.numeric import atan2, clip, sincos
from tussle.plugins.historic.integration import (
    advance_by,
    multiplied,
    normalized,
    quat_rates,
    rk4_step,
    rotated,
    solved,
    unrotated,
)
from tussle.plugins.stock.motion import multirotor


class Multirotor(multirotor.Multirotor):
    """Multirotor of which the position follows one velocity, and another one is published.

    The velocity along the body axes and the one in the world are integrated side by side; the first begins at 0 whatever the initial
    velocity. Weight, drag and gyroscopic moment are those of the start of each step. A rotor exactly at omega_min has torque but no
    thrust; height and tilt of rotors do not count. An external force upwards beyond the thrust becomes one that bears the weight.
    In tussle there is one velocity, and loads are those of each stage.
    """

    grade = "machine"
    rigid_body = State(
        "x y z vx vy vz qw qx qy qz p q r u v w",
        unit="m m m m/s m/s m/s 1 1 1 1 rad/s rad/s rad/s m/s m/s m/s",
        doc="Position, velocity, world frame; quaternion body to world; angular velocity and velocity, body frame.",
    )

    @property
    def advance(self) -> Callable[..., None]:
        """RK4."""
        rotors = np.array(self.rotor_config)
        return advance_by(self, lambda x, u, p, h: _step(x, u, p, h, rotors))

    def body_inputs(self) -> list[str]:
        """Return the external force."""
        return ["force_x", "force_y", "force_z"]

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position, velocity and attitude; rates and the velocity along the body axes are 0."""
        x = self.rigid_body
        x[:, rows] = 0.0
        x[:3, rows], x[3:6, rows], x[6:10, rows] = body.pos[:, rows], body.vel[:, rows], body.quat[:, rows]

    def to_body(self, body: MotionBody) -> None:
        """Write position, velocity, attitude and angular velocity."""
        x = self.rigid_body
        body.pos[:], body.vel[:], body.quat[:] = x[:3], x[3:6], x[6:10]
        body.omega[:] = rotated(x[6:10], x[10:13])


def _step(x: np.ndarray, u: dict[str, np.ndarray], p: dict[str, Any], h: float, rotors: np.ndarray) -> None:
    quat, rates, own, mass = x[6:10], x[10:13], x[13:], p["mass"]
    lift, moment = 0.0 * mass, np.zeros((3, x.shape[1]))
    for i, (turning, along, left, *_) in enumerate(rotors):
        speed = clip(u[f"motor_{i}"], p["omega_min"], p["omega_max"])
        thrust = np.where(speed == p["omega_min"], 0.0, p["c_T"] * speed * speed)
        arm, (sine, cosine) = np.sqrt(along * along + left * left), sincos(atan2(left, along))
        lift = lift + thrust
        moment += np.array([thrust * arm * sine, -thrust * arm * cosine, turning * p["c_Q"] * speed * speed])
    weight = unrotated(quat, np.array([0.0 * mass, 0.0 * mass, -mass * p["gravity_magnitude"]]))
    held = weight - 0.5 * p["c_D"] * np.sqrt(own[0] * own[0] + own[1] * own[1] + own[2] * own[2]) * own
    held[2] += lift
    push = unrotated(quat, [u["force_x"], u["force_y"], u["force_z"]])
    inertia = p["inertia_matrix"]
    spin = solved(inertia, moment - np.cross(rates, multiplied(inertia, rates), axis=0))

    def f(s: np.ndarray) -> np.ndarray:
        beyond = push[2] - lift  # the stored force is modified at every stage
        push[2] = np.where(beyond > 0.0, -weight[2] - lift, np.where(beyond < 0.0, 0.0, push[2]))
        acceleration = (held + push) / mass
        attitude = normalized(s[6:10])
        return np.concatenate(
            [
                rotated(attitude, s[13:]),
                rotated(attitude, acceleration),
                quat_rates(s[6:10], s[10:13]),
                spin,
                np.cross(s[13:], s[10:13], axis=0) + acceleration,
            ]
        )

    x[:] = rk4_step(f, x, h)
    x[6:10] = normalized(x[6:10])
