"""UnicycleControllerPoint as in SCRIMMAGE."""

from __future__ import annotations

from typing import Any

from tussle.api import row_law
from tussle.numeric import sincos
from tussle.plugins.stock.controller import unicycle_controller_point


class UnicycleControllerPoint(unicycle_controller_point.UnicycleControllerPoint):
    """UnicycleControllerPoint that takes the vehicle's own position instead of the point ahead, and does not pitch.

    In tussle the distance of the point ahead decays to 0, in three dimensions.
    """

    @row_law("speed", "turn_rate", "pitch_rate", "velocity_z")
    @staticmethod
    def pull(point: Any, pos: Any, yaw: float, l: float, gain: float) -> Any:
        """Velocity towards the point, along the body axes."""
        (px, py, pz), (x, y, z) = point, pos
        turn, ahead = sincos(yaw)
        ex, ey = gain * (px - x), gain * (py - y)
        return ahead * ex + turn * ey, (ahead * ey - turn * ex) / l, 0.0, gain * (pz - z)
