"""SCRIMMAGE's ranges of angles. Its sums of full turns round, so errors between -4.4e-16 and 0 rad become 0."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tussle.numeric.kernel import device

TURN = 2.0 * math.pi


@device
def angle_2pi(angle: Any) -> Any:
    """Return an angle [rad] in [0, 2 pi]; 2 pi itself for a negative angle that is too small to be added to it."""
    angle = angle - TURN * math.floor(angle / TURN) if angle >= TURN else angle
    return angle + TURN * math.ceil(-angle / TURN) if angle < 0.0 else angle


@device
def angle_pi(angle: Any) -> Any:
    """Return an angle [rad] in (-pi, pi], by way of its value in [0, 2 pi]."""
    angle = angle_2pi(angle)
    return angle - TURN if angle > math.pi else angle


def headings(directions: np.ndarray) -> np.ndarray:
    """Return angles (n,) of [-pi, pi] [rad] in [0, 2 pi]."""
    return np.where(directions < 0.0, directions + TURN, directions)
