"""Keep away from others."""

from __future__ import annotations

import numpy as np

from tussle.api import Behavior, GroupView, Input, Param, neighbors

TOUCHING = 1e10
"""Magnitude at or below the minimum range: stands for infinity (the existing system's number)."""


class AvoidEntityMS(Behavior):
    """Wish away from each entity in the sphere of influence, the more the nearer; at full length within `minimum_range`.

    The magnitude is that of the Boids' repulsion, (S - r) / (S - m) between S and m, and overwhelming below m. With
    `contacts="noisy"` the others are those that a sensor such as NoisyContacts reports, where it says they are.
    """

    grade = "portable"

    sphere_of_influence = Param(10.0, unit="m", ge=0.0, doc="S: distance from which others are felt.")
    minimum_range = Param(5.0, unit="m", ge=0.0, doc="m: distance below which nothing else counts.")
    avoid_non_team = Param(True, doc="Avoid entities of other teams too.")
    contacts = Param(
        "truth", choices=("truth", "noisy"), doc="Everybody, or those in the channel 'contacts'."
    )
    seen = Input(
        "contacts", ragged=True, fields="id team x y z vx vy vz qw qx qy qz", unit="1 1 m m m m/s m/s m/s 1 1 1 1",
        doc="Whom a sensor reports, with contacts='noisy'.",
    )  # fmt: skip

    def active_inputs(self) -> list[str]:
        """Names of the inputs that this instance reads."""
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
        self.wish[:] = away * g.call("longest_wish")

    def _from_seen(self, g: GroupView) -> np.ndarray:
        """The same law over what is reported, from where the entity believes itself, (3, n)."""
        law, row = AvoidEntityMS.push.laws[0].function, self.seen.row
        offset = self.seen.data[2:5] - g.pos[:, row]
        x, y, z = offset
        distance = np.sqrt(x * x + y * y + z * z)
        push = np.zeros(offset.shape)
        for k in np.flatnonzero(distance < self.sphere_of_influence[row]):
            i = row[k]
            own = self.sphere_of_influence[i], self.minimum_range[i], self.avoid_non_team[i]
            push[:, k] = law(x[k], y[k], z[k], distance[k], g.team[i], self.seen.data[1, k], *own) or 0.0
        wish: np.ndarray = self.seen.sum(push)
        return wish
