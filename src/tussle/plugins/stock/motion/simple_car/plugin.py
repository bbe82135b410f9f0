"""A car: the kinematic bicycle."""

from __future__ import annotations

import numpy as np

from tussle.api import (
    HistoricAttributes,
    Input,
    MassProperties,
    MotionBody,
    MotionModel,
    Param,
    State,
    row_law,
)
from tussle.numeric import sincos
from tussle.plugins.stock.motion.simple_car import kernels


class SimpleCar(MotionModel):
    """A car that follows a speed and a steering angle: the kinematic bicycle, steered in front, seen at its rear axle.

    x' = v cos(yaw), y' = v sin(yaw), yaw' = v tan(steering) / length (Siciliano et al. 2009, Robotics, equation 11.16), with
    v = speed within [0, max_velocity] and a steering angle of at most 45 degrees. Arcs are exact. With `enable_gravity` the car falls
    until a force bears its weight, such as that of `GroundCollision`. Other forces are ignored.

    SCRIMMAGE calls the steering angle `turn_rate`, falls with 9.8 m/s^2 times the mass, sets the initial velocity to 0 and
    stops the car along each axis with a force. Its parameter `mass` is that of the block here.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(unread=("mass",))

    length = Param(2.62, unit="m", gt=0.0, doc="Distance between the axles.")
    max_velocity = Param(20.0, unit="m/s", ge=0.0, doc="Largest speed.")
    enable_gravity = Param(False, structural=True, doc="Fall; else the height is constant.")
    x = State(
        "x y z z_rate yaw v yaw_rate",
        unit="m m m m/s rad m/s rad/s",
        doc="Position of the rear axle, climb speed, heading, speed, yaw rate.",
    )
    speed = Input(unit="m/s", doc="Speed of the rear axle.")
    steering = Input(unit="rad", doc="Angle of the front wheels, left positive.")

    driven = row_law("x", "pos", "vel", "yaw")(kernels.driven)

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position, climb speed, heading, speed and yaw rate."""
        sine, cosine = sincos(body.yaw)
        forward = body.vel[0] * cosine + body.vel[1] * sine
        climb = body.vel[2] if self.enable_gravity else np.zeros(body.n)
        self.x[:, rows] = np.array([*body.pos, climb, body.yaw, forward, body.omega[2]])[:, rows]

    def to_body(self, body: MotionBody) -> None:
        """Write position, velocity, attitude and yaw rate."""
        x, (sine, cosine) = self.x, sincos(self.x[4])
        body.pos[:], body.omega[2] = x[:3], x[6]
        body.vel[0], body.vel[1], body.vel[2] = x[5] * cosine, x[5] * sine, x[3]
        body.set_attitude(yaw=x[4])

    def mass_properties(self, body: MotionBody) -> MassProperties:
        """Mass and, with `enable_gravity`, weight."""
        found = super().mass_properties(body)
        return found if self.enable_gravity else found._replace(weight=np.zeros(body.n))
