"""GroundCollision as in SCRIMMAGE."""

from __future__ import annotations

from tussle.api import WorldView
from tussle.stock.interaction import ground_collision


class GroundCollision(ground_collision.GroundCollision):
    """GroundCollision that reports the entities on the ground in every step, so that a metric counts each step."""

    def step(self, w: WorldView) -> None:
        self.is_down[:] = False
        super().step(w)
