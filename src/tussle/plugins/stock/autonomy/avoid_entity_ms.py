"""A behaviour that avoids other entities."""

from __future__ import annotations

import numpy as np

from tussle.api import Behavior, GroupView, Input, Param, neighbors

TOUCHING = 1e10
"""Magnitude of the repulsion at or below the minimum range, in place of infinity (value of SCRIMMAGE)."""


class AvoidEntityMS(Behavior):
    """Moves away from every entity inside the sphere of influence.

    At distance r the magnitude is (S - r) / (S - m) for m < r < S, as in Boids, and 1e10 for r <= m, with S =
    `sphere_of_influence` and m = `minimum_range`. With `contacts="noisy"` the positions are those measured by a
    sensor such as NoisyContacts.
    """

    grade = "portable"
    needed_services = ("max_desired_speed",)

    sphere_of_influence = Param(10.0, unit="m", ge=0.0, doc="S: distance below which other entities repel.")
    minimum_range = Param(
        5.0, unit="m", ge=0.0, doc="m: distance below which avoidance overrides other behaviours."
    )
    avoid_non_team = Param(True, doc="Avoid entities of other teams too.")
    contacts = Param(
        "truth", choices=("truth", "noisy"), doc="Use true positions, or those of the channel 'contacts'."
    )
    seen = Input(
        "contacts", ragged=True, fields="id team x y z vx vy vz qw qx qy qz", unit="1 1 m m m m/s m/s m/s 1 1 1 1",
        doc="Measured states of other entities, with contacts='noisy'.",
    )  # fmt: skip

    def active_inputs(self) -> list[str]:
        """Return the inputs that this instance reads."""
        return ["seen"] if self.contacts == "noisy" else []

    @neighbors("sphere_of_influence", x="sum", y="sum", z="sum")
    @staticmethod
    def push(
        offset_x: float, offset_y: float, offset_z: float, distance: float, team: int, other_team: int,
        sphere_of_influence: float, minimum_range: float, avoid_non_team: bool,
    ) -> tuple[float, float, float] | None:  # fmt: skip
        if distance == 0.0 or not (team == other_team or avoid_non_team):
            return None
        if distance <= minimum_range:
            magnitude = TOUCHING
        else:
            magnitude = (sphere_of_influence - distance) / (sphere_of_influence - minimum_range)
        away = -magnitude / distance
        return away * offset_x, away * offset_y, away * offset_z

    def step(self, g: GroupView) -> None:
        away = self._from_seen(g) if self.contacts == "noisy" else self.push(g).values
        self.desired_velocity[:] = away * g.call("max_desired_speed")

    def _from_seen(self, g: GroupView) -> np.ndarray:
        """Sum `push` over the measured entities, relative to the entity's believed position, (3, n)."""
        law, row = AvoidEntityMS.push.laws[0].function, self.seen.row
        offset = self.seen.data[2:5] - g.pos[:, row]
        x, y, z = offset
        distance = np.sqrt(x * x + y * y + z * z)
        push = np.zeros(offset.shape)
        for k in np.flatnonzero(distance < self.sphere_of_influence[row]):
            i = row[k]
            own = self.sphere_of_influence[i], self.minimum_range[i], self.avoid_non_team[i]
            push[:, k] = law(x[k], y[k], z[k], distance[k], g.team[i], self.seen.data[1, k], *own) or 0.0
        velocity: np.ndarray = self.seen.sum(push)
        return velocity
