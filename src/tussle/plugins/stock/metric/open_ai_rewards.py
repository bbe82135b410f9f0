"""Sums of rewards."""

from __future__ import annotations

import numpy as np

from tussle.api import HistoricAttributes, Metric, State, WorldView
from tussle.declare.messages import RewardGiven


class OpenAIRewards(Metric):
    """Sums the rewards (`RewardGiven`) of each team, and in the column `earned` those of each living entity.

    SCRIMMAGE wrote the sum of each entity to a file.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(unread=("ground_collisions",))

    reward = State(per="team", doc="Sum of the rewards of the team.")
    earned = State(per="entity", doc="Sum of the rewards of the entity.")

    def step(self, w: WorldView) -> None:
        messages = w.inbox(RewardGiven)
        np.add.at(self.reward, (w.team_numbers(messages.team), messages.world), messages.reward)
        row = w.rows_at(messages.world, messages.entity)
        np.add.at(self.earned, row[row >= 0], messages.reward[row >= 0])

    def result(self, w: WorldView) -> dict[str, np.ndarray]:
        return {"reward": self.reward}
