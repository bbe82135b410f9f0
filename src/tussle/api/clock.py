"""The clocks of a stack of worlds."""

from __future__ import annotations

import numpy as np


class Clock:
    """Time of each world, computed from its step and never accumulated.

    Attributes:
        start: Time of step 0 [s].
        dt: Length of a step [s].
        step: Number of the step each world is in, (n_worlds,), int64.
        common: The step that all running worlds share, -1 when they differ.
    """

    def __init__(self, n_worlds: int, start: float, dt: float) -> None:
        self.start = start
        self.dt = dt
        self.step = np.zeros(n_worlds, np.int64)
        self.common = 0

    def at(self, phase: float) -> np.ndarray:
        """Time of each world after a part of its step [s], (n_worlds,); phase 1 is exactly the beginning of the next."""
        return self.start + (self.step + phase) * self.dt

    @property
    def t(self) -> np.ndarray:
        """Time of each world [s], (n_worlds,)."""
        return self.start + self.step * self.dt
