"""Counts and times of arrivals."""

from __future__ import annotations

import numpy as np

from tussle.api import Metric, State, WorldView
from tussle.messages import GoalReached


class Arrivals(Metric):
    """Counts by team who reached the goal (`GoalReached`), and their mean time of arrival [s]; the score is the count.

    The mean is NaN for a team of which nobody arrived.
    """

    grade = "portable"

    arrived = State(dtype=int, per="team", doc="Arrivals so far.")
    total = State(unit="s", per="team", doc="Sum of their times.")

    def step(self, w: WorldView) -> None:
        """Count the messages of this step."""
        told = w.inbox(GoalReached)
        teams = w.team_numbers(told.team)
        np.add.at(self.arrived, (teams, told.world), 1)
        np.add.at(self.total, (teams, told.world), told.t)

    def result(self, w: WorldView) -> dict[str, np.ndarray]:
        """Return counts and mean times."""
        n = self.arrived
        mean = np.where(n > 0, self.total / np.maximum(n, 1), np.nan)
        return {"arrived": n, "mean_time": mean, "score": n}
