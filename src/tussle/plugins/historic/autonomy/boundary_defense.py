"""BoundaryDefense as in SCRIMMAGE."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.plugins.stock.autonomy import boundary_defense


class BoundaryDefense(boundary_defense.BoundaryDefense):
    """BoundaryDefense that does not add the speed of the intruder to its own, and stands still in the first step.

    In SCRIMMAGE it receives its regions in messages, which are delivered at the end of that step; in tussle all entities have the
    regions of the mission at once. In SCRIMMAGE entities born later never receive them; here they have them too.
    """

    def step(self, g: Any) -> None:
        super().step(g)
        self.velocity[:, g.step_count == 0] = 0.0

    def command(self, way: np.ndarray, _: np.ndarray) -> np.ndarray:
        """Desired velocity [m/s], (3, n): the way [m] in one second."""
        return way
