"""Static convex shapes (ground, walls, regions): containment of points and intersection with rays.

A flat ground, a plane, a cuboid and a polyhedron are intersections of half-spaces, so one containment test and one ray test
serve them all. Positions are (3, n) in the world frame (East, North, Up) [m]. Only + - * /, square roots, comparisons and
`tussle.numeric` are applied to arrays: results are bit-identical on every machine.
"""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tussle.errors import ParameterError
from tussle.numeric import cos, sin, volumes

Vector = Sequence[float]
Matrix = tuple[Vector, Vector, Vector]
IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
MAX_POINTS = 32
"""Maximum number of points of a polyhedron: faces are searched among all triples of points, 4,960 for 32."""


class Volume(ABC):
    """A region of space; abstract. Its surface counts as outside."""

    @abstractmethod
    def contains(self, pos: np.ndarray) -> np.ndarray:
        """Return True if positions [m], (3, n), lie inside, (n,); NaN counts as outside."""

    @abstractmethod
    def inward(self, pos: np.ndarray) -> np.ndarray:
        """Directions of any length, (3, n), that lead positions [m], (3, n), from outside to the inside."""

    @abstractmethod
    def ray(self, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """Distance along rays to the first point of the surface, hit from outside or from inside.

        Args:
            origin: Starts of the rays [m], (3, n).
            direction: Directions of any length, (3, n); a zero vector hits nothing.

        Returns:
            Distance [m], (n,); inf where the ray hits nothing.
        """

    def triangles(self) -> np.ndarray | None:
        """Corners of triangles that make up the surface [m], (m, 3, 3); None for a shape whose `ray` is called instead."""
        return None

    def outward(self, pos: np.ndarray) -> np.ndarray:
        """Outward unit normals at points of the surface [m], (3, n)."""
        return -_unit(self.inward(pos))

    def crossed(self, a: np.ndarray, b: np.ndarray, among: np.ndarray | None = None) -> np.ndarray:
        """Return True if a point of the straight way from a to b [m], (3, n) each, lies inside, (n,); of those `among` all."""
        found: np.ndarray
        if among is not None:
            rows, found = np.flatnonzero(among), np.zeros(len(among), np.bool_)
            found[rows] = self.crossed(a[:, rows], b[:, rows])
            return found
        found = np.asarray(self.contains(a) | self.contains(b))
        rest = np.flatnonzero(~found & (a != b).any(axis=0))
        if len(rest):
            with np.errstate(over="ignore", invalid="ignore"):
                x, y, z = way = b[:, rest] - a[:, rest]
                # Between the first surface from a and that from b; a way that only ends at the surface has no length there.
                outside = self.ray(a[:, rest], way) + self.ray(b[:, rest], -way)
                found[rest] = outside < (1.0 - 1e-9) * np.sqrt(x * x + y * y + z * z)
        return found

    def touches(self, center: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Return True if spheres with centres outside [m], (3, n), and radii [m], (n,), reach the inside, (n,)."""
        return self.contains(center + radius * _unit(self.inward(center)))


class Convex(Volume):
    """An intersection of half-spaces; abstract."""

    @abstractmethod
    def half_spaces(self) -> tuple[tuple[Vector, float], ...]:
        """Outward unit normal m and offset d [m] of each face: inside is where m . pos < d."""

    @cached_property
    def _faces(self) -> tuple[tuple[Vector, float], ...]:
        return self.half_spaces()

    @cached_property
    def _face_columns(self) -> np.ndarray:
        """Components of the normals and offset of each face, (4, faces)."""
        return np.array([(*normal, offset) for normal, offset in self._faces]).T.copy()

    def contains(self, pos: np.ndarray) -> np.ndarray:
        return _applied(volumes.contained, (self._face_columns,), pos)

    def crossed(self, a: np.ndarray, b: np.ndarray, among: np.ndarray | None = None) -> np.ndarray:
        return _applied(volumes.crossed, (self._face_columns,), a, b, among=among)

    def inward(self, pos: np.ndarray) -> np.ndarray:
        """Opposite to the normals of the faces that a position lies beyond."""
        way = np.zeros(np.shape(pos))
        for normal, offset in self._faces:
            way -= np.array(normal)[:, None] * (_along(normal, pos) >= offset)
        return way

    def outward(self, pos: np.ndarray) -> np.ndarray:
        """Outward normals of the faces whose planes are nearest."""
        east, north, up, offset = self._face_columns[:, :, None]
        face = (east * pos[0] + north * pos[1] + up * pos[2] - offset).argmax(axis=0)
        return np.asarray(self._face_columns[:3, face])

    def ray(self, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
        # T. L. Kay and J. T. Kajiya, Ray tracing complex scenes, SIGGRAPH 1986: a line is inside between its last entry through
        # a face and its first exit.
        direction, enter = _unit(direction), np.full(np.shape(origin)[1:], -np.inf)
        leave = np.full(np.shape(origin)[1:], np.inf)
        missed = np.zeros(np.shape(origin)[1:], np.bool_)
        for normal, offset in self._faces:
            depth, rate = offset - _along(normal, origin), _along(normal, direction)
            crossing = depth / np.where(rate == 0.0, 1.0, rate)
            enter = np.where(rate < 0.0, np.maximum(enter, crossing), enter)
            leave = np.where(rate > 0.0, np.minimum(leave, crossing), leave)
            missed |= ~((rate != 0.0) | (depth > 0.0))
        first = np.where(enter >= 0.0, enter, leave)
        return np.where(~missed & (enter <= leave) & (first >= 0.0), first, np.inf)


@dataclass(frozen=True)
class FlatGround(Convex):
    """Ground at one height; it contains all space below.

    Args:
        height: z of its surface [m].

    Raises:
        ParameterError: The height is not a finite number.
    """

    height: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "height", checked_number(self, "height"))

    def half_spaces(self) -> tuple[tuple[Vector, float], ...]:
        return (((0.0, 0.0, 1.0), self.height),)


@dataclass(frozen=True)
class Plane(Convex):
    """All space behind a plane.

    Args:
        point: A point of the plane [m], (3,), world frame.
        normal: Outward normal, any length, (3,), world frame.

    Raises:
        ParameterError: A value is not finite, or the normal is zero.
    """

    point: Vector
    normal: Vector

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", checked_vector(self, "point"))
        object.__setattr__(self, "normal", checked_vector(self, "normal"))
        if not _length(self.normal) > 0.0:
            raise ParameterError(
                f"Plane.normal = {self.normal!r} is not allowed; it takes a vector with a direction"
            )

    def half_spaces(self) -> tuple[tuple[Vector, float], ...]:
        length = _length(self.normal)
        x, y, z = (c / length for c in self.normal)
        return (((x, y, z), _dot((x, y, z), self.point)),)


@dataclass(frozen=True)
class Cuboid(Convex):
    """A box, rotated by roll, pitch and yaw.

    Args:
        center: Its centre [m], (3,), world frame.
        lengths: Lengths of its edges along its own x, y, z [m], (3,).
        rpy: Roll, pitch, yaw from world to box [rad], (3,); positive pitch turns its x axis down.

    Raises:
        ParameterError: A value is not finite, or a length is not positive.
    """

    center: Vector = (0.0, 0.0, 0.0)
    lengths: Vector = (10.0, 10.0, 10.0)
    rpy: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("center", "lengths", "rpy"):
            object.__setattr__(self, name, checked_vector(self, name))
        if not min(self.lengths) > 0.0:
            raise ParameterError(
                f"Cuboid.lengths = {self.lengths!r} is not allowed; it takes three lengths in m > 0"
            )

    def half_spaces(self) -> tuple[tuple[Vector, float], ...]:
        faces = []
        for axis, length in zip(_axes(self.rpy), self.lengths, strict=True):
            middle = _dot(axis, self.center)
            back = (-axis[0], -axis[1], -axis[2])
            faces += [(axis, middle + 0.5 * length), (back, 0.5 * length - middle)]
        return tuple(faces)

    def inward(self, pos: np.ndarray) -> np.ndarray:
        """Towards the centre."""
        way: np.ndarray = np.array(self.center)[:, None] - pos
        return way

    def triangles(self) -> np.ndarray:
        halves = [
            0.5 * length * np.array(axis) for length, axis in zip(self.lengths, _axes(self.rpy), strict=True)
        ]
        # Each corner is computed once, so that faces meet without gaps: corner 4 i + 2 j + k is at the ends i, j, k of the axes.
        signs = list(itertools.product((-1.0, 1.0), repeat=3))
        corners = np.array(
            [np.array(self.center) + i * halves[0] + j * halves[1] + k * halves[2] for i, j, k in signs]
        )
        squares = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
        return corners[[three for a, b, c, d in squares for three in ((a, b, c), (a, c, d))]]


@dataclass(frozen=True)
class Polyhedron(Convex):
    """The convex hull of points.

    Args:
        points: 4 to 32 corners [m], each (3,), world frame, in any order. Points inside the hull have no effect.

    Raises:
        ParameterError: A value is not finite, there are too few or too many points, or all lie in one plane.
    """

    points: Sequence[Vector]

    def __post_init__(self) -> None:
        points = tuple(_as_vector(p, f"Polyhedron.points[{i}]") for i, p in enumerate(self.points))
        object.__setattr__(self, "points", points)
        if not 4 <= len(points) <= MAX_POINTS:
            raise ParameterError(f"Polyhedron.points has {len(points)} points; it takes 4 to {MAX_POINTS}")
        if len(self._faces) < 4:
            raise ParameterError(
                f"Polyhedron.points = {points!r} is not allowed; all of them lie in one plane"
            )

    def half_spaces(self) -> tuple[tuple[Vector, float], ...]:
        x, y, z = corners = np.array(self.points).T
        # A corner counts as lying in a face within the rounding error of the sums of products below: about ten operations on
        # numbers as large as `scale`. Thinner slivers get no face.
        scale = float(np.abs(corners).max() + np.abs(corners - corners[:, :1]).max())
        thickness = 64.0 * float(np.finfo(np.float64).eps) * scale
        faces: list[tuple[Vector, float]] = []
        corners_of_faces: list[set[int]] = []
        for i, j, k in itertools.combinations(range(len(self.points)), 3):
            if any({i, j, k} <= known for known in corners_of_faces):
                continue
            ux, uy, uz = float(x[j] - x[i]), float(y[j] - y[i]), float(z[j] - z[i])
            vx, vy, vz = float(x[k] - x[i]), float(y[k] - y[i]), float(z[k] - z[i])
            cross = (uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)
            length = _length(cross)
            if length <= thickness * scale:
                continue
            normal = (cross[0] / length, cross[1] / length, cross[2] / length)
            height = _along(normal, corners - corners[:, i : i + 1])
            above, below = bool(height.max() > thickness), bool(height.min() < -thickness)
            if above and below:
                continue
            if above:
                normal = (-normal[0], -normal[1], -normal[2])
            elif not below:
                return ()
            faces.append((normal, float(_along(normal, corners).max())))
            corners_of_faces.append(set(np.flatnonzero(np.abs(height) <= thickness).tolist()))
        return tuple(faces)


@dataclass(frozen=True)
class Sphere(Volume):
    """A sphere.

    Args:
        center: Its centre [m], (3,), world frame.
        radius: Its radius [m].

    Raises:
        ParameterError: A value is not finite, or the radius is not positive.
    """

    center: Vector = (0.0, 0.0, 0.0)
    radius: float = 10.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", checked_vector(self, "center"))
        object.__setattr__(self, "radius", checked_number(self, "radius", above=0.0))

    def contains(self, pos: np.ndarray) -> np.ndarray:
        return _applied(volumes.sphere_contained, (self.center, self.radius), pos)

    def crossed(self, a: np.ndarray, b: np.ndarray, among: np.ndarray | None = None) -> np.ndarray:
        return _applied(volumes.sphere_crossed, (self.center, self.radius), a, b, among=among)

    def inward(self, pos: np.ndarray) -> np.ndarray:
        """Towards the centre."""
        way: np.ndarray = np.array(self.center)[:, None] - pos
        return way

    def touches(self, center: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Return True if spheres with centres outside [m], (3, n), and radii [m], (n,), reach the inside, (n,)."""
        x, y, z = self.inward(center)
        reached: np.ndarray = np.sqrt(x * x + y * y + z * z) < self.radius + radius
        return reached

    def ray(self, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
        direction = _unit(direction)
        x, y, z = (c - p for p, c in zip(origin, self.center, strict=True))
        nearest = x * direction[0] + y * direction[1] + z * direction[2]
        # Uses the ray's closest point; the discriminant of the quadratic formula would cancel for a far, small sphere.
        dx, dy, dz = x - nearest * direction[0], y - nearest * direction[1], z - nearest * direction[2]
        inward = (self.radius - np.sqrt(dx * dx + dy * dy + dz * dz)) * (
            self.radius + np.sqrt(dx * dx + dy * dy + dz * dz)
        )
        half = np.sqrt(np.maximum(inward, 0.0))
        first = np.where(nearest - half >= 0.0, nearest - half, nearest + half)
        moving = direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2] > 0.0
        return np.where(moving & (inward >= 0.0) & (first >= 0.0), first, np.inf)


def _applied(
    law: Callable[..., None], shape: tuple[Any, ...], *points: np.ndarray, among: np.ndarray | None = None
) -> np.ndarray:
    """What a kernel of a shape says of points or ways, (3, n) each: (n,); false for others than those `among` them."""
    flat = [np.ascontiguousarray(np.reshape(pos, (3, -1)), float) for pos in points]
    out = np.ones(flat[0].shape[1], np.bool_) if among is None else np.array(among, np.bool_)
    law(*shape, *flat, out)
    return out.reshape(np.shape(points[0])[1:])


def checked_number(owner: object, name: str, above: float = -math.inf) -> float:
    """An attribute as a float.

    Raises:
        ParameterError: It is not finite, or not above the bound.
    """
    value = float(getattr(owner, name))
    if not (math.isfinite(value) and value > above):
        bound = f" > {above:g}" if math.isfinite(above) else ""
        raise ParameterError(
            f"{type(owner).__name__}.{name} = {value!r} is not allowed; it takes a finite number{bound}"
        )
    return value


def checked_vector(owner: object, name: str) -> Vector:
    """An attribute as three floats.

    Raises:
        ParameterError: They are not three finite numbers.
    """
    return _as_vector(getattr(owner, name), f"{type(owner).__name__}.{name}")


def _as_vector(value: Iterable[float], place: str) -> Vector:
    numbers = tuple(float(v) for v in value)
    if len(numbers) != 3 or not all(math.isfinite(v) for v in numbers):
        raise ParameterError(f"{place} = {value!r} is not allowed; it takes three finite numbers")
    return numbers


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _length(a: Vector) -> float:
    return math.sqrt(_dot(a, a))


def _along(normal: Vector, pos: np.ndarray) -> np.ndarray:
    """Component of positions (3, n) along a normal, (n,)."""
    component: np.ndarray = normal[0] * pos[0] + normal[1] * pos[1] + normal[2] * pos[2]
    return component


def _unit(direction: np.ndarray) -> np.ndarray:
    """Directions (3, n) scaled to unit length; zero stays zero."""
    x, y, z = direction
    length = np.sqrt(x * x + y * y + z * z)
    scaled: np.ndarray = direction / np.where(length > 0.0, length, 1.0)
    return scaled


def _axes(rpy: Vector) -> Matrix:
    """The rotated x, y and z axes in the world frame: columns of Rz(yaw) Ry(pitch) Rx(roll)."""
    if rpy == (0.0, 0.0, 0.0):
        return IDENTITY
    (sr, cr), (sp, cp), (sy, cy) = ((float(sin(a)), float(cos(a))) for a in rpy)
    return (
        (cy * cp, sy * cp, -sp),
        (cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr),
        (cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr),
    )
