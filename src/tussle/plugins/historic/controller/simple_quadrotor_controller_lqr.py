"""SimpleQuadrotorControllerLQR as in SCRIMMAGE."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import State, row_law
from tussle.numeric import wrap
from tussle.plugins.historic.pid import clamp, pid_loop
from tussle.plugins.stock.controller import simple_quadrotor_controller_lqr

DAMPING, SLOWING, NEAR = math.sqrt(2.0), 10.0, 10.0


class SimpleQuadrotorControllerLQR(simple_quadrotor_controller_lqr.SimpleQuadrotorControllerLQR):
    """SimpleQuadrotorControllerLQR that commands a speed along the nose, wherever the point is, and coasts within 10 m of it.

    The yaw rate is the difference of two headings, 0 in the first call. With SCRIMMAGE's loops (module `historic.pid`). In tussle it
    flies to the point in any direction.
    """

    seen = State(
        "yaw has_yaw", unit="rad 1", doc="Heading of the last call; has_yaw is 1 after the first call."
    )

    @row_law("turn_force", "seen")
    @staticmethod
    def turn(desired_heading: float, yaw: float, seen: Any, dt: float) -> Any:
        """Regulator of the heading."""
        last, has_yaw = seen
        return wrap(desired_heading - yaw) - DAMPING * (has_yaw * (yaw - last) / dt), (yaw, 1.0)

    @row_law("thrust", "forward")
    @staticmethod
    def push(
        point: Any, pos: Any, vel: Any, max_vel: float, vel_p_gain: float, vel_i_gain: float, vel_d_gain: float, vel_i_lim: float,
        forward: Any, dt: float,
    ) -> Any:  # fmt: skip
        """Loop of the speed, and the regulator of the height."""
        (px, py, pz), (x, y, z), (vx, vy, vz) = point, pos, vel
        dx, dy = px - x, py - y
        distance = math.sqrt(dx * dx + dy * dy)
        wanted = 0.0 if distance < NEAR else distance / SLOWING
        gains = vel_p_gain, vel_i_gain, vel_d_gain, vel_i_lim
        ahead, forward = pid_loop(wanted - math.sqrt(vx * vx + vy * vy), gains, forward, dt)
        return (clamp(ahead, max_vel), 0.0, pz - z - DAMPING * vz), forward
