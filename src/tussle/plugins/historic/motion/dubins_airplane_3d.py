"""DubinsAirplane3D as in SCRIMMAGE."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.api import MotionBody
from tussle.numeric import clip, tan
from tussle.numeric.paths import GRAVITY
from tussle.numeric.quaternion import quat_from_euler, quat_to_yaw
from tussle.plugins.historic.integration import advance_by
from tussle.plugins.historic.relative_attitude import LOADS, begin, publish, relative_state, turn
from tussle.plugins.stock.motion import dubins_airplane_3d

STILL = 2.220446049250313e-16
"""Speed below which there are no turns [m/s]."""


class DubinsAirplane3D(dubins_airplane_3d.DubinsAirplane3D):
    """DubinsAirplane3D that turns about the z axis of its attitude, relative to that of the start, at (g / V) tan(roll).

    So the heading does not turn as in a coordinated turn. A positive desired_pitch lowers the nose. A force gives a velocity of force
    over 1 kg, a torque a rate.
    """

    grade = "machine"
    x = relative_state()

    @property
    def advance(self) -> Callable[..., None]:
        """RK4."""
        return advance_by(self, _step)

    def body_inputs(self) -> list[str]:
        """Return external force and torque."""
        return list(LOADS)

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position, velocity and attitude, which is that of the start."""
        begin(self.x, body, rows)

    def to_body(self, body: MotionBody) -> None:
        """Write position, attitude and velocity."""
        publish(self.x, body)


def _step(x: np.ndarray, u: dict[str, np.ndarray], p: dict[str, Any], h: float) -> None:
    speed, roll = clip(u["desired_speed"], p["speed_min"], p["speed_max"]), u["desired_roll"]
    moves = np.abs(speed) >= STILL
    rate = np.where(moves, -GRAVITY / np.where(moves, speed, 1.0) * tan(roll), 0.0)
    x[3:7] = quat_from_euler(roll, u["desired_pitch"], quat_to_yaw(x[3:7]))
    x[7] = speed
    turn(x, u, (0.0 * speed, 0.0 * speed, 0.0 * speed, rate), h)
