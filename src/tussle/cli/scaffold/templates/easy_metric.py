"""A metric: what is counted in a game, and who wins it, in plain Python for one world at a time."""

import math

from tussle.api import EasyMetric, OneWorld, Param, State


class New(EasyMetric):
    """The time that each team's robots spend near a point; the team that is there more wins."""

    radius = Param(500.0, unit="m", gt=0.0, doc="What counts as near the origin.")
    time_there = State(unit="s", per="team", doc="Robot seconds so far.")

    def step_one(self, w: OneWorld) -> None:
        """Look at one world; `w` has its entities, t, messages, and all that is declared above."""
        for entity in w.entities:
            east, north, _ = entity.pos
            if math.hypot(east, north) < w.radius:
                w.time_there[entity.team] += w.dt

    def result_one(self, w: OneWorld) -> dict[str, object]:
        """What is told at the end: a number, or one for each team; "score" decides who wins."""
        return {"score": w.time_there}
