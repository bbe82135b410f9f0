"""SingleIntegrator as in SCRIMMAGE."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.api import MotionBody, Param
from tussle.numeric import atan2
from tussle.numeric.quaternion import quat_from_euler
from tussle.plugins.historic.integration import advance_by
from tussle.plugins.stock.motion import single_integrator


class SingleIntegrator(single_integrator.SingleIntegrator):
    """SingleIntegrator that flies every nonzero command at max_speed, with the nose down in a climb, and faces East at rest.

    In tussle max_speed is a limit, a climb is nose up, and at rest the attitude does not change.
    """

    max_speed = Param(
        -1.0, unit="m/s", doc="Speed of every nonzero command; negative to use the commanded speed."
    )

    @property
    def advance(self) -> Callable[..., None]:  # type: ignore[override]
        """Euler's method."""
        return advance_by(self, _step)

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position and heading; it is level and at rest."""
        super().from_body(body, rows)
        self.x[3:6, rows] = self.x[7, rows] = 0.0
        body.vel[:, rows] = 0.0
        body.quat[:, rows] = quat_from_euler(0.0, 0.0, self.x[6, rows])


def _step(x: np.ndarray, u: dict[str, np.ndarray], p: dict[str, Any], h: float) -> None:
    vel = np.array([u["velocity_x"], u["velocity_y"], u["velocity_z"]])
    length = np.sqrt(vel[0] * vel[0] + vel[1] * vel[1] + vel[2] * vel[2])
    scaled = vel / np.where(length > 0.0, length, 1.0) * p["max_speed"]
    vel = np.where(p["max_speed"] < 0.0, vel, scaled)
    x[:3] += vel * h
    x[3:6] = vel
    x[6] = u.get("desired_heading", atan2(vel[1], vel[0]))
    x[7] = -atan2(vel[2], np.sqrt(vel[0] * vel[0] + vel[1] * vel[1]))
