"""A sensor of velocities, rates and accelerations in the body frame."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView, Output, Param, Sensor, State
from tussle.numeric.quaternion import quat_rotate_inverse

PAIR = "mean sd"


def axes(name: str) -> str:
    """Names of three channels."""
    return " ".join(f"{name}_{axis}" for axis in "xyz")


class RigidBody6DOFStateSensor(Sensor):
    """Measures the position with normal noise, and without noise velocity, angular velocity and accelerations in the body frame.

    Accelerations are the change of the velocities since the last call over its time; gravity is not added. It measures any entity.

    Differences from SCRIMMAGE: the noise is applied (there, the parameters were read and not used); the values are channels
    (there, a message on LocalNetwork), without the wind.
    """

    grade = "portable"

    pos_noise_0 = Param((0.0, 5.0), fields=PAIR, unit="m", doc="Error of x: mean and standard deviation.")
    pos_noise_1 = Param((0.0, 5.0), fields=PAIR, unit="m", doc="Error of y.")
    pos_noise_2 = Param((0.0, 1.0), fields=PAIR, unit="m", doc="Error of z.")
    measured_pos = Output(axes("measured_pos"), unit="m", doc="Position, world frame.")
    body_velocity = Output(axes("body_velocity"), unit="m/s", doc="Velocity.")
    body_rate = Output(axes("body_rate"), unit="rad/s", doc="Angular velocity.")
    body_acceleration = Output(axes("body_acceleration"), unit="m/s^2", doc="Rate of the velocity.")
    body_rate_change = Output(axes("body_rate_change"), unit="rad/s^2", doc="Rate of the angular velocity.")
    last_vel = State("x y z", unit="m/s", doc="Velocity at the last call, world frame.")
    last_omega = State("x y z", unit="rad/s", doc="Angular velocity at the last call, world frame.")

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Start from the velocities at birth."""
        self.last_vel[:, rows], self.last_omega[:, rows] = g.vel[:, rows], g.omega[:, rows]

    def step(self, g: GroupView) -> None:
        """Measure all rows."""
        noise = np.array([self.pos_noise_0, self.pos_noise_1, self.pos_noise_2])
        self.measured_pos[:] = g.pos + noise[:, 0] + noise[:, 1] * g.normal("pos", 3)
        for measured, change, now, last in (
            (self.body_velocity, self.body_acceleration, g.vel, self.last_vel),
            (self.body_rate, self.body_rate_change, g.omega, self.last_omega),
        ):
            measured[:] = quat_rotate_inverse(g.quat, now)
            change[:] = quat_rotate_inverse(g.quat, (now - last) / g.dt)
            last[:] = now
