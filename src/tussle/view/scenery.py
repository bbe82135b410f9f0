"""Scenery: ground, grid, origin, bases, boundaries, terrain."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tussle.arguments import explained
from tussle.errors import TussleError
from tussle.mission import Block, GivenMission, Mission, mission_of
from tussle.view.ground_map.map_file import GroundMap
from tussle.view.ground_map.placed import Area
from tussle.view.shapes import Mesh
from tussle.view.solids import MAX_FACES, Terrain, mesh_of, outline_of
from tussle.world.geodesy import Origin
from tussle.world.rays.surfaces import MeshPart
from tussle.world.scene import (
    Base,
    Cuboid,
    HeightField,
    Plane,
    Polyhedron,
    Prism,
    Sphere,
    TriangleMesh,
    Volume,
)

MIN_EXTENT = 50.0
"""Least width of the visible box [m]."""
MIN_MAP_MARGIN = 500.0
"""Least distance to which a map reaches beyond the visible box [m]: entities may leave it."""
N_GRID_LINES = 20
"""Approximate number of lines of the default ground grid."""


@dataclass(frozen=True, eq=False)
class Region:
    """A boundary or a wall.

    Attributes:
        name: Its id or name.
        team: Its team; None without one.
        shape: Its shape.
        is_wall: Whether it stops rays.
        mesh: Its surface; of a plane, a square as wide as the visible box.
        outline: Its edges, or circles of a sphere, (k, 2, 3): ends of each line [m].
        parts: Its surface in its own colours and textures, which is drawn in place of `mesh`; () for none.
    """

    name: str
    team: int | None
    shape: Volume | TriangleMesh
    is_wall: bool
    mesh: Mesh
    outline: np.ndarray
    parts: tuple[MeshPart, ...] = ()


@dataclass(frozen=True, eq=False)
class Scenery:
    """The static parts of a picture.

    Attributes:
        origin: Geodetic position of (0, 0, 0).
        origin_length: Length of the axes at the origin [m]; 0 for none.
        ground: z of the ground grid [m].
        low: Lower corner of the visible box [m], (3,).
        high: Upper corner [m], (3,).
        grid_step: Distance between lines of the ground grid [m].
        bases: Bases of the teams.
        boundaries: Regions and walls.
        terrain: The terrain; None for flat ground.
        background: Red, green, blue, 0 to 255; None for the default.
        notes: Viewer tags that were not followed, one line each.
        has_ground: Something in the mission says where the ground is; otherwise entities may be at any height.
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
    has_ground: bool = True

    @property
    def size(self) -> float:
        """Diagonal of the visible box [m]."""
        return float(np.linalg.norm(self.high - self.low))


@explained
def scenery_of(
    mission: GivenMission | None,
    viewer: Mapping[str, Any] | None = None,
    extent: tuple[np.ndarray, np.ndarray] | None = None,
    ground_map: GroundMap | None = None,
) -> Scenery:
    """The scenery of a mission.

    Args:
        mission: The mission, the name of one that ships, or a mission file; None if it is unknown, which leaves ground and grid.
        viewer: Viewer tags of the mission file, see `tussle.mission.Loaded`.
        extent: Lower and upper corner of all positions of a game [m], each (3,); by default of the initial positions.
        ground_map: A map on the ground, in place of the terrain's texture; by default that of the mission file.

    Raises:
        MissionError: There is no such mission.
        ParameterError: The map cannot be read, or has no place in the mission.
    """
    mission = None if mission is None else mission_of(mission, "scenery_of")[0]
    viewer = viewer or {}
    corners = [np.asarray(c, float) for c in extent or ()]
    notes: list[str] = []
    hills: HeightField | None = None
    shapes = _shapes(mission, notes) if mission is not None else []
    if mission is not None:
        if not corners:
            corners += [c for block in mission.blocks for c in _start(block)]
        corners += [np.add(b.position, s * b.radius) for b in mission.scene.bases for s in (-1.0, 1.0)]
        corners += [c for _, _, shape, _ in shapes for c in _corners(shape)]
        hills = mission.scene.terrain or _generated(mission, notes)
        corners += [] if hills is None else _corners_of_field(hills)
    low, high = _at_least(np.array(corners).reshape(-1, 3))
    scene = None if mission is None else mission.scene
    origin = Origin() if scene is None else scene.origin
    ground = scene.ground.height if scene is not None and scene.ground is not None else 0.0
    terrain = None if hills is None else Terrain.of(hills)
    try:
        if ground_map is None and "map" in viewer:
            own = GroundMap.of_mission(viewer["map"])
            terrain = _mapped(own, origin, terrain, ground, low, high)
    except TussleError as error:
        notes.append(f"{error}; the mission's map is not shown")
    if ground_map is not None:
        terrain = _mapped(ground_map, origin, terrain, ground, low, high)
    spacing = viewer.get("grid_spacing", 0.0)
    return Scenery(
        origin=origin,
        origin_length=_origin_length(viewer, low, high),
        ground=ground,
        low=low,
        high=high,
        grid_step=float(spacing) if spacing > 0.0 else _grid_step(low, high),
        bases=list(scene.bases) if scene else [],
        boundaries=[
            Region(
                name,
                team,
                shape,
                is_wall,
                mesh_of(shape, low, high),
                outline_of(shape, low, high),
                shape.parts if isinstance(shape, TriangleMesh) else (),
            )
            for name, team, shape, is_wall in shapes
        ],
        terrain=terrain,
        background=_background(viewer, notes),
        notes=tuple(notes),
        has_ground=mission is None or _has_ground(mission, hills),
    )


