"""Straight ways that points take in a step."""

from __future__ import annotations

import numpy as np

from tussle.numeric.arrays import Floats
from tussle.numeric.functions import atan2


def closest_approach(offset: Floats, way: Floats, first: Floats | float = 0.0) -> tuple[Floats, Floats]:
    """When and how near a point comes to another one that moves straight from `offset` to `offset + way` [m], (3, n) each.

    Args:
        offset: Position of the other point at the begin, relative to the first one.
        way: Change of `offset`.
        first: The part of the way that counts begins here, 0 to 1, one number or (n,).

    Returns:
        The part of the way at which they are nearest, `first` to 1, and their distance there [m], (n,) each. Of one that does not
        move, it is `first`.
    """
    x, y, z = offset
    u, v, w = way
    square = u * u + v * v + w * w
    along = -(x * u + y * v + z * w)
    part = np.minimum(np.maximum(along / np.where(square > 0.0, square, 1.0), first), 1.0)
    x, y, z = x + part * u, y + part * v, z + part * w
    return part, np.sqrt(x * x + y * y + z * z)


def is_passed(offset: Floats, way: Floats) -> np.ndarray:
    """Whether a point that moves straight from `offset` to `offset + way` [m], (3, n) each, comes nearer to 0 and then no more, (n,)."""
    x, y, z = offset
    u, v, w = way
    along = -(x * u + y * v + z * w)
    return np.asarray((along > 0.0) & (along <= u * u + v * v + w * w))


def turn(begin: Floats, end: Floats) -> Floats:
    """Angle from directions `begin` to `end`, (2, n) or more each, counter-clockwise from above [rad], (n,)."""
    angle: Floats = atan2(begin[0] * end[1] - begin[1] * end[0], begin[0] * end[0] + begin[1] * end[1])
    return angle


__all__ = ["closest_approach", "is_passed", "turn"]
