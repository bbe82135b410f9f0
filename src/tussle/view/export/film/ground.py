"""Colours behind the entities, and a ground grid that suits what is seen of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tussle.view.export.film.cameras import View

Rgb = tuple[float, float, float]


@dataclass(frozen=True)
class Tints:
    """Colours of the background: red, green, blue, 0 to 255.

    Attributes:
        sky: Above the horizon.
        haze: At the horizon.
        ground: Near the target.
        line: Grid lines.
        shadow: Shadows of entities.
        ink: Text.
    """

    sky: Rgb = (204.0, 223.0, 241.0)
    haze: Rgb = (236.0, 242.0, 248.0)
    ground: Rgb = (222.0, 229.0, 217.0)
    line: Rgb = (120.0, 132.0, 122.0)
    shadow: Rgb = (190.0, 199.0, 187.0)
    ink: Rgb = (84.0, 92.0, 100.0)

    @classmethod
    def on(cls, background: Rgb | None) -> Tints:
        """Colours that suit a background colour; the defaults without one."""
        if background is None:
            return cls()
        light = 0.299 * background[0] + 0.587 * background[1] + 0.114 * background[2]
        contrast = -1.0 if light > 110.0 else 1.0

        def shade(share: float) -> Rgb:
            r, g, b = (min(max(c + contrast * share, 0.0), 255.0) for c in background)
            return r, g, b

        return cls(background, background, shade(8.0), shade(90.0), shade(34.0), shade(130.0))


N_PIECES = 20
"""Pieces of a grid line, which fades toward its ends."""


def ground_width(view: View, ground: float, aspect: float) -> float:
    """Approximate width of the ground in the picture [m]; `ground` is its height [m]."""
    half = view.half_height
    if not view.is_parallel:
        half = max(half, 0.5 * abs(float(view.eye[2]) - ground))
    return 2.0 * half * aspect


def grid_steps(width: float) -> tuple[float, float, float]:
    """Spacing of fine and of coarse grid lines [m], and the weight of the fine ones, for this width in the picture [m]."""
    level = math.log10(max(width, 1e-6) / 6.0)
    fine = 10.0 ** math.floor(level)
    return fine, 10.0 * fine, 1.0 - (level - math.floor(level))


def grid_lines(view: View, ground: float, width: float, colour: Rgb) -> tuple[np.ndarray, np.ndarray]:
    """The grid around the middle of a picture.

    Args:
        view: Pose of the camera.
        ground: Height of the grid [m].
        width: Width of the ground in the picture [m].
        colour: Red, green, blue.

    Returns:
        Ends of line pieces [m], (2 k, 3), and red, green, blue and opacity of each, (2 k, 4), 0 to 255.
    """
    fine, coarse, weight = grid_steps(width)
    middle = view.target[:2]
    far = 0.75 * width if view.is_parallel else None
    layers = [
        _lattice(middle, ground, fine, far or 1.3 * width, 0.55 * weight),
        _lattice(middle, ground, coarse, far or 4.5 * width, 0.75),
    ]
    ends = np.concatenate([layer[0] for layer in layers])
    alpha = np.concatenate([layer[1] for layer in layers])
    return ends, np.column_stack([np.tile(colour, (len(ends), 1)), 255.0 * alpha])


def _lattice(
    middle: np.ndarray, ground: float, step: float, reach: float, weight: float
) -> tuple[np.ndarray, np.ndarray]:
    """Lines along both axes within a circle, fading outward: ends (2 k, 3) and opacities (2 k,)."""
    ends, alpha = [], []
    for axis in (0, 1):
        first = math.ceil((middle[axis] - reach) / step)
        at = step * np.arange(first, math.floor((middle[axis] + reach) / step) + 1)
        half = np.sqrt(np.maximum(reach**2 - (at - middle[axis]) ** 2, 0.0))
        along = middle[1 - axis] + half[:, None] * np.linspace(-1.0, 1.0, N_PIECES + 1)
        points = np.empty((len(at), N_PIECES + 1, 3))
        points[..., axis], points[..., 1 - axis], points[..., 2] = at[:, None], along, ground
        away = np.linalg.norm(points[..., :2] - middle, axis=-1) / reach
        opacity = weight * np.clip(1.0 - away**2, 0.0, 1.0)
        ends.append(np.stack([points[:, :-1], points[:, 1:]], 2).reshape(-1, 3))
        alpha.append(np.stack([opacity[:, :-1], opacity[:, 1:]], 2).reshape(-1))
    return np.concatenate(ends), np.concatenate(alpha)
