"""A metric: measures a game and decides who wins, in plain Python for one world at a time."""

import math

from tussle.api import EasyMetric, OneWorld, Param, State


class New(EasyMetric):
    """Measures the time that the robots of each team spend near the origin; the team with the longest time wins."""

    radius = Param(500.0, unit="m", gt=0.0, doc="Distance from the origin that counts as near.")
    time_there = State(unit="s", per="team", doc="Time so far, summed over the robots.")

    def step_one(self, w: OneWorld) -> None:
        """Update one world. `w` has its entities, t, messages, and the columns declared above."""
        for entity in w.entities:
            east, north, _ = entity.pos
            if math.hypot(east, north) < w.radius:
                w.time_there[entity.team] += w.dt

    def result_one(self, w: OneWorld) -> dict[str, object]:
        """Return the results at the end: a number, or one per team; "score" decides who wins."""
        return {"score": w.time_there}
