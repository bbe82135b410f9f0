"""Heading, altitude and speed loops for SimpleAircraft."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import Controller, Input, Output, Param, State, row_law
from tussle.numeric import atan2
from tussle.numeric.pid import pid_angle_loop, pid_loop

GAINS = "kp ki kd band"
LOOP = "integral error has_error"
LOOP_DOC = "integral, last error, and 1 after the first call."


class SimpleAircraftControllerPID(Controller):
    """Controls heading (or bank), altitude (or slope of descent) and speed of a SimpleAircraft with one PID loop each.

    The heading error commands the roll rate; that loop is of third order and needs its derivative gain to be stable. The
    integral of a loop is zero while its error exceeds `band`. desired_roll is right wing down, desired_glide_slope is
    positive downwards.

    Differences from SCRIMMAGE: a positive pitch_rate raises the nose; the measured slope is that of the true
    velocity (there the sign of its z was wrong, so the loops act as before); the time step of each loop is that of the
    call (there, the full step even when called once per substep); the first call has no derivative kick, which there
    rolled every aircraft at its largest rate at the start; and the derivative of the heading error does not jump where
    the error passes from +pi to -pi.
    """

    grade = "portable"

    heading_pid = Param(
        (1.0, 0.01, 2.0, math.radians(9.0)),
        fields=GAINS,
        unit="1/s 1/s^2 1 rad",
        text_unit="1/s 1/s^2 1 deg",
        doc="Heading (or bank) to roll rate.",
    )
    alt_pid = Param(
        (1.0, 0.0, 0.8, 1.0), fields=GAINS, doc="Altitude [m] (or slope [rad]) to pitch rate [rad/s]."
    )
    vel_pid = Param((1.0, 0.1, 0.0, 1.0), fields=GAINS, unit="s/m 1/m s^2/m m/s", doc="Speed to throttle.")
    use_roll = Param(False, structural=True, doc="Hold desired_roll instead of desired_heading.")
    use_glide_slope = Param(
        False, structural=True, doc="Hold desired_glide_slope instead of desired_altitude."
    )
    desired_heading = Input(unit="rad", doc="Desired heading, counter-clockwise from East.")
    desired_roll = Input(unit="rad", doc="Desired bank, right wing down, with use_roll.")
    desired_altitude = Input(unit="m", doc="Desired height above the origin's tangent plane.")
    desired_glide_slope = Input(unit="rad", doc="Desired slope of the descent, with use_glide_slope.")
    desired_speed = Input(unit="m/s", doc="Desired speed.")
    throttle = Output(doc="Throttle; five times the acceleration [m/s^2].")
    roll_rate = Output(unit="rad/s", doc="Rate of the bank, positive into a left turn.")
    pitch_rate = Output(unit="rad/s", doc="Rate of the elevation, nose up positive.")
    lateral = State(LOOP, doc="Of the heading or the bank: " + LOOP_DOC)
    vertical = State(LOOP, doc="Of the altitude or the slope: " + LOOP_DOC)
    forward = State(LOOP, doc="Of the speed: " + LOOP_DOC)

    def active_inputs(self) -> list[str]:
        """Return heading or bank, altitude or slope, and speed."""
        lateral = "desired_roll" if self.use_roll else "desired_heading"
        vertical = "desired_glide_slope" if self.use_glide_slope else "desired_altitude"
        return [lateral, vertical, "desired_speed"]

    @row_law("roll_rate", "lateral")
    @staticmethod
    def turn(desired_heading: float, yaw: float, heading_pid: Any, lateral: Any, dt: float) -> Any:
        """Heading loop."""
        return pid_angle_loop(desired_heading - yaw, heading_pid, lateral, dt)

    @row_law("roll_rate", "lateral")
    @staticmethod
    def bank(desired_roll: float, roll: float, heading_pid: Any, lateral: Any, dt: float) -> Any:
        """Bank loop; a bank to the right needs a negative roll rate of the model."""
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
        """Slope loop; a steeper descent needs a lower nose."""
        vx, vy, vz = vel
        slope = atan2(-vz, math.sqrt(vx * vx + vy * vy))
        command, vertical = pid_loop(desired_glide_slope - slope, alt_pid, vertical, dt)
        return -command, vertical

    @row_law("throttle", "forward")
    @staticmethod
    def push(desired_speed: float, vel: Any, vel_pid: Any, forward: Any, dt: float) -> Any:
        """Speed loop."""
        vx, vy, vz = vel
        return pid_loop(desired_speed - math.sqrt(vx * vx + vy * vy + vz * vz), vel_pid, forward, dt)
