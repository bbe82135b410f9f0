"""Entities that meet are gone."""

from __future__ import annotations

import numpy as np

from tussle.api import Interaction, Param, WorldView
from tussle.messages import EntityCollided


class SimpleCollision(Interaction):
    """Removes every two entities that are nearer than `collision_range`, and keeps that much room when entities are placed.

    All pairs of a step count; the historic one took the first pair of a cluster and spared the rest.
    """

    grade = "portable"

    collision_range = Param(2.0, unit="m", ge=0.0, doc="Distance below which two collide.")
    startup_collision_range = Param(2.0, unit="m", ge=0.0, doc="Room around each entity when it is placed.")
    startup_collisions_only = Param(False, structural=True, doc="Look after placement only.")
    init_alt_deconflict = Param(False, doc="Keep the room in height alone when placing.")
    enable_team_collisions = Param(True, doc="Team mates collide.")
    enable_non_team_collisions = Param(True, doc="Others collide.")

    def start(self, w: WorldView) -> None:
        self._collide(w)

    @property
    def is_idle(self) -> bool:
        """With startup_collisions_only it looks at the start alone."""
        return bool(self.startup_collisions_only)

    def step(self, w: WorldView) -> None:
        self._collide(w)

    def _collide(self, w: WorldView) -> None:
        pairs = w.near(self.collision_range[w.world])
        if not len(pairs.row):
            return
        first, second = pairs.row, pairs.other
        world = w.world[first]
        is_team = w.team[first] == w.team[second]
        counts = np.where(is_team, self.enable_team_collisions[world], self.enable_non_team_collisions[world])
        counts &= w.id[first] < w.id[second]
        first, second, world = first[counts], second[counts], world[counts]
        w.publish(
            EntityCollided,
            world,
            first=w.id[first],
            second=w.id[second],
            first_team=w.team[first],
            second_team=w.team[second],
        )
        w.kill(np.unique(np.concatenate([first, second])), "collision")

    def rejects(self, w: WorldView, world: int, pos: np.ndarray, taken: np.ndarray) -> bool:
        dx, dy, dz = taken - pos[:, None]
        room = self.startup_collision_range[world]
        distance = np.abs(dz) if self.init_alt_deconflict[world] else np.sqrt(dx * dx + dy * dy + dz * dz)
        return bool((distance < room).any())
