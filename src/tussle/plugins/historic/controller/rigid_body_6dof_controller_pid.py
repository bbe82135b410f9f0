"""RigidBody6DOFControllerPID as in SCRIMMAGE."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import row_law
from tussle.plugins.historic.pid import pid_angle_loop, pid_loop
from tussle.plugins.stock.controller import rigid_body_6dof_controller_pid


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
