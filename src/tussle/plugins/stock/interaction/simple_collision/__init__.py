"""Collisions between entities."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import Interaction, Param, WorldView
from tussle.declare.messages import EntityCollided
from tussle.plugins.stock.interaction.simple_collision.kernels import measure, swept_pairs


class SimpleCollision(Interaction):
    """Removes both entities of each pair that comes nearer than `collision_range`.

    Entities move straight from their positions at the start of a step to those at its end, so that none is too fast to collide. Initial
    positions nearer than `startup_collision_range` to another entity are rejected. All pairs of a step collide; SCRIMMAGE takes the
    first pair of a cluster and spares the rest, and measures at the end of the step.
    """

    grade = "portable"
    reads_start_positions = True

    collision_range = Param(2.0, unit="m", ge=0.0, doc="Distance below which two entities collide.")
    startup_collision_range = Param(2.0, unit="m", ge=0.0, doc="Least distance of initial positions.")
    startup_collisions_only = Param(False, structural=True, doc="Check at the start only.")
    init_alt_deconflict = Param(False, doc="Measure startup_collision_range in altitude only.")
    enable_team_collisions = Param(True, doc="Team mates collide.")
    enable_non_team_collisions = Param(True, doc="Entities of different teams collide.")

    def start(self, w: WorldView) -> None:
        self._collide(w, w.pos)

    def step(self, w: WorldView) -> None:
        if not self.startup_collisions_only:
            self._collide(w, self._begin(w))

    def _begin(self, w: WorldView) -> np.ndarray:
        """Positions at which the ways of the step begin [m], (3, n)."""
        return w.start_pos

    def _collide(self, w: WorldView, begin: np.ndarray) -> None:
        first, second = self._pairs(w, begin)
        if not len(first):
            return
        k = self._colliding(w, first, second)
        first, second = first[k], second[k]
        w.publish(
            EntityCollided,
            w.world[first],
            first=w.id[first],
            second=w.id[second],
            first_team=w.team[first],
            second_team=w.team[second],
        )
        w.kill(np.unique(np.concatenate([first, second])), "collision")

    def _pairs(self, w: WorldView, begin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows of the pairs that come within range, the smaller id first, ordered by ids, (m,) each."""
        limit, far = self.collision_range[w.world], np.empty(w.n)
        index = w.index(float(limit.max(initial=0.0)) + 2.0 * measure(w.pos, begin, far))
        rows = w.id, w.team, index.row_world, index.place, index.order
        enabled = self.enable_team_collisions[w.world], self.enable_non_team_collisions[w.world]
        table = (*index.table, w.by_place(index, "team")[0])
        room, n_pairs = -1, 16 + w.n
        while n_pairs > room:  # repeat with more room if the pairs did not fit
            room = n_pairs
            first, second = np.empty(room, np.int64), np.empty(room, np.int64)
            n_pairs = swept_pairs((w.pos, begin, far), limit, enabled, rows, table, (first, second))
        first, second = first[:n_pairs], second[:n_pairs]
        if not n_pairs:
            return first, second
        order = np.lexsort((w.id[second], w.id[first], w.world[first]))
        return first[order], second[order]

    def _colliding(self, w: WorldView, first: np.ndarray, second: np.ndarray) -> Any:
        """Return the indices of the pairs within range that collide."""
        return slice(None)

    def rejects(self, w: WorldView, world: int, pos: np.ndarray, taken: np.ndarray) -> bool:
        dx, dy, dz = taken - pos[:, None]
        room = self.startup_collision_range[world]
        distance = np.abs(dz) if self.init_alt_deconflict[world] else np.sqrt(dx * dx + dy * dy + dz * dz)
        return bool((distance < room).any())
