"""Counts and times of arrivals."""

from __future__ import annotations

import numpy as np

from tussle.api import Metric, State, WorldView
from tussle.declare.messages import GoalReached


class Arrivals(Metric):
    """Counts the entities that reached their goals (`GoalReached`), by team, with their mean arrival time [s]. The score is the count.

    The mean is NaN for a team without arrivals.
    """

    grade = "portable"

    arrived = State(dtype=int, per="team", doc="Arrivals so far.")
    total = State(unit="s", per="team", doc="Sum of their times.")

    def step(self, w: WorldView) -> None:
        """Count the messages of this step."""
        messages = w.inbox(GoalReached)
        teams = w.team_numbers(messages.team)
        np.add.at(self.arrived, (teams, messages.world), 1)
        np.add.at(self.total, (teams, messages.world), messages.t)

    def result(self, w: WorldView) -> dict[str, np.ndarray]:
        """Return counts and mean times."""
        n = self.arrived
        mean = np.where(n > 0, self.total / np.maximum(n, 1), np.nan)
        return {"arrived": n, "mean_time": mean, "score": n}
