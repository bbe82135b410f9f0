"""What happens over a film, looked at before its first picture is made, so that the eye can move calmly."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from tussle.errors import MissingExtraError
from tussle.view.export.film.moments import Moments
from tussle.view.frame import Frame

MOST_LOOKS = 2000
"""Pictures whose states are looked at; between them things are taken to change evenly."""
CALM = 0.9
"""Time over which motion of the eye is evened out [s of film]."""
OUTSIDERS = 0.02
"""Share of a team that may be out of the picture on each side, when it has many."""


def survey(
    moments: Moments, look: Callable[[Frame], np.ndarray], n_values: int, most: int = MOST_LOOKS
) -> tuple[np.ndarray, np.ndarray]:
    """What is seen over the film: times [s], (m,), and values of each, (m, n_values).

    Args:
        moments: The pictures.
        look: Values of a moment; nan where it has none.
        n_values: How many they are.
        most: Moments looked at.

    Returns:
        Where a moment has no value, those around it are taken; a column without any is nan.
    """
    t = moments.t[np.unique(np.linspace(0, len(moments) - 1, min(len(moments), most)).round().astype(int))]
    values = np.full((len(t), n_values), np.nan)
    for k, moment in enumerate(t):
        frame = moments.at(float(moment))
        if len(frame):
            values[k] = look(frame)
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
        k = int(OUTSIDERS * len(pos))
        low, high = np.minimum(low, pos[k]), np.maximum(high, pos[-1 - k])
    return np.concatenate([low, high])


def crowd_of(frame: Frame) -> np.ndarray:
    """Median of the distances to the nearest other [m], nan where nobody has one, and how many there are, (2,)."""
    if len(frame) < 2:
        return np.array([np.nan, len(frame)])
    try:
        from scipy.spatial import cKDTree
    except ImportError:
        raise MissingExtraError(
            "films and MCAP files need scipy, which is not installed: pip install 'tussle[view]'"
        ) from None
    distance, _ = cKDTree(frame.pos).query(frame.pos, k=2)
    return np.array([np.median(distance[:, 1]), len(frame)])


def pose_of(frame: Frame, who: int) -> np.ndarray:
    """Position [m], direction of the nose in the plane, and distance within which some others are [m], of one entity, (6,)."""
    row = frame.row_of(who)
    if row < 0:
        return np.full(6, np.nan)
    w, x, y, z = frame.quat[row]
    distance = np.sort(np.linalg.norm(frame.pos - frame.pos[row], axis=1))
    near = distance[min(8, len(distance) - 1)] if len(distance) > 1 else np.nan
    return np.array([*frame.pos[row], 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), near])


def calm_width(moments: Moments, t: np.ndarray) -> float:
    """Standard deviation of the evening, in surveyed moments."""
    if len(t) < 2:
        return 0.0
    return CALM * moments.speed / float(t[-1] - t[0]) * (len(t) - 1)


def evened(values: np.ndarray, width: float) -> np.ndarray:
    """Columns, (m, k), averaged with a Gaussian of this standard deviation; the ends are taken to last."""
    reach = min(math.ceil(3.0 * width), 10 * len(values))
    if reach < 1:
        return values
    weight = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    padded = np.concatenate([np.repeat(values[:1], reach, 0), values, np.repeat(values[-1:], reach, 0)])
    return np.stack([np.convolve(c, weight / weight.sum(), "valid") for c in padded.T], axis=1)


def reached(values: np.ndarray, width: float) -> np.ndarray:
    """The largest in the neighbourhood of each value, (m,)."""
    reach = min(math.ceil(1.2 * width), len(values))
    padded = np.pad(values, reach, mode="edge")
    largest: np.ndarray = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).max(axis=1)
    return largest
