"""An interaction: effects between robots after the motion of each step, in plain Python for one world at a time."""

import math

from tussle.api import EasyInteraction, OneWorld, Param, State


class New(EasyInteraction):
    """An arena; robots that leave it are removed."""

    radius = Param(1500.0, unit="m", gt=0.0, doc="Radius of the arena around the origin.")
    n_lost = State(dtype=int, per="team", doc="Robots removed so far.")

    def step_one(self, w: OneWorld) -> None:
        """Update one world. `w` has its entities, t, messages, and the columns declared above."""
        for entity in w.entities:
            east, north, _ = entity.pos
            if math.hypot(east, north) > w.radius:
                w.n_lost[entity.team] += 1
                w.kill(entity, "left the arena")

    def result_one(self, w: OneWorld) -> dict[str, object]:
        """Return the results at the end: a number, or one per team."""
        return {"left the arena": w.n_lost}
