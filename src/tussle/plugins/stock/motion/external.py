"""A body whose state is set from outside."""

from __future__ import annotations

import numpy as np

from tussle.api import MotionBody, MotionModel, State


class External(MotionModel):
    """A body without motion: position, velocity, attitude and angular velocity are set by `Simulation.write`.

    Use it for a real robot, a tracked object or another simulator: write the states, step, and read the outputs of sensors,
    autonomies and controllers. Channels that no plugin reads can be read with `Simulation.read`.
    """

    grade = "portable"
    reads_all = True

    x = State("x y z", unit="m", doc="Position, world frame.")

    @staticmethod
    def derivative() -> tuple[float, float, float]:
        """State equation: the state is constant."""
        return 0.0, 0.0, 0.0

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy the position."""
        self.x[:, rows] = body.pos[:, rows]

    def to_body(self, body: MotionBody) -> None:
        """Do nothing: the body table already holds what was written."""
