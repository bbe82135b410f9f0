"""An interaction: what happens between robots, or between them and the world, after all have moved."""

import numpy as np

from tussle.api import Interaction, Param, State, WorldView


class New(Interaction):
    """An arena: who leaves it is out of the game."""

    grade = "portable"

    radius = Param(1500.0, unit="m", gt=0.0, doc="Of the arena, around the origin.")
    n_lost = State(dtype=int, per="team", doc="Who left so far.")

    def step(self, w: WorldView) -> None:
        """One call for all robots of all worlds; parameters have one value per world."""
        east, north, _ = w.pos
        is_out = east * east + north * north > self.radius[w.world] ** 2
        np.add.at(self.n_lost, (w.team_numbers(w.team[is_out]), w.world[is_out]), 1)
        w.kill(is_out, "left the arena")

    def result(self, w: WorldView) -> dict[str, np.ndarray]:
        """What is told at the end: one value per team and world."""
        return {"left the arena": self.n_lost}
