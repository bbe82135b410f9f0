"""A metric: what is counted in a game, and who wins it."""

import numpy as np

from tussle.api import Metric, Param, State, WorldView


class New(Metric):
    """The time that each team's robots spend near a point; the team that is there more wins."""

    grade = "portable"

    radius = Param(500.0, unit="m", gt=0.0, doc="What counts as near the origin.")
    time_there = State(unit="s", per="team", doc="Robot seconds so far.")

    def step(self, w: WorldView) -> None:
        """One call for all robots of all worlds; parameters have one value per world."""
        east, north, _ = w.pos
        is_there = east * east + north * north < self.radius[w.world] ** 2
        np.add.at(self.time_there, (w.team_numbers(w.team[is_there]), w.world[is_there]), w.dt)

    def result(self, w: WorldView) -> dict[str, np.ndarray]:
        """What is told at the end, one value per team and world; "score" decides who wins."""
        return {"score": self.time_there}
