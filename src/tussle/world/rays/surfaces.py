"""Surfaces of a scene: height fields and triangle meshes."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tussle.errors import ParameterError, listed, nearest_name
from tussle.numeric import rng
from tussle.numeric.arrays import unit

MAX_HEIGHTS = 4_000_000
MAX_FACES = 2_000_000
MAX_COORDINATE = 1e9
"""Largest coordinate of a surface [m]: positions there are still good to a micrometre."""
TECHNIQUES = ("RANDOM_WALK", "LINEAR", "LINEAR_WALK")


@dataclass(frozen=True, eq=False, repr=False)
class MeshPart:
    """A part of a mesh in its colours, for pictures; rays do not see it.

    Args:
        vertices: Corners [m], (n, 3), world frame.
        faces: Three corners of each triangle, by number, (m, 3).
        colours: Red, green, blue of each corner, (n, 3), uint8; those of the image are multiplied by them.
        uv: Place of each corner in the image, (n, 2), from its lower left corner to (1, 1) at its upper right one; None without an image.
        image: Red, green, blue, (height, width, 3), uint8, from its upper left corner; None for none.
    """

    vertices: np.ndarray
    faces: np.ndarray
    colours: np.ndarray
    uv: np.ndarray | None = None
    image: np.ndarray | None = None

    @classmethod
    def draped(cls, vertices: np.ndarray, faces: np.ndarray, image: np.ndarray) -> MeshPart:
        """A surface with an image laid over it from above, with the upper edge in the north."""
        low, high = vertices[:, :2].min(axis=0), vertices[:, :2].max(axis=0)
        uv = (vertices[:, :2] - low) / np.maximum(high - low, 1e-9)
        return cls(vertices, faces, np.full((len(vertices), 3), 255, np.uint8), uv, image)

    def corner_colours(self) -> np.ndarray:
        """Red, green, blue of each corner with those of the image there, (n, 3), 0 to 255."""
        if self.image is None or self.uv is None:
            return self.colours
        height, width = self.image.shape[:2]
        column, row = self.uv[:, 0] % 1.000001 * (width - 1), (1.0 - self.uv[:, 1]) % 1.000001 * (height - 1)
        found: np.ndarray = (
            self.image[np.rint(row).astype(int), np.rint(column).astype(int)] / 255.0 * self.colours
        )
        return found


@dataclass(frozen=True, eq=False, repr=False)
class HeightField:
    """Ground whose heights are given on a grid. Each cell has two triangles, divided from its south-western to its north-eastern corner.

    Args:
        height: z at the corners of the cells [m], (ny, nx), from south to north and from west to east.
        west: x of the first column [m].
        south: y of the first row [m].
        cell: Distance between columns and between rows [m].
        tag: Text and attributes of the mission's tag that it was read from; () for none.
        texture: Image that pictures show on it, red, green, blue, (height, width, 3), uint8, from its north-western corner; None for none.

    Raises:
        ParameterError: A value is not finite or too large, the cell is not positive, or there are fewer than 2 x 2 or more than
            4,000,000 heights.
    """

    height: Any
    west: float = 0.0
    south: float = 0.0
    cell: float = 1.0
    tag: tuple[tuple[str, str], ...] = ()
    texture: np.ndarray | None = None

    def __post_init__(self) -> None:
        height = np.ascontiguousarray(self.height, np.float64)
        if height.ndim != 2 or min(height.shape) < 2 or height.size > MAX_HEIGHTS:
            raise ParameterError(
                f"HeightField.height has shape {height.shape}; it takes (ny, nx) with 2 x 2 to {MAX_HEIGHTS:,} heights"
            )
        for name in ("west", "south", "cell"):
            object.__setattr__(self, name, float(getattr(self, name)))
        edges = [
            self.west,
            self.south,
            self.west + self.cell * height.shape[1],
            self.south + self.cell * height.shape[0],
        ]
        _check_coordinates("HeightField", np.array(edges))
        if not self.cell > 0.0:
            raise ParameterError(f"HeightField.cell = {self.cell!r} is not allowed; it takes a length > 0 m")
        _check_coordinates("HeightField.height", height)
        height.flags.writeable = False
        object.__setattr__(self, "height", height)

    @classmethod
    def generate(
        cls, length: tuple[float, float] = (500.0, 500.0), cell: float = 1.0, *, technique: str = "RANDOM_WALK", z_std: float = 1.0,
        center: tuple[float, float, float] = (0.0, 0.0, 0.0), seed: int = 0,
    ) -> HeightField:  # fmt: skip
        """Make random hills, the same for the same seed.

        Args:
            length: Extent along x and y [m].
            cell: Distance between heights [m].
            technique: "RANDOM_WALK": each height is the mean of its neighbours to the west, south and south-west plus a normal draw;
                "LINEAR": an inclined plane whose slopes along x and y are drawn once; "LINEAR_WALK": both added.
            z_std: Standard deviation of a draw [m], per cell.
            center: Centre of the field; its z is the mean height [m].
            seed: Seed of the draws.

        Raises:
            ParameterError: A value is not allowed.
        """
        if technique not in TECHNIQUES:
            raise ParameterError(
                f"technique = {technique!r} is not allowed{nearest_name(technique, TECHNIQUES)}; {listed(TECHNIQUES)}"
            )
        if not (0.0 < cell < np.inf and all(0.0 < side < np.inf for side in length)):
            raise ParameterError(
                f"length = {length!r} with cell = {cell!r} is not allowed; they take lengths > 0 m"
            )
        nx, ny = (max(2, round(side / cell) + 1) for side in length)
        if nx * ny > MAX_HEIGHTS:
            raise ParameterError(f"{nx:,} x {ny:,} heights are not allowed; at most {MAX_HEIGHTS:,} are")
        return cls(
            _hills((ny, nx), technique, z_std, seed) + center[2],
            center[0] - 0.5 * cell * (nx - 1),
            center[1] - 0.5 * cell * (ny - 1),
            cell,
        )

    def draped(self, image: np.ndarray) -> HeightField:
        """The field with an image over it, see `texture`."""
        return replace(self, texture=image)

    @property
    def grid(self) -> np.ndarray:
        """Numbers of the grid for kernels: west, south, width and depth of a cell, least and greatest height [m], (6,)."""
        return np.array([self.west, self.south, self.cell, self.cell, self.height.min(), self.height.max()])

    def triangles(self) -> np.ndarray:
        """Corners of the triangles [m], (n, 3, 3)."""
        ny, nx = self.height.shape
        x, y = np.meshgrid(self.west + self.cell * np.arange(nx), self.south + self.cell * np.arange(ny))
        points = np.stack([x, y, self.height], axis=-1)
        a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
        pairs = np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)], axis=2)
        return pairs.reshape(-1, 3, 3)

    def outward(self, pos: np.ndarray) -> np.ndarray:
        """Upward unit normals at points of the surface [m], (3, n)."""
        ny, nx = self.height.shape
        u, v = (pos[0] - self.west) / self.cell, (pos[1] - self.south) / self.cell
        i, j = np.clip(u.astype(np.int64), 0, nx - 2), np.clip(v.astype(np.int64), 0, ny - 2)
        h, is_above = self.height, v - j > u - i
        along = np.where(is_above, h[j + 1, i + 1] - h[j + 1, i], h[j, i + 1] - h[j, i])
        across = np.where(is_above, h[j + 1, i] - h[j, i], h[j + 1, i + 1] - h[j, i + 1])
        return unit(np.stack([-along, -across, np.full(len(i), self.cell)]))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, HeightField):
            return NotImplemented
        place, others = (self.west, self.south, self.cell), (other.west, other.south, other.cell)
        return place == others and np.array_equal(self.height, other.height)

    def __hash__(self) -> int:
        return hash((self.west, self.south, self.cell, self.height.shape))

    def __repr__(self) -> str:
        ny, nx = self.height.shape
        return f"HeightField({nx} x {ny}, west={self.west:g}, south={self.south:g}, cell={self.cell:g})"


@dataclass(frozen=True, eq=False, repr=False)
class TriangleMesh:
    """A surface of triangles, seen from both sides. Triangles without area are left out.

    Args:
        vertices: Corners [m], (n, 3), world frame.
        faces: Three corners of each triangle, by number, (m, 3).
        tag: Text and attributes of the mission's tag that it was read from; () for none.
        parts: The mesh in its own colours and textures, for pictures; () where it has none.

    Raises:
        ParameterError: A coordinate is not finite or too large, a corner does not exist, or there are no triangles, or more than 2,000,000.
    """

    vertices: Any
    faces: Any
    tag: tuple[tuple[str, str], ...] = ()
    parts: tuple[MeshPart, ...] = ()
    normals: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        vertices, faces = np.array(self.vertices, np.float64), np.array(self.faces)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3:
            raise ParameterError(
                f"TriangleMesh: vertices have shape {vertices.shape} and faces {faces.shape}; they take (n, 3) and (m, 3)"
            )
        if not 0 < len(faces) <= MAX_FACES:
            raise ParameterError(f"TriangleMesh has {len(faces):,} triangles; it takes 1 to {MAX_FACES:,}")
        if not np.issubdtype(faces.dtype, np.integer) or faces.min() < 0 or faces.max() >= len(vertices):
            raise ParameterError(
                f"TriangleMesh.faces refer to other than the {len(vertices):,} vertices; they take numbers from 0"
            )
        _check_coordinates("TriangleMesh.vertices", vertices)
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        normals = np.stack(_cross((b - a).T, (c - a).T), axis=1)
        length = np.sqrt(normals[:, 0] ** 2 + normals[:, 1] ** 2 + normals[:, 2] ** 2)
        has_area = length > 0.0
        if not has_area.any():
            raise ParameterError("TriangleMesh has no triangle with an area")
        found = {
            "vertices": vertices,
            "faces": faces[has_area].astype(np.int64),
            "normals": normals[has_area] / length[has_area, None],
        }
        for name, array in found.items():
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def draped(self, image: np.ndarray) -> TriangleMesh:
        """The mesh with an image laid over it from above, with the upper edge in the north."""
        part = MeshPart.draped(self.vertices, self.faces, image)
        return TriangleMesh(self.vertices, self.faces, self.tag, (part,))

    def triangles(self) -> np.ndarray:
        """Corners of the triangles [m], (m, 3, 3)."""
        corners: np.ndarray = self.vertices[self.faces]
        return corners

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, TriangleMesh):
            return NotImplemented
        return np.array_equal(self.vertices, other.vertices) and np.array_equal(self.faces, other.faces)

    def __hash__(self) -> int:
        return hash((self.vertices.shape, self.faces.shape))

    def __repr__(self) -> str:
        return f"TriangleMesh({len(self.vertices)} vertices, {len(self.faces)} faces)"


def _check_coordinates(name: str, values: np.ndarray) -> None:
    wrong = ~(np.abs(values) <= MAX_COORDINATE)
    if wrong.any():
        raise ParameterError(
            f"{name} has the coordinate {values[wrong].flat[0]:g}; coordinates are numbers within +-{MAX_COORDINATE:g} m"
        )


def _cross(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _hills(shape: tuple[int, int], technique: str, z_std: float, seed: int) -> np.ndarray:
    """Heights with mean 0 [m], (ny, nx)."""
    ny, nx = shape
    rows, columns = np.arange(ny), np.arange(nx)
    height = np.zeros(shape)
    if technique != "RANDOM_WALK":
        slope = _normal(seed, "slope", 2)
        height += z_std * (slope[0] * columns + slope[1] * rows[:, None])
    if technique != "LINEAR":
        walk = np.zeros((ny + 1, nx + 1))
        draws = z_std * _normal(seed, "walk", ny * nx).reshape(shape)
        # Anti-diagonals: the cells of one depend only on the two before it.
        for k in range(ny + nx - 1):
            j = np.arange(max(0, k - nx + 1), min(ny, k + 1))
            i = k - j
            south = np.where(j > 0, walk[j, i + 1], walk[j + 1, i])
            west = np.where(i > 0, walk[j + 1, i], south)
            corner = np.where((i > 0) & (j > 0), walk[j, i], south)
            walk[j + 1, i + 1] = (west + south + corner) / 3.0 + draws[j, i]
        height += walk[1:, 1:]
    return height - math.fsum(height.ravel()) / height.size  # exact, so the same on every machine


def _normal(seed: int, label: str, n: int) -> np.ndarray:
    """Standard normal draws, (n,)."""
    key = np.full(n, seed % 2**64, np.uint64)
    stream = rng.stream_key("HeightField", label)
    return np.asarray(rng.normal(key, stream, np.arange(n), np.zeros(n, np.int64), 0, 1)[0])
