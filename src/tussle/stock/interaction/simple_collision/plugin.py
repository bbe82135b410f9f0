"""Collisions between entities."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import Interaction, Param, WorldView, neighbors
from tussle.api.laws import Listed
from tussle.messages import EntityCollided


class SimpleCollision(Interaction):
    """Removes both entities of each pair nearer than `collision_range`.

    Initial positions nearer than `startup_collision_range` to another entity are rejected. All pairs of a step collide; the existing
    system took the first pair of a cluster and spared the rest.
    """

    grade = "portable"

    collision_range = Param(2.0, unit="m", ge=0.0, doc="Distance below which two entities collide.")
    startup_collision_range = Param(2.0, unit="m", ge=0.0, doc="Least distance of initial positions.")
    startup_collisions_only = Param(False, structural=True, doc="Check at the start only.")
    init_alt_deconflict = Param(False, doc="Measure startup_collision_range in altitude only.")
    enable_team_collisions = Param(True, doc="Team mates collide.")
    enable_non_team_collisions = Param(True, doc="Entities of different teams collide.")

    def start(self, w: WorldView) -> None:
        self._collide(w)

    def step(self, w: WorldView) -> None:
        if not self.startup_collisions_only:
            self._collide(w)

    @neighbors("collision_range", first="each", second="each", first_team="each", second_team="each")
    @staticmethod
    def meet(
        id: int, other_id: int, team: int, other_team: int,  # noqa: A002 - a column
        enable_team_collisions: bool, enable_non_team_collisions: bool,
    ) -> tuple[int, ...] | None:  # fmt: skip
        if id > other_id or not (
            enable_team_collisions if team == other_team else enable_non_team_collisions
        ):
            return None
        return id, other_id, team, other_team

    def _collide(self, w: WorldView) -> None:
        met = self.meet(w)
        if not len(met):
            return
        k = self._colliding(w, met)
        w.publish(
            EntityCollided,
            w.world[met.row[k]],
            first=met.first[k],
            second=met.second[k],
            first_team=met.first_team[k],
            second_team=met.second_team[k],
        )
        w.kill(np.unique(np.concatenate([met.row[k], met.other[k]])), "collision")

    def _colliding(self, w: WorldView, met: Listed) -> Any:
        """Return the indices of the pairs within range that collide."""
        return slice(None)

    def rejects(self, w: WorldView, world: int, pos: np.ndarray, taken: np.ndarray) -> bool:
        dx, dy, dz = taken - pos[:, None]
        room = self.startup_collision_range[world]
        distance = np.abs(dz) if self.init_alt_deconflict[world] else np.sqrt(dx * dx + dy * dy + dz * dz)
        return bool((distance < room).any())
