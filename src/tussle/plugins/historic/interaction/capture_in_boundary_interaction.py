"""CaptureInBoundaryInteraction as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import WorldView
from tussle.plugins.stock.interaction import capture_in_boundary_interaction
from tussle.world.scene import Volume


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
