"""Unicycle3D as in SCRIMMAGE."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.api import MotionBody, Param
from tussle.numeric import clip
from tussle.plugins.historic.integration import advance_by
from tussle.plugins.historic.relative_attitude import LOADS, begin, publish, relative_state, turn
from tussle.plugins.stock.motion import unicycle_3d

LIMITED = {"speed": "m/s", "turn_rate": "rad/s", "pitch_rate": "rad/s", "roll_rate": "rad/s"}


class Unicycle3D(unicycle_3d.Unicycle3D):
    """Unicycle3D whose attitude is integrated as the turn since the start, by RK4 with a pull towards length 1.

    So the rates act about axes that move with the vehicle but were the world's at the start, the body's own only where it started
    with (1, 0, 0, 0); tussle takes the body's own always. Attitude and path carry RK4's errors, 2e-5 m where a turn at full rate ends
    at 25 m/s; tussle's attitude is exact for held rates. With `accel_max` >= 0 the acceleration is always accel_max, whatever the
    command, without a limit of the speed. A force gives a velocity of force over 1 kg, a torque a rate. Speed and rates have a lower
    limit of their own; where it is above the upper one, the two are swapped.
    """

    grade = "machine"
    for _name, _unit in LIMITED.items():
        vars()[f"{_name}_max"] = Param(1.0, unit=_unit, doc=f"Upper limit of {_name}.")
        vars()[f"{_name}_min"] = Param(
            -math.inf, unit=_unit, doc=f"Lower limit of {_name}; without one it is -{_name}_max."
        )
    x = relative_state()

    @property
    def advance(self) -> Callable[..., None]:
        """RK4."""
        limit = float(self.accel_max)
        return advance_by(self, lambda x, u, p, h: _step(x, u, p, h, limit))

    def body_inputs(self) -> list[str]:
        """Return external force and torque."""
        return list(LOADS)

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position, velocity and attitude, which is that of the start."""
        begin(self.x, body, rows)

    def to_body(self, body: MotionBody) -> None:
        """Write position, attitude and velocity."""
        publish(self.x, body)


def _limited(u: dict[str, np.ndarray], p: dict[str, Any], name: str) -> np.ndarray:
    """Return a command within its limits."""
    a, b = p[f"{name}_min"], p[f"{name}_max"]
    a = np.where(np.isinf(a), -b, a)
    return np.asarray(clip(u[name], np.minimum(a, b), np.maximum(a, b)))


def _step(x: np.ndarray, u: dict[str, np.ndarray], p: dict[str, Any], h: float, accel_max: float) -> None:
    turn_rate, pitch_rate, roll_rate = (
        _limited(u, p, name) for name in ("turn_rate", "pitch_rate", "roll_rate")
    )
    if accel_max < 0.0:
        x[7] = _limited(u, p, "speed")
    turn(x, u, (np.full(x.shape[1], max(accel_max, 0.0)), roll_rate, -pitch_rate, turn_rate), h)
