"""DoubleIntegratorControllerVelYaw as in SCRIMMAGE."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import row_law
from tussle.numeric import sincos
from tussle.plugins.historic.pid import pid_angle_loop, pid_loop
from tussle.plugins.stock.controller import double_integrator_controller_vel_yaw


class DoubleIntegratorControllerVelYaw(double_integrator_controller_vel_yaw.DoubleIntegratorControllerVelYaw):
    """DoubleIntegratorControllerVelYaw whose speed error acts along the desired heading only.

    So a vehicle at its desired speed never turns. The altitude error commands the acceleration, so the altitude oscillates.
    With SCRIMMAGE's loops (`tussle.plugins.historic.pid`).
    """

    @row_law("turn_rate", "heading")
    @staticmethod
    def turn(desired_heading: float, yaw: float, yaw_pid: Any, heading: Any, dt: float) -> Any:
        """Heading loop."""
        return pid_angle_loop(desired_heading - yaw, yaw_pid, heading, dt)

    @row_law("acceleration", "altitude", "east")
    @staticmethod
    def push(
        desired_altitude: float, desired_speed: float, desired_heading: float, pos_z: float, vel: Any, speed_pid: Any, alt_pid: Any,
        altitude: Any, east: Any, dt: float,
    ) -> Any:  # fmt: skip
        """Speed loop, whose memory is `east`, and altitude loop."""
        vx, vy, vz = vel
        sine, cosine = sincos(desired_heading)
        ahead, east = pid_loop(desired_speed - math.sqrt(vx * vx + vy * vy + vz * vz), speed_pid, east, dt)
        rise, altitude = pid_loop(desired_altitude - pos_z, alt_pid, altitude, dt)
        return (ahead * cosine, ahead * sine, rise), altitude, east
