"""Controllers of copters and of rigid bodies, as in SCRIMMAGE."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import State, row_law
from tussle.numeric import sincos, wrap
from tussle.plugins.historic.pid import clamp, pid_angle_loop, pid_loop
from tussle.plugins.stock.controller import (
    double_integrator_controller_vel_yaw,
    rigid_body_6dof_controller_pid,
    simple_quadrotor_controller_lqr,
)


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


class RigidBody6DOFControllerPID(rigid_body_6dof_controller_pid.RigidBody6DOFControllerPID):
    """RigidBody6DOFControllerPID whose heading loop moves the elevator, and whose altitude loop moves the aileron.

    With SCRIMMAGE's loops (`tussle.plugins.historic.pid`). In tussle the outputs are in the order of the model's inputs.
    """

    @row_law("elevator", "aileron", "rudder", "heading", "altitude")
    @staticmethod
    def steer(
        desired_heading: float, desired_altitude: float, yaw: float, climb: float, roll: float, pos_z: float,
        heading_pid: Any, alt_pid: Any, heading: Any, altitude: Any, dt: float,
    ) -> Any:  # fmt: skip
        """Loops of heading and altitude."""
        turn, heading = pid_angle_loop(desired_heading - yaw, heading_pid, heading, dt)
        rise, altitude = pid_loop(desired_altitude - pos_z, alt_pid, altitude, dt)
        return turn + roll, climb - rise, 0.0, heading, altitude

    @row_law("thrust", "forward")
    @staticmethod
    def push(desired_speed: float, vel: Any, vel_pid: Any, forward: Any, dt: float) -> Any:
        """Speed loop."""
        vx, vy, vz = vel
        return pid_loop(desired_speed - math.sqrt(vx * vx + vy * vy + vz * vz), vel_pid, forward, dt)


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
