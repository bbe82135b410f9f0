"""DoubleIntegrator as in SCRIMMAGE."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.api import MotionBody
from tussle.numeric import atan2, clip
from tussle.plugins.historic.integration import advance_by, rk4_step, unrotated
from tussle.plugins.stock.motion import double_integrator


class DoubleIntegrator(double_integrator.DoubleIntegrator):
    """DoubleIntegrator whose position advances with the velocity of the start of each step, without a dt^2 / 2.

    Each component of the velocity is limited; max_yaw_acc limits the yaw *rate*, which is written as the yaw angle unless the attitude
    follows the motion or the tilt. The tilt is that of the velocity in the last attitude. In tussle parabolas are exact, the speed is
    limited, and the yaw rate goes to its command at max_yaw_acc.
    """

    @property
    def advance(self) -> Callable[..., None]:
        """RK4, in which the position has a constant derivative."""
        follows = bool(self.motion_model_sets_yaw)
        return advance_by(self, lambda x, u, p, h: _step(x, u, p, h, follows))

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position, velocity within its limits, heading and yaw rate."""
        super().from_body(body, rows)
        limit = self.max_vel[rows]
        self.x[3:6, rows] = clip(self.x[3:6, rows], -limit, limit)

    def to_body(self, body: MotionBody) -> None:
        """Write position, velocity and attitude."""
        x, last = self.x, np.array(body.quat)
        body.pos[:], body.vel[:] = x[:3], x[3:6]
        if self.motion_model_sets_yaw:
            body.set_attitude(yaw=x[6])
        elif self.sim_copter_orientation:
            ahead, left, _ = unrotated(last, x[3:6])
            climb = -ahead / self.max_vel * self.sim_copter_max_pitch
            body.set_attitude(-(left / self.max_vel * self.sim_copter_max_roll), climb, x[6])
        else:
            body.set_attitude(yaw=x[7])


def _step(x: np.ndarray, u: dict[str, np.ndarray], p: dict[str, Any], h: float, follows: bool) -> None:
    push = np.array([u["acceleration_x"], u["acceleration_y"], u["acceleration_z"]])
    size = np.sqrt(push[0] * push[0] + push[1] * push[1] + push[2] * push[2])
    push = np.where(size > p["max_acc"], push / np.where(size > 0.0, size, 1.0) * p["max_acc"], push)
    most, turn = p["max_vel"], clip(u["turn_rate"], -p["max_yaw_acc"], p["max_yaw_acc"])
    moved, turned = clip(x[3:6], -most, most), clip(turn, -p["max_yaw_vel"], p["max_yaw_vel"])

    def f(s: np.ndarray) -> np.ndarray:
        is_limit = ((s[3:6] >= most) & (push > 0.0)) | ((s[3:6] <= -most) & (push < 0.0))
        return np.concatenate([moved, np.where(is_limit, 0.0, push), [turned, 0.0 * turned]])

    x[:] = rk4_step(f, x, h)
    speed = np.sqrt(x[3] * x[3] + x[4] * x[4] + x[5] * x[5])
    x[3:6] = np.where(speed > most, x[3:6] / np.where(speed > 0.0, speed, 1.0) * most, x[3:6])
    x[7] = turn
    if follows:
        moves = (x[3] != 0.0) | (x[4] != 0.0)
        x[6] = np.where(moves, atan2(x[4], x[3]), x[6])
