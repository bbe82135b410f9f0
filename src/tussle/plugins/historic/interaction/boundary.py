"""Boundary as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import WorldView
from tussle.plugins.stock.interaction import boundary
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
