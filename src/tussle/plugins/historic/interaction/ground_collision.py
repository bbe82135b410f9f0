"""GroundCollision as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import WorldView
from tussle.plugins.stock.interaction.ground_collision import Ground


class GroundCollision(Ground):
    """GroundCollision that reports the entities on the ground in every step, so that a metric counts each step.

    It is no contact: those at or below the level are pushed up with their weight.
    """

    def step(self, w: WorldView) -> None:
        self.is_down[:] = False
        super().step(w)

    def _carry(self, w: WorldView, height: np.ndarray) -> None:
        rows = np.flatnonzero(height <= 0.0)
        if len(rows):
            # Not less than 0: the ground does not hold down what rises.
            w.bodies.force[2, rows] += np.maximum(w.mass_properties().weight[rows], 0.0)
