"""The scene as contacts see it."""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np

from tussle.world.contacts.bodies.kernels import ITEM
from tussle.world.contacts.surfaces.kernels import TRIANGLE
from tussle.world.rays.solids import grow
from tussle.world.rays.surfaces import HeightField, TriangleMesh
from tussle.world.shapes import Convex, FlatGround, Plane, Sphere, Volume

NO_FIELD = np.zeros((0, 0)), np.zeros(6)


class StaticSolids:
    """The parts of a scene in the arrays that contacts take.

    Args:
        parts: Walls, meshes, terrain and ground, as in `Scene.solids`.

    Attributes:
        planes: Half-spaces: outward normals and offsets [m], (k, 4).
        balls: Balls as items of bodies, (k, ITEM).
        tree: Bounds, links, roots, and triangles by place.
        field: Heights and grid; empty arrays for none.
    """

    def __init__(self, parts: Sequence[Volume | HeightField | TriangleMesh]) -> None:
        planes = [np.zeros((0, 4))]
        balls = [np.zeros((0, ITEM))]
        triangles = [np.zeros((0, TRIANGLE))]
        self.field = NO_FIELD
        for part in parts:
            if isinstance(part, HeightField):
                self.field = part.height, part.grid
            elif isinstance(part, Sphere):
                balls.append(np.array([[*part.center, part.radius, *[0.0] * 3, *np.eye(3).ravel()]]))
            elif isinstance(part, (FlatGround, Plane)):
                planes.append(np.array([[*normal, offset] for normal, offset in part.half_spaces()]))
            else:
                triangles.append(_numbers(part))
        self.planes, self.balls = np.concatenate(planes), np.concatenate(balls)
        every = np.concatenate(triangles)
        corners = every[:, :9].reshape(-1, 3, 3)
        boxes = np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)
        bounds, links, roots, order = grow(boxes, np.array([0, len(every)]), np.arange(len(every)))
        self.tree = bounds, links, roots, np.ascontiguousarray(every[order])

    def with_plane(self, plane: tuple[float, float, float, float]) -> StaticSolids:
        """The same with a further half-space: outward unit normal and offset [m]."""
        other = copy.copy(self)
        other.planes = np.concatenate([self.planes, np.array([plane])])
        return other

    @property
    def is_empty(self) -> bool:
        """True if there is nothing to touch."""
        return not (len(self.planes) + len(self.balls) + len(self.tree[3]) + self.field[0].size)


def _numbers(part: Volume | TriangleMesh) -> np.ndarray:
    """Triangles of a part, (m, TRIANGLE); those of a solid have outward normals."""
    if isinstance(part, TriangleMesh):
        corners, normal = part.triangles(), part.normals
    else:
        found = part.triangles()
        corners = _hull_triangles(part) if found is None else found
        a, b, c = (corners[:, k].T for k in range(3))
        (ux, uy, uz), (vx, vy, vz) = b - a, c - a
        way = np.stack([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx])
        length = np.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
        corners, way = corners[length > 0.0], (way / np.where(length > 0.0, length, 1.0))[:, length > 0.0]
        middle, size = (corners[:, 0] + corners[:, 1] + corners[:, 2]).T / 3.0, np.abs(corners).max()
        inward = part.contains(middle + 1e-9 * (1.0 + size) * way)
        normal = np.where(inward, -way, way).T
    one_sided = np.full((len(corners), 1), 0.0 if isinstance(part, TriangleMesh) else 1.0)
    return np.concatenate([corners.reshape(-1, 9), normal, one_sided], axis=1)


def _hull_triangles(part: Volume) -> np.ndarray:
    """Triangles of the faces of a polyhedron, (m, 3, 3): its corners in each face, joined in the order around their middle."""
    assert isinstance(part, Convex)
    points = np.array(getattr(part, "points", ()), float).reshape(-1, 3)
    found = []
    for normal, offset in part.half_spaces():
        height = normal[0] * points[:, 0] + normal[1] * points[:, 1] + normal[2] * points[:, 2]
        face = points[np.abs(height - offset) <= 1e-9 * (1.0 + np.abs(points).max())]
        found += _fan(face, np.array(normal))
    return np.array(found).reshape(-1, 3, 3)


def _fan(face: np.ndarray, normal: np.ndarray) -> list[np.ndarray]:
    """Triangles of a convex polygon with corners (m, 3), in any order."""
    corners, ordered = list(range(1, len(face))), [0]
    while corners:  # gift wrapping: from the last corner, all others lie to one side of the line to the next
        here = face[ordered[-1]]
        best = corners[0]
        for k in corners[1:]:
            (ux, uy, uz), (vx, vy, vz) = face[best] - here, face[k] - here
            turn = np.array([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx])
            best = k if float((turn * normal).sum()) < 0.0 else best
        ordered.append(best)
        corners.remove(best)
    return [face[[ordered[0], ordered[k], ordered[k + 1]]] for k in range(1, len(face) - 1)]
