"""Heading, altitude and speed loops for FixedWing6DOF."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import Controller, Input, Output, Param, State, row_law
from tussle.numeric import atan2, wrap
from tussle.numeric.pid import pid_angle_loop, pid_loop, slope_error

GAINS = "kp ki kd band"
LOOP = "integral error has_error"
LOOP_DOC = "integral, last error, and 1 after the first call."
MAX_BANK = math.radians(60.0)
MAX_SLOPE = math.radians(30.0)
AILERON_PER_BANK = 0.1
GRAVITY = 9.81
ELEVATOR_PER_ELEVATION = 2.0


class FixedWing6DOFControllerPID(Controller):
    """Controls heading, altitude and speed of a FixedWing6DOF by throttle, elevator and aileron; the rudder is 0.

    The heading error commands a turn rate and this the bank of a coordinated turn, of at most 60 degrees; the altitude error a
    slope of the path of at most 30 degrees; the speed error the throttle. Inside, aileron is 0.1 times the error of the bank and
    elevator 2 times that of the elevation (see `tussle.numeric.pid.slope_error`). The integral of a loop is zero while its error
    exceeds `band`.

    In SCRIMMAGE it is a stub that moves rudder and aileron at fixed times.
    """

    grade = "portable"

    heading_pid = Param(
        (0.2, 0.01, 0.001, math.radians(9.0)), fields=GAINS, unit="1/s 1/s^2 1 rad", text_unit="1/s 1/s^2 1 deg",
        doc="Heading to turn rate.",
    )  # fmt: skip
    alt_pid = Param(
        (0.0025, 0.0001, 0.0002, 1.0), fields=GAINS, unit="rad/m rad/m/s rad*s/m m", doc="Altitude to slope."
    )
    vel_pid = Param((1.0, 0.1, 0.0, 1.0), fields=GAINS, unit="s/m 1/m s^2/m m/s", doc="Speed to throttle.")
    desired_heading = Input(unit="rad", doc="Desired heading, counter-clockwise from East.")
    desired_altitude = Input(unit="m", doc="Desired height above the origin's tangent plane.")
    desired_speed = Input(unit="m/s", doc="Desired speed.")
    throttle = Output(doc="Throttle in [-1, 1].")
    elevator = Output(doc="Elevator in [-1, 1], nose down positive.")
    aileron = Output(doc="Aileron in [-1, 1], right wing down positive.")
    rudder = Output(doc="0.")
    heading = State(LOOP, doc="Of the heading: " + LOOP_DOC)
    altitude = State(LOOP, doc="Of the altitude: " + LOOP_DOC)
    trim = State(unit="rad", doc="Elevation minus slope in steady flight.")
    forward = State(LOOP, doc="Of the speed: " + LOOP_DOC)

    @row_law("aileron", "heading")
    @staticmethod
    def turn(
        desired_heading: float, yaw: float, roll: float, vel: Any, heading_pid: Any, heading: Any, dt: float
    ) -> Any:
        """Heading loop; a turn to the left needs the left wing down."""
        command, heading = pid_angle_loop(desired_heading - yaw, heading_pid, heading, dt)
        vx, vy, _ = vel
        bank = atan2(command * math.sqrt(vx * vx + vy * vy), GRAVITY)
        wanted = -min(max(bank, -MAX_BANK), MAX_BANK)
        return min(max(AILERON_PER_BANK * wrap(wanted - roll), -1.0), 1.0), heading

    @row_law("elevator", "altitude", "trim")
    @staticmethod
    def rise(
        desired_altitude: float, pos_z: float, climb: float, vel: Any, alt_pid: Any, altitude: Any, trim: float, dt: float
    ) -> Any:  # fmt: skip
        """Altitude loop."""
        command, altitude = pid_loop(desired_altitude - pos_z, alt_pid, altitude, dt)
        error, trim = slope_error(min(max(command, -MAX_SLOPE), MAX_SLOPE), climb, vel, trim, dt)
        return -min(max(ELEVATOR_PER_ELEVATION * error, -1.0), 1.0), altitude, trim

    @row_law("throttle", "rudder", "forward")
    @staticmethod
    def push(desired_speed: float, vel: Any, vel_pid: Any, forward: Any, dt: float) -> Any:
        """Speed loop."""
        vx, vy, vz = vel
        command, forward = pid_loop(
            desired_speed - math.sqrt(vx * vx + vy * vy + vz * vz), vel_pid, forward, dt
        )
        return min(max(command, -1.0), 1.0), 0.0, forward
