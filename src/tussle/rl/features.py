"""Features of observations: names of columns as what kernels take, and their bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tussle.api.bodies import FLOATS, OFFSETS
from tussle.errors import ParameterError, listed, nearest_name
from tussle.rl import kernels

FRAMES = {"world": kernels.WORLD, "heading": kernels.HEADING, "body": kernels.BODY}
VECTORS = ("pos", "vel", "omega", "force", "torque")
OWN = ("forward", *FLOATS)
OTHERS = {
    "distance": kernels.DISTANCE,
    "direction": kernels.DIRECTION,
    "same_team": kernels.SAME_TEAM,
    "present": kernels.PRESENT,
}
LIMITS = {"forward": (-1.0, 1.0), "quat": (-1.0, 1.0), "radius": (0.0, np.inf), "mass": (0.0, np.inf)}
"""Body columns whose ranges are known."""
RELATIVE = {"offset": "pos", "relative_vel": "vel"}
Scale = float | Mapping[str, float]
Spec = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Features as kernels take them: kinds and rows of their source table, (n,), and their numbers, (n, 4)."""
ROUNDING = 1.0 + 1e-6
"""Bounds are wider by this factor, since turned vectors of single precision may be longer by a rounding error."""


def span(low: float, high: float, factor: float, n: int) -> list[tuple[float, float]]:
    """Bounds of n numbers that are multiplied by a factor."""
    ends = low * factor * ROUNDING, high * factor * ROUNDING
    return [(min(ends), max(ends))] * n


def spans_of_others(
    names: Sequence[str], scale: Scale, planar: bool, reach: float
) -> list[tuple[float, float]]:
    """Bounds of the features of others within `reach` [m]."""
    known = {
        "offset": (-reach, reach), "distance": (0.0, reach), "direction": (-1.0, 1.0), "same_team": (0.0, 1.0),
        "present": (0.0, 1.0), **LIMITS,
    }  # fmt: skip
    found = []
    for name in names:
        _, width = of_others([name], scale, planar)
        found += span(*known.get(name, (-np.inf, np.inf)), factor_of(scale, name), width)
    return found


def bounds_of(spans: Sequence[tuple[float, float]]) -> np.ndarray:
    """Bounds as arrays, (2, n)."""
    return np.array(spans, float).reshape(-1, 2).T


def check_features(
    where: str, frame: str, names: Sequence[str], allowed: Sequence[str], scale: Scale
) -> None:
    """Check a declaration.

    Raises:
        ParameterError: A name or value is not allowed.
    """
    if frame not in FRAMES:
        raise ParameterError(f"{where}: frame = {frame!r} is not allowed; {listed(FRAMES)}")
    for name in names:
        if name not in allowed and not ("." in name and where == "Own"):
            raise ParameterError(f"{where} has no {name!r}{nearest_name(name, allowed)}; {listed(allowed)}")
    for name, value in scale.items() if isinstance(scale, Mapping) else [("", scale)]:
        if name and name not in names:
            raise ParameterError(f"{where}: scale of {name!r}{nearest_name(name, names)}; {listed(names)}")
        if not abs(value) > 0.0:
            raise ParameterError(f"{where}: scale = {value!r} is not allowed; it takes numbers other than 0")


def factor_of(scale: Scale, name: str) -> float:
    """Factor of a feature: one over its scale."""
    return 1.0 / (scale.get(name, 1.0) if isinstance(scale, Mapping) else scale)


def spec_of(lines: Sequence[tuple[float, ...]]) -> Spec:
    """Features as kernels take them, from a line (kind, source, scale, x, y, z) for each."""
    numbers = np.array(lines, float).reshape(-1, 6)
    return numbers[:, 0].astype(np.int64), numbers[:, 1].astype(np.int64), numbers[:, 2:].copy()


def scalars(first: int, n: int, factor: float) -> list[tuple[float, ...]]:
    """Features that are n numbers of a table from row `first` on."""
    return [(kernels.SCALAR, first + k, factor, 0.0, 0.0, 0.0) for k in range(n)]


def of_others(names: Sequence[str], scale: Scale, planar: bool) -> tuple[Spec, int]:
    """The spec of features of others, and its number of columns."""
    lines: list[tuple[float, ...]] = []
    width = 0
    for name in names:
        source = RELATIVE.get(name, name)
        factor = factor_of(scale, name)
        if name in OTHERS:
            lines.append((OTHERS[name], 0, factor, 0, 0, 0))
            width += 3 if name == "direction" else 1
        elif source in VECTORS:
            kind, k = (kernels.PLANE, 2) if planar else (kernels.SPACE, 3)
            lines.append((kind, OFFSETS[source], factor, name in RELATIVE, 0, 0))
            width += k
        else:
            lines += scalars(OFFSETS[source], FLOATS[source], factor)
            width += FLOATS[source]
    return spec_of(lines), width


__all__ = [
    "FRAMES",
    "LIMITS",
    "OTHERS",
    "OWN",
    "RELATIVE",
    "ROUNDING",
    "VECTORS",
    "Scale",
    "Spec",
    "bounds_of",
    "check_features",
    "factor_of",
    "of_others",
    "scalars",
    "span",
    "spans_of_others",
    "spec_of",
]
