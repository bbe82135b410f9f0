"""Velocity, altitude and heading loops for a double integrator."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import Controller, Input, Output, Param, State, row_law
from tussle.numeric import sincos
from tussle.numeric.pid import pid_angle_loop, pid_loop

GAINS = "kp ki kd band"
LOOP = "integral error has_error"
LOOP_DOC = "Integral and last error of its loop; has_error is 1 after the first call."


class DoubleIntegratorControllerVelYaw(Controller):
    """Flies a double integrator at a speed along a heading, at an altitude, facing the heading, with one PID loop each.

    The altitude error commands a climb speed; the errors of the three components of the velocity command the acceleration, all with
    `speed_pid`. The integral of a loop is zero while its error exceeds `band`.

    In SCRIMMAGE the speed error acts along the desired heading only, so a vehicle at its desired speed never turns to another
    heading; the altitude error commands the acceleration, which with the default gains oscillates for ever; and the first call
    has a derivative kick.
    """

    grade = "portable"

    yaw_pid = Param(
        (0.2, 0.01, 0.001, math.radians(9.0)),
        fields=GAINS,
        unit="1/s 1/s^2 1 rad",
        text_unit="1/s 1/s^2 1 deg",
        doc="Heading to turn rate.",
    )
    speed_pid = Param(
        (1.0, 0.1, 0.0, 1.0), fields=GAINS, unit="1/s 1/s^2 1 m/s", doc="Velocity to acceleration."
    )
    alt_pid = Param((1.0, 0.0, 0.0, 1.0), fields=GAINS, unit="1/s 1/s^2 1 m", doc="Altitude to climb speed.")
    desired_altitude = Input(unit="m", doc="Desired height above the origin's tangent plane.")
    desired_speed = Input(unit="m/s", doc="Desired horizontal speed.")
    desired_heading = Input(unit="rad", doc="Desired heading, counter-clockwise from East.")
    acceleration = Output(
        "acceleration_x acceleration_y acceleration_z", unit="m/s^2", doc="Acceleration, world frame."
    )
    turn_rate = Output(unit="rad/s", doc="Yaw rate, counter-clockwise positive.")
    heading = State(LOOP, unit="rad*s rad 1", doc=LOOP_DOC)
    altitude = State(LOOP, unit="m*s m 1", doc=LOOP_DOC)
    east = State(LOOP, unit="m m/s 1", doc=LOOP_DOC)
    north = State(LOOP, unit="m m/s 1", doc=LOOP_DOC)
    up = State(LOOP, unit="m m/s 1", doc=LOOP_DOC)

    @row_law("turn_rate", "heading")
    @staticmethod
    def turn(desired_heading: float, yaw: float, yaw_pid: Any, heading: Any, dt: float) -> Any:
        """Heading loop."""
        return pid_angle_loop(desired_heading - yaw, yaw_pid, heading, dt)

    @row_law("acceleration", "altitude", "east", "north", "up")
    @staticmethod
    def push(
        desired_altitude: float, desired_speed: float, desired_heading: float, pos_z: float, vel: Any, speed_pid: Any, alt_pid: Any,
        altitude: Any, east: Any, north: Any, up: Any, dt: float,
    ) -> Any:  # fmt: skip
        """Velocity loops, and the altitude loop around the one of the climb speed."""
        vx, vy, vz = vel
        sine, cosine = sincos(desired_heading)
        climb, altitude = pid_loop(desired_altitude - pos_z, alt_pid, altitude, dt)
        ax, east = pid_loop(desired_speed * cosine - vx, speed_pid, east, dt)
        ay, north = pid_loop(desired_speed * sine - vy, speed_pid, north, dt)
        az, up = pid_loop(climb - vz, speed_pid, up, dt)
        return (ax, ay, az), altitude, east, north, up
