"""Collisions of entities with the scene."""

from __future__ import annotations

import numpy as np

from tussle.api import Interaction, Param, State, WorldView

FAR = 1e150
"""Coordinate beyond which collisions are not checked [m]: the square of a distance would overflow."""


class SceneCollision(Interaction):
    """Removes entities whose sphere of `radius` touches the scene: walls, buildings, meshes, hills, ground.

    The straight path of the centre since the last step must be free too, so that fast entities do not pass through thin walls. Initial
    positions in the scene are rejected.
    """

    grade = "portable"
    named_teams = ("team",)

    margin = Param(
        0.0,
        unit="m",
        ge=0.0,
        doc="Distance to the scene below which an entity of radius 0 collides; adds to the radius.",
    )
    team = Param(0, doc="Team that collides; 0 for all.")
    last = State("x y z", unit="m", per="entity", doc="Position at the last call.")
    is_known = State(dtype=bool, per="entity", doc="Whether there was a call before.")

    def start(self, w: WorldView) -> None:
        """Check the first positions."""
        self.step(w)

    def step(self, w: WorldView) -> None:
        """Remove colliding entities."""
        team = self.team[w.world]
        is_near = (np.abs(w.pos) < FAR).all(axis=0)
        rows = np.flatnonzero(((team == 0) | (team == w.team)) & is_near)
        pos = w.pos[:, rows]
        last = np.where(self.is_known[rows], self.last[:, rows], pos)
        is_clear = w.scene.free(pos, w.radius[rows] + self.margin[w.world[rows]]) & w.scene.line_of_sight(
            last, pos
        )
        w.kill(rows[~is_clear], "scene")
        self.last[:, rows], self.is_known[rows] = pos, True

    def rejects(self, w: WorldView, world: int, pos: np.ndarray, taken: np.ndarray) -> bool:
        """Return True if a point is in the scene."""
        return not w.scene.free(pos[:, None], self.margin[world])[0]
