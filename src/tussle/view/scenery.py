"""What stands still in the picture: ground, grid, origin, bases, boundaries, terrain."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tussle.errors import ViewError
from tussle.geodesy import Origin
from tussle.mission import Block, Mission
from tussle.scene import Cuboid, Plane, Polyhedron, Sphere, Volume
from tussle.stock import Boundary
from tussle.view.shapes import Mesh
from tussle.view.solids import mesh_of, outline_of
from tussle.view.terrain import Terrain, find_terrain

LEAST_EXTENT = 50.0
"""Width of what is shown of a game that takes place in one point [m]."""
N_GRID_LINES = 20
"""Lines of the ground grid, about, where a mission does not say."""


@dataclass(frozen=True, eq=False)
class Base:
    """A team's home.

    Attributes:
        team: The team's number.
        pos: Its centre [m], (3,).
        radius: Its radius [m].
        opacity: How it is drawn, 0 to 1.
    """

    team: int
    pos: np.ndarray
    radius: float
    opacity: float


@dataclass(frozen=True, eq=False)
class Region:
    """A boundary or a wall.

    Attributes:
        name: Its id or name.
        team: Team that it belongs to; None for nobody's.
        shape: What it is.
        is_wall: Whether it stops rays.
        mesh: Its surface; of a plane, a square as wide as what is shown.
        outline: Its edges, or circles of a sphere, (k, 2, 3): ends of each line [m].
    """

    name: str
    team: int | None
    shape: Volume
    is_wall: bool
    mesh: Mesh
    outline: np.ndarray


@dataclass(frozen=True, eq=False)
class Scenery:
    """All that stands still.

    Attributes:
        origin: Where the world's frame touches Earth; in the world it is (0, 0, 0).
        origin_length: Length of the axes to be drawn there [m]; 0 for none.
        ground: z of the ground grid [m].
        low: Lower corner of what is to be shown [m], (3,).
        high: Upper corner [m], (3,).
        grid_step: Distance between lines of the ground grid [m].
        bases: Homes of the teams.
        boundaries: Regions and walls.
        terrain: The ground where it is not flat; None for a flat one.
        background: Red, green, blue, 0 to 255; None for the viewer's own.
        notes: What the mission asks for and does not get, one line each.
    """

    origin: Origin
    origin_length: float
    ground: float
    low: np.ndarray
    high: np.ndarray
    grid_step: float
    bases: list[Base] = field(default_factory=list)
    boundaries: list[Region] = field(default_factory=list)
    terrain: Terrain | None = None
    background: tuple[int, int, int] | None = None
    notes: tuple[str, ...] = ()

    @property
    def size(self) -> float:
        """Length of the diagonal of what is to be shown [m]."""
        return float(np.linalg.norm(self.high - self.low))


def scenery_of(
    mission: Mission | None,
    viewer: Mapping[str, Any] | None = None,
    extent: tuple[np.ndarray, np.ndarray] | None = None,
    folder: Path | None = None,
) -> Scenery:
    """What stands still in a mission.

    Args:
        mission: The mission; None where it is not known, which leaves the ground and the grid.
        viewer: What the mission file says for the viewer, see `tussle.mission.Loaded`.
        extent: Lower and upper corner of all positions of a game [m], each (3,); by default where the mission's entities begin.
        folder: Folder of the mission file, where its terrain is looked for.
    """
    viewer = viewer or {}
    corners = [np.asarray(c, float) for c in extent or ()]
    if mission is not None:
        if not corners:
            corners += [c for block in mission.blocks for c in _start(block)]
        corners += [np.add(b.position, s * b.radius) for b in mission.scene.bases for s in (-1.0, 1.0)]
        corners += [c for _, _, shape, _ in _shapes(mission) for c in _corners(shape)]
    low, high = _at_least(np.array(corners).reshape(-1, 3))
    scene = None if mission is None else mission.scene
    spacing = viewer.get("grid_spacing", 0.0)
    notes: list[str] = []
    return Scenery(
        origin=Origin() if scene is None else scene.origin,
        origin_length=_origin_length(viewer, low, high),
        ground=scene.ground.height if scene is not None and scene.ground is not None else 0.0,
        low=low,
        high=high,
        grid_step=float(spacing) if spacing > 0.0 else _round_step(low, high),
        bases=[
            Base(b.team, np.array(b.position), b.radius, b.opacity) for b in (scene.bases if scene else ())
        ],
        boundaries=[
            Region(name, team, shape, is_wall, mesh_of(shape, low, high), outline_of(shape, low, high))
            for name, team, shape, is_wall in (_shapes(mission) if mission is not None else ())
        ],
        terrain=_terrain(viewer, folder, notes),
        background=_background(viewer, notes),
        notes=tuple(notes),
    )


def _start(block: Block) -> list[np.ndarray]:
    """Corners of where nearly all entities of a block begin: three standard deviations hold 997 of 1,000."""
    spread = np.array(block.half_width) if block.placement == "uniform" else 3.0 * np.sqrt(block.variance)
    if block.count == 1 and not block.scatter_first:
        spread = np.zeros(3)
    return [np.array(block.position) - spread, np.array(block.position) + spread]


def _shapes(mission: Mission) -> list[tuple[str, int | None, Volume, bool]]:
    """Name, team, shape and whether it is a wall, of all regions of a mission."""
    found: list[tuple[str, int | None, Volume, bool]] = []
    scene = mission.scene
    found += [(str(name), None, shape, False) for name, shape in scene.boundaries.items()]
    found += [(f"wall {i + 1}", None, shape, True) for i, shape in enumerate(scene.walls)]
    found += [
        (p.instance_name, p.team, p.region(), False) for p in mission.interactions if isinstance(p, Boundary)
    ]
    return found


def _corners(shape: Volume) -> list[np.ndarray]:
    """Of a box around a shape; none of one without end."""
    if isinstance(shape, Sphere):
        return [np.array(shape.center) - shape.radius, np.array(shape.center) + shape.radius]
    if isinstance(shape, (Cuboid, Polyhedron)):
        nothing = np.zeros(3)
        vertices = mesh_of(shape, nothing, nothing).vertices.astype(float)
        return [vertices.min(axis=0), vertices.max(axis=0)]
    assert not isinstance(shape, Plane) or shape.normal
    return []


def _at_least(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Box around corners (k, 3), no narrower than can be looked at."""
    if not len(corners):
        corners = np.zeros((1, 3))
    low, high = corners.min(axis=0), corners.max(axis=0)
    missing = np.maximum(0.0, np.array([LEAST_EXTENT, LEAST_EXTENT, 0.0]) - (high - low))
    return low - 0.5 * missing, high + 0.5 * missing


