"""Heading, altitude and speed loops for unicycles."""

from __future__ import annotations

import math

from tussle.api import Controller, GroupView, Input, Output, Param, State
from tussle.stock.controller.unicycle_pid import kernels

GAINS = "kp ki kd band"


class UnicyclePID(Controller):
    """Controls heading, altitude and speed of a unicycle with one PID loop each for heading, elevation, bank and speed.

    The desired elevation is that of the vector (speed forwards, altitude error upwards), with the opposite sign for a
    vehicle that flies backwards. The desired speed is passed through as `speed`; the speed loop commands `acceleration_x`
    for models that take an acceleration. The integral of a loop is zero while its error exceeds `band`.

    Differences from the existing system: elevation is nose up and a positive pitch_rate raises the nose; the time step
    of each loop is that of the call (there, the full step even when called once per substep); the first call has no
    derivative kick; and the derivative of an angle's error does not jump where the error passes from +pi to -pi.
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
    memory = State(
        "heading_integral heading_error pitch_integral pitch_error roll_integral roll_error speed_integral speed_error has_error",
        unit="rad*s rad rad*s rad rad*s rad m m/s 1",
        doc="Integral and last error of each loop; has_error is 1 after the first call.",
    )

    def step(self, g: GroupView) -> None:
        """Run all loops of all rows."""
        kernels.steer(
            (self.desired_altitude, self.desired_speed, self.desired_heading), (g.pos[2], *g.vel), (g.yaw, g.climb, g.roll),
            (self.heading_pid, self.pitch_pid, self.roll_pid, self.speed_pid), self.memory, g.dt,
            (self.speed, self.acceleration_x, self.turn_rate, self.pitch_rate, self.roll_rate),
        )  # fmt: skip
