"""A body that does not move."""

from __future__ import annotations

import numpy as np

from tussle.api import MotionBody, MotionModel, State


class Still(MotionModel):
    """A body that does not move: a ground station, a target, a landmark. It has no inputs.

    Missions of SCRIMMAGE name no motion model for such entities.
    """

    grade = "portable"

    x = State("x y z", unit="m", doc="Position, world frame.")

    @staticmethod
    def derivative() -> tuple[float, float, float]:
        """State equation: the state is constant."""
        return 0.0, 0.0, 0.0

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy the position."""
        self.x[:, rows] = body.pos[:, rows]

    def to_body(self, body: MotionBody) -> None:
        """Write zero velocity; position and attitude are already in the body table."""
        body.vel[:] = 0.0
