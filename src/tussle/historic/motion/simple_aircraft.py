"""SimpleAircraft as in SCRIMMAGE."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tussle.historic.integration import rk4_step
from tussle.stock.motion import simple_aircraft


class SimpleAircraft(simple_aircraft.SimpleAircraft):
    """SimpleAircraft whose roll, pitch and speed are put within their limits before a step, and leave them in it by up to a step's worth.

    In tussle a rate that would go beyond a limit is lowered so that it ends there, so what is published and flown keeps the limits.
    Different are the three clips and RK4 over rates that ignore the limits.
    """

    grade = "machine"

    @property
    def advance(self) -> Callable[..., None]:
        """RK4 between clips, for all rows."""
        return _advance


def _advance(x: np.ndarray, u: np.ndarray, p: np.ndarray, dt: float, substeps: int) -> None:
    radius, speed_min, speed_max, roll_max, pitch_max, roll_rate_max, pitch_rate_max, target, slope = p
    throttle, roll_rate, pitch_rate = u

    def f(s: np.ndarray) -> np.ndarray:
        roll, pitch, yaw, speed = s[3:]
        return np.array(
            [
                speed * np.cos(pitch) * np.cos(yaw),
                speed * np.cos(pitch) * np.sin(yaw),
                speed * np.sin(pitch),
                np.clip(roll_rate, -roll_rate_max, roll_rate_max),
                np.clip(pitch_rate, -pitch_rate_max, pitch_rate_max),
                speed / (radius + slope * (speed - target)) * np.tan(roll),
                np.clip(throttle, -100.0, 100.0) / 5.0,
            ]
        )

    for _ in range(substeps):
        x[3] = np.clip(x[3], -roll_max, roll_max)
        x[4] = np.clip(x[4], -pitch_max, pitch_max)
        x[6] = np.clip(x[6], speed_min, speed_max)
        x[:] = rk4_step(f, x, dt / substeps)
