"""GroundCollision as in SCRIMMAGE."""

from __future__ import annotations

from tussle.api import WorldView
from tussle.stock.interaction import ground_collision


class GroundCollision(ground_collision.GroundCollision):
    """GroundCollision that reports the entities on the ground in every step, so that a metric counts each step.

    It bears those at or below the level. In tussle it bears what is up to a micrometre above it too.
    """

    rest_height = 0.0

    def step(self, w: WorldView) -> None:
        self.is_down[:] = False
        super().step(w)
