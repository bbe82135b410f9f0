"""Surfaces and edges of shapes of a scene."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tussle.view.shapes import Mesh, ball
from tussle.world.rays.surfaces import MeshPart
from tussle.world.scene import Convex, FlatGround, HeightField, Plane, Prism, Sphere, TriangleMesh, Volume

MAX_FACES = 100_000
"""Triangles of a mesh that are drawn."""
N_CIRCLE = 48
"""Lines of each circle that outlines a sphere."""


def mesh_of(shape: Volume | TriangleMesh, low: np.ndarray, high: np.ndarray) -> Mesh:
    """The surface of a shape.

    Args:
        shape: The shape.
        low: Lower corner of the visible box [m], (3,), to which infinite shapes are cut.
        high: Upper corner [m], (3,).
    """
    if isinstance(shape, TriangleMesh):
        return Mesh(shape.vertices, shape.faces[:MAX_FACES])
    if isinstance(shape, Sphere):
        return ball(3).placed(2.0 * shape.radius, shape.center)
    rings = _rings(shape, low, high)
    return _polygons([*rings, *shape.ends()] if isinstance(shape, Prism) else rings)


def outline_of(shape: Volume | TriangleMesh, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Edges of a shape, or three circles of a sphere: ends of lines [m], (k, 2, 3), float32."""
    if isinstance(shape, TriangleMesh):
        return np.zeros((0, 2, 3), np.float32)
    if isinstance(shape, Sphere):
        angle = 2.0 * np.pi * np.arange(N_CIRCLE + 1) / N_CIRCLE
        wave = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], 1) * shape.radius
        circles = [np.roll(wave, shift, axis=1) + shape.center for shift in range(3)]
        return np.concatenate([_lines(c) for c in circles]).astype(np.float32)
    sides = [_lines(np.concatenate([r, r[:1]])) for r in _rings(shape, low, high)]
    lines = np.concatenate([np.zeros((0, 2, 3)), *sides])
    # Each edge belongs to two faces; both copies get the same direction, and one is kept.
    rounded = lines.astype(np.float32)
    backward = [tuple(a) > tuple(b) for a, b in rounded.tolist()]
    rounded[backward] = rounded[backward][:, ::-1]
    return np.unique(rounded, axis=0)


def _lines(points: np.ndarray) -> np.ndarray:
    """Lines from each point (k, 3) to the next, (k - 1, 2, 3)."""
    return np.stack([points[:-1], points[1:]], axis=1)


def _rings(shape: Volume, low: np.ndarray, high: np.ndarray) -> list[np.ndarray]:
    """Corners of each flat face, counter-clockwise seen from outside, each (k, 3)."""
    if isinstance(shape, FlatGround):
        shape = Plane((0.0, 0.0, shape.height), (0.0, 0.0, 1.0))
    if isinstance(shape, Plane):
        return [_square(shape, low, high)]
    if isinstance(shape, Prism):
        return _walls(shape)
    if not isinstance(shape, Convex):
        return []
    faces = shape.half_spaces()
    normals = np.array([normal for normal, _ in faces])
    offsets = np.array([offset for _, offset in faces])
    if len(faces) < 4:
        return []
    corners = _corners(normals, offsets)
    rings = []
    slack = 1e-9 * (1.0 + float(np.abs(corners).max(initial=0.0)))
    for normal, offset in zip(normals, offsets, strict=True):
        own = corners[np.abs(corners @ normal - offset) <= slack]
        first, second = _axes_in(normal)
        about = own - own.mean(axis=0)
        rings.append(own[np.argsort(np.arctan2(about @ second, about @ first))])
    return rings


def _walls(prism: Prism) -> list[np.ndarray]:
    """Corners of the vertical faces of a prism, each (4, 3)."""
    first = np.array(prism.corners)
    second = np.roll(first, -1, axis=0)
    x, y = first.T
    if (x * second[:, 1] - y * second[:, 0]).sum() < 0.0:  # clockwise seen from above
        first, second = second, first
    heights = (prism.low, prism.low, prism.high, prism.high)
    return [
        np.array([(*p, z) for p, z in zip((a, b, b, a), heights, strict=True)])
        for a, b in zip(first, second, strict=True)
    ]


