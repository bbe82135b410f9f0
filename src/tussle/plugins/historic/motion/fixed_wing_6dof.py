"""FixedWing6DOF as in SCRIMMAGE."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.numeric import atan2, clip, sincos
from tussle.numeric.quaternion import quat_from_euler, quat_multiply
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
from tussle.plugins.stock.motion import fixed_wing_6dof
from tussle.plugins.stock.motion.fixed_wing_6dof.plugin import SLUG_FT_SQ

STILL = 1e-5
"""Speed of an aircraft at rest in the air [m/s]."""
FLIP = np.array([[1.0], [-1.0], [-1.0]])
"""Between the axes forward, left, up and forward, right, down."""
GROUND_FREQUENCY = 20.0
"""Natural frequency of the contact with the ground [rad/s]."""
ROUNDED_SLUG = 1.35581795 / SLUG_FT_SQ
"""SCRIMMAGE's slug ft^2 over that of tussle."""


class FixedWing6DOF(fixed_wing_6dof.FixedWing6DOF):
    """FixedWing6DOF whose loads are those of the start of each step, and which moves with another velocity than its own.

    The velocity of the body and the one in the world are integrated side by side; the position follows the first, and the next step
    begins with the second. The rate of the angle of attack is 0; the wind is added to the velocity; the aspect ratio is span / chord;
    lift has no limit; the side force is across the sideslip; the ground hardly damps; the product of inertia is that of axes forward,
    right, down; drag by the elevator is 0.01 / rad whatever the mission says. External forces and torques have no effect. In tussle
    loads are those of each stage, and there is one velocity.
    """

    grade = "machine"

    @property
    def advance(self) -> Callable[..., None]:
        """RK4 under the loads of the start of each step."""
        return advance_by(self, lambda x, u, p, h: _step(x, u, p, h, bool(self.use_ground_model)))

    def body_inputs(self) -> list[str]:
        """Return no inputs: external forces have no effect."""
        return []


class FixedWing6DOFRascal(fixed_wing_6dof.FixedWing6DOFRascal):
    """The Rascal with the law of `FixedWing6DOF`."""

    grade = "machine"
    advance = FixedWing6DOF.advance
    body_inputs = FixedWing6DOF.body_inputs


def _flipped(quat: np.ndarray) -> np.ndarray:
    """Quaternions between both axes: half a turn about x on either side, with its rounding, which sets lateral motion off."""
    half = np.array(quat_from_euler(math.pi, 0.0, 0.0))[:, None]
    return np.asarray(quat_multiply(half, quat_multiply(quat, half)))


def _step(
    x: np.ndarray, u: dict[str, np.ndarray], p: dict[str, Any], h: float, uses_ground_model: bool
) -> None:
    quat, rates = _flipped(x[6:10]), FLIP * x[10:13]
    velocity = unrotated(quat, FLIP * x[3:6])
    force, moment = _loads(quat, velocity, rates, u, p)
    mass = p["mass"]
    weight = np.array([0.0 * mass, 0.0 * mass, mass * p["gravity_magnitude"]])
    if uses_ground_model:
        push = np.maximum(0.0, -(GROUND_FREQUENCY**2) * mass * x[2] - 2.0 * GROUND_FREQUENCY * x[5])
        weight[2] -= np.where(x[2] < 0.0, push, 0.0)
    acceleration = (force + unrotated(quat, weight)) / mass
    inertia = p["inertia_matrix_slug_ft_sq"] * ROUNDED_SLUG
    spin = solved(inertia, moment - np.cross(rates, multiplied(inertia, rates), axis=0))

    def f(s: np.ndarray) -> np.ndarray:
        own, turning, attitude = s[:3], s[3:6], s[6:10]
        return np.concatenate(
            [
                np.cross(own, turning, axis=0) + acceleration,
                spin,
                quat_rates(attitude, turning),
                FLIP * rotated(attitude, own),
                FLIP * rotated(attitude, acceleration),
            ]
        )

    s = rk4_step(f, np.concatenate([velocity, rates, quat, x[:3], x[3:6]]), h)
    x[:6], x[6:10], x[10:13] = s[10:], _flipped(normalized(s[6:10])), FLIP * s[3:6]


def _loads(
    quat: np.ndarray, velocity: np.ndarray, rates: np.ndarray, u: dict[str, np.ndarray], p: dict[str, Any]
) -> tuple[np.ndarray, np.ndarray]:
    """Thrust and air force [N], and moment [N m], (3, n) each, in axes forward, right, down."""
    span, chord, area = p["wing_span"], p["chord_length"], p["surface_area_of_wing"]
    elevator, aileron, rudder = (
        clip(u[name], p[f"delta_{name}_min"], p[f"delta_{name}_max"])
        for name in ("elevator", "aileron", "rudder")
    )
    low, high = p["throttle_input_min"], p["throttle_input_max"]
    share = (clip(clip(u["throttle"], -1.0, 1.0), low, high) - low) / (high - low)
    thrust = p["thrust_min"] + share * (p["thrust_max"] - p["thrust_min"])
    air = velocity + unrotated(quat, FLIP * p["wind"])
    speed = np.sqrt((air * air).sum(axis=0))
    speed = np.where(speed < STILL, STILL, speed)
    alpha, slip = atan2(air[2], air[0]), clip(air[1] / speed, -1.0, 1.0)
    beta = np.arcsin(slip)
    half_span, half_chord = 0.5 * span / speed, 0.5 * chord / speed
    lift, drag, side = p["lift"], p["drag"], p["side_force"]
    c_lift = lift[0] + lift[1] * alpha + lift[2] * rates[1] * half_chord + lift[4] * elevator
    induced = c_lift * c_lift / (math.pi * (span / chord) * p["efficiency_factor"])
    c_drag = drag[0] + drag[1] * np.abs(alpha) + induced + 0.01 * np.abs(elevator)
    c_side = side[0] * beta + side[1] * rudder
    push = 0.5 * p["air_density"] * speed * speed * area
    (sa, ca), (sb, cb) = sincos(alpha), sincos(beta)
    force = push * np.array([
        c_lift * sa - c_drag * ca - c_side * sb, c_side * cb, -c_lift * ca - c_drag * sa,
    ])  # fmt: skip
    force[0] += thrust
    pitch = p["pitch_moment"]
    c_roll, c_yaw = (
        c[0] * beta + (c[1] * rates[0] + c[2] * rates[2]) * half_span + c[3] * aileron + c[4] * rudder
        for c in (p["roll_moment"], p["yaw_moment"])
    )
    c_pitch = pitch[0] + pitch[1] * alpha + pitch[2] * rates[1] * half_chord + pitch[4] * elevator
    return force, push * np.array([span * c_roll, chord * c_pitch, span * c_yaw])
