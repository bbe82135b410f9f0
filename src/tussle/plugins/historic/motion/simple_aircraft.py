"""SimpleAircraft as in SCRIMMAGE."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.api import MotionBody
from tussle.numeric import clip, cos, sin, tan
from tussle.numeric.quaternion import quat_from_euler
from tussle.plugins.historic.integration import advance_by, rk4_step
from tussle.plugins.stock.motion import simple_aircraft


class SimpleAircraft(simple_aircraft.SimpleAircraft):
    """SimpleAircraft whose roll, pitch and speed are put within their limits before a step, and can exceed them by one step's change.

    In tussle a rate that would exceed a limit is lowered so that it ends there, so the limits always hold. The differences are the
    three clips, RK4 with rates that ignore the limits, the sign of the published climb speed, and the initial velocity, which is
    level.
    """

    grade = "machine"

    @property
    def advance(self) -> Callable[..., None]:
        """RK4 between clips, for all rows."""
        return advance_by(self, _step)

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position, attitude and speed, clamped to the limits, and write them."""
        super().from_body(body, rows)
        roll, climb, yaw, speed = self.x[3:, rows]
        flat = np.zeros(len(rows))
        body.vel[:, rows] = speed * cos(yaw), speed * sin(yaw), flat
        body.quat[:, rows] = quat_from_euler(-roll, -climb, yaw)

    def to_body(self, body: MotionBody) -> None:
        """Write position, attitude and velocity."""
        super().to_body(body)
        body.vel[2] *= -1.0


def _step(x: np.ndarray, u: dict[str, np.ndarray], p: dict[str, Any], h: float) -> None:
    roll_rate = clip(u["roll_rate"], -p["max_roll_rate"], p["max_roll_rate"])
    pitch_rate = clip(u["pitch_rate"], -p["max_pitch_rate"], p["max_pitch_rate"])
    push = clip(u["throttle"], -100.0, 100.0) / 5.0

    def f(s: np.ndarray) -> np.ndarray:
        roll, pitch, yaw, speed = s[3:]
        radius = p["turning_radius"] + p["radius_slope_per_speed"] * (speed - p["speed_target"])
        return np.array(
            [
                speed * cos(pitch) * cos(yaw),
                speed * cos(pitch) * sin(yaw),
                speed * sin(pitch),
                roll_rate,
                pitch_rate,
                speed / radius * tan(roll),
                push,
            ]
        )

    x[3] = clip(x[3], -p["max_roll"], p["max_roll"])
    x[4] = clip(x[4], -p["max_pitch"], p["max_pitch"])
    x[6] = clip(x[6], p["min_velocity"], p["max_velocity"])
    x[:] = rk4_step(f, x, h)
