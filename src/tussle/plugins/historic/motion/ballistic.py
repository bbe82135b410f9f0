"""Ballistic as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import MotionBody, State
from tussle.numeric.paths import GRAVITY
from tussle.plugins.stock.motion import ballistic


class Ballistic(ballistic.Ballistic):
    """Ballistic in which gravity is the rate of the acceleration, z''' = -m g, and the attitude is that of the world frame.

    External forces have no effect. In tussle gravity is an acceleration.
    """

    x = State(
        "x y z vx vy vz az",
        unit="m m m m/s m/s m/s m/s^2",
        doc="Position, velocity, vertical acceleration, world frame.",
    )

    @staticmethod
    def derivative(  # type: ignore[override]  # arguments are matched by name
        vx: float, vy: float, vz: float, az: float, mass: float
    ) -> tuple[float, ...]:
        """State equation: velocity [m/s], acceleration [m/s^2] and its rate [m/s^3]."""
        return vx, vy, vz, 0.0, 0.0, az, -mass * GRAVITY

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position and velocity; the attitude is that of the world frame."""
        self.x[:3, rows], self.x[3:6, rows], self.x[6, rows] = body.pos[:, rows], body.vel[:, rows], 0.0
        body.quat[:, rows] = np.array([[1.0], [0.0], [0.0], [0.0]])

    def to_body(self, body: MotionBody) -> None:
        """Write position and velocity."""
        body.pos[:], body.vel[:] = self.x[:3], self.x[3:6]
