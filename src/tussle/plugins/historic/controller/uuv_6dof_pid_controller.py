"""UUV6DOFPIDController as in SCRIMMAGE."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import row_law
from tussle.numeric import atan2
from tussle.plugins.historic.pid import pid_angle_loop, pid_loop
from tussle.plugins.stock.controller import uuv_6dof_pid_controller


class UUV6DOFPIDController(uuv_6dof_pid_controller.UUV6DOFPIDController):
    """UUV6DOFPIDController without damping of the rates, and without limits of its outputs, which the model clamps.

    With SCRIMMAGE's loops (`tussle.plugins.historic.pid`). In tussle rates are damped, which the hull needs.
    """

    @row_law("rudder", "heading")
    @staticmethod
    def turn(desired_heading: float, yaw: float, heading_pid: Any, heading: Any, dt: float) -> Any:
        """Heading loop."""
        return pid_angle_loop(desired_heading - yaw, heading_pid, heading, dt)

    @row_law("elevator", "elevation")
    @staticmethod
    def rise(
        desired_altitude: float, desired_speed: float, pos_z: float, climb: float, pitch_pid: Any, elevation: Any, dt: float
    ) -> Any:  # fmt: skip
        """Elevation loop."""
        aim = atan2((desired_altitude - pos_z) * desired_speed, desired_speed * desired_speed)
        command, elevation = pid_loop(aim - climb, pitch_pid, elevation, dt)
        return -command, elevation

    @row_law("throttle", "forward")
    @staticmethod
    def push(desired_speed: float, vel: Any, speed_pid: Any, forward: Any, dt: float) -> Any:
        """Speed loop."""
        vx, vy, vz = vel
        return pid_loop(desired_speed - math.sqrt(vx * vx + vy * vy + vz * vz), speed_pid, forward, dt)
