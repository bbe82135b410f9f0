"""Simulated time of a stack of worlds."""

from __future__ import annotations

import numpy as np


class Clock:
    """Time of each world, computed from its step number: rounding errors do not accumulate.

    Attributes:
        start: Time at the beginning of step 0 [s].
        dt: Length of a step [s].
        step: Current step number of each world, (n_worlds,), int64.
        common: Step number of all running worlds; -1 if they differ.
    """

    def __init__(self, n_worlds: int, start: float, dt: float) -> None:
        self.start = start
        self.dt = dt
        self.step = np.zeros(n_worlds, np.int64)
        self.common = 0

    def at(self, phase: float) -> np.ndarray:
        """Time of each world at a fraction `phase` of its step [s], (n_worlds,); phase 1 is exactly the start of the next step."""
        return self.start + (self.step + phase) * self.dt

    @property
    def t(self) -> np.ndarray:
        """Time of each world [s], (n_worlds,)."""
        return self.start + self.step * self.dt
