"""SimpleCar as in SCRIMMAGE."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.api import HistoricAttributes, MotionBody, Param, State
from tussle.numeric import clip, cos, sin, tan
from tussle.plugins.historic.integration import advance_by, rk4_step
from tussle.plugins.stock.motion import simple_car

STEERING_MAX = 0.25 * math.pi - 1e-4
GRAVITY = 9.8
MIN_FORCE = 0.1
"""Force that stops the car along its axis [N]."""


class SimpleCar(simple_car.SimpleCar):
    """SimpleCar that falls with 9.8 m/s^2 times its parameter `mass`, and that any force above 0.1 N stops along the force's axis.

    Its initial velocity is 0, and `vel` is the mean over the last substep. In tussle it falls with 9.81 m/s^2 until a force bears its
    weight. The steering angle is the channel `steering`, as in tussle.
    """

    grade = "machine"
    historic_attributes = HistoricAttributes()
    mass = Param(1.0, unit="kg", doc="Mass.")
    x = State(
        "x y z z_rate yaw vx vy vz",
        unit="m m m m/s rad m/s m/s m/s",
        doc="Position, rate of the fall, heading; mean velocity.",
    )

    @property
    def advance(self) -> Callable[..., None]:
        """RK4."""
        falls = bool(self.enable_gravity)
        return advance_by(self, lambda x, u, p, h: _step(x, u, p, h, falls))

    def body_inputs(self) -> list[str]:
        """Return the external force."""
        return ["force_x", "force_y", "force_z"]

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position and heading; the velocity is 0."""
        self.x[:, rows] = 0.0
        self.x[:3, rows], self.x[4, rows] = body.pos[:, rows], body.yaw[rows]
        body.vel[:, rows] = 0.0

    def to_body(self, body: MotionBody) -> None:
        """Write position, velocity and heading."""
        body.pos[:], body.vel[:] = self.x[:3], self.x[5:]
        body.set_attitude(yaw=self.x[4])


def _step(x: np.ndarray, u: dict[str, np.ndarray], p: dict[str, Any], h: float, falls: bool) -> None:
    speed = clip(u["speed"], 0.0, p["max_velocity"])
    turn = speed / p["length"] * tan(clip(u["steering"], -STEERING_MAX, STEERING_MAX))
    is_free = np.array([np.abs(u[name]) <= MIN_FORCE for name in ("force_x", "force_y", "force_z")])
    fall = -GRAVITY * p["mass"] if falls else 0.0 * speed

    def f(s: np.ndarray) -> np.ndarray:
        moved = np.array([speed * cos(s[4]), speed * sin(s[4]), s[3] if falls else 0.0 * speed])
        return np.concatenate([np.where(is_free, moved, 0.0), [fall, turn], np.zeros_like(x[5:])])

    start = x[:3].copy()
    x[:] = rk4_step(f, x, h)
    x[5:] = (x[:3] - start) / h
