"""HarmonicOscillator as in SCRIMMAGE."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.api import MotionBody
from tussle.plugins.historic.integration import advance_by, rk4_step
from tussle.plugins.stock.motion import harmonic_oscillator


class HarmonicOscillator(harmonic_oscillator.HarmonicOscillator):
    """HarmonicOscillator that takes one step of RK4, however stiff it is, so that it diverges at long steps."""

    @property
    def advance(self) -> Callable[..., None]:  # type: ignore[override]
        """RK4."""
        return advance_by(self, _step)

    def to_body(self, body: MotionBody) -> None:
        """Write height and climb speed; the horizontal velocity is not changed."""
        body.pos[2], body.vel[2] = self.x


def _step(x: np.ndarray, u: dict[str, np.ndarray], p: dict[str, Any], h: float) -> None:
    frequency, push = p["natural_frequency"], u["acceleration_z"]

    def f(s: np.ndarray) -> np.ndarray:
        z, vz = s
        return np.array([vz, push - frequency * frequency * z - 2.0 * p["damping_ratio"] * frequency * vz])

    x[:] = rk4_step(f, x, h)
