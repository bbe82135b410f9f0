"""Interactions with boundaries and regions, as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import WorldView
from tussle.plugins.stock.interaction import (
    boundary,
    capture_in_boundary_interaction,
    enforce_boundary_interaction,
    flag_capture_interaction,
)
from tussle.world.scene import Cuboid, Volume


class Boundary(boundary.Boundary):
    """Boundary that ignores the rotation of a cuboid, and publishes its shape in the first step only, even if no entity is there.

    Entities that are born later never receive it; in tussle it waits for the first entity. An entity that goes through
    the region in one step does not enter it. Planes and polyhedra are those of tussle:
    in SCRIMMAGE a plane has sides, and a polyhedron ends the run.
    """

    def region(self) -> Volume:
        """Return the region as a shape of the scene."""
        if self.values["shape"] == "cuboid":
            return Cuboid(center=self.values["center"], lengths=self.values["lengths"])
        return super().region()

    def step(self, w: WorldView) -> None:
        self.is_told[:] |= w.step_count > 0
        super().step(w)

    def _is_through(self, w: WorldView, may: np.ndarray) -> np.ndarray:
        return np.zeros(w.n, bool)


class CaptureInBoundaryInteraction(capture_in_boundary_interaction.CaptureInBoundaryInteraction):
    """CaptureInBoundaryInteraction that measures from defenders after the motion to where the others were before it.

    Both must be inside the boundary after it. The boundary is known from the end of the first step on.
    """

    def _is_inside(self, w: WorldView, shape: Volume) -> np.ndarray:
        return shape.contains(w.pos)

    def _near(self, w: WorldView, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        reach = np.where(w.step_count[w.world] > 0, reach, 0.0)
        moved = w.pos - w.start_pos
        farthest = np.sqrt((moved * moved).sum(axis=0)).max(initial=0.0)
        near = w.near(np.where(reach > 0.0, reach + farthest + 1e-6, 0.0), teams="other")
        row, other = near.row, near.other
        x, y, z = w.start_pos[:, other] - w.pos[:, row]
        distance = np.sqrt(x * x + y * y + z * z)
        is_near = distance < reach[row]
        return row[is_near], other[is_near], distance[is_near]


class EnforceBoundaryInteraction(enforce_boundary_interaction.EnforceBoundaryInteraction):
    """EnforceBoundaryInteraction that ignores ids without a boundary, and uses its boundaries from the end of the first step on.

    If none of the ids has a boundary, nobody is removed.
    """

    def named_regions(self) -> tuple[int, ...]:
        """Return none: an id without a boundary is no error."""
        return ()

    def step(self, w: WorldView) -> None:
        active = self.values["active_boundary_ids"]
        regions = [region.shape for region in w.context.regions if region.boundary in active]
        is_outside = (w.step_count > 0)[w.world] & bool(regions)
        for shape in regions:
            is_outside &= ~shape.contains(w.pos)
        w.kill(np.flatnonzero(is_outside), "outside the boundary")


class FlagCaptureInteraction(flag_capture_interaction.FlagCaptureInteraction):
    """FlagCaptureInteraction in which all that enter in one step publish that they took the flag, and the last one has it.

    The last is that of the largest id; in tussle the nearest to the centre takes it. The boundaries are known from the end of the first
    step on. Only those that are inside at the end of a step enter.
    """

    def _enters(self, w: WorldView, shape: Volume, may: np.ndarray) -> np.ndarray:
        return np.asarray(may & shape.contains(w.pos))

    def _takers(self, w: WorldView, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rows = rows[w.step_count[w.world[rows]] > 0]
        rows = rows[np.lexsort((w.id[rows], w.world[rows]))]
        _, last = np.unique(w.world[rows][::-1], return_index=True)
        return rows[::-1][last], rows
