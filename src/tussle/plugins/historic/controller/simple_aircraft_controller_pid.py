"""SimpleAircraftControllerPID as in SCRIMMAGE."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import row_law
from tussle.numeric import atan2
from tussle.plugins.historic.pid import pid_angle_loop, pid_loop
from tussle.plugins.stock.controller import simple_aircraft_controller_pid


class SimpleAircraftControllerPID(simple_aircraft_controller_pid.SimpleAircraftControllerPID):
    """SimpleAircraftControllerPID with SCRIMMAGE's loops (`tussle.plugins.historic.pid`).

    The derivative has a kick in the first call, and where the heading error passes from pi to -pi.
    """

    @row_law("roll_rate", "lateral")
    @staticmethod
    def turn(desired_heading: float, yaw: float, heading_pid: Any, lateral: Any, dt: float) -> Any:
        """Heading loop."""
        return pid_angle_loop(desired_heading - yaw, heading_pid, lateral, dt)

    @row_law("roll_rate", "lateral")
    @staticmethod
    def bank(desired_roll: float, roll: float, heading_pid: Any, lateral: Any, dt: float) -> Any:
        """Bank loop."""
        command, lateral = pid_angle_loop(desired_roll - roll, heading_pid, lateral, dt)
        return -command, lateral

    @row_law("pitch_rate", "vertical")
    @staticmethod
    def rise(desired_altitude: float, pos_z: float, alt_pid: Any, vertical: Any, dt: float) -> Any:
        """Altitude loop."""
        return pid_loop(desired_altitude - pos_z, alt_pid, vertical, dt)

    @row_law("pitch_rate", "vertical")
    @staticmethod
    def glide(desired_glide_slope: float, vel: Any, alt_pid: Any, vertical: Any, dt: float) -> Any:
        """Slope loop; the published climb of SimpleAircraft has the wrong sign."""
        vx, vy, vz = vel
        slope = atan2(vz, math.sqrt(vx * vx + vy * vy))
        command, vertical = pid_loop(desired_glide_slope - slope, alt_pid, vertical, dt)
        return -command, vertical

    @row_law("throttle", "forward")
    @staticmethod
    def push(desired_speed: float, vel: Any, vel_pid: Any, forward: Any, dt: float) -> Any:
        """Speed loop."""
        vx, vy, vz = vel
        return pid_loop(desired_speed - math.sqrt(vx * vx + vy * vy + vz * vz), vel_pid, forward, dt)
