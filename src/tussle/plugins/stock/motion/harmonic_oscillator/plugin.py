"""A mass on a damped vertical spring."""

from __future__ import annotations

import numpy as np

from tussle.api import Input, MotionBody, MotionModel, Param, State
from tussle.plugins.stock.motion.harmonic_oscillator import kernels


class HarmonicOscillator(MotionModel):
    """A mass on a damped vertical spring: z'' = -w^2 z - 2 d w z' + acceleration_z.

    w is `natural_frequency`, d is `damping_ratio`. The horizontal position and the attitude do not change. The closed-form solution
    makes it a test of integrators and wiring. It is stable for any stiffness and time step.
    """

    grade = "portable"

    damping_ratio = Param(0.707, ge=0.0, doc="d: damping ratio; 1 is critical damping.")
    natural_frequency = Param(1.0, unit="rad/s", ge=0.0, doc="w: angular frequency without damping.")
    x = State("z z_rate", unit="m m/s", doc="Height above the origin's tangent plane and its rate.")
    acceleration_z = Input(unit="m/s^2", doc="Vertical acceleration, up positive.")

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
        """Copy height and vertical velocity."""
        self.x[0, rows] = body.pos[2, rows]
        self.x[1, rows] = body.vel[2, rows]

    def to_body(self, body: MotionBody) -> None:
        """Write height and velocity."""
        body.pos[2] = self.x[0]
        body.vel[:2] = 0.0
        body.vel[2] = self.x[1]
