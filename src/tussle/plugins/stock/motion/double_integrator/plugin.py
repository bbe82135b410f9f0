"""A point mass that follows an acceleration command."""

from __future__ import annotations

import math

import numpy as np

from tussle.api import Input, MotionBody, MotionModel, Param, State, row_law
from tussle.numeric import sincos
from tussle.plugins.stock.motion.double_integrator import kernels


class DoubleIntegrator(MotionModel):
    """A point mass that follows an acceleration command: x' = v, v' = a with |a| <= max_acc and |v| <= max_vel.

    The yaw rate goes to `turn_rate`, clamped to max_yaw_vel, with an angular acceleration of at most max_yaw_acc. Constant
    commands are integrated exactly (Rao and Bernstein 2001, "Naive control of the double integrator", equation 1); a command that
    would end a substep above max_vel is lowered so that the substep ends at it.

    The attitude follows the direction of motion (`motion_model_sets_yaw`), or the yaw rate; in the second case
    `sim_copter_orientation` adds the tilt of a multirotor, proportional to the velocity. External forces are ignored.

    SCRIMMAGE advanced the position with the old velocity (no a dt^2 / 2), limited each component of the velocity, and
    wrote the yaw rate as the yaw angle; max_yaw_acc limited the yaw rate.
    """

    grade = "portable"

    max_vel = Param(1.0, unit="m/s", ge=0.0, doc="Largest speed.")
    max_acc = Param(1.0, unit="m/s^2", ge=0.0, doc="Largest acceleration.")
    motion_model_sets_yaw = Param(
        True, structural=True, doc="Face the direction of motion instead of following turn_rate."
    )
    sim_copter_orientation = Param(
        False, structural=True, doc="Tilt with the velocity, if the yaw follows turn_rate."
    )
    sim_copter_max_roll = Param(math.radians(30.0), unit="rad", text_unit="deg", doc="Bank at max_vel.")
    sim_copter_max_pitch = Param(
        math.radians(30.0), unit="rad", text_unit="deg", doc="Nose-down angle at max_vel."
    )
    max_yaw_vel = Param(1.0, unit="rad/s", ge=0.0, doc="Largest yaw rate.")
    max_yaw_acc = Param(1.0, unit="rad/s^2", ge=0.0, doc="Largest angular acceleration about the vertical.")
    x = State(
        "x y z vx vy vz yaw yaw_rate",
        unit="m m m m/s m/s m/s rad rad/s",
        doc="Position, velocity, heading and its rate, world frame.",
    )
    acceleration = Input(
        "acceleration_x acceleration_y acceleration_z", unit="m/s^2", doc="Acceleration, world frame."
    )
    turn_rate = Input(unit="rad/s", optional=True, doc="Yaw rate, counter-clockwise positive.")

    flown = row_law("x", "pos", "vel", "yaw")(kernels.flown)

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position, velocity, heading and yaw rate."""
        parts = body.pos, body.vel, body.yaw[None], body.omega[2:]
        self.x[:, rows] = np.concatenate([part[:, rows] for part in parts])

    def to_body(self, body: MotionBody) -> None:
        """Write position, velocity, attitude and yaw rate."""
        x = self.x
        body.pos[:], body.vel[:] = x[:3], x[3:6]
        roll = climb = np.zeros(1)
        if not self.motion_model_sets_yaw:
            body.omega[2] = x[7]
            if self.sim_copter_orientation:
                sine, cosine = sincos(x[6])
                fastest = np.where(self.max_vel > 0.0, self.max_vel, 1.0)
                climb = -self.sim_copter_max_pitch * (x[3] * cosine + x[4] * sine) / fastest
                roll = -self.sim_copter_max_roll * (x[4] * cosine - x[3] * sine) / fastest
        body.set_attitude(roll, climb, x[6])
