"""The integrator of SCRIMMAGE's motion models, over whole columns."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.api import MotionModel

Derivative = Callable[[np.ndarray], np.ndarray]
Step = Callable[[np.ndarray, dict[str, np.ndarray], dict[str, Any], float], None]


def rk4_step(f: Derivative, x: np.ndarray, h: float) -> np.ndarray:
    """One classical Runge-Kutta step of all columns, (m, n), with the sums in SCRIMMAGE's order."""
    k1 = f(x)
    k2 = f(x + 0.5 * h * k1)
    k3 = f(x + 0.5 * h * k2)
    k4 = f(x + h * k3)
    return x + h / 6.0 * k1 + h / 3.0 * k2 + h / 3.0 * k3 + h / 6.0 * k4


def advance_by(model: MotionModel, step: Step) -> Callable[..., None]:
    """Return the function `advance` of a motion model that advances all its rows by steps.

    Args:
        model: The model.
        step: Changes the state, (m, n), in place: called with state, inputs by name, parameters by name, and the duration [s].
    """
    names = [*model.input_channels(), *model.body_inputs()]

    def advance(x: np.ndarray, u: np.ndarray, p: np.ndarray, dt: float, substeps: int) -> None:
        given, params = dict(zip(names, u, strict=True)), columns_of(model, p)
        with np.errstate(all="ignore"):  # a state that is not finite ends its world
            for _ in range(substeps):
                step(x, given, params, dt / substeps)

    return advance


def columns_of(model: MotionModel, p: np.ndarray) -> dict[str, Any]:
    """Return row parameters of a motion model by name: (n,), or with fields (k, n).

    Args:
        model: The model.
        p: Its parameters as `advance` gets them, (q, n).
    """
    found, first = {}, 0
    for name, column in type(model).row_params().items():
        k = len(column.fields)
        found[name] = p[first : first + k] if k else p[first]
        first += k or 1
    return found


def quat_rates(quat: np.ndarray, rates: Any) -> np.ndarray:
    """Derivative of quaternions, (4, n), at rates about their own axes [rad/s], (3, n), with a pull towards length 1."""
    w, x, y, z = quat
    p, q, r = rates
    pull = 1.0 - (w * w + x * x + y * y + z * z)
    return np.array(
        [
            -0.5 * (x * p + y * q + z * r) + pull * w,
            0.5 * (w * p + y * r - z * q) + pull * x,
            0.5 * (w * q + z * p - x * r) + pull * y,
            0.5 * (w * r + x * q - y * p) + pull * z,
        ]
    )


def normalized(quat: np.ndarray) -> np.ndarray:
    """Quaternions, (4, n), scaled to length 1."""
    w, x, y, z = quat
    return np.asarray(quat / np.sqrt(w * w + x * x + y * y + z * z))


def rotated(quat: np.ndarray, vector: Any) -> np.ndarray:
    """Vectors, (3, n), turned by quaternions of any length, (4, n): v + 2 (w u x v + u x (u x v))."""
    w, x, y, z = normalized(quat)
    a, b, c = vector
    p, q, r = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return np.array([a + w * p + (y * r - z * q), b + w * q + (z * p - x * r), c + w * r + (x * q - y * p)])


def unrotated(quat: np.ndarray, vector: Any) -> np.ndarray:
    """Vectors, (3, n), turned back by quaternions of any length, (4, n)."""
    w, x, y, z = quat
    return rotated(np.array([w, -x, -y, -z]), vector)


def multiplied(matrix: np.ndarray, vector: Any) -> np.ndarray:
    """Products of matrices, nine elements row by row, (9, n), and vectors, (3, n)."""
    x, y, z = vector
    return np.array([a * x + b * y + c * z for a, b, c in matrix.reshape(3, 3, -1)])


def solved(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Solutions s, (k, n), of m s = v for matrices, (k * k, n), and vectors, (k, n)."""
    k = len(vector)
    matrices = np.broadcast_to(matrix, (k * k, vector.shape[1])).T.reshape(-1, k, k)
    return np.linalg.solve(matrices, vector.T[..., None])[..., 0].T
