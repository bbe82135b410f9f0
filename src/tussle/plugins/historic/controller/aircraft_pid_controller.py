"""AircraftPIDController as in SCRIMMAGE."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import row_law
from tussle.plugins.historic.pid import clamp, pid_angle_loop, pid_loop
from tussle.plugins.stock.controller import aircraft_pid_controller


class AircraftPIDController(aircraft_pid_controller.AircraftPIDController):
    """AircraftPIDController whose altitude error times its gain is the elevation, without regard to the angle of attack.

    With SCRIMMAGE's loops (module `historic.pid`). In tussle the altitude error commands a climb speed, and the elevation is that of
    the path plus an integrated trim, so that the aircraft does not pitch between its limits.
    """

    @row_law("aileron", "heading", "bank")
    @staticmethod
    def turn(
        desired_heading: float, yaw: float, roll: float, max_roll: float, heading_pid: Any, roll_pid: Any, heading: Any, bank: Any,
        dt: float,
    ) -> Any:  # fmt: skip
        """Heading loop and bank loop."""
        command, heading = pid_angle_loop(desired_heading - yaw, heading_pid, heading, dt)
        aileron, bank = pid_angle_loop(clamp(-command, max_roll) - roll, roll_pid, bank, dt)
        return clamp(aileron, 1.0), heading, bank

    @row_law("aileron", "bank")
    @staticmethod
    def hold_bank(
        desired_roll: float, roll: float, max_roll: float, roll_pid: Any, bank: Any, dt: float
    ) -> Any:
        """Bank loop."""
        aileron, bank = pid_angle_loop(clamp(desired_roll, max_roll) - roll, roll_pid, bank, dt)
        return clamp(aileron, 1.0), bank

    @row_law("elevator", "altitude", "elevation")
    @staticmethod
    def rise(
        desired_altitude: float, pos_z: float, climb: float, max_pitch: float, altitude_pid: Any, pitch_pid: Any,
        altitude: Any, elevation: Any, dt: float,
    ) -> Any:  # fmt: skip
        """Altitude loop and elevation loop; angles nose down."""
        command, altitude = pid_loop(desired_altitude - pos_z, altitude_pid, altitude, dt)
        elevator, elevation = pid_angle_loop(clamp(-command, max_pitch) + climb, pitch_pid, elevation, dt)
        return clamp(elevator, 1.0), altitude, elevation

    @row_law("throttle", "rudder", "forward")
    @staticmethod
    def push(desired_speed: float, vel: Any, speed_pid: Any, forward: Any, dt: float) -> Any:
        """Speed loop."""
        vx, vy, vz = vel
        command, forward = pid_loop(
            desired_speed - math.sqrt(vx * vx + vy * vy + vz * vz), speed_pid, forward, dt
        )
        return clamp(command, 1.0), 0.0, forward
