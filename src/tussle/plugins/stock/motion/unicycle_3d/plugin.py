"""A unicycle that rotates about all three body axes."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import Input, MotionBody, MotionModel, Param, State
from tussle.plugins.stock.motion.unicycle_3d import kernels


class Unicycle3D(MotionModel):
    """A vehicle that moves where its nose points and follows commanded rates about its body axes without delay.

    pos' = v forward(q), q' = q (0, roll_rate, -pitch_rate, turn_rate) / 2, every command clamped to its limit. With level wings
    turn_rate is the rate of the heading and pitch_rate that of the elevation; in a bank they are not, as in an aircraft. With
    `accel_max` >= 0 the speed is a state and `acceleration_x` is commanded; else `speed` is commanded.

    Differences from SCRIMMAGE: the rates are about the body axes (there, about axes that rotate with the vehicle but
    coincide with the world axes at the start, wrong for a vehicle that starts banked or climbing); a positive pitch_rate raises the
    nose; `accel_max` limits the acceleration in both directions (there, the lower limit was read from the key of the upper one, so
    every command gave the same acceleration), and the speed stays within speed_max. Limits are symmetric; there is no `speed_min`
    etc. External forces are ignored, because the model has no inertia (there, a force gave a velocity of force over mass). `omega` is
    written.
    """

    grade = "portable"
    only_calls_kernels = True

    speed_max = Param(1.0, unit="m/s", ge=0.0, doc="Limit of the speed, forwards and backwards.")
    turn_rate_max = Param(1.0, unit="rad/s", ge=0.0, doc="Limit of turn_rate.")
    pitch_rate_max = Param(1.0, unit="rad/s", ge=0.0, doc="Limit of pitch_rate.")
    roll_rate_max = Param(1.0, unit="rad/s", ge=0.0, doc="Limit of roll_rate.")
    accel_max = Param(
        -1.0,
        unit="m/s^2",
        structural=True,
        doc="Limit of the acceleration; if negative, the speed is commanded.",
    )
    x = State(
        "x y z qw qx qy qz v",
        unit="m m m 1 1 1 1 m/s",
        doc="Position, quaternion body to world, speed along the body x axis.",
    )
    speed = Input(unit="m/s", doc="Speed along the body x axis.")
    acceleration_x = Input(unit="m/s^2", doc="Rate of the speed, with accel_max >= 0.")
    turn_rate = Input(unit="rad/s", doc="Rate about the body z axis, left positive.")
    pitch_rate = Input(unit="rad/s", doc="Rate about the body y axis, nose up positive.")
    roll_rate = Input(unit="rad/s", doc="Rate about the body x axis, right wing down positive.")

    def active_inputs(self) -> list[str]:
        """Return speed or acceleration_x, and the three rates."""
        first = "speed" if self.accel_max < 0.0 else "acceleration_x"
        return [first, "turn_rate", "pitch_rate", "roll_rate"]

    @property
    def advance(self) -> Any:
        """Kernel for this value of accel_max."""
        limit = float(self.accel_max)
        if limit < 0.0:
            return kernels.advance_speed

        def advance(x: Any, u: Any, p: Any, dt: float, substeps: int) -> None:
            kernels.advance_acceleration(x, u, p, limit, dt, substeps)

        return advance

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position, attitude and speed."""
        self.x[:3, rows] = body.pos[:, rows]
        quat = body.quat[:, rows]
        w, x, y, z = quat
        self.x[3:7, rows] = quat / np.sqrt(w * w + x * x + y * y + z * z)
        self.x[7, rows] = body.forward_speed[rows]

    def to_body(self, body: MotionBody) -> None:
        """Write position, attitude, velocity and angular velocity."""
        kernels.to_body(
            self.x, (self.turn_rate, self.pitch_rate, self.roll_rate),
            (self.turn_rate_max, self.pitch_rate_max, self.roll_rate_max), body.table, body.first,
        )  # fmt: skip
