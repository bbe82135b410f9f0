"""SimpleCarControllerHeading as in SCRIMMAGE."""

from __future__ import annotations

from typing import Any

from tussle.api import row_law
from tussle.plugins.historic.pid import pid_angle_loop
from tussle.plugins.stock.controller import simple_car_controller_heading


class SimpleCarControllerHeading(simple_car_controller_heading.SimpleCarControllerHeading):
    """SimpleCarControllerHeading with SCRIMMAGE's loop (`tussle.plugins.historic.pid`).

    The derivative has a kick in the first call, and where the error passes from pi to -pi.
    """

    @row_law("speed", "steering", "heading")
    @staticmethod
    def drive(
        desired_speed: float, desired_heading: float, yaw: float, p_gain: float, i_gain: float, d_gain: float, i_lim: float,
        heading: Any, dt: float,
    ) -> Any:  # fmt: skip
        """Heading loop; the speed is passed through."""
        gains = p_gain, i_gain, d_gain, i_lim
        angle, heading = pid_angle_loop(desired_heading - yaw, gains, heading, dt)
        return desired_speed, angle, heading
