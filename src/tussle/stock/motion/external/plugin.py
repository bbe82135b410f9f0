"""A body whose state comes from outside."""

from __future__ import annotations

import numpy as np

from tussle.api import MotionBody, MotionModel, State


class External(MotionModel):
    """No motion of its own: position, velocity, attitude and angular velocity stay as `Simulation.write` sets them.

    For a real robot, a tracked object or another simulator: write their states, make a step, and read what sensors, autonomies and
    controllers make of them. Channels that nobody in the simulation takes are outputs to be read.
    """

    grade = "portable"
    reads_all = True

    x = State("x y z", unit="m", doc="Position, world frame.")

    @staticmethod
    def derivative() -> tuple[float, float, float]:
        """State equation: nothing changes."""
        return 0.0, 0.0, 0.0

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Take the position over."""
        self.x[:, rows] = body.pos[:, rows]

    def to_body(self, body: MotionBody) -> None:
        """Nothing to publish: the table holds what was written."""
