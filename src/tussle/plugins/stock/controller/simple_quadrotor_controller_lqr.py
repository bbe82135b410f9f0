"""Linear-quadratic regulators that bring a quadrotor to a point and a heading."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import Controller, HistoricAttributes, Input, Output, Param, State, row_law
from tussle.numeric import sincos, wrap
from tussle.numeric.pid import pid_loop

DAMPING = math.sqrt(2.0)
"""Gain of the rate of a double integrator whose regulator minimizes the integral of error^2 + command^2; that of the error is 1."""
SLOWING = 10.0
"""Distance per speed at which it approaches a point [s]: of SCRIMMAGE."""


class SimpleQuadrotorControllerLQR(Controller):
    """Brings a SimpleQuadrotor to a point and a heading.

    Height and heading by linear-quadratic regulators, u = -e - sqrt(2) e' (Anderson and Moore 1990, Optimal Control, section 3.1). The
    desired horizontal velocity points towards the point; its size is a tenth of the distance per second, at most max_vel. A PID loop for
    each horizontal axis, along the heading and to its left, follows it; the integral of a loop is zero while its error exceeds vel_i_lim.

    SCRIMMAGE commands the speed along the nose only, wherever the point is, and coasts within 10 m of it.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(renamed={"i_lim": "vel_i_lim"})
    vel_p_gain = Param(1.0, unit="1/s", doc="Velocity error to acceleration.")
    vel_i_gain = Param(0.0, unit="1/s^2", doc="Its integral to acceleration.")
    vel_d_gain = Param(0.0, doc="Its derivative to acceleration.")
    vel_i_lim = Param(1.0, unit="m/s", ge=0.0, doc="Largest error at which the integral grows.")
    max_vel = Param(20.0, unit="m/s", ge=0.0, doc="Largest desired speed.")
    point = Input("position_x position_y position_z", unit="m", doc="Point to go to, world frame.")
    desired_heading = Input(unit="rad", doc="Desired heading, counter-clockwise from East.")
    thrust = Output(
        "x_thrust y_thrust z_thrust", unit="m/s^2", doc="Acceleration forwards, to the left and up."
    )
    turn_force = Output(unit="rad/s^2", doc="Angular acceleration about the vertical.")
    forward = State("integral error has_error", unit="m m/s 1", doc="Memory of the loop along the heading.")
    sideways = State("integral error has_error", unit="m m/s 1", doc="Memory of the loop across the heading.")

    @row_law("turn_force")
    @staticmethod
    def turn(desired_heading: float, yaw: float, omega_z: float) -> Any:
        """Regulator of the heading."""
        return wrap(desired_heading - yaw) - DAMPING * omega_z

    @row_law("thrust", "forward", "sideways")
    @staticmethod
    def push(
        point: Any, pos: Any, vel: Any, yaw: float, max_vel: float, vel_p_gain: float, vel_i_gain: float, vel_d_gain: float,
        vel_i_lim: float, forward: Any, sideways: Any, dt: float,
    ) -> Any:  # fmt: skip
        """Loops of the horizontal velocity, and the regulator of the height."""
        (px, py, pz), (x, y, z), (vx, vy, vz) = point, pos, vel
        gains = vel_p_gain, vel_i_gain, vel_d_gain, vel_i_lim
        dx, dy = px - x, py - y
        distance = math.sqrt(dx * dx + dy * dy)
        rate = min(1.0 / SLOWING, max_vel / max(distance, 1e-9))
        ex, ey = rate * dx - vx, rate * dy - vy
        sine, cosine = sincos(yaw)
        ahead, forward = pid_loop(cosine * ex + sine * ey, gains, forward, dt)
        left, sideways = pid_loop(cosine * ey - sine * ex, gains, sideways, dt)
        return (ahead, left, pz - z - DAMPING * vz), forward, sideways
