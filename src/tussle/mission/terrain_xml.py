"""Terrain XML of SCRIMMAGE: poly data in UTM coordinates."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from tussle.declare.texts import shown
from tussle.errors import MissionError, listed, nearest_name
from tussle.mission import codecs
from tussle.mission.limits import Limits
from tussle.mission.node import Budget, parse
from tussle.mission.source import read_text
from tussle.world.geodesy import Origin, utm
from tussle.world.rays.files import read_surface
from tussle.world.scene import HeightField, TriangleMesh

TAGS = (
    "polydata", "texture", "system", "hemisphere", "zone", "origin_offset_x", "origin_offset_y", "origin_offset_z", "extrusion",
    "extrusion_property", "enable_grid",
)  # fmt: skip
OFFSETS = ("origin_offset_x", "origin_offset_y", "origin_offset_z")


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
        east, north = utm(
            origin.latitude, origin.longitude, zone, given.get("hemisphere", "north").lower().startswith("s")
        )
        x, y, z = x - east, y - north, z - origin.altitude
    a, b, c = numbers.get("position", (0.0, 0.0, 0.0))
    return (
        read_surface(inner, **numbers | {"position": (x + a, y + b, z + c)}),
        inner,
        (path.parent / given["texture"] if given.get("texture") else None),
    )
