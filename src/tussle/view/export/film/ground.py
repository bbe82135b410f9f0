"""What lies under a game: sky, ground and a grid that fits whatever is seen of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tussle.view.export.film.view import ANGLE, View

Rgb = tuple[float, float, float]


@dataclass(frozen=True)
class Tints:
    """Colours of what lies behind everything: red, green, blue, 0 to 255.

    Attributes:
        sky: Straight up.
        haze: At the horizon.
        ground: Nearby.
        line: Of the grid.
        shadow: Of the ground under somebody.
        ink: Of words on the ground.
    """

    sky: Rgb = (143.0, 186.0, 226.0)
    haze: Rgb = (236.0, 242.0, 248.0)
    ground: Rgb = (222.0, 229.0, 217.0)
    line: Rgb = (120.0, 132.0, 122.0)
    shadow: Rgb = (190.0, 199.0, 187.0)
    ink: Rgb = (84.0, 92.0, 100.0)

    @classmethod
    def on(cls, background: Rgb | None) -> Tints:
        """Those that go with a background; the usual ones without."""
        if background is None:
            return cls()
        light = 0.299 * background[0] + 0.587 * background[1] + 0.114 * background[2]
        contrast = -1.0 if light > 110.0 else 1.0

        def shade(share: float) -> Rgb:
            r, g, b = (min(max(c + contrast * share, 0.0), 255.0) for c in background)
            return r, g, b

        return cls(background, background, shade(8.0), shade(90.0), shade(34.0), shade(130.0))


REACH = 4.0
"""Radius of the ground, in widths of what is seen of it."""
N_AROUND = 48
N_PIECES = 20
"""Pieces of a grid line, whose ends fade into the haze."""


def sky_dome(tints: Tints) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A hollow ball of radius 1 around the eye: points (k, 3), triangles (m, 3), colours (k, 3)."""
    rises = np.radians([-90.0, -6.0, 0.0, 4.0, 10.0, 20.0, 40.0, 90.0])
    shares = np.array([0.0, 0.0, 0.0, 0.18, 0.4, 0.65, 0.9, 1.0])
    points, faces = _rings(np.cos(rises), np.sin(rises))
    colours = _mixed(tints.haze, tints.sky, np.repeat(shares, N_AROUND))
    return points, faces, colours


def ground_disc(tints: Tints) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A disc of radius 1 that fades outward: points (k, 3), triangles (m, 3), colours (k, 3)."""
    radii = np.array([0.0, 0.12, 0.2, 0.3, 0.45, 0.65, 1.0])
    points, faces = _rings(radii, np.zeros_like(radii))
    share = np.clip((radii - 0.12) / 0.6, 0.0, 1.0) ** 0.8
    colours = _mixed(tints.ground, tints.haze, np.repeat(share, N_AROUND))
    return points, faces, colours


def _mixed(first: Rgb, second: Rgb, share: np.ndarray) -> np.ndarray:
    """Colours, (n, 3), with this share of the second, (n,)."""
    mixed: np.ndarray = np.array(first) + share[:, None] * np.subtract(second, first)
    return mixed


def _rings(radii: np.ndarray, heights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A surface of rings about the z axis, each joined to the next."""
    angle = 2.0 * np.pi * np.arange(N_AROUND) / N_AROUND
    points = np.stack(
        [
            np.outer(radii, np.cos(angle)),
            np.outer(radii, np.sin(angle)),
            np.repeat(heights[:, None], N_AROUND, 1),
        ],
        axis=-1,
    ).reshape(-1, 3)
    i = np.arange(N_AROUND)
    j = (i + 1) % N_AROUND
    faces = [
        np.concatenate(
            [
                np.stack([r + i, r + j, r + N_AROUND + j], 1),
                np.stack([r + i, r + N_AROUND + j, r + N_AROUND + i], 1),
            ]
        )
        for r in N_AROUND * np.arange(len(radii) - 1)
    ]
    return points, np.concatenate(faces)


def ground_width(view: View, ground: float, aspect: float) -> float:
    """About how much of the ground is seen across a picture [m]: from high above as much as from far away."""
    half = (
        view.half_height
        if view.is_parallel
        else max(view.half_height, 0.5 * abs(float(view.eye[2]) - ground))
    )
    return 2.0 * half * aspect


def sees_sky(view: View, ground: float, reach: float) -> bool:
    """Whether the picture shows more than ground that reaches so far [m]."""
    if view.is_parallel:
        return False
    edge = 0.5 * ANGLE - math.asin(view.axes()[2][2])
    rim = math.atan2(float(view.eye[2]) - ground, reach)
    return edge > -rim - math.radians(1.0)


def grid_steps(width: float) -> tuple[float, float, float]:
    """Distances between fine and between coarse lines [m], and the weight of the fine ones, for what is seen of this width [m]."""
    level = math.log10(max(width, 1e-6) / 6.0)
    fine = 10.0 ** math.floor(level)
    return fine, 10.0 * fine, 1.0 - (level - math.floor(level))


def grid_lines(view: View, ground: float, width: float, colour: Rgb) -> tuple[np.ndarray, np.ndarray]:
    """The grid about the middle of a picture.

    Args:
        view: From where it is seen.
        ground: z of the grid [m].
        width: Width of what is seen at the target [m].
        colour: Red, green, blue.

    Returns:
        Ends of pieces of lines [m], (2 k, 3), and red, green, blue and opacity at each, (2 k, 4), 0 to 255.
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
    colours = np.empty((len(ends), 4))
    colours[:, :3], colours[:, 3] = colour, 255.0 * alpha
    return ends, colours


def _lattice(
    middle: np.ndarray, ground: float, step: float, reach: float, weight: float
) -> tuple[np.ndarray, np.ndarray]:
    """Lines of both directions within a circle, fading outward: ends (2 k, 3) and opacities (2 k,)."""
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
