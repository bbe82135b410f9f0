"""An interaction: effects between robots, or between robots and the world, after the motion of each step."""

import numpy as np

from tussle.api import Interaction, Param, State, WorldView


class New(Interaction):
    """An arena; robots that leave it are removed."""

    grade = "portable"

    radius = Param(1500.0, unit="m", gt=0.0, doc="Radius of the arena around the origin.")
    n_lost = State(dtype=int, per="team", doc="Robots removed so far.")

    def step(self, w: WorldView) -> None:
        """Update all robots of all worlds; parameters have one value per world."""
        east, north, _ = w.pos
        is_out = east * east + north * north > self.radius[w.world] ** 2
        np.add.at(self.n_lost, (w.team_numbers(w.team[is_out]), w.world[is_out]), 1)
        w.kill(is_out, "left the arena")

    def result(self, w: WorldView) -> dict[str, np.ndarray]:
        """Return the results at the end: one value per team and world."""
        return {"left the arena": self.n_lost}
