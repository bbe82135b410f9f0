"""WaypointGenerator as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView, State
from tussle.plugins.stock.autonomy import waypoint_generator


class WaypointGenerator(waypoint_generator.WaypointGenerator):
    """WaypointGenerator whose clock adds dt in each step, and so may reach the time of a waypoint one step late by rounding.

    tussle's time is start + k dt, and a waypoint is due at the step next to its time.
    """

    clock = State(unit="s", doc="Sum of the steps since the start.")

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        for row, n_steps in zip(rows, g.step_count[rows], strict=True):
            self.clock[row] = np.cumsum([g.context.clock.start, *[g.dt] * n_steps])[-1]

    def _now(self, g: GroupView) -> np.ndarray:
        now: np.ndarray = self.clock.copy()
        self.clock[:] += g.dt
        return now
