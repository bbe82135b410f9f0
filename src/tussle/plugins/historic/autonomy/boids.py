"""Boids as in SCRIMMAGE."""

from __future__ import annotations

import math

import numpy as np

from tussle.api import GroupView, State, together
from tussle.numeric import atan2
from tussle.plugins.stock.autonomy import boids
from tussle.plugins.stock.autonomy.boids.kernels import historic_velocity


class Boids(boids.Boids):
    """Boids with SCRIMMAGE's averages, whatever `averaging` says, and with its output of the climb speed as the desired altitude.

    Its velocity is at most half of max_speed, and 1 m/s without neighbours.

    The sign of pitch_rate is opposite: SCRIMMAGE turned the pitch of its vehicles nose down in 2020, but not this command, so entities
    that should climb dive, do half a loop, and fly on upside down, where the sign is right. Fields of view are cut to whole
    degrees. A neighbour exactly astern is outside of a field of view of 360 degrees too.
    """

    velocity_kernel = staticmethod(historic_velocity)
    half_view = State("az el", unit="rad", doc="Half the fields of view, of whole degrees.")

    @staticmethod
    def in_whole_degrees(
        offset_x: float, offset_y: float, offset_z: float,
        quat_w: float, quat_x: float, quat_y: float, quat_z: float, half_view_az: float, half_view_el: float,
    ) -> bool:  # fmt: skip
        """Return True if azimuth and elevation of an offset [m] are smaller than half the fields of view, cut to whole degrees."""
        w, i, j, k = quat_w, quat_x, quat_y, quat_z
        ahead = (
            (1 - 2 * (j * j + k * k)) * offset_x
            + 2 * (i * j + w * k) * offset_y
            + 2 * (i * k - w * j) * offset_z
        )
        left = (
            2 * (i * j - w * k) * offset_x
            + (1 - 2 * (i * i + k * k)) * offset_y
            + 2 * (j * k + w * i) * offset_z
        )
        up = (
            2 * (i * k + w * j) * offset_x
            + 2 * (j * k - w * i) * offset_y
            + (1 - 2 * (i * i + j * j)) * offset_z
        )
        level = np.sqrt(ahead * ahead + left * left)
        return not (abs(atan2(left, ahead)) >= half_view_az or abs(atan2(up, level)) >= half_view_el)

    seen_by_degrees = together(
        boids.Boids.historic_mates,
        boids.Boids.others,
        boids.Boids.team_push,
        boids.Boids.other_push,
        where=in_whole_degrees,
    )

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        super().spawn(g, rows)
        for half, field in zip(self.half_view, (self.fov_az, self.fov_el), strict=True):
            # 1e-9: 45 degrees must not become 44 by rounding on the way to radians.
            half[rows] = np.floor(field[rows] * (180.0 / math.pi) + 1e-9) * (math.pi / 360.0)

    def _neighbor_sums(self, g: GroupView) -> np.ndarray:
        """Neighbour sums with the historic means, (13, n)."""
        return np.asarray(self._with_historic_means(g, self.seen_by_degrees))

    def step(self, g: GroupView) -> None:
        super().step(g)
        self.pitch_rate[:] *= -1.0
        if "desired_altitude" in self.wired:
            self.desired_altitude[:] -= g.pos[2]
