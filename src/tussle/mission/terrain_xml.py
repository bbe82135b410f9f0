"""Terrain XML of SCRIMMAGE: poly data in UTM coordinates."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tussle.declare.texts import shown
from tussle.errors import MissionError, listed, nearest_name
from tussle.mission import codecs
from tussle.mission.limits import Limits
from tussle.mission.node import Budget, parse
from tussle.mission.source import read_text
from tussle.world.geodesy import FLATTENING, SEMI_MAJOR, Origin
from tussle.world.rays.files import read_surface
from tussle.world.scene import HeightField, TriangleMesh

TAGS = (
    "polydata", "texture", "system", "hemisphere", "zone", "origin_offset_x", "origin_offset_y", "origin_offset_z", "extrusion",
    "extrusion_property", "enable_grid",
)  # fmt: skip
OFFSETS = ("origin_offset_x", "origin_offset_y", "origin_offset_z")
CENTRAL_SCALE, FALSE_EASTING, FALSE_NORTHING = 0.9996, 500_000.0, 10_000_000.0
"""UTM: NGA.SIG.0012, The Universal Grids and the Transverse Mercator and Polar Stereographic Map Projections (2014), section 7."""


def utm(origin: Origin, zone: int, is_south: bool) -> tuple[float, float]:
    """Return easting and northing of a point [m]. L. Krueger (1912), fourth order: the error is below 1 um inside the zone."""
    n = FLATTENING / (2.0 - FLATTENING)
    radius = SEMI_MAJOR / (1.0 + n) * (1.0 + n**2 / 4.0 + n**4 / 64.0)
    alpha = (
        n / 2.0 - 2.0 * n**2 / 3.0 + 5.0 * n**3 / 16.0 + 41.0 * n**4 / 180.0,
        13.0 * n**2 / 48.0 - 3.0 * n**3 / 5.0 + 557.0 * n**4 / 1440.0,
        61.0 * n**3 / 240.0 - 103.0 * n**4 / 140.0,
        49561.0 * n**4 / 161280.0,
    )
    away = origin.longitude - math.radians(6.0 * zone - 183.0)
    sine, e = math.sin(origin.latitude), math.sqrt(FLATTENING * (2.0 - FLATTENING))
    t = math.sinh(math.atanh(sine) - e * math.atanh(e * sine))
    xi, eta = math.atan2(t, math.cos(away)), math.atanh(math.sin(away) / math.hypot(1.0, t))
    north = xi + sum(a * math.sin(2 * j * xi) * math.cosh(2 * j * eta) for j, a in enumerate(alpha, 1))
    east = eta + sum(a * math.cos(2 * j * xi) * math.sinh(2 * j * eta) for j, a in enumerate(alpha, 1))
    return FALSE_EASTING + CENTRAL_SCALE * radius * east, CENTRAL_SCALE * radius * north + (
        FALSE_NORTHING if is_south else 0.0
    )


def read_terrain_xml(
    path: Path, check: Callable[[Path], None], origin: Origin, numbers: dict[str, Any]
) -> tuple[HeightField | TriangleMesh, Path, Path | None]:
    """Read the surface that a terrain XML names. Its extrusion is left out.

    Poly data are shifted by the UTM coordinates of the mission's origin, if the file has a <zone>, and by its offsets.

    Args:
        path: The XML file.
        check: Raises an error for a path that may not be read.
        origin: Origin of the world frame.
        numbers: Further arguments of `read_surface`.

    Returns:
        The surface, its file, and that of its texture, which may not exist.

    Raises:
        MissionError: The XML is damaged, or has a tag or value that is not allowed.
        ParameterError: The surface cannot be read.
    """
    budget = Budget(Limits())
    root, _ = parse(read_text(path, budget), str(path), budget)
    given = {}
    for node in root.children:
        if node.tag not in TAGS:
            raise MissionError(
                f"{node.place}: a terrain has no {shown(node.tag)}{nearest_name(node.tag, TAGS)}; {listed(TAGS)}"
            )
        given[node.tag] = node.text.strip()
    if not given.get("polydata"):
        raise MissionError(f"{path}: the terrain has no <polydata>, which names its surface")
    inner = path.parent / given["polydata"]
    check(inner)
    x, y, z = (codecs.number(given.get(name) or "0", "m") for name in OFFSETS)
    if given.get("zone"):
        zone = codecs.integer(given["zone"], 1, 60)
        east, north = utm(origin, zone, given.get("hemisphere", "north").lower().startswith("s"))
        x, y, z = x - east, y - north, z - origin.altitude
    a, b, c = numbers.get("position", (0.0, 0.0, 0.0))
    return (
        read_surface(inner, **numbers | {"position": (x + a, y + b, z + c)}),
        inner,
        (path.parent / given["texture"] if given.get("texture") else None),
    )
