"""The static scene of a mission: origin on Earth, ground, walls, named regions and the teams' bases."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from tussle.errors import MissionError, ParameterError, listed, nearest_name
from tussle.geodesy import Origin
from tussle.prism import Prism
from tussle.shapes import (
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

__all__ = [
    "Base",
    "Convex",
    "Cuboid",
    "FlatGround",
    "Origin",
    "Plane",
    "Polyhedron",
    "Prism",
    "Scene",
    "Sphere",
    "TeamRegion",
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


@dataclass(frozen=True)
class Scene:
    """Everything in a mission that does not move.

    Args:
        origin: Point on Earth at which the world frame is tangent.
        ground: The ground; None for a world without ground.
        walls: Solid shapes that stop rays.
        boundaries: Named regions; they have no effect by themselves.
        bases: The teams' bases, in the mission's order.
    """

    origin: Origin = field(default_factory=Origin)
    ground: FlatGround | None = None
    walls: tuple[Volume, ...] = ()
    boundaries: Mapping[int | str, Volume] = field(default_factory=dict)
    bases: tuple[Base, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "walls", tuple(self.walls))
        object.__setattr__(self, "boundaries", dict(self.boundaries))
        object.__setattr__(self, "bases", tuple(self.bases))

    def with_walls(self, walls: tuple[Volume, ...]) -> Scene:
        """The scene with further walls."""
        return replace(self, walls=(*self.walls, *walls)) if walls else self

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
        """Whether positions [m], (3, n), lie inside a region, (n,).

        Raises:
            ParameterError: There is no such region.
        """
        return self.boundary(boundary).contains(pos)

    def ray(self, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """Distance along rays to the ground or the first wall.

        Args:
            origin: Starts of the rays [m], (3, n).
            direction: Directions of any length, (3, n).

        Returns:
            Distance [m], (n,); inf where a ray hits nothing.
        """
        distance = np.full(np.shape(origin)[1:], np.inf)
        for solid in (*self.walls, *((self.ground,) if self.ground else ())):
            distance = np.minimum(distance, solid.ray(origin, direction))
        return distance
