"""What stands where it is put."""

from __future__ import annotations

import numpy as np

from tussle.api import MotionBody, MotionModel, State


class Still(MotionModel):
    """No motion: a ground station, a target, a landmark. It has no inputs, so whatever it decides goes out by message.

    Missions of the existing system write no motion model at all for such entities.
    """

    grade = "portable"

    x = State("x y z", unit="m", doc="Position, world frame.")

    @staticmethod
    def derivative() -> tuple[float, float, float]:
        """State equation: nothing changes."""
        return 0.0, 0.0, 0.0

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Take the position over."""
        self.x[:, rows] = body.pos[:, rows]

    def to_body(self, body: MotionBody) -> None:
        """Publish a velocity of zero; position and attitude are in the table already."""
        body.vel[:] = 0.0
