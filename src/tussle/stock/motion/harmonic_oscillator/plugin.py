"""A damped spring along the vertical."""

from __future__ import annotations

import numpy as np

from tussle.api import Input, MotionBody, MotionModel, Param, State
from tussle.stock.motion.harmonic_oscillator import kernels


class HarmonicOscillator(MotionModel):
    """A mass on a damped spring between it and the ground plane: z'' = -w^2 z - 2 d w z' + acceleration_z.

    w is `natural_frequency`, d `damping_ratio`. It moves along the vertical only; position and attitude stay as they were placed
    otherwise. Its solution is known in closed form, which makes it the test of integrators and of wiring. However stiff it is, no
    step is too long for it.
    """

    grade = "portable"

    damping_ratio = Param(0.707, ge=0.0, doc="d: 1 is critical damping.")
    natural_frequency = Param(1.0, unit="rad/s", ge=0.0, doc="w: angular frequency without damping.")
    x = State("z z_rate", unit="m m/s", doc="Height above the origin's tangent plane and its rate.")
    acceleration_z = Input(unit="m/s^2", doc="Push upwards, per mass.")

    advance = kernels.advance

    @staticmethod
    def derivative(
        z: float, z_rate: float, acceleration_z: float, damping_ratio: float, natural_frequency: float
    ) -> tuple[float, float]:
        """State equation: (z' [m/s], z'' [m/s^2])."""
        spring = -(natural_frequency * natural_frequency) * z
        damping = -2.0 * damping_ratio * natural_frequency * z_rate
        return z_rate, spring + damping + acceleration_z

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Take height and vertical velocity over."""
        self.x[0, rows] = body.pos[2, rows]
        self.x[1, rows] = body.vel[2, rows]

    def to_body(self, body: MotionBody) -> None:
        """Publish height and velocity."""
        body.pos[2] = self.x[0]
        body.vel[:2] = 0.0
        body.vel[2] = self.x[1]
