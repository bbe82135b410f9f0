"""The static scene of a mission: origin on Earth, ground, walls, named regions and the teams' bases."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.arguments import Array, explained
from tussle.errors import MissionError, ParameterError, listed, nearest_name
from tussle.world.geodesy import Origin
from tussle.world.prism import Prism
from tussle.world.rays.hits import Hits, checked_vectors
from tussle.world.rays.solids import Solids
from tussle.world.rays.surfaces import HeightField, TriangleMesh
from tussle.world.shapes import (
    Convex,
    Cuboid,
    FlatGround,
    Plane,
    Polyhedron,
    Sphere,
    Vector,
    Volume,
    checked_number,
    checked_vector,
)

if TYPE_CHECKING:
    from tussle.world.contacts.solids import StaticSolids

__all__ = [
    "Base",
    "Convex",
    "Cuboid",
    "FlatGround",
    "HeightField",
    "Hits",
    "Origin",
    "Plane",
    "Polyhedron",
    "Prism",
    "Scene",
    "Sphere",
    "TeamRegion",
    "TriangleMesh",
    "Volume",
]


@dataclass(frozen=True)
class Base:
    """A team's base.

    Args:
        team: The team's id.
        position: Its centre [m], (3,), world frame.
        radius: Its radius [m].
        opacity: Opacity in the viewer, 0 to 1.

    Raises:
        ParameterError: A value is not finite or out of bounds.
    """

    team: int
    position: Vector
    radius: float = 25.0
    opacity: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", checked_vector(self, "position"))
        object.__setattr__(self, "radius", checked_number(self, "radius", above=0.0))
        object.__setattr__(self, "opacity", checked_number(self, "opacity"))
        if not 0.0 <= self.opacity <= 1.0:
            raise ParameterError(
                f"Base.opacity = {self.opacity!r} is not allowed; it takes a number from 0 to 1"
            )


@dataclass(frozen=True)
class TeamRegion:
    """A region of a mission that belongs to a team.

    Args:
        boundary: Its id.
        team: The team's id.
        center: Its centre [m], (3,), world frame; of a plane, a point on it.
        shape: Its shape.
    """

    boundary: int
    team: int
    center: Vector
    shape: Volume


def find_region(regions: Iterable[TeamRegion], boundary: float) -> TeamRegion:
    """The region with an id.

    Raises:
        MissionError: No region, or more than one, has the id.
    """
    known = list(regions)
    found = [region for region in known if region.boundary == boundary]
    if len(found) == 1:
        return found[0]
    ids = sorted({region.boundary for region in known})
    raise MissionError(
        f"{len(found) or 'no'} boundaries of the mission have the id {boundary:g}; {listed(map(str, ids))}"
    )


@explained
@dataclass(frozen=True)
class Scene:
    """Everything in a mission that does not move.

    Args:
        origin: Point on Earth at which the world frame is tangent.
        ground: The ground; None for a world without ground.
        walls: Solid shapes that stop rays, such as buildings.
        boundaries: Named regions; they have no effect by themselves.
        bases: The teams' bases, in the mission's order.
        terrain: Hills; None for none.
        meshes: Surfaces of triangles.
    """

    origin: Origin = field(default_factory=Origin)
    ground: FlatGround | None = None
    walls: Sequence[Volume] = ()
    boundaries: Mapping[int | str, Volume] = field(default_factory=dict)
    bases: Sequence[Base] = ()
    terrain: HeightField | None = None
    meshes: Sequence[TriangleMesh] = ()

    def __post_init__(self) -> None:
        for name, kind in (("walls", Volume), ("bases", Base), ("meshes", TriangleMesh)):
            parts = tuple(getattr(self, name))
            _check_kinds(name, parts, kind)
            object.__setattr__(self, name, parts)
        object.__setattr__(self, "boundaries", dict(self.boundaries))
        _check_kinds("ground", [self.ground] if self.ground is not None else [], FlatGround)
        _check_kinds("terrain", [self.terrain] if self.terrain is not None else [], HeightField)

    def __getstate__(self) -> dict[str, Any]:
        made = ("caster", "static_walls", "static_solids")
        return {name: value for name, value in self.__dict__.items() if name not in made}

    def with_parts(self, walls: tuple[Volume, ...], terrain: HeightField | None) -> Scene:
        """The scene with further walls, and with a terrain.

        Raises:
            MissionError: It has a terrain already.
        """
        if terrain is not None and self.terrain is not None:
            raise MissionError(
                "the scene has two terrains, of <terrain> or of plugins such as TerrainGenerator; it takes one"
            )
        if not walls and terrain is None:
            return self
        return replace(self, walls=(*self.walls, *walls), terrain=terrain or self.terrain)

    def boundary(self, name: int | str) -> Volume:
        """The region with this id or name.

        Raises:
            ParameterError: There is no such region.
        """
        try:
            return self.boundaries[name]
        except KeyError:
            names = [str(key) for key in self.boundaries]
            raise ParameterError(
                f"the scene has no boundary {name!r}{nearest_name(str(name), names)}; {listed(names)}"
            ) from None

    def bases_of(self, team: int) -> tuple[Base, ...]:
        """The bases of one team, in the mission's order."""
        return tuple(base for base in self.bases if base.team == team)

    def contains(self, boundary: int | str, pos: np.ndarray) -> np.ndarray:
        """Return True if positions [m], (3, n), lie inside a region, (n,).

        Raises:
            ParameterError: There is no such region.
        """
        return self.boundary(boundary).contains(pos)

    @property
    def solids(self) -> tuple[Volume | HeightField | TriangleMesh, ...]:
        """Everything that stops rays: walls, meshes, terrain and ground."""
        last = (self.terrain, self.ground)
        return (*self.walls, *self.meshes, *(part for part in last if part is not None))

    @cached_property
    def caster(self) -> Solids:
        """The solids, ready for rays; made on first access."""
        return Solids(self.solids)

    @cached_property
    def static_solids(self) -> StaticSolids:
        """The solids, ready for contacts; made on first access."""
        from tussle.world.contacts.solids import StaticSolids

        return StaticSolids(self.solids)

    @cached_property
    def static_walls(self) -> StaticSolids:
        """The walls alone, ready for contacts; made on first access."""
        from tussle.world.contacts.solids import StaticSolids

        return StaticSolids(self.walls)

    def cast(self, origins: Array, directions: Array, max_range: Array = np.inf) -> Hits:
        """The first hits of rays on the scene; `g.cast` also finds entities.

        A ray meets a surface from either side, also one on which it begins.

        Args:
            origins: Where the rays begin [m], (3, n), world frame.
            directions: Where they go, of any length, (3, n); a zero vector hits nothing.
            max_range: Hits further away do not count [m], one number or (n,).

        Raises:
            ParameterError: A shape does not fit, or a value is not allowed.
        """
        return self.caster.cast(origins, directions, max_range)

    def height(self, x: Array, y: Array) -> np.ndarray:
        """Height of the highest surface at places x, y [m], (n,): roofs, meshes, terrain and ground.

        -inf where there is none, and at places that are not finite.

        Raises:
            ParameterError: A shape does not fit.
        """
        east, north = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        is_place = np.isfinite(east) & np.isfinite(north)
        east, north = np.where(is_place, east, 0.0), np.where(is_place, north, 0.0)
        top = self.caster.top + 1.0
        start = np.stack([east.ravel(), north.ravel(), np.full(east.size, top)])
        down = np.repeat([[0.0], [0.0], [-1.0]], east.size, axis=1)
        surface = (top - self.cast(start, down).distance).reshape(east.shape)
        return np.asarray(np.where(is_place, surface, -np.inf))

    def free(self, points: Array, radius: Array) -> np.ndarray:
        """Return True if spheres round points [m], (3, n), with a radius [m], one or (n,), neither touch nor lie inside a solid, (n,).

        A mesh is a surface: a point that it surrounds is free.

        Raises:
            ParameterError: A shape does not fit, or a value is not allowed.
        """
        return ~self.caster.touches(points, radius)

    def free_between(self, a: Array, b: Array, radius: Array) -> np.ndarray:
        """Return True if spheres that move straight from points a to b [m], (3, n) each, stay `free` all the way, (n,).

        A touch less deep than 0.1 mm, or than 0.5 % of the radius [m], one or (n,), may not be found.

        Raises:
            ParameterError: A shape does not fit, or a value is not allowed.
        """
        start, end = checked_vectors("a", a), checked_vectors("b", b)
        if start.shape != end.shape:
            raise ParameterError(f"a has shape {start.shape} and b {end.shape}; they must be equal")
        return ~self.caster.touches_between(start, end, radius)

    def line_of_sight(self, a: Array, b: Array) -> np.ndarray:
        """Return True if nothing of the scene lies between points a and b [m], (3, n) each; (n,).

        Raises:
            ParameterError: A shape does not fit, or a value is not finite.
        """
        start, end = checked_vectors("a", a), checked_vectors("b", b)
        if start.shape != end.shape:
            raise ParameterError(f"a has shape {start.shape} and b {end.shape}; they must be equal")
        with np.errstate(over="ignore"):  # of points that are far beyond any scene
            x, y, z = way = end - start
            length = np.sqrt(x * x + y * y + z * z)
        return ~(self.cast(start, way, length).distance < np.inf)


def _check_kinds(name: str, parts: Iterable[Any], kind: type) -> None:
    for part in parts:
        if not isinstance(part, kind):
            raise ParameterError(f"Scene.{name} has {part!r}; it takes {kind.__name__}")
