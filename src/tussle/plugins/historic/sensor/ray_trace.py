"""A lidar as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView
from tussle.plugins.stock.sensor.ray_trace import plugin as stock


class RayTrace(stock.RayTrace):
    """The range of a ray that is not in range is `max_range`, whatever the reason, and the ray ends there."""

    def _near_end(self, rows: np.ndarray) -> np.ndarray:
        return np.asarray(self.max_range[rows])

    def _scan(self, g: GroupView, rows: np.ndarray, pattern: np.ndarray) -> np.ndarray:
        scan = super()._scan(g, rows, pattern)
        scan[3] = np.where(scan[4] > 0.0, scan[3], np.repeat(self.max_range[rows], pattern.shape[1]))
        return scan
