"""Keep away from others."""

from __future__ import annotations

import numpy as np

from tussle.api import Behavior, GroupView, Param


class AvoidEntityMS(Behavior):
    """Wish away from each entity in the sphere of influence, the more the nearer; at full length within `minimum_range`.

    The magnitude is that of the Boids' repulsion, (S - r) / (S - m) between S and m, and overwhelming below m.
    """

    grade = "portable"

    sphere_of_influence = Param(10.0, unit="m", ge=0.0, doc="S: distance from which others are felt.")
    minimum_range = Param(5.0, unit="m", ge=0.0, doc="m: distance below which nothing else counts.")
    avoid_non_team = Param(True, doc="Avoid entities of other teams too.")

    def step(self, g: GroupView) -> None:
        near = g.near(self.sphere_of_influence)
        row, distance = near.row, near.distance
        reach, least = self.sphere_of_influence[row], self.minimum_range[row]
        span = np.where(reach > least, reach - least, 1.0)
        magnitude = np.where(distance <= least, 1e10, (reach - distance) / span)
        counts = (near.team == g.team[row]) | self.avoid_non_team[row]
        away = np.where(counts & (distance > 0.0), -magnitude / np.where(distance > 0.0, distance, 1.0), 0.0)
        self.wish[:] = near.sum(away * near.offset) * g.call("longest_wish")
