"""A region that reports which entities cross its boundary."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from tussle.api import HistoricAttributes, Interaction, Param, State, WorldView, service
from tussle.declare.messages import BoundaryCrossed, BoundaryShape
from tussle.numeric import cos, sin, total
from tussle.world.scene import Cuboid, Plane, Polyhedron, Prism, Sphere, TeamRegion, Volume
from tussle.world.shapes import Vector

CUBE = tuple((x, y, z) for z in (0.0, 1000.0) for x in (1000.0, -1000.0) for y in (1000.0, -1000.0))
N_SIDES = 64
SHAPING = (
    "shape", "center", "lengths", "rpy", "radius", "normal", "polyhedron_points", "polygon_points",
)  # fmt: skip


class Boundary(Interaction):
    """A cuboid, sphere, half-space, polyhedron, or polygon or cylinder between two heights.

    Publishes its shape once (`BoundaryShape`) and each entry and exit (`BoundaryCrossed`). An entity that moves straight through the
    region within one step enters and leaves it.

    SCRIMMAGE ignored the rotation, could not use a polyhedron, and did not see who was in the region between two steps.
    """

    grade = "portable"
    reads_start_positions = True
    historic_attributes = HistoricAttributes(
        renamed={"id": "boundary_id", "team_id": "team", "type": "shape"},
        unread=("network_name",),
    )

    boundary_id = Param(0, structural=True, doc="Id of the boundary in its messages.")
    team = Param(0, structural=True, doc="Team that owns the boundary.")
    shape = Param(
        "cuboid",
        choices=("cuboid", "sphere", "plane", "polyhedron", "polygon", "cylinder"),
        doc="Kind of region; a cylinder is vertical, with 64 sides.",
    )
    center = Param(
        (0.0, 0.0, 0.0), fields="x y z", unit="m", structural=True, doc="Centre; of a plane, a point on it."
    )
    lengths = Param(
        (10.0, 10.0, 10.0),
        fields="x y z",
        unit="m",
        gt=0.0,
        structural=True,
        doc="Edge lengths of a cuboid; of a polygon or cylinder, z is the height.",
    )
    rpy = Param(
        (0.0, 0.0, 0.0), fields="roll pitch yaw", unit="rad", structural=True, doc="Attitude of a cuboid."
    )
    radius = Param(500.0, unit="m", gt=0.0, structural=True, doc="Radius of a sphere or cylinder.")
    normal = Param((0.0, 0.0, 1.0), fields="x y z", structural=True, doc="Outward normal of a plane.")
    polyhedron_points = Param(
        CUBE, fields="x y z", unit="m", ragged=True, doc="Points whose convex hull is the polyhedron."
    )
    polygon_points = Param(
        ((0.0, 0.0), (100.0, 0.0), (0.0, 100.0)),
        fields="x y",
        unit="m",
        ragged=True,
        doc="Corners of a polygon, in order; it may be concave. Its middle height is that of `center`.",
    )
    was_inside = State(
        dtype=bool, per="entity", doc="Whether an entity was inside at the end of the last step."
    )
    is_known = State(dtype=bool, per="entity", doc="Whether `was_inside` of the entity is valid.")
    is_told = State(dtype=bool, per="world", doc="Whether the shape has been published.")

    def region(self) -> Volume:
        """Return the region as a shape of the scene."""
        given = self.values
        return _volume(*(given[name] for name in SHAPING))

    def regions(self) -> tuple[TeamRegion, ...]:
        """Return the region with its id, team and centre."""
        shape = self.region()
        center = self.center
        if isinstance(shape, Polyhedron):
            center = _mean(shape.points)
        elif isinstance(shape, Prism):
            center = (*_mean(shape.corners), center[2])
        return (TeamRegion(self.boundary_id, self.team, center, shape),)

    def step(self, w: WorldView) -> None:
        if not self.is_told.all():
            fresh = np.flatnonzero(~self.is_told & (np.bincount(w.world, minlength=w.n_worlds) > 0))
            w.publish(BoundaryShape, fresh, boundary=self.boundary_id, team=self.team, shape=self.region())
            self.is_told[fresh] = True
        inside = self.region().contains(w.pos)
        changes = self.is_known & (inside != self.was_inside)
        is_through = self._is_through(w, self.is_known & ~inside & ~self.was_inside)
        for chosen, is_in in ((is_through, ~inside), (is_through | changes, inside)):
            rows = np.flatnonzero(chosen)
            if len(rows):
                w.publish(
                    BoundaryCrossed, w.world[rows], entity=w.id[rows], boundary=self.boundary_id, inside=is_in[rows]
                )  # fmt: skip
        self.was_inside[:] = inside
        self.is_known[:] = True

    def _is_through(self, w: WorldView, may: np.ndarray) -> np.ndarray:
        """Return which of the entities that `may`, (n,), have gone through the region in the step, (n,)."""
        return self.region().crossed(w.start_pos, w.pos, may)

    @service
    def is_inside(self, pos: np.ndarray) -> np.ndarray:
        """Return whether points [m], (3, n), lie inside, (n,)."""
        return np.asarray(self.region().contains(pos))


@lru_cache(maxsize=256)
def _volume(
    shape: str, center: Vector, lengths: Vector, rpy: Vector, radius: float, normal: Vector,
    polyhedron: tuple[Vector, ...], polygon: tuple[tuple[float, float], ...],
) -> Volume:  # fmt: skip
    """Return a region as a shape of the scene. Cached, because finding its faces takes longer than a step."""
    if shape == "sphere":
        return Sphere(center=center, radius=radius)
    if shape == "plane":
        return Plane(point=center, normal=normal)
    if shape == "polyhedron":
        return Polyhedron(polyhedron)
    if shape == "cylinder":
        angle = np.arange(N_SIDES) * (2.0 * math.pi / N_SIDES)
        x, y = center[0] + radius * cos(angle), center[1] + radius * sin(angle)
        polygon = tuple(zip(x.tolist(), y.tolist(), strict=True))
    if shape in ("polygon", "cylinder"):
        return Prism(polygon, low=center[2] - 0.5 * lengths[2], high=center[2] + 0.5 * lengths[2])
    return Cuboid(center=center, lengths=lengths, rpy=rpy)


def _mean(points: Sequence[Sequence[float]]) -> tuple[float, ...]:
    """Mean of points."""
    return tuple(total(values) / len(points) for values in zip(*points, strict=True))
