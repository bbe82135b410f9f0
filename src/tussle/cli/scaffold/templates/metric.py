"""A metric: measures a game and decides who wins."""

import numpy as np

from tussle.api import Metric, Param, State, WorldView


class New(Metric):
    """Measures the time that the robots of each team spend near the origin; the team with the longest time wins."""

    grade = "portable"

    radius = Param(500.0, unit="m", gt=0.0, doc="Distance from the origin that counts as near.")
    time_there = State(unit="s", per="team", doc="Time so far, summed over the robots.")

    def step(self, w: WorldView) -> None:
        """Update all robots of all worlds; parameters have one value per world."""
        east, north, _ = w.pos
        is_there = east * east + north * north < self.radius[w.world] ** 2
        np.add.at(self.time_there, (w.team_numbers(w.team[is_there]), w.world[is_there]), w.dt)

    def result(self, w: WorldView) -> dict[str, np.ndarray]:
        """Return the results at the end: one value per team and world; "score" decides who wins."""
        return {"score": self.time_there}
