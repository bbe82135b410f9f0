"""A region that reports which entities cross its boundary."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from tussle.api import HistoricAttributes, Interaction, Param, State, WorldView, service
from tussle.messages import BoundaryCrossed, BoundaryShape
from tussle.scene import Cuboid, Plane, Sphere, TeamRegion, Volume
from tussle.shapes import Vector


class Boundary(Interaction):
    """A cuboid, sphere or half-space. Publishes its shape once (`BoundaryShape`) and each entry and exit (`BoundaryCrossed`).

    The existing system ignored the rotation.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(
        renamed={"id": "boundary_id", "team_id": "team", "type": "shape"},
        unread=("network_name", "polyhedron_points"),
    )

    boundary_id = Param(0, structural=True, doc="Id of the boundary in its messages.")
    team = Param(0, structural=True, doc="Team that owns the boundary.")
    shape = Param("cuboid", choices=("cuboid", "sphere", "plane"), doc="Kind of region.")
    center = Param(
        (0.0, 0.0, 0.0), fields="x y z", unit="m", structural=True, doc="Centre; of a plane, a point on it."
    )
    lengths = Param(
        (10.0, 10.0, 10.0), fields="x y z", unit="m", gt=0.0, structural=True, doc="Edge lengths of a cuboid."
    )
    rpy = Param(
        (0.0, 0.0, 0.0), fields="roll pitch yaw", unit="rad", structural=True, doc="Attitude of a cuboid."
    )
    radius = Param(500.0, unit="m", gt=0.0, structural=True, doc="Radius of a sphere.")
    normal = Param((0.0, 0.0, 1.0), fields="x y z", structural=True, doc="Outward normal of a plane.")
    was_inside = State(
        dtype=bool, per="entity", doc="Whether an entity was inside at the end of the last step."
    )
    is_known = State(dtype=bool, per="entity", doc="Whether `was_inside` of the entity is valid.")
    is_told = State(dtype=bool, per="world", doc="Whether the shape has been published.")

    def region(self) -> Volume:
        """Return the region as a shape of the scene."""
        given = self.values
        return _volume(*(given[name] for name in ("shape", "center", "lengths", "rpy", "radius", "normal")))

    def regions(self) -> tuple[TeamRegion, ...]:
        """Return the region with its id, team and centre."""
        return (TeamRegion(self.boundary_id, self.team, self.center, self.region()),)

    def step(self, w: WorldView) -> None:
        fresh = np.flatnonzero(~self.is_told & (np.bincount(w.world, minlength=w.n_worlds) > 0))
        if len(fresh):
            w.publish(BoundaryShape, fresh, boundary=self.boundary_id, team=self.team, shape=self.region())
            self.is_told[fresh] = True
        inside = self.region().contains(w.pos)
        rows = np.flatnonzero(self.is_known & (inside != self.was_inside))
        if len(rows):
            w.publish(
                BoundaryCrossed,
                w.world[rows],
                entity=w.id[rows],
                boundary=self.boundary_id,
                inside=inside[rows],
            )
        self.was_inside[:] = inside
        self.is_known[:] = True

    @service
    def is_inside(self, pos: np.ndarray) -> np.ndarray:
        """Return whether points [m], (3, n), lie inside, (n,)."""
        return np.asarray(self.region().contains(pos))


@lru_cache(maxsize=256)
def _volume(
    shape: str, center: Vector, lengths: Vector, rpy: Vector, radius: float, normal: Vector
) -> Volume:
    """A region as a shape of the scene; kept, because finding its faces takes longer than a step."""
    if shape == "sphere":
        return Sphere(center=center, radius=radius)
    if shape == "plane":
        return Plane(point=center, normal=normal)
    return Cuboid(center=center, lengths=lengths, rpy=rpy)
