"""UnicyclePID as in SCRIMMAGE."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import row_law
from tussle.numeric import atan2
from tussle.plugins.historic.pid import pid_angle_loop, pid_loop
from tussle.plugins.stock.controller import unicycle_pid


class UnicyclePID(unicycle_pid.UnicyclePID):
    """UnicyclePID with SCRIMMAGE's loops (module `historic.pid`): a kick in the first call, and where the error passes from pi to -pi.

    The bank is not wrapped.
    """

    @row_law("turn_rate", "heading")
    @staticmethod
    def turn(desired_heading: float, yaw: float, heading_pid: Any, heading: Any, dt: float) -> Any:
        """Heading loop."""
        return pid_angle_loop(desired_heading - yaw, heading_pid, heading, dt)

    @row_law("pitch_rate", "elevation")
    @staticmethod
    def rise(
        desired_altitude: float, desired_speed: float, pos_z: float, climb: float, pitch_pid: Any, elevation: Any, dt: float
    ) -> Any:  # fmt: skip
        """Elevation loop."""
        aim = atan2((desired_altitude - pos_z) * desired_speed, desired_speed * desired_speed)
        return pid_loop(aim - climb, pitch_pid, elevation, dt)

    @row_law("roll_rate", "bank")
    @staticmethod
    def level(roll: float, roll_pid: Any, bank: Any, dt: float) -> Any:
        """Bank loop; keeps the wings level."""
        return pid_loop(-roll, roll_pid, bank, dt)

    @row_law("acceleration_x", "forward")
    @staticmethod
    def push(desired_speed: float, vel: Any, speed_pid: Any, forward: Any, dt: float) -> Any:
        """Speed loop."""
        vx, vy, vz = vel
        return pid_loop(desired_speed - math.sqrt(vx * vx + vy * vy + vz * vz), speed_pid, forward, dt)
