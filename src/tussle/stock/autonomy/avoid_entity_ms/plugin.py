"""Keep away from others."""

from __future__ import annotations

from tussle.api import Behavior, GroupView, Param, neighbors

TOUCHING = 1e10
"""Magnitude at or below the minimum range: stands for infinity (the existing system's number)."""


class AvoidEntityMS(Behavior):
    """Wish away from each entity in the sphere of influence, the more the nearer; at full length within `minimum_range`.

    The magnitude is that of the Boids' repulsion, (S - r) / (S - m) between S and m, and overwhelming below m.
    """

    grade = "portable"

    sphere_of_influence = Param(10.0, unit="m", ge=0.0, doc="S: distance from which others are felt.")
    minimum_range = Param(5.0, unit="m", ge=0.0, doc="m: distance below which nothing else counts.")
    avoid_non_team = Param(True, doc="Avoid entities of other teams too.")

    @neighbors("sphere_of_influence", x="sum", y="sum", z="sum")
    @staticmethod
    def push(
        offset_x: float, offset_y: float, offset_z: float, distance: float, team: int, other_team: int,
        sphere_of_influence: float, minimum_range: float, avoid_non_team: bool,
    ) -> tuple[float, float, float] | None:  # fmt: skip
        if distance == 0.0 or not (team == other_team or avoid_non_team):
            return None
        magnitude = (sphere_of_influence - distance) / (sphere_of_influence - minimum_range)
        if distance <= minimum_range:
            magnitude = TOUCHING
        away = -magnitude / distance
        return away * offset_x, away * offset_y, away * offset_z

    def step(self, g: GroupView) -> None:
        self.wish[:] = self.push(g).values * g.call("longest_wish")
