"""BoundaryDefense as in SCRIMMAGE."""

from __future__ import annotations

from typing import Any

from tussle.stock.autonomy import boundary_defense


class BoundaryDefense(boundary_defense.BoundaryDefense):
    """BoundaryDefense that aims one step ahead of an intruder, and stands still in the first step.

    In SCRIMMAGE it receives its regions in messages, which are delivered at the end of that step; in tussle all entities have the
    regions of the mission at once. In SCRIMMAGE entities born later never receive them; here they have them too.
    """

    def step(self, g: Any) -> None:
        super().step(g)
        self.velocity[:, g.step_count == 0] = 0.0

    def lead(self, g: Any) -> Any:
        """One step [s]."""
        return g.dt
