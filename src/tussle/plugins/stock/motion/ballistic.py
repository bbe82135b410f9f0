"""A mass in free fall."""

from __future__ import annotations

import numpy as np

from tussle.api import MotionBody, MotionModel, State
from tussle.numeric.paths import GRAVITY


class Ballistic(MotionModel):
    """A mass in free fall without drag: x'' = F / m - (0, 0, g), Newton's second law with g = 9.81 m/s^2.

    F is the external force, such as that of the ground. Parabolas are integrated exactly. The attitude does not change. In
    SCRIMMAGE gravity is the rate of the acceleration, and the attitude is that of the world frame.
    """

    grade = "portable"

    x = State("x y z vx vy vz", unit="m m m m/s m/s m/s", doc="Position and velocity, world frame.")

    @staticmethod
    def derivative(
        vx: float, vy: float, vz: float, force_x: float, force_y: float, force_z: float, mass: float
    ) -> tuple[float, ...]:
        """State equation: velocity [m/s] and acceleration [m/s^2]."""
        return vx, vy, vz, force_x / mass, force_y / mass, force_z / mass - GRAVITY

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position and velocity."""
        self.x[:3, rows], self.x[3:, rows] = body.pos[:, rows], body.vel[:, rows]

    def to_body(self, body: MotionBody) -> None:
        """Write position and velocity."""
        body.pos[:], body.vel[:] = self.x[:3], self.x[3:]
