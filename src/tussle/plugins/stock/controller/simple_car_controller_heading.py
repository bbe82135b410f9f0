"""A heading loop for a car."""

from __future__ import annotations

from typing import Any

from tussle.api import Controller, Input, Output, Param, State, row_law
from tussle.numeric.pid import pid_angle_loop


class SimpleCarControllerHeading(Controller):
    """Steers a car to a heading with a PID loop, and passes the desired speed through.

    The integral of the loop is zero while its error exceeds `i_lim`. SCRIMMAGE's first call has a derivative kick, and its
    derivative jumps where the error passes from pi to -pi; there the steering angle is the channel `turn_rate`.
    """

    grade = "portable"
    p_gain = Param(0.1, doc="Heading error [rad] to steering angle [rad].")
    i_gain = Param(0.001, unit="1/s", doc="Its integral to steering angle.")
    d_gain = Param(0.2, unit="s", doc="Its derivative to steering angle.")
    i_lim = Param(1e7, unit="rad", ge=0.0, doc="Largest error at which the integral grows.")
    desired_speed = Input(unit="m/s", doc="Desired speed.")
    desired_heading = Input(unit="rad", doc="Desired heading, counter-clockwise from East.")
    speed = Output(unit="m/s", doc="Desired speed, passed through.")
    steering = Output(unit="rad", doc="Steering angle, left positive.")
    heading = State(
        "integral error has_error",
        unit="rad*s rad 1",
        doc="Integral and last error; has_error is 1 after the first call.",
    )

    @row_law("speed", "steering", "heading")
    @staticmethod
    def drive(
        desired_speed: float, desired_heading: float, yaw: float, p_gain: float, i_gain: float, d_gain: float, i_lim: float,
        heading: Any, dt: float,
    ) -> Any:  # fmt: skip
        """Heading loop; the speed is passed through."""
        gains = p_gain, i_gain, d_gain, i_lim
        angle, heading = pid_angle_loop(desired_heading - yaw, gains, heading, dt)
        return desired_speed, angle, heading
