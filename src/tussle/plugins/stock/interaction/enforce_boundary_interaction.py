"""Regions that entities must not leave, or enter."""

from __future__ import annotations

import numpy as np

from tussle.api import Interaction, Param, WorldView


class EnforceBoundaryInteraction(Interaction):
    """Removes entities that are outside all active boundaries at the end of a step, or inside a no-fly boundary during the step.

    During the step an entity moves straight, so that none is too fast for a narrow no-fly boundary.

    Raises:
        MissionError: An id is not that of exactly one boundary of the mission.
    """

    grade = "portable"
    reads_start_positions = True

    active_boundary_ids = Param(
        (1, 2, 3, 4), ragged=True, doc="Boundaries of which entities must be in at least one; none if empty."
    )
    no_fly_boundary_ids = Param((), ragged=True, doc="Boundaries in which entities must not be.")

    def named_regions(self) -> tuple[int, ...]:
        """Return the boundaries of both kinds."""
        return *self.values["active_boundary_ids"], *self.values["no_fly_boundary_ids"]

    def step(self, w: WorldView) -> None:
        allowed, forbidden = (
            [w.region(i).shape for i in self.values[name]]
            for name in ("active_boundary_ids", "no_fly_boundary_ids")
        )
        is_inside = np.full(w.n, not allowed)
        for shape in allowed:
            is_inside |= shape.contains(w.pos)
        w.kill(~is_inside, "outside the boundary")
        for shape in forbidden:
            w.kill(shape.crossed(w.start_pos, w.pos), "in a no-fly region")
