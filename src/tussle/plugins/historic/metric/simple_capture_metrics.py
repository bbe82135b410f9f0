"""SimpleCaptureMetrics as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import State, WorldView
from tussle.plugins.stock.metric import simple_capture_metrics


class SimpleCaptureMetrics(simple_capture_metrics.SimpleCaptureMetrics):
    """SimpleCaptureMetrics that counts no captures by teams which first appear after the first step."""

    is_listed = State(dtype=bool, per="team", doc="Whether the team was there in the first step.")

    def step(self, w: WorldView) -> None:
        is_first = w.step_count[w.world] == 0
        self.is_listed[w.team_numbers(w.team[is_first]), w.world[is_first]] = True
        super().step(w)

    def result(self, w: WorldView) -> dict[str, np.ndarray]:
        return {name: np.where(self.is_listed, count, 0) for name, count in super().result(w).items()}
