"""A car that turns away from what its lidar sees."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, GroupView, Input, Output, Param
from tussle.numeric import atan2
from tussle.numeric.quaternion import quat_rotate

SLOW = 10.0
"""Speed while it avoids walls [m/s], that of SCRIMMAGE."""


class AvoidWalls(Autonomy):
    """Drives straight on, and turns away from walls that `RayTrace` sees within `avoid_distance`.

    Each point that the lidar sees within this distance pushes the car away from it, with a force of `avoid_distance` - range, or of
    `avoid_distance` for points nearer than the lidar's `min_range`. The car drives slowly in the direction of the sum of these forces. If
    all rays of the scan end within the distance, it turns to its right. Potential fields: O. Khatib, IJRR 5 (1986), 90-98, with a linear
    law.

    In SCRIMMAGE a car that has slowed down never accelerates again.
    """

    grade = "portable"

    initial_speed = Param(24.3, unit="m/s", ge=0.0, doc="Speed while no wall is near.")
    avoid_distance = Param(20.0, unit="m", gt=0.0, doc="Range within which walls repel.")
    points = Input("raytrace", fields="x y z range in_range", unit="m m m m 1", ragged=True)
    desired_speed = Output(unit="m/s")
    desired_heading = Output(unit="rad")
    desired_altitude = Output(unit="m")

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Start at `initial_speed` with the current heading and altitude."""
        self.desired_speed[rows], self.desired_altitude[rows] = self.initial_speed[rows], g.pos[2][rows]
        self.desired_heading[rows] = g.yaw[rows]

    def step(self, g: GroupView) -> None:
        """Choose heading and speed."""
        x, y, z, distance, in_range = self.points.data
        row, count = self.points.row, self.points.count
        too_near = distance == -np.inf
        excess = self.avoid_distance[row] - np.where(too_near, 0.0, distance)
        is_near = ((in_range > 0.0) | too_near) & (excess > 0.0)
        length = np.where(too_near, np.sqrt(x * x + y * y + z * z), distance)
        pushes = is_near & (length > 0.0)
        weight = np.where(pushes, -excess, 0.0) / np.where(pushes, length, 1.0)
        push = self.points.sum(np.stack([weight * x, weight * y, weight * z]))
        n_near = self.points.sum(is_near)
        push[:, (n_near == count) & (count > 0)] = np.array([[0.0], [-1.0], [0.0]])
        east, north, _ = quat_rotate(g.quat, push)
        avoids = (n_near > 0) & ((east != 0.0) | (north != 0.0))
        self.desired_heading[:] = np.where(avoids, atan2(north, east), g.yaw)
        self.desired_speed[:] = np.where(avoids, SLOW, self.initial_speed)