def _mapped(
    ground_map: GroundMap,
    origin: Origin,
    terrain: Terrain | None,
    ground: float,
    low: np.ndarray,
    high: np.ndarray,
) -> Terrain:
    """The terrain with a map over it; without a terrain, the map flat on the ground, and around the visible box."""
    if terrain is not None:
        corners = (terrain.x[0], terrain.y[0]), (terrain.x[-1], terrain.y[-1])
        area = Area(origin, *corners, float(terrain.height.mean()))
        return replace(terrain, texture=ground_map.over(area, is_trimmed=False).image)
    margin = max(MIN_MAP_MARGIN, float((high - low)[:2].max()))
    area = Area(origin, tuple((low[:2] - margin).tolist()), tuple((high[:2] + margin).tolist()), ground)
    laid = ground_map.over(area)
    x, y = (np.array([laid.low[i], laid.high[i]]) for i in range(2))
    return Terrain(x, y, np.full((2, 2), ground), laid.image)


def _has_ground(mission: Mission, hills: HeightField | None) -> bool:
    """Return True if the scene has a ground or a terrain, which may be a mesh, or a plugin a ground level."""
    levels = (name for p in mission.interactions for name in p.values if name.startswith("ground_"))
    return mission.scene.ground is not None or hills is not None or bool(mission.scene.meshes) or any(levels)


def _start(block: Block) -> list[np.ndarray]:
    """Corners of a box around nearly all initial positions of a block: three standard deviations hold 99.7 %."""
    spread = np.array(block.half_width) if block.placement == "uniform" else 3.0 * np.sqrt(block.variance)
    if block.count == 1 and not block.scatter_first:
        spread = np.zeros(3)
    return [np.array(block.position) - spread, np.array(block.position) + spread]


def _shapes(mission: Mission, notes: list[str]) -> list[tuple[str, int | None, Volume | TriangleMesh, bool]]:
    """Name, team, shape and whether it is a wall, of all regions of a mission; walls of plugins have no names."""
    found: list[tuple[str, int | None, Volume | TriangleMesh, bool]] = []
    scene = mission.scene
    found += [(str(name), None, shape, False) for name, shape in scene.boundaries.items()]
    for i, mesh in enumerate(scene.meshes, 1):
        found.append((f"mesh {i}", None, mesh, True))
        if len(mesh.faces) > MAX_FACES:
            notes.append(f"mesh {i} has {len(mesh.faces):,} triangles; {MAX_FACES:,} of them are shown")
    found += [(f"wall {i + 1}", None, shape, True) for i, shape in enumerate(scene.walls)]
    roles = _roles(mission)
    for p in mission.interactions:
        found += [(_region_name(p, r.boundary, roles), r.team, r.shape, False) for r in p.regions()]
    for plugin in mission.interactions:
        try:
            found += [("", None, wall, True) for wall in plugin.walls()]
        except TussleError as error:  # the file of a recorded run's map may be elsewhere
            notes.append(f"{error}; its walls are not shown")
    return found


