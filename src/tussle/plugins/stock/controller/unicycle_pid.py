"""Heading, altitude and speed loops for unicycles."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import Controller, Input, Output, Param, State, row_law
from tussle.numeric import atan2
from tussle.numeric.pid import pid_angle_loop, pid_loop

GAINS = "kp ki kd band"
LOOP = "integral error has_error"
LOOP_DOC = "Integral and last error of its loop; has_error is 1 after the first call."


class UnicyclePID(Controller):
    """Controls heading, altitude and speed of a unicycle with one PID loop each for heading, elevation, bank and speed.

    The desired elevation is that of the vector (speed forwards, altitude error upwards), with the opposite sign for a
    vehicle that flies backwards. The desired speed is passed through as `speed`; the speed loop commands `acceleration_x`
    for models that take an acceleration. The integral of a loop is zero while its error exceeds `band`.

    Other than in SCRIMMAGE, elevation is nose up and a positive pitch_rate raises the nose; each loop's
    time step is that of the call (there, the full step even when called once per substep); the first call has no
    derivative kick; the derivative of an angle's error does not jump where the error passes from +pi to -pi; and a loop
    does not run if no plugin reads its output.
    """

    grade = "portable"

    heading_pid = Param(
        (1.0, 0.1, 0.1, math.radians(45.0)),
        fields=GAINS,
        unit="1/s 1/s^2 1 rad",
        text_unit="1/s 1/s^2 1 deg",
        doc="Heading to turn rate.",
    )
    pitch_pid = Param(
        (1.0, 0.0, 0.0, 10.0), fields=GAINS, unit="1/s 1/s^2 1 rad", doc="Elevation to pitch rate."
    )
    roll_pid = Param(
        (1.0, 0.0, 0.0, 10.0),
        fields=GAINS,
        unit="1/s 1/s^2 1 rad",
        doc="Bank to roll rate; keeps the wings level.",
    )
    speed_pid = Param(
        (1.0, 0.1, 0.03, 10.0), fields=GAINS, unit="1/s 1/s^2 1 m/s", doc="Speed to acceleration_x."
    )
    desired_altitude = Input(unit="m", doc="Desired height above the origin's tangent plane.")
    desired_speed = Input(unit="m/s", doc="Desired speed.")
    desired_heading = Input(unit="rad", doc="Desired heading, counter-clockwise from East.")
    speed = Output(unit="m/s", doc="Desired speed, passed through.")
    acceleration_x = Output(unit="m/s^2", doc="Acceleration along the body x axis.")
    turn_rate = Output(unit="rad/s", doc="Turn rate, counter-clockwise positive.")
    pitch_rate = Output(unit="rad/s", doc="Rate of the elevation, nose up positive.")
    roll_rate = Output(unit="rad/s", doc="Roll rate, right wing down positive.")
    heading = State(LOOP, unit="rad*s rad 1", doc=LOOP_DOC)
    elevation = State(LOOP, unit="rad*s rad 1", doc=LOOP_DOC)
    bank = State(LOOP, unit="rad*s rad 1", doc=LOOP_DOC)
    forward = State(LOOP, unit="m m/s 1", doc=LOOP_DOC)

    @row_law("speed")
    @staticmethod
    def pass_speed(desired_speed: float) -> float:
        """Pass the desired speed through."""
        return desired_speed

    @row_law("turn_rate", "heading")
    @staticmethod
    def turn(desired_heading: float, yaw: float, heading_pid: Any, heading: Any, dt: float) -> Any:
        """Heading loop."""
        return pid_angle_loop(desired_heading - yaw, heading_pid, heading, dt)

    @row_law("pitch_rate", "elevation")
    @staticmethod
    def rise(
        desired_altitude: float,
        desired_speed: float,
        pos_z: float,
        climb: float,
        pitch_pid: Any,
        elevation: Any,
        dt: float,
    ) -> Any:
        """Elevation loop."""
        aim = atan2((desired_altitude - pos_z) * desired_speed, desired_speed * desired_speed)
        return pid_loop(aim - climb, pitch_pid, elevation, dt)

    @row_law("roll_rate", "bank")
    @staticmethod
    def level(roll: float, roll_pid: Any, bank: Any, dt: float) -> Any:
        """Bank loop; keeps the wings level."""
        return pid_angle_loop(-roll, roll_pid, bank, dt)

    @row_law("acceleration_x", "forward")
    @staticmethod
    def push(desired_speed: float, vel: Any, speed_pid: Any, forward: Any, dt: float) -> Any:
        """Speed loop."""
        vx, vy, vz = vel
        return pid_loop(desired_speed - math.sqrt(vx * vx + vy * vy + vz * vz), speed_pid, forward, dt)
