"""SimpleCollision as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import WorldView
from tussle.plugins.stock.interaction import simple_collision


class SimpleCollision(simple_collision.SimpleCollision):
    """SimpleCollision that takes pairs in the order of ids, and ignores pairs with an entity just removed.

    So of three that collide, the first pair is removed and the third flies on. Entities that an earlier interaction has removed in the
    step do not collide. Distances are those at the end of the step. In tussle all pairs collide, also between
    two steps. With `init_alt_deconflict`, positions at the range itself are rejected too.
    """

    def _begin(self, w: WorldView) -> np.ndarray:
        return np.asarray(w.pos)

    def _colliding(self, w: WorldView, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        is_gone = np.zeros(w.n, bool)
        for rows, _ in w.deaths:
            is_gone[rows] = True
        kept = []
        for number, (row, other) in enumerate(zip(first, second, strict=True)):
            if not (is_gone[row] or is_gone[other]):
                is_gone[[row, other]] = True
                kept.append(number)
        return np.array(kept, np.int64)

    def rejects(self, w: WorldView, world: int, pos: np.ndarray, taken: np.ndarray) -> bool:
        if self.init_alt_deconflict[world]:
            return bool((np.abs(taken[2] - pos[2]) <= self.startup_collision_range[world]).any())
        return super().rejects(w, world, pos, taken)
