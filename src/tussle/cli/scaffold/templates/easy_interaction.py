"""An interaction: what happens between robots after all have moved, in plain Python for one world at a time."""

import math

from tussle.api import EasyInteraction, OneWorld, Param, State


class New(EasyInteraction):
    """An arena: who leaves it is out of the game."""

    radius = Param(1500.0, unit="m", gt=0.0, doc="Of the arena, around the origin.")
    n_lost = State(dtype=int, per="team", doc="Who left so far.")

    def step_one(self, w: OneWorld) -> None:
        """Look at one world; `w` has its entities, t, messages, and all that is declared above."""
        for entity in w.entities:
            east, north, _ = entity.pos
            if math.hypot(east, north) > w.radius:
                w.n_lost[entity.team] += 1
                w.kill(entity, "left the arena")

    def result_one(self, w: OneWorld) -> dict[str, object]:
        """What is told at the end: a number, or one for each team."""
        return {"left the arena": w.n_lost}
