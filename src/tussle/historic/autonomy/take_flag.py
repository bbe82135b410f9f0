"""TakeFlag as in SCRIMMAGE."""

from __future__ import annotations

from typing import Any

from tussle.stock.autonomy import take_flag


class TakeFlag(take_flag.TakeFlag):
    """TakeFlag that stands still in the first step.

    In SCRIMMAGE it learns of its regions by messages that are delivered at the end of that step; in tussle all entities know the
    regions of the mission at once. Entities born later never learn of them in SCRIMMAGE; here they do.
    """

    def step(self, g: Any) -> None:
        super().step(g)
        self.velocity[:, g.step_count == 0] = 0.0