def _corners(normals: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Corners of a bounded intersection of half-spaces, (k, 3)."""
    found: list[np.ndarray] = []
    slack = 1e-9 * (1.0 + float(np.abs(offsets).max()))
    for three in combinations(range(len(offsets)), 3):
        matrix = normals[list(three)]
        if abs(np.linalg.det(matrix)) < 1e-9:
            continue
        point = np.linalg.solve(matrix, offsets[list(three)])
        if (normals @ point <= offsets + slack).all() and not any(
            np.abs(point - known).max() <= slack for known in found
        ):
            found.append(point)
    return np.array(found).reshape(-1, 3)


def _axes_in(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two axes in a plane that are right-handed with its normal."""
    helper = np.eye(3)[np.argmin(np.abs(normal))]
    first = np.cross(helper, normal)
    first /= np.linalg.norm(first)
    return first, np.cross(normal, first)


def _square(plane: Plane, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """A square of a plane near the middle of the visible box, and as wide."""
    normal = np.array(plane.normal) / np.linalg.norm(plane.normal)
    middle = 0.5 * (np.asarray(low) + high)
    center = middle - ((middle - plane.point) @ normal) * normal
    first, second = _axes_in(normal)
    half = 0.5 * max(float(np.linalg.norm(np.asarray(high) - low)), 1.0)
    return np.array(
        [center + half * (a * first + b * second) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    )


def _polygons(rings: list[np.ndarray]) -> Mesh:
    """Convex polygons as triangles that share no corners, so that edges are sharp."""
    vertices, faces, n = [np.zeros((0, 3))], [np.zeros((0, 3), int)], 0
    for ring in rings:
        i = np.arange(1, len(ring) - 1)
        vertices.append(ring)
        faces.append(np.stack([np.zeros_like(i), i, i + 1], 1) + n)
        n += len(ring)
    return Mesh(np.concatenate(vertices), np.concatenate(faces))


MAX_DRAWN = 40_000
"""Largest number of heights that are drawn: 80,000 triangles."""


@dataclass(frozen=True, eq=False)
class Terrain:
    """Heights of the ground on a grid.

    Attributes:
        x: East of the columns [m], (nx,), ascending.
        y: North of the rows [m], (ny,), ascending.
        height: z of the ground [m], (ny, nx).
        texture: Image over it, red, green, blue, (h, w, 3), uint8, from its north-western corner; None for none.
    """

    x: np.ndarray
    y: np.ndarray
    height: np.ndarray
    texture: np.ndarray | None = None

    @classmethod
    def of(cls, field: HeightField) -> Terrain:
        """The terrain of a height field."""
        ny, nx = field.height.shape
        x, y = field.west + field.cell * np.arange(nx), field.south + field.cell * np.arange(ny)
        return cls(x, y, field.height, field.texture)

    def thinned(self, most: int = MAX_DRAWN) -> Terrain:
        """Every k-th column and row, with the least k that leaves at most this number of heights."""
        stride = 1
        while len(self.x[::stride]) * len(self.y[::stride]) > most:
            stride += 1
        return Terrain(self.x[::stride], self.y[::stride], self.height[::stride, ::stride], self.texture)

    def mesh(self, most: int = MAX_DRAWN) -> Mesh:
        """Two triangles between each four neighbours, of at most this number of heights."""
        thin = self.thinned(most)
        nx, ny = len(thin.x), len(thin.y)
        east, north = np.meshgrid(thin.x, thin.y)
        corner = (np.arange(ny - 1)[:, None] * nx + np.arange(nx - 1)).ravel()
        below = np.stack([corner, corner + 1, corner + nx + 1], 1)
        above = np.stack([corner, corner + nx + 1, corner + nx], 1)
        vertices = np.stack([east.ravel(), north.ravel(), thin.height.ravel()], 1)
        return Mesh(vertices, np.concatenate([below, above]))

    def part(self, most: int = MAX_DRAWN) -> MeshPart | None:
        """The surface with its image, of at most this number of heights; None without an image."""
        if self.texture is None:
            return None
        mesh = self.mesh(most)
        return MeshPart.draped(mesh.vertices, mesh.faces, self.texture)
