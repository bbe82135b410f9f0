"""A vertical prism over any simple polygon, such as a no-fly zone on a map."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tussle.errors import ParameterError
from tussle.numeric import total
from tussle.world.shapes import Volume, checked_number

MIN_CORNERS, MAX_CORNERS = 3, 1000


@dataclass(frozen=True)
class Prism(Volume):
    """All points above and below a polygon, between two heights. The polygon may be concave; its sides must not cross.

    A point of a vertical side is inside if the polygon is east of it.

    Args:
        corners: 3 to 1000 corners of the polygon [m], each (2,), world frame, in order; the last is joined to the first.
        low: z of the lower end [m].
        high: z of the upper end [m].

    Raises:
        ParameterError: A value is not finite, the count of corners is out of bounds, all lie on one line, or low is not below high.
    """

    corners: Sequence[Sequence[float]]
    low: float = 0.0
    high: float = 100.0

    def __post_init__(self) -> None:
        corners = tuple((float(x), float(y)) for x, y in self.corners)
        object.__setattr__(self, "corners", corners)
        if not MIN_CORNERS <= len(corners) <= MAX_CORNERS:
            raise ParameterError(
                f"Prism.corners has {len(corners)} corners; it takes {MIN_CORNERS} to {MAX_CORNERS}"
            )
        if not all(math.isfinite(value) for corner in corners for value in corner):
            raise ParameterError(f"Prism.corners = {corners!r} is not allowed; it takes finite numbers")
        offset = np.array(corners).T - np.array(corners[0])[:, None]
        farthest = offset[:, np.argmax((offset * offset).sum(axis=0))]
        across = np.abs(offset[0] * farthest[1] - offset[1] * farthest[0]).max()
        # Rounding errors of these products, as for `Polyhedron`.
        if across <= 64.0 * np.finfo(np.float64).eps * np.abs(corners).max() * np.abs(farthest).max():
            raise ParameterError(f"Prism.corners = {corners!r} is not allowed; all of them lie on one line")
        object.__setattr__(self, "low", checked_number(self, "low"))
        object.__setattr__(self, "high", checked_number(self, "high", above=self.low))

    @cached_property
    def _sides(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """First corner of each side and offset to the second: x, y, dx, dy, each (sides, 1) [m]."""
        first = np.array(self.corners).T[:, :, None]
        x, y = first
        dx, dy = np.roll(first, -1, axis=1) - first
        return x, y, dx, dy

    def contains(self, pos: np.ndarray) -> np.ndarray:
        inside: np.ndarray = self._over(pos[0], pos[1]) & (pos[2] > self.low) & (pos[2] < self.high)
        return inside

    def _over(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return True if points, (n,) each, lie over the polygon: a ray to the East crosses an odd number of sides."""
        east, north, dx, dy = self._sides
        crosses = (north > y) != (north + dy > y)
        at = east + (y - north) * dx / np.where(dy == 0.0, 1.0, dy)
        over: np.ndarray = np.logical_xor.reduce(crosses & (x < at), axis=0)
        return over

    def inward(self, pos: np.ndarray) -> np.ndarray:
        """Towards the nearest point of the prism."""
        x, y, z = pos
        east, north, dx, dy = self._sides
        length = dx * dx + dy * dy
        along = ((x - east) * dx + (y - north) * dy) / np.where(length > 0.0, length, 1.0)
        along = np.minimum(np.maximum(along, 0.0), 1.0)
        way_x, way_y = east + along * dx - x, north + along * dy - y
        nearest = (way_x * way_x + way_y * way_y).argmin(axis=0)
        column = np.arange(len(nearest))
        is_over = self._over(x, y)
        level = [np.where(is_over, 0.0, way[nearest, column]) for way in (way_x, way_y)]
        return np.array([*level, np.minimum(np.maximum(z, self.low), self.high) - z])

    def ray(self, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
        x, y, z = origin
        length = np.sqrt(
            direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]
        )
        ux, uy, uz = direction / np.where(length > 0.0, length, 1.0)
        east, north, dx, dy = self._sides
        # Side: (x, y) + t u = (east, north) + s d, solved by Cramer's rule.
        area = dx * uy - dy * ux
        divisor = np.where(area == 0.0, 1.0, area)
        t = (dx * (north - y) - dy * (east - x)) / divisor
        s = (ux * (north - y) - uy * (east - x)) / divisor
        height = z + t * uz
        is_hit = (
            (area != 0.0) & (t >= 0.0) & (s >= 0.0) & (s < 1.0) & (height >= self.low) & (height <= self.high)
        )
        distance: np.ndarray = np.where(is_hit, t, np.inf).min(axis=0)
        for end in (self.low, self.high):
            t = (end - z) / np.where(uz == 0.0, 1.0, uz)
            is_hit = (uz != 0.0) & (t >= 0.0) & self._over(x + t * ux, y + t * uy)
            distance = np.minimum(distance, np.where(is_hit, t, np.inf))
        return distance

    def ends(self) -> list[np.ndarray]:
        """Triangles of the roof and of the floor [m], (3, 3) each, counter-clockwise seen from outside."""
        found = []
        for three in _ears(self.corners):
            for corners, z in ((three, self.high), (three[::-1], self.low)):
                found.append(np.array([(*corner, z) for corner in corners]))
        return found

    def triangles(self) -> np.ndarray:
        found: list[tuple[tuple[float, ...], ...]] = []
        for i, (x, y) in enumerate(self.corners):
            u, v = self.corners[i - 1]
            a, b, c, d = (u, v, self.low), (x, y, self.low), (x, y, self.high), (u, v, self.high)
            found += [(a, b, c), (a, c, d)]
        for three in _ears(self.corners):
            found += [tuple((*corner, z) for corner in three) for z in (self.low, self.high)]
        return np.array(found)


Corner = Sequence[float]


def _turn(a: Corner, b: Corner, c: Corner) -> float:
    """Twice the area of a triangle, positive if it is counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _ears(corners: Sequence[Corner]) -> list[tuple[Corner, Corner, Corner]]:
    """Divide a simple polygon into triangles by cutting off corners in which no other corner lies.

    G. H. Meisters, Polygons have ears, The American Mathematical Monthly 82 (1975).
    """
    left = list(corners)
    if total(_turn((0.0, 0.0), a, b) for a, b in zip(left, left[1:] + left[:1], strict=True)) < 0.0:
        left.reverse()
    found = []
    while len(left) > 3:
        for i in range(len(left)):
            a, b, c = left[i - 1], left[i], left[(i + 1) % len(left)]
            if _turn(a, b, c) > 0.0 and not any(
                _turn(a, b, p) >= 0.0 and _turn(b, c, p) >= 0.0 and _turn(c, a, p) >= 0.0
                for p in left
                if p not in (a, b, c)
            ):
                found.append((a, b, c))
                break
        else:
            i = min(
                range(len(left)), key=lambda k: abs(_turn(left[k - 1], left[k], left[(k + 1) % len(left)]))
            )
            # Corners on a line, or sides that cross: the flattest corner is dropped.
        del left[i]
    return [*found, (left[0], left[1], left[2])]
