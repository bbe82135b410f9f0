"""MoveToGoalMS as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView
from tussle.plugins.stock.autonomy import move_to_goal_ms


class MoveToGoalMS(move_to_goal_ms.MoveToGoalMS):
    """MoveToGoalMS whose PID differentiates from a distance of 0 in its first call: a kick of d_gain times distance over dt.

    tussle begins with the distance at birth. SCRIMMAGE also sends waypoints as latitude and longitude, which rounds to 1e-9 m.
    """

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        super().spawn(g, rows)
        self.previous[rows] = 0.0