def _round_step(low: np.ndarray, high: np.ndarray) -> float:
    """1, 2 or 5 times a power of ten, so that some twenty lines cross what is shown."""
    wanted = float((high - low)[:2].max()) / N_GRID_LINES
    power = 10.0 ** math.floor(math.log10(wanted))
    return next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= wanted * (1.0 - 1e-9))


def _origin_length(viewer: Mapping[str, Any], low: np.ndarray, high: np.ndarray) -> float:
    """Of the axes at the origin: as the mission says; where it says nothing, as long as can be seen."""
    if viewer.get("show_origin") is False:
        return 0.0
    said = viewer.get("origin_length", 0.0)
    return float(said) if said > 0.0 else _round_step(low, high)


def _terrain(viewer: Mapping[str, Any], folder: Path | None, notes: list[str]) -> Terrain | None:
    named = viewer.get("terrain")
    name = str(named.get("value", "") if isinstance(named, dict) else named or "").strip()
    if not name:
        return None
    try:
        return find_terrain(name, folder)
    except ViewError as error:
        notes.append(f"{error}; a flat ground is shown")
        return None


def _background(viewer: Mapping[str, Any], notes: list[str]) -> tuple[int, int, int] | None:
    text = viewer.get("background_color")
    if not text:
        return None
    try:
        red, green, blue = (round(float(v)) for v in str(text).replace(",", " ").split())
    except ValueError:
        red = green = blue = -1
    if min(red, green, blue) < 0 or max(red, green, blue) > 255:
        notes.append(
            f"background_color {text!r} is not three numbers from 0 to 255; the viewer's own is taken"
        )
        return None
    return red, green, blue
