"""AvoidWalls as in SCRIMMAGE."""

from __future__ import annotations

from tussle.api import GroupView
from tussle.plugins.stock.autonomy import avoid_walls


class AvoidWalls(avoid_walls.AvoidWalls):
    """AvoidWalls that drives on with `initial_speed` whatever its sensor sees: it listens to a topic to which no sensor talks."""

    def step(self, g: GroupView) -> None:
        """Keep the heading."""
        self.desired_heading[:] = g.yaw
