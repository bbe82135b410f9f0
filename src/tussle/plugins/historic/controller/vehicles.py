"""Controllers of unicycles, cars and underwater vehicles, as in SCRIMMAGE."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import row_law
from tussle.numeric import atan2, sincos
from tussle.plugins.historic.pid import pid_angle_loop, pid_loop
from tussle.plugins.stock.controller import (
    simple_car_controller_heading,
    unicycle_controller_point,
    unicycle_pid,
    uuv_6dof_pid_controller,
)


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


class UnicycleControllerPoint(unicycle_controller_point.UnicycleControllerPoint):
    """UnicycleControllerPoint that takes the vehicle's own position instead of the point ahead, and does not pitch.

    In tussle the distance of the point ahead decays to 0, in three dimensions.
    """

    @row_law("speed", "turn_rate", "pitch_rate", "velocity_z")
    @staticmethod
    def pull(point: Any, pos: Any, yaw: float, l: float, gain: float) -> Any:
        """Velocity towards the point, along the body axes."""
        (px, py, pz), (x, y, z) = point, pos
        turn, ahead = sincos(yaw)
        ex, ey = gain * (px - x), gain * (py - y)
        return ahead * ex + turn * ey, (ahead * ey - turn * ex) / l, 0.0, gain * (pz - z)


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
