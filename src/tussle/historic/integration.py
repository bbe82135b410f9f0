"""The integrator of SCRIMMAGE's motion models, over whole columns."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Derivative = Callable[[np.ndarray], np.ndarray]


def rk4_step(f: Derivative, x: np.ndarray, h: float) -> np.ndarray:
    """One classical Runge-Kutta step of all columns, (m, n), with the sums in SCRIMMAGE's order."""
    k1 = f(x)
    k2 = f(x + 0.5 * h * k1)
    k3 = f(x + 0.5 * h * k2)
    k4 = f(x + h * k3)
    return x + h / 6.0 * k1 + h / 3.0 * k2 + h / 3.0 * k3 + h / 6.0 * k4
