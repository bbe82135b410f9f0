"""A behaviour that follows an entity at a fixed place in its body frame."""

from __future__ import annotations

import math

import numpy as np

from tussle.api import Behavior, GroupView, Input, Param
from tussle.numeric import cos, sin
from tussle.numeric.quaternion import quat_rotate


class TrailMS(Behavior):
    """Follows the entity `trail_id` at a point that is fixed in its body frame: 5 m behind it by default.

    With that point at q and the velocity w of the entity, the desired velocity is (q - p) / (1 s) + w, so that a vehicle that flies as
    desired approaches the point exponentially, with a time constant of 1 s. While there is no such entity, or it is not among the
    contacts, the desired velocity is zero.
    """

    grade = "portable"

    trail_id = Param(-1, doc="Id of the entity that is followed; none below 1.")
    trail_range = Param(5.0, unit="m", ge=0.0, doc="Distance of the point from it.")
    trail_angle_azimuth = Param(
        math.pi, unit="rad", text_unit="deg", doc="Azimuth of the point, counter-clockwise from its nose."
    )
    trail_angle_elevation = Param(
        0.0, unit="rad", text_unit="deg", doc="Elevation of the point, up positive."
    )
    contacts = Param(
        "truth", choices=("truth", "noisy"), doc="Use its true state, or that of the channel 'contacts'."
    )
    seen = Input(
        "contacts", ragged=True, fields="id team x y z vx vy vz qw qx qy qz", unit="1 1 m m m m/s m/s m/s 1 1 1 1",
        doc="Measured states of other entities, with contacts='noisy'.",
    )  # fmt: skip

    def active_inputs(self) -> list[str]:
        """Return the inputs that this instance reads."""
        return ["seen"] if self.contacts == "noisy" else []

    def step(self, g: GroupView) -> None:
        rows, pos, vel, quat = self._seen_leaders() if self.contacts == "noisy" else self._leaders(g)
        self.desired_velocity[:] = 0.0
        azimuth, elevation = self.trail_angle_azimuth[rows], self.trail_angle_elevation[rows]
        level = cos(elevation)
        direction = np.stack([level * cos(azimuth), level * sin(azimuth), sin(elevation)])
        point = pos + quat_rotate(quat, self.trail_range[rows] * direction)
        self.desired_velocity[:, rows] = point - g.pos[:, rows] + vel

    def _leaders(self, g: GroupView) -> tuple[np.ndarray, ...]:
        """Return the rows that have a leader, (m,), and its true position [m], velocity [m/s], (3, m) each, and attitude, (4, m)."""
        leader = g.rows_of(np.maximum(self.trail_id, 0))
        rows = np.flatnonzero(leader >= 0)
        leaders = leader[rows]
        return rows, g.bodies.pos[:, leaders], g.bodies.vel[:, leaders], g.bodies.quat[:, leaders]

    def _seen_leaders(self) -> tuple[np.ndarray, ...]:
        """Return the same for the measured contacts."""
        data = self.seen.data
        is_leader = data[0] == self.trail_id[self.seen.row]
        item = self.seen.argmin(np.where(is_leader, 0.0, 1.0))
        rows = np.flatnonzero((item >= 0) & is_leader[item] if len(is_leader) else np.zeros(len(item), bool))
        found = data[:, item[rows]]
        return rows, found[2:5], found[5:8], found[8:12]