def _roles(mission: Mission) -> dict[int, set[str]]:
    """Uses of boundaries by their ids: "flag" of one that a plugin's `flag_boundary_id` names."""
    roles: dict[int, set[str]] = {}
    for plugin in mission.interactions:
        for name, value in plugin.values.items():
            if name.endswith("_boundary_id"):
                roles.setdefault(int(value), set()).add(name.removesuffix("_boundary_id"))
    return roles


def _region_name(plugin: Any, boundary: int, roles: Mapping[int, set[str]]) -> str:
    """Name of a region: that of its plugin, with its id where the mission gives none, and its uses: "Boundary 2 (capture)"."""
    name = str(plugin.instance_name)
    if name == type(plugin).__name__:
        name = f"{name} {boundary}"
    uses = sorted(roles.get(boundary, set()) - {name})
    return f"{name} ({', '.join(uses)})" if uses else name


def _corners(shape: Volume | TriangleMesh) -> list[np.ndarray]:
    """Corners of a box around a shape; none for an infinite one."""
    if isinstance(shape, Sphere):
        return [np.array(shape.center) - shape.radius, np.array(shape.center) + shape.radius]
    if isinstance(shape, (Cuboid, Polyhedron, Prism, TriangleMesh)):
        nothing = np.zeros(3)
        vertices = mesh_of(shape, nothing, nothing).vertices.astype(float)
        return [vertices.min(axis=0), vertices.max(axis=0)]
    assert not isinstance(shape, Plane) or shape.normal
    return []


def _generated(mission: Mission, notes: list[str]) -> HeightField | None:
    """The terrain of a plugin."""
    for plugin in mission.interactions:
        try:
            if (found := plugin.terrain()) is not None:
                return found  # type: ignore[no-any-return]
        except TussleError as error:
            notes.append(f"{error}; its terrain is not shown")
    return None


def _corners_of_field(field: HeightField) -> list[np.ndarray]:
    west, south, cell, _, low, high = field.grid
    ny, nx = field.height.shape
    return [np.array([west, south, low]), np.array([west + cell * (nx - 1), south + cell * (ny - 1), high])]


def _at_least(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A box around corners (k, 3), at least `MIN_EXTENT` wide."""
    if not len(corners):
        corners = np.zeros((1, 3))
    low, high = corners.min(axis=0), corners.max(axis=0)
    missing = np.maximum(0.0, np.array([MIN_EXTENT, MIN_EXTENT, 0.0]) - (high - low))
    return low - 0.5 * missing, high + 0.5 * missing


def round_up(value: float) -> float:
    """The least of 1, 2 and 5 times a power of ten that is not less than a value > 0."""
    power = 10.0 ** math.floor(math.log10(value) + 1e-9)
    return next(f * power for f in (1.0, 2.0, 5.0, 10.0) if f * power >= value * (1.0 - 1e-9))


def _grid_step(low: np.ndarray, high: np.ndarray) -> float:
    """A round step with which about `N_GRID_LINES` lines are visible."""
    return round_up(float((high - low)[:2].max()) / N_GRID_LINES)


def _origin_length(viewer: Mapping[str, Any], low: np.ndarray, high: np.ndarray) -> float:
    """Length of the axes at the origin [m]: that of the mission, else a visible one."""
    if viewer.get("show_origin") is False:
        return 0.0
    said = viewer.get("origin_length", 0.0)
    return float(said) if said > 0.0 else _grid_step(low, high)


def _background(viewer: Mapping[str, Any], notes: list[str]) -> tuple[int, int, int] | None:
    text = viewer.get("background_color")
    if not text:
        return None
    try:
        red, green, blue = (round(float(v)) for v in str(text).replace(",", " ").split())
    except ValueError:
        red = green = blue = -1
    if min(red, green, blue) < 0 or max(red, green, blue) > 255:
        notes.append(f"background_color {text!r} is not three numbers from 0 to 255; the default is used")
        return None
    return red, green, blue
