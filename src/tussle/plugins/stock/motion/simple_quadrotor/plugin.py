"""A quadrotor reduced to a double integrator in the frame of its heading."""

from __future__ import annotations

import math

import numpy as np

from tussle.api import Input, MotionBody, MotionModel, Param, State, row_law
from tussle.numeric import sincos
from tussle.plugins.stock.motion.simple_quadrotor import kernels


class SimpleQuadrotor(MotionModel):
    """A hovering quadrotor with perfect attitude control: accelerations along its heading, to its left and up, and a turn.

    x'' = R(yaw) (x_thrust, y_thrust), z'' = z_thrust, yaw'' = turn_force, |v| <= max_vel: the outer loops of Mellinger, Michael, Kumar
    2012, "Trajectory generation and control for precise aggressive maneuvers with quadrotors", section 3.2. Gravity is compensated.
    The attitude is tilted in proportion to the velocity, nose down forwards, at most max_pitch. External forces are ignored.

    In SCRIMMAGE the velocity turns with the nose, and y_thrust and the velocity to the left have no effect; the speed counts
    up to 15 m/s forwards and 10 m/s upwards only.
    """

    grade = "portable"

    max_vel = Param(20.0, unit="m/s", gt=0.0, doc="Largest speed.")
    max_pitch = Param(
        math.radians(30.0), unit="rad", text_unit="deg", ge=0.0, lt=math.pi / 2, doc="Tilt at max_vel."
    )
    x = State(
        "x y z vx vy vz yaw yaw_rate",
        unit="m m m m/s m/s m/s rad rad/s",
        doc="Position, velocity, heading and its rate, world frame.",
    )
    thrust = Input(
        "x_thrust y_thrust z_thrust", unit="m/s^2", doc="Acceleration forwards, to the left and up."
    )
    turn_force = Input(
        unit="rad/s^2", doc="Angular acceleration about the vertical, counter-clockwise positive."
    )

    flown = row_law("x", "pos", "vel", "yaw", "omega_z")(kernels.flown)

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position, velocity, heading and yaw rate."""
        parts = body.pos, body.vel, body.yaw[None], body.omega[2:]
        self.x[:, rows] = np.concatenate([part[:, rows] for part in parts])

    def to_body(self, body: MotionBody) -> None:
        """Write position, velocity, attitude and yaw rate."""
        x, (sine, cosine) = self.x, sincos(self.x[6])
        body.pos[:], body.vel[:], body.omega[2] = x[:3], x[3:6], x[7]
        tilt = self.max_pitch / self.max_vel
        climb, roll = -tilt * (x[3] * cosine + x[4] * sine), -tilt * (x[4] * cosine - x[3] * sine)
        body.set_attitude(roll, climb, x[6])
