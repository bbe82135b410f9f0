"""DubinsAirplane as in SCRIMMAGE."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.api import MotionBody, State
from tussle.numeric import clip, cos, sin, sincos, tan
from tussle.numeric.paths import GRAVITY
from tussle.plugins.historic.integration import advance_by, rk4_step
from tussle.plugins.stock.motion import dubins_airplane

STILL = 2.220446049250313e-16
"""Speed below which there are no turns [m/s]."""


class DubinsAirplane(dubins_airplane.DubinsAirplane):
    """DubinsAirplane of which a positive desired_pitch lowers the nose; `vel` is the mean over the last substep.

    In tussle a positive desired_pitch raises the nose.
    """

    grade = "machine"
    x = State(
        "x y z yaw dive roll vx vy vz",
        unit="m m m rad rad rad m/s m/s m/s",
        doc="Position, heading, elevation (nose down), bank (right wing down), mean velocity.",
    )

    @property
    def advance(self) -> Callable[..., None]:
        """RK4."""
        return advance_by(self, _step)

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position, attitude and velocity."""
        parts = [*body.pos, body.yaw, -body.climb, body.roll, *body.vel]
        self.x[:, rows] = np.array(parts)[:, rows]

    def to_body(self, body: MotionBody) -> None:
        """Write position, velocity and attitude."""
        x = self.x
        body.pos[:], body.vel[:] = x[:3], x[6:]
        body.set_attitude(x[5], -x[4], x[3])


def _step(x: np.ndarray, u: dict[str, np.ndarray], p: dict[str, Any], h: float) -> None:
    speed = clip(u["desired_speed"], p["speed_min"], p["speed_max"])
    dive = clip(u["desired_pitch"], p["pitch_min"], p["pitch_max"])
    roll = clip(u["desired_roll"], p["roll_min"], p["roll_max"])
    moves = np.abs(speed) >= STILL
    turn = np.where(moves, -GRAVITY / np.where(moves, speed, 1.0) * tan(roll), 0.0)
    sine, cosine = sincos(dive)

    def f(s: np.ndarray) -> np.ndarray:
        level = speed * cosine
        return np.array([level * cos(s[3]), level * sin(s[3]), -speed * sine, turn])

    start = x[:3].copy()
    x[:4] = rk4_step(f, x[:4], h)
    x[4], x[5], x[6:] = dive, roll, (x[:3] - start) / h
