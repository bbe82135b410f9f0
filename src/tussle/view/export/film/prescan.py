"""Sampling a film before its first picture, so that the camera moves smoothly."""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from tussle.errors import MissingExtraError
from tussle.view.export.film.moments import Moments
from tussle.view.frame import Frame

MAX_SAMPLES = 2000
"""Pictures whose states are sampled; values in between are interpolated."""
SMOOTHING = 0.9
"""Standard deviation of the Gaussian that smooths camera motion [s of film]."""
OUTLIERS = 0.02
"""Share of a large team that may lie outside the picture, on each side."""


def prescan(
    moments: Moments, measure: Callable[[Frame], np.ndarray], n_values: int, n_samples: int = MAX_SAMPLES
) -> tuple[np.ndarray, np.ndarray]:
    """Sample a film: times [s], (m,), and values, (m, n_values).

    Args:
        moments: The pictures.
        measure: Returns the values of a frame; nan where it has none.
        n_values: Number of values.
        n_samples: Maximum number of samples.

    Returns:
        Missing values are interpolated; a column without any value is nan.
    """
    chosen = np.unique(np.linspace(0, len(moments) - 1, min(len(moments), n_samples)).round().astype(int))
    t = moments.t[chosen]
    values = np.full((len(t), n_values), np.nan)
    for k, moment in enumerate(t):
        frame = moments.at(float(moment))
        if len(frame):
            values[k] = measure(frame)
    for column in values.T:
        known = np.isfinite(column)
        if known.any():
            column[:] = np.interp(t, t[known], column[known])
    return t, values


def box_of(frame: Frame) -> np.ndarray:
    """Lower and upper corner of a box around nearly all entities of each team [m], (6,)."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for team in np.unique(frame.team):
        pos = np.sort(frame.pos[frame.team == team], axis=0)
        k = int(OUTLIERS * len(pos))
        low, high = np.minimum(low, pos[k]), np.maximum(high, pos[-1 - k])
    return np.concatenate([low, high])


def crowd_of(frame: Frame) -> np.ndarray:
    """Median distance to the nearest neighbour [m], nan without neighbours, and number of entities, (2,)."""
    if len(frame) < 2:
        return np.array([np.nan, len(frame)])
    distance, _ = _scipy("spatial").cKDTree(frame.pos).query(frame.pos, k=2)
    return np.array([np.median(distance[:, 1]), len(frame)])


def pose_of(frame: Frame, entity: int) -> np.ndarray:
    """Position [m], horizontal direction of the nose, and distance to the eighth neighbour [m], of one entity, (6,)."""
    row = frame.row_of(entity)
    if row < 0:
        return np.full(6, np.nan)
    w, x, y, z = frame.quat[row]
    distance = np.sort(np.linalg.norm(frame.pos - frame.pos[row], axis=1))
    near = distance[min(8, len(distance) - 1)] if len(distance) > 1 else np.nan
    return np.array([*frame.pos[row], 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), near])


def smoothing_width(moments: Moments, t: np.ndarray) -> float:
    """Standard deviation of the smoothing, in samples."""
    if len(t) < 2:
        return 0.0
    return SMOOTHING * moments.speed / float(t[-1] - t[0]) * (len(t) - 1)


def smoothed(values: np.ndarray, width: float) -> np.ndarray:
    """Columns, (m, k), smoothed by a Gaussian of this standard deviation [samples]."""
    if width < 1e-3:
        return values
    radius = min(math.ceil(3.0 * width), 10 * len(values))
    result: np.ndarray = _scipy("ndimage").gaussian_filter1d(
        values, width, axis=0, mode="nearest", radius=radius
    )
    return result


def local_maximum(values: np.ndarray, width: float) -> np.ndarray:
    """Largest of the values, (m,), within 1.2 widths [samples] of each."""
    size = 2 * min(math.ceil(1.2 * width), len(values)) + 1
    result: np.ndarray = _scipy("ndimage").maximum_filter1d(values, size, mode="nearest")
    return result


def _scipy(module: str) -> Any:
    """A module of SciPy.

    Raises:
        MissingExtraError: SciPy is not installed.
    """
    try:
        import_module("scipy")
        return import_module(f"scipy.{module}")
    except ImportError:
        raise MissingExtraError(
            "films and MCAP files need scipy, which is not installed: pip install 'tussle[view]'"
        ) from None
