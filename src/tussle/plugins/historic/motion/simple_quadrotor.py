"""SimpleQuadrotor as in SCRIMMAGE."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.api import MotionBody, State
from tussle.numeric import cos, sin, sincos
from tussle.plugins.historic.integration import advance_by, rk4_step
from tussle.plugins.stock.motion import simple_quadrotor

FASTEST, FASTEST_UP = 15.0, 10.0
"""Speeds beyond which the motion does not count, forwards and up [m/s]."""


class SimpleQuadrotor(simple_quadrotor.SimpleQuadrotor):
    """SimpleQuadrotor whose velocity turns with the nose, and moves it with up to 15 m/s forwards and 10 m/s up.

    There is no limit backwards and down; y_thrust has no effect on the path. The nose is tilted down forwards, up backwards without
    limit. In tussle the velocity keeps its direction, and the speed is limited.
    """

    grade = "machine"
    x = State(
        "x y z forward left up yaw yaw_rate",
        unit="m m m m/s m/s m/s rad rad/s",
        doc="Position, speed forwards, to the left and up, heading and its rate.",
    )

    @property
    def advance(self) -> Callable[..., None]:
        """RK4."""
        return advance_by(self, _step)

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position, velocity along the heading, heading and yaw rate."""
        super().from_body(body, rows)
        (sine, cosine), (vx, vy) = sincos(self.x[6, rows]), self.x[3:5, rows]
        self.x[3:5, rows] = vx * cosine + vy * sine, vy * cosine - vx * sine

    def to_body(self, body: MotionBody) -> None:
        """Write position, velocity and attitude."""
        x, (sine, cosine) = self.x, sincos(self.x[6])
        body.pos[:] = x[:3]
        body.vel[0], body.vel[1], body.vel[2] = x[3] * cosine, x[3] * sine, x[5]
        body.set_attitude(climb=-self.max_pitch * np.minimum(1.0, x[3] / self.max_vel), yaw=x[6])


def _step(x: np.ndarray, u: dict[str, np.ndarray], p: dict[str, Any], h: float) -> None:
    def f(s: np.ndarray) -> np.ndarray:
        speed = np.minimum(s[3], FASTEST)
        return np.array(
            [
                speed * cos(s[6]),
                speed * sin(s[6]),
                np.minimum(s[5], FASTEST_UP),
                u["x_thrust"],
                u["y_thrust"],
                u["z_thrust"],
                s[7],
                u["turn_force"],
            ]
        )

    x[:] = rk4_step(f, x, h)
