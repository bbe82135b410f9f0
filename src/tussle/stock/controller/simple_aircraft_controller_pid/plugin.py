"""Heading, altitude and speed loops for SimpleAircraft."""

from __future__ import annotations

import math

from tussle.api import Controller, GroupView, Input, Output, Param, State
from tussle.stock.controller.simple_aircraft_controller_pid import kernels

GAINS = "kp ki kd band"


class SimpleAircraftControllerPID(Controller):
    """Controls heading (or bank), altitude (or slope of descent) and speed of a SimpleAircraft with one PID loop each.

    The heading error commands the roll rate; that loop is of third order and needs its derivative gain to be stable. The
    integral of a loop is zero while its error exceeds `band`. desired_roll is right wing down, desired_glide_slope is
    positive downwards.

    Differences from the existing system: a positive pitch_rate raises the nose; the measured slope is that of the true
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
    memory = State(
        "lateral_integral lateral_error vertical_integral vertical_error speed_integral speed_error has_error",
        doc="Integral and last error of each loop; has_error is 1 after the first call.",
    )

    def active_inputs(self) -> list[str]:
        """Return heading or bank, altitude or slope, and speed."""
        lateral = "desired_roll" if self.use_roll else "desired_heading"
        vertical = "desired_glide_slope" if self.use_glide_slope else "desired_altitude"
        return [lateral, vertical, "desired_speed"]

    def step(self, g: GroupView) -> None:
        """Run all loops of all rows."""
        lateral, angle = (self.desired_roll, g.roll) if self.use_roll else (self.desired_heading, g.yaw)
        vertical = self.desired_glide_slope if self.use_glide_slope else self.desired_altitude
        kernels.steer(
            (lateral, vertical, self.desired_speed), (g.pos[2], *g.vel), angle, (self.use_roll, self.use_glide_slope),
            (self.heading_pid, self.alt_pid, self.vel_pid), self.memory, g.dt, (self.throttle, self.roll_rate, self.pitch_rate),
        )  # fmt: skip
