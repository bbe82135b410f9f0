"""Cascaded loops of an aircraft with surfaces."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import Controller, Input, Output, Param, State, row_law
from tussle.numeric.pid import pid_angle_loop, pid_loop, slope_error

GAINS = "kp ki kd band"
ANGLE_UNITS = "1 1/s s rad"
ANGLE_TEXT_UNITS = "1 1/s s deg"
LOOP = "integral error has_error"
LOOP_DOC = "integral, last error, and 1 after the first call."
MIN_SPEED = 1.0  # [m/s], where a climb speed is divided by the speed


class AircraftPIDController(Controller):
    """Controls heading (or bank), altitude and speed of an aircraft by throttle, elevator and aileron; the rudder is 0.

    The heading error commands a bank, and the error of the bank the aileron. The altitude error commands a climb speed; divided by the
    speed this is a slope of the path, whose error (see `tussle.numeric.pid.slope_error`) commands the elevator. The speed error commands
    the throttle. Surfaces and throttle are clamped to [-1, 1]. The integral of a loop is zero while its error exceeds `band`.

    Differences from SCRIMMAGE: there the altitude error times the gain was an elevation, so that the default of 0.1 rad/m
    made a fast aircraft pitch from -45 to 45 degrees for ever; here it is a climb speed, and the trim is integrated. The time
    step of each loop is that of the call; the first call has no derivative kick.
    """

    grade = "portable"

    heading_pid = Param(
        (1.0, 0.2, 1.0, math.radians(45.0)), fields=GAINS, unit=ANGLE_UNITS, text_unit=ANGLE_TEXT_UNITS, doc="Heading to bank."
    )  # fmt: skip
    altitude_pid = Param(
        (0.1, 0.0001, 0.01, 10.0), fields=GAINS, unit="1/s 1/s^2 1 m", doc="Altitude to climb speed."
    )
    speed_pid = Param(
        (1.0, 0.1, 0.03, 10.0), fields=GAINS, unit="s/m 1/m s^2/m m/s", doc="Speed to throttle."
    )
    roll_pid = Param(
        (0.3, 0.1, 0.001, math.radians(9.0)), fields=GAINS, unit=ANGLE_UNITS, text_unit=ANGLE_TEXT_UNITS, doc="Bank to aileron."
    )  # fmt: skip
    pitch_pid = Param(
        (5.0, 0.01, 0.01, math.radians(9.0)), fields=GAINS, unit=ANGLE_UNITS, text_unit=ANGLE_TEXT_UNITS, doc="Elevation to elevator."
    )  # fmt: skip
    max_pitch = Param(math.radians(45.0), unit="rad", text_unit="deg", ge=0.0, doc="Largest slope.")
    max_roll = Param(math.radians(60.0), unit="rad", text_unit="deg", ge=0.0, doc="Largest bank.")
    use_roll_control = Param(False, structural=True, doc="Hold desired_roll instead of desired_heading.")
    desired_heading = Input(unit="rad", doc="Desired heading, counter-clockwise from East.")
    desired_roll = Input(unit="rad", doc="Desired bank, right wing down, with use_roll_control.")
    desired_altitude = Input(unit="m", doc="Desired height above the origin's tangent plane.")
    desired_speed = Input(unit="m/s", doc="Desired speed.")
    throttle = Output(doc="Throttle in [-1, 1].")
    elevator = Output(doc="Elevator in [-1, 1], nose down positive.")
    aileron = Output(doc="Aileron in [-1, 1], right wing down positive.")
    rudder = Output(doc="0.")
    heading = State(LOOP, doc="Of the heading: " + LOOP_DOC)
    bank = State(LOOP, doc="Of the bank: " + LOOP_DOC)
    altitude = State(LOOP, doc="Of the altitude: " + LOOP_DOC)
    elevation = State(LOOP, doc="Of the elevation: " + LOOP_DOC)
    trim = State(unit="rad", doc="Elevation minus slope in steady flight.")
    forward = State(LOOP, doc="Of the speed: " + LOOP_DOC)

    def active_inputs(self) -> list[str]:
        """Return heading or bank, altitude and speed."""
        return [
            "desired_roll" if self.use_roll_control else "desired_heading",
            "desired_altitude",
            "desired_speed",
        ]

    @row_law("aileron", "heading", "bank")
    @staticmethod
    def turn(
        desired_heading: float, yaw: float, roll: float, max_roll: float, heading_pid: Any, roll_pid: Any, heading: Any, bank: Any,
        dt: float,
    ) -> Any:  # fmt: skip
        """Heading loop and bank loop; a turn to the left needs the left wing down."""
        command, heading = pid_angle_loop(desired_heading - yaw, heading_pid, heading, dt)
        wanted = -min(max(command, -max_roll), max_roll)
        aileron, bank = pid_angle_loop(wanted - roll, roll_pid, bank, dt)
        return min(max(aileron, -1.0), 1.0), heading, bank

    @row_law("aileron", "bank")
    @staticmethod
    def hold_bank(
        desired_roll: float, roll: float, max_roll: float, roll_pid: Any, bank: Any, dt: float
    ) -> Any:
        """Bank loop."""
        wanted = min(max(desired_roll, -max_roll), max_roll)
        aileron, bank = pid_angle_loop(wanted - roll, roll_pid, bank, dt)
        return min(max(aileron, -1.0), 1.0), bank

    @row_law("elevator", "altitude", "elevation", "trim")
    @staticmethod
    def rise(
        desired_altitude: float, pos_z: float, climb: float, vel: Any, max_pitch: float, altitude_pid: Any, pitch_pid: Any,
        altitude: Any, elevation: Any, trim: float, dt: float,
    ) -> Any:  # fmt: skip
        """Altitude loop and elevation loop."""
        vx, vy, vz = vel
        speed = max(math.sqrt(vx * vx + vy * vy + vz * vz), MIN_SPEED)
        climb_speed, altitude = pid_loop(desired_altitude - pos_z, altitude_pid, altitude, dt)
        slope = min(max(climb_speed / speed, -max_pitch), max_pitch)
        error, trim = slope_error(slope, climb, vel, trim, dt)
        command, elevation = pid_loop(error, pitch_pid, elevation, dt)
        return -min(max(command, -1.0), 1.0), altitude, elevation, trim

    @row_law("throttle", "rudder", "forward")
    @staticmethod
    def push(desired_speed: float, vel: Any, speed_pid: Any, forward: Any, dt: float) -> Any:
        """Speed loop."""
        vx, vy, vz = vel
        command, forward = pid_loop(
            desired_speed - math.sqrt(vx * vx + vy * vy + vz * vz), speed_pid, forward, dt
        )
        return min(max(command, -1.0), 1.0), 0.0, forward
