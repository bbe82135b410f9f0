"""A vehicle that turns about all three axes of its body."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import Input, MotionBody, MotionModel, Param, State
from tussle.stock.motion.unicycle_3d import kernels


class Unicycle3D(MotionModel):
    """A vehicle that flies where its nose points and is turned by rates about the axes of its own body, all followed at once.

    pos' = v forward(q), q' = q (0, roll_rate, -pitch_rate, turn_rate) / 2, every command held within its limit. With the wings level
    turn_rate is that of the heading and pitch_rate that of the elevation; banked, they are not, as in an aircraft. With `accel_max`
    >= 0 the speed is a state and the command its rate, `acceleration_x`; else `speed` is the command.

    Other than in the existing system: the rates are about the body's own axes (there, about axes that move with the vehicle but were
    the world's at the start, so that one that started banked or climbing turned about axes of nothing); positive pitch_rate raises
    the nose; `accel_max` limits the acceleration both ways (there, the lower limit was read from the upper one's key, so every command
    gave the same acceleration), and the accelerated speed stays within speed_max. A limit is the same both ways; there is no
    `speed_min` and the like. External forces, which there gave a velocity of force over mass, mean nothing to a model without inertia
    and are ignored. `omega` is filled.
    """

    grade = "portable"

    speed_max = Param(1.0, unit="m/s", ge=0.0, doc="Limit of the speed, forwards and backwards.")
    turn_rate_max = Param(1.0, unit="rad/s", ge=0.0, doc="Limit of turn_rate.")
    pitch_rate_max = Param(1.0, unit="rad/s", ge=0.0, doc="Limit of pitch_rate.")
    roll_rate_max = Param(1.0, unit="rad/s", ge=0.0, doc="Limit of roll_rate.")
    accel_max = Param(
        -1.0,
        unit="m/s^2",
        structural=True,
        doc="Limit of the acceleration; negative, the speed is commanded.",
    )
    x = State(
        "x y z qw qx qy qz v",
        unit="m m m 1 1 1 1 m/s",
        doc="Position, quaternion body to world, speed along the body x axis.",
    )
    speed = Input(unit="m/s", doc="Speed along the body x axis.")
    acceleration_x = Input(unit="m/s^2", doc="Rate of that speed, with accel_max.")
    turn_rate = Input(unit="rad/s", doc="Rate about the body z axis, to the left positive.")
    pitch_rate = Input(unit="rad/s", doc="Rate about the body y axis, nose up positive.")
    roll_rate = Input(unit="rad/s", doc="Rate about the body x axis, right wing down positive.")

    def active_inputs(self) -> list[str]:
        """The first input is speed or acceleration_x."""
        first = "speed" if self.accel_max < 0.0 else "acceleration_x"
        return [first, "turn_rate", "pitch_rate", "roll_rate"]

    @property
    def advance(self) -> Any:
        """Kernel of the structural variant."""
        limit = float(self.accel_max)
        if limit < 0.0:
            return kernels.advance_speed

        def advance(x: Any, u: Any, p: Any, dt: float, substeps: int) -> None:
            kernels.advance_acceleration(x, u, p, limit, dt, substeps)

        return advance

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Take position, attitude and speed over."""
        self.x[:3, rows] = body.pos[:, rows]
        quat = body.quat[:, rows]
        w, x, y, z = quat
        self.x[3:7, rows] = quat / np.sqrt(w * w + x * x + y * y + z * z)
        self.x[7, rows] = body.forward_speed[rows]

    def to_body(self, body: MotionBody) -> None:
        """Publish position, attitude, velocity and turn rate."""
        kernels.to_body(
            self.x, (self.turn_rate, self.pitch_rate, self.roll_rate),
            (self.turn_rate_max, self.pitch_rate_max, self.roll_rate_max), body.table, body.first,
        )  # fmt: skip
