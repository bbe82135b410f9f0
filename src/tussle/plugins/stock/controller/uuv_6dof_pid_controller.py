"""Heading, depth and speed loops for UUV6DOF."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import Controller, Input, Output, Param, State, row_law
from tussle.numeric import atan2
from tussle.numeric.pid import pid_angle_loop, pid_loop
from tussle.numeric.quaternion import quat_rotate_inverse

GAINS = "kp ki kd band"
RATE_GAIN = 8.0
"""Deflection per rate [s/rad]: more than 4 s/rad make the hull of REMUS, which turns across its path by itself, stable at 1.5 m/s."""
LOOP = "integral error has_error"
LOOP_DOC = "integral, last error, and 1 after the first call."


class UUV6DOFPIDController(Controller):
    """Controls heading, altitude (negative: depth) and speed of an underwater vehicle by throttle, elevator and rudder.

    The desired elevation is that of the vector (desired speed forwards, altitude error upwards). Outputs are clamped to [-1, 1].
    The integral of a loop is zero while its error exceeds `band`. Rates of turn and pitch are damped by fixed gains. With the
    defaults the speed loop has no integral, so a speed error remains, and a buoyant vehicle remains above the desired altitude.

    Differences from SCRIMMAGE: the time step of each loop is that of the call; the first call has no derivative kick; angles
    are wrapped; rates are damped, which the hull needs (there, it was stable, because forces of inertia were missing).
    """

    grade = "portable"

    heading_pid = Param(
        (0.5, 0.001, 0.005, math.radians(9.0)), fields=GAINS, unit="1/rad 1/rad/s s/rad rad", text_unit="1/rad 1/rad/s s/rad deg",
        doc="Heading to rudder.",
    )  # fmt: skip
    pitch_pid = Param(
        (2.0, 0.001, 0.01, 0.5), fields=GAINS, unit="1/rad 1/rad/s s/rad rad", doc="Elevation to elevator."
    )
    speed_pid = Param((1.0, 0.0, 0.0, 1.0), fields=GAINS, unit="s/m 1/m s^2/m m/s", doc="Speed to throttle.")
    desired_heading = Input(unit="rad", doc="Desired heading, counter-clockwise from East.")
    desired_altitude = Input(unit="m", doc="Desired height above the origin's tangent plane.")
    desired_speed = Input(unit="m/s", doc="Desired speed.")
    throttle = Output(doc="Throttle in [-1, 1].")
    elevator = Output(doc="Stern planes in [-1, 1], nose down positive.")
    rudder = Output(doc="Rudder in [-1, 1], left positive.")
    heading = State(LOOP, doc="Of the heading: " + LOOP_DOC)
    elevation = State(LOOP, doc="Of the elevation: " + LOOP_DOC)
    forward = State(LOOP, doc="Of the speed: " + LOOP_DOC)

    @row_law("rudder", "heading")
    @staticmethod
    def turn(
        desired_heading: float, yaw: float, quat: Any, omega: Any, heading_pid: Any, heading: Any, dt: float
    ) -> Any:
        """Heading loop."""
        command, heading = pid_angle_loop(desired_heading - yaw, heading_pid, heading, dt)
        _, _, r = quat_rotate_inverse(*quat, *omega)
        return min(max(command - RATE_GAIN * r, -1.0), 1.0), heading

    @row_law("elevator", "elevation")
    @staticmethod
    def rise(
        desired_altitude: float, desired_speed: float, pos_z: float, climb: float, quat: Any, omega: Any, pitch_pid: Any, elevation: Any,
        dt: float,
    ) -> Any:  # fmt: skip
        """Elevation loop."""
        aim = atan2(desired_altitude - pos_z, abs(desired_speed))
        command, elevation = pid_loop(aim - climb, pitch_pid, elevation, dt)
        _, q, _ = quat_rotate_inverse(*quat, *omega)
        return min(max(-command - RATE_GAIN * q, -1.0), 1.0), elevation

    @row_law("throttle", "forward")
    @staticmethod
    def push(desired_speed: float, vel: Any, speed_pid: Any, forward: Any, dt: float) -> Any:
        """Speed loop."""
        vx, vy, vz = vel
        command, forward = pid_loop(
            desired_speed - math.sqrt(vx * vx + vy * vy + vz * vz), speed_pid, forward, dt
        )
        return min(max(command, -1.0), 1.0), forward
