"""Straight as in SCRIMMAGE."""

from __future__ import annotations

from tussle.api import GroupView
from tussle.plugins.historic.angles import headings
from tussle.plugins.stock.autonomy import straight


class Straight(straight.Straight):
    """Straight whose desired heading is not negative: a controller's error then rounds as there."""

    def step(self, g: GroupView) -> None:
        super().step(g)
        self.desired_heading[:] = headings(self.desired_heading)
