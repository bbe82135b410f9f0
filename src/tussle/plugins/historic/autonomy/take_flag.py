"""TakeFlag as in SCRIMMAGE."""

from __future__ import annotations

from typing import Any

from tussle.plugins.stock.autonomy import take_flag


class TakeFlag(take_flag.TakeFlag):
    """TakeFlag that stands still in the first step.

    In SCRIMMAGE it receives its regions in messages, which are delivered at the end of that step; in tussle all entities have the
    regions of the mission at once. In SCRIMMAGE entities born later never receive them; here they have them too.
    """

    def step(self, g: Any) -> None:
        super().step(g)
        self.velocity[:, g.step_count == 0] = 0.0
