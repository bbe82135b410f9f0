"""The static part of a scene, ready for rays: one tree over all triangles, the height field, and shapes without triangles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from tussle.world.rays import kernels, touching
from tussle.world.rays.hits import MAX_RAY, Hits, checked_numbers, checked_vectors, new_rays
from tussle.world.rays.surfaces import HeightField, TriangleMesh
from tussle.world.shapes import FlatGround, Polyhedron, Sphere, Volume

PIECE, MIN_PIECE = 0.1, 1e-4
"""Half length of the pieces of a path that are not divided further: the larger of two lengths, in radii of the sphere and in metres.

Of what a sphere of radius r sweeps, spheres whose centres are 2 h apart leave out less than a depth of h^2 / (2 r).
"""
PARTS = (np.arange(8) - 3.5) / 4.0
"""Middles of the pieces into which a piece is divided, in half lengths of it. Halves would take three times as many passes."""
KINDS = ("nothing", "ground", "wall", "mesh", "entity")
"""Kinds of solids that rays hit, by number; hills are "ground", buildings "wall"."""
Split = Callable[[int, Callable[[int, int], Any]], Any]


def in_one_call(n: int, run: Callable[[int, int], Any]) -> None:
    """Call run(0, n); in place of a function that uses threads."""
    run(0, n)


class Solids:
    """Casts rays at the static part of a scene.

    A hit has a code: the number of a triangle, or `n_triangles` plus the number of a part without triangles.

    Args:
        parts: Meshes, height fields and shapes; a hit's `solid` is a number of this list.

    Attributes:
        kinds: Number in KINDS of each part, and of nothing at the end, (len(parts) + 1,).
        n_codes: Codes of entities begin here.
        top: Height of the highest point of all parts that end above [m]; at least 0.
    """

    def __init__(self, parts: Sequence[Volume | HeightField | TriangleMesh]) -> None:
        self.parts = tuple(parts)
        self.kinds = np.array([*map(_kind, self.parts), 0])
        corners, owner = [], []
        self._rest: list[int] = []
        for i, part in enumerate(self.parts):
            found = None if isinstance(part, HeightField) else part.triangles()
            if found is None:
                self._rest.append(i)
            else:
                corners.append(found)
                owner.append(np.full(len(found), i))
        triangles = np.concatenate([np.zeros((0, 3, 3)), *corners])
        self._owner = np.concatenate([np.zeros(0, np.int64), *owner])
        self.n_triangles = len(triangles)
        self.n_codes = self.n_triangles + len(self.parts)
        low, high = triangles.min(axis=1), triangles.max(axis=1)
        starts = np.array([0, self.n_triangles])
        bounds, links, roots, self._order = grow(
            np.concatenate([low, high], axis=1), starts, np.arange(self.n_triangles)
        )
        self._tree = bounds, links, roots
        self._normals = _normals(triangles)
        numbers = np.concatenate([triangles.reshape(-1, 9), self._normals], axis=1)
        self._items = np.ascontiguousarray(numbers[self._order])
        tops = [_top(self.parts[i]) for i in self._rest]
        self.top = max([0.0, float(triangles[:, :, 2].max(initial=0.0)), *tops])

    def first_hits(
        self,
        start: np.ndarray,
        way: np.ndarray,
        distance: np.ndarray,
        code: np.ndarray,
        split: Split = in_one_call,
    ) -> None:
        """Update distance [m] and code, (n,), of rays with unit directions. `split` calls a function for parts of the rows, in threads."""
        n = start.shape[1]
        if self.n_triangles:
            rays = start, way, np.zeros(n, np.int64), np.full(n, -1.0)
            split(
                n,
                lambda *part: kernels.cast(
                    (*self._tree, self._order), self._items, rays, (distance, code, 0.0), part
                ),
            )
        for i in self._rest:
            solid, own = self.parts[i], float(self.n_triangles + i)
            if isinstance(solid, HeightField):
                height, grid = solid.height, solid.grid
                split(
                    n,
                    lambda *part, h=height, g=grid, c=own: kernels.cast_field(
                        h, g, (start, way), (distance, code, c), part
                    ),
                )
            elif isinstance(solid, Volume):
                found = solid.ray(start, way)
                is_first = (found < distance) | ((found == distance) & (own < code))
                distance[is_first], code[is_first] = found[is_first], own

    def cast(self, origins: object, directions: object, max_range: object = np.inf) -> Hits:
        """The first hits of rays, see `Scene.cast`."""
        start, way, distance, code = new_rays(origins, directions, max_range)
        self.first_hits(start, way, distance, code)
        return self.hits(start, way, distance, code)

    def hits(self, start: np.ndarray, way: np.ndarray, distance: np.ndarray, code: np.ndarray) -> Hits:
        """Hits on the static part; those of other codes count as of nobody."""
        is_hit = code < np.inf
        solid = self.solid_of(code)
        return Hits(
            np.where(is_hit, distance, np.inf),
            np.zeros(len(code), np.int64),
            solid,
            start,
            way,
            self.normal,
            code,
            np.full(len(code), -1),
        )

    def solid_of(self, code: np.ndarray) -> np.ndarray:
        """Number of the part with each code, (n,); -1 for others."""
        solid = np.full(len(code), -1)
        rest = (code >= self.n_triangles) & (code < self.n_codes)
        solid[rest] = code[rest].astype(np.int64) - self.n_triangles
        is_triangle = code < self.n_triangles
        solid[is_triangle] = self._owner[code[is_triangle].astype(np.int64)]
        return solid

    def normal(self, hits: Hits) -> np.ndarray:
        """Unit normals at the hits on this part, (3, n); zero elsewhere."""
        normal = np.zeros(hits.origins.shape)
        rows = np.flatnonzero(hits.code < self.n_triangles)
        normal[:, rows] = self._normals[hits.code[rows].astype(np.int64)].T
        for i in self._rest:
            rows = np.flatnonzero(hits.code == self.n_triangles + i)
            if len(rows):
                normal[:, rows] = self.parts[i].outward(hits.points[:, rows])  # type: ignore[union-attr]
        return normal

    def touches(self, points: object, radius: object) -> np.ndarray:
        """Return whether spheres round points [m], (3, n), touch a part or lie inside one, (n,)."""
        center = checked_vectors("points", points)
        reach = np.minimum(checked_numbers("radius", radius, center.shape[1]), MAX_RAY)
        touches = np.zeros(center.shape[1], np.bool_)
        if self.n_triangles:
            touching.touch(self._tree, self._items, center, reach, touches)
        for part in self.parts:
            if isinstance(part, HeightField):
                touching.touch_field(part.height, part.grid, center, reach, touches)
            elif isinstance(part, Volume):
                touches |= part.contains(center) | part.touches(center, reach)
        return touches

    def touches_between(self, start: np.ndarray, end: np.ndarray, radius: object) -> np.ndarray:
        """Return whether spheres that move straight from `start` to `end` [m], (3, n), touch a part or lie inside one, (n,).

        A piece of a path is clear if the ball that encloses it is; otherwise it is divided. A path beyond the reach of rays is not clear.
        """
        size = np.minimum(checked_numbers("radius", radius, start.shape[1]), MAX_RAY)
        with np.errstate(over="ignore"):
            x, y, z = way = 0.5 * (end - start)
            half = np.sqrt(x * x + y * y + z * z)
            center = 0.5 * (start + end)
        is_sane = half <= MAX_RAY
        touches: np.ndarray = ~is_sane
        path = np.flatnonzero(is_sane)
        is_near = self.touches(center[:, path], size[path] + half[path])
        if any(
            isinstance(part, HeightField) for part in self.parts
        ):  # its lower side is inside, and may be far from the surface
            is_near |= self.touches(start[:, path], size[path]) | self.touches(end[:, path], size[path])
        path = path[is_near]
        ends = np.concatenate([start[:, path], end[:, path]], axis=1)
        touches[path] = self.touches(ends, np.tile(size[path], 2)).reshape(2, -1).any(axis=0)
        # A sphere smaller than the pieces may pass through a surface between two points.
        rays = new_rays(start[:, path], way[:, path], 2.0 * half[path])
        self.first_hits(*rays)
        touches[path] |= rays[3] < np.inf
        path, part = path[~touches[path]], 1.0
        place = np.zeros(
            len(path)
        )  # of the middle of a piece, from the middle of the path, in its half lengths
        while len(path):
            is_long = part * half[path] > np.maximum(PIECE * size[path], MIN_PIECE)
            reach = size[path] + np.where(is_long, part * half[path], 0.0)
            meets = self.touches(center[:, path] + place * way[:, path], reach)
            touches[path[meets & ~is_long]] = True
            divided = np.flatnonzero(meets & is_long)
            path, place = path[divided], place[divided]
            place = (place[:, None] + part * PARTS).ravel()
            path, part = np.repeat(path, len(PARTS)), part / len(PARTS)
        return touches


def _kind(part: Volume | HeightField | TriangleMesh) -> int:
    is_ground = isinstance(part, (FlatGround, HeightField))
    return KINDS.index("ground" if is_ground else "mesh" if isinstance(part, TriangleMesh) else "wall")


def _top(part: Volume | HeightField | TriangleMesh) -> float:
    """Height of the highest point of a part without triangles [m]; 0 for one without end."""
    if isinstance(part, HeightField):
        return float(part.height.max())
    if isinstance(part, FlatGround):
        return part.height
    if isinstance(part, Sphere):
        return part.center[2] + part.radius
    return max(z for _, _, z in part.points) if isinstance(part, Polyhedron) else 0.0


def grow(boxes: np.ndarray, starts: np.ndarray, order: np.ndarray) -> tuple[np.ndarray, ...]:
    """A tree for each world: bounds, links, roots, and the items in their order. See `kernels.build_tree`."""
    n = len(order)
    bounds, links = np.empty((2 * n, 6)), np.empty((2 * n, 2), np.int64)
    roots = np.empty(len(starts) - 1, np.int64)
    count = kernels.build_tree(np.ascontiguousarray(boxes), starts, order, (bounds, links, roots))
    return bounds[:count], links[:count], roots, order


def _normals(triangles: np.ndarray) -> np.ndarray:
    """Unit normals, (n, 3)."""
    (ax, ay, az), (bx, by, bz) = (triangles[:, k].T - triangles[:, 0].T for k in (1, 2))
    normal = np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
    length = np.sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2])
    return np.ascontiguousarray((normal / np.where(length > 0.0, length, 1.0)).T)
