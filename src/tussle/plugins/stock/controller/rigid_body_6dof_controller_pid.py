"""Heading, altitude and speed loops for RigidBody6DOF."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import Controller, Input, Output, Param, State, row_law
from tussle.numeric.pid import pid_angle_loop, pid_loop
from tussle.numeric.quaternion import quat_rotate_inverse

GAINS = "kp ki kd band"
LOOP = "integral error has_error"
LOOP_DOC = "integral, last error, and 1 after the first call."
MAX_CLIMB = math.radians(45.0)
MAX_TURN = 1.0  # [rad/s]
RATE_GAIN = 2.0  # torque per error of a rate, at an inertia of 1 kg m^2 [1/s]
ANGLE_GAIN = 1.0  # rate per error of elevation and bank [1/s]


class RigidBody6DOFControllerPID(Controller):
    """Controls heading, altitude and speed of a RigidBody6DOF, with level wings.

    The heading error commands a turn rate, the altitude error an elevation of at most 45 degrees, the speed error the thrust. Elevation
    and bank are followed with a time constant of 1 s, rates with 0.5 s at an inertia of 1 kg m^2. The integral of a loop is zero while
    its error exceeds `band`.

    In SCRIMMAGE its outputs are in another order than the model's inputs, and not connected to them.
    """

    grade = "portable"

    heading_pid = Param(
        (0.2, 0.01, 0.001, math.radians(9.0)), fields=GAINS, unit="1/s 1/s^2 1 rad", text_unit="1/s 1/s^2 1 deg",
        doc="Heading to turn rate.",
    )  # fmt: skip
    alt_pid = Param(
        (0.0025, 0.0001, 0.0002, 1.0),
        fields=GAINS,
        unit="rad/m rad/m/s rad*s/m m",
        doc="Altitude to elevation.",
    )
    vel_pid = Param((1.0, 0.1, 0.0, 1.0), fields=GAINS, unit="N*s/m N/m N*s^2/m m/s", doc="Speed to thrust.")
    desired_heading = Input(unit="rad", doc="Desired heading, counter-clockwise from East.")
    desired_altitude = Input(unit="m", doc="Desired height above the origin's tangent plane.")
    desired_speed = Input(unit="m/s", doc="Desired speed.")
    thrust = Output(doc="Force along the body x axis [N].")
    elevator = Output(doc="Torque about the body y axis [N m], nose down positive.")
    aileron = Output(doc="Torque about the body x axis [N m], right wing down positive.")
    rudder = Output(doc="Torque about the body z axis [N m], left positive.")
    heading = State(LOOP, doc="Of the heading: " + LOOP_DOC)
    altitude = State(LOOP, doc="Of the altitude: " + LOOP_DOC)
    forward = State(LOOP, doc="Of the speed: " + LOOP_DOC)

    @row_law("elevator", "aileron", "rudder", "heading", "altitude")
    @staticmethod
    def steer(
        desired_heading: float, desired_altitude: float, yaw: float, climb: float, roll: float, pos_z: float, quat: Any, omega: Any,
        heading_pid: Any, alt_pid: Any, heading: Any, altitude: Any, dt: float,
    ) -> Any:  # fmt: skip
        """Loops of heading, altitude and bank, and of the rates."""
        turn, heading = pid_angle_loop(desired_heading - yaw, heading_pid, heading, dt)
        aim, altitude = pid_loop(desired_altitude - pos_z, alt_pid, altitude, dt)
        p, q, r = quat_rotate_inverse(*quat, *omega)
        rise = ANGLE_GAIN * (min(max(aim, -MAX_CLIMB), MAX_CLIMB) - climb)
        turn = min(max(turn, -MAX_TURN), MAX_TURN)
        return (
            RATE_GAIN * (-rise - q),
            RATE_GAIN * (-ANGLE_GAIN * roll - p),
            RATE_GAIN * (turn - r),
            heading,
            altitude,
        )

    @row_law("thrust", "forward")
    @staticmethod
    def push(desired_speed: float, vel: Any, vel_pid: Any, forward: Any, dt: float) -> Any:
        """Speed loop."""
        vx, vy, vz = vel
        return pid_loop(desired_speed - math.sqrt(vx * vx + vy * vy + vz * vz), vel_pid, forward, dt)
