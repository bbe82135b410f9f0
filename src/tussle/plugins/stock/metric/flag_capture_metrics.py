"""Counts of flags taken and captured."""

from __future__ import annotations

import numpy as np

from tussle.api import Metric, Param, State, WorldView
from tussle.declare.messages import FlagCaptured, FlagTaken


class FlagCaptureMetrics(Metric):
    """Counts flags taken and flags brought home, by team of the carrier; the score is their weighted sum."""

    grade = "portable"

    flags_taken_w = Param(1.0, doc="Score per flag taken.")
    flags_captured_w = Param(1.0, doc="Score per flag captured.")
    flags_taken = State(dtype=int, per="team", doc="Flags taken so far.")
    flags_captured = State(dtype=int, per="team", doc="Flags captured so far.")

    def step(self, w: WorldView) -> None:
        for event, count in ((FlagTaken, self.flags_taken), (FlagCaptured, self.flags_captured)):
            messages = w.inbox(event)
            np.add.at(count, (w.team_numbers(messages.team), messages.world), 1)

    def result(self, w: WorldView) -> dict[str, np.ndarray]:
        score = self.flags_taken_w * self.flags_taken + self.flags_captured_w * self.flags_captured
        return {"flags_taken": self.flags_taken, "flags_captured": self.flags_captured, "score": score}
