"""Fields of view of plugins, as pictures show them: read from the names and units of their parameters."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from tussle.mission import Block
from tussle.numeric.quaternion import quat_from_euler

RANGES = (
    "range", "max_range", "max_detect_range", "detection_range", "sensing_range", "comms_range", "sphere_of_influence",
)  # fmt: skip
"""Parameters that say how far a plugin sees or hears, the first one counts."""
MAX_RANGE = 1e6
"""Ranges from here on have no end [m]."""
_ANGLE = re.compile(r"(?:^|_)(?:fov|field_of_view)(?:_|$)")
_RISING = re.compile(r"(?:^|_)(?:el|elevation|v|vert|vertical)(?:_|$)")


@dataclass(frozen=True)
class Sight:
    """What a plugin of an entity sees.

    Attributes:
        plugin: Name of the plugin's class.
        azimuth: Full angle to both sides [rad].
        elevation: Full angle up and down [rad]; None for a cone whose full angle is `azimuth`.
        range: How far it sees [m]; inf if that has no end.
        pos: Place on the body [m], forward, left, up.
        quat: Attitude on the body, (w, x, y, z).
    """

    plugin: str
    azimuth: float
    elevation: float | None
    range: float
    pos: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quat: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)


def fields_of_view(block: Block) -> tuple[Sight, ...]:
    """Fields of view of the plugins of a block, but those that leave nothing out."""
    return tuple(filter(None, map(field_of_view, block.plugins)))


def range_of(plugin: Any) -> float | None:
    """How far a plugin sees or hears [m]; None if no parameter says so, inf if it has no end."""
    for name in RANGES:
        value = plugin.values.get(name)
        if isinstance(value, (int, float)) and not isinstance(value, bool) and value > 0.0:
            return float(value) if value < MAX_RANGE else math.inf
    return None


def field_of_view(plugin: Any) -> Sight | None:
    """What a plugin sees; None if no parameter says so, or if it leaves nothing out."""
    angles = dict(_angles(plugin))
    if not angles:
        return None
    elevation = angles.get("elevation")
    azimuth = angles.get("azimuth", 2.0 * math.pi)
    if azimuth >= 2.0 * math.pi - 1e-6 and (elevation is None or elevation >= math.pi - 1e-6):
        return None
    place, turn = (plugin.values.get(name) for name in ("xyz", "rpy"))
    x, y, z = map(float, place) if place is not None else (0.0, 0.0, 0.0)
    w, i, j, k = map(float, quat_from_euler(*turn)) if turn is not None else (1.0, 0.0, 0.0, 0.0)
    return Sight(
        type(plugin).__name__, azimuth, elevation, range_of(plugin) or math.inf, (x, y, z), (w, i, j, k)
    )


def _angles(plugin: Any) -> Iterator[tuple[str, float]]:
    """Full angles [rad] as "azimuth" or "elevation".

    Parameters in radians with fov or field_of_view in their names count, and those of patterns of rays.
    """
    for name, column in type(plugin).params().items():
        value = plugin.values.get(name)
        if (
            _ANGLE.search(name)
            and column.units == ("rad",)
            and isinstance(value, (int, float))
            and value > 0.0
        ):
            yield "elevation" if _RISING.search(name) else "azimuth", float(value)
    for axis, end in (("azimuth", "horiz"), ("elevation", "vert")):
        step, n = (plugin.values.get(f"{name}_{end}") for name in ("angle_res", "num_rays"))
        if isinstance(step, (int, float)) and isinstance(n, (int, float)):
            yield axis, abs(step) * (n - 1)
