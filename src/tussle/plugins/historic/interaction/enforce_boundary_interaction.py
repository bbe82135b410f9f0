"""EnforceBoundaryInteraction as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import WorldView
from tussle.plugins.stock.interaction import enforce_boundary_interaction


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
