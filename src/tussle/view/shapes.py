"""Meshes, and the models of entities."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from tussle.arguments import explained


@explained
@dataclass(frozen=True, eq=False)
class Mesh:
    """A closed surface of triangles.

    Attributes:
        vertices: Corners [m], (V, 3), float32; of a model, nose along +x and up along +z, about 1 m long.
        faces: Corners of each triangle, counter-clockwise seen from outside, (F, 3), int32.
    """

    vertices: np.ndarray
    faces: np.ndarray

    def __post_init__(self) -> None:
        for name, kind in (("vertices", np.float32), ("faces", np.int32)):
            array = np.ascontiguousarray(getattr(self, name), kind)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def placed(self, scale: float | Sequence[float] = 1.0, at: Sequence[float] = (0.0, 0.0, 0.0)) -> Mesh:
        """The mesh scaled by a factor > 0, one or one per axis, and moved [m]."""
        return Mesh(self.vertices * np.asarray(scale, float) + np.asarray(at, float), self.faces)


def joined(parts: Iterable[Mesh]) -> Mesh:
    """Several meshes as one."""
    vertices, faces, n = [], [], 0
    for part in parts:
        vertices.append(part.vertices)
        faces.append(part.faces + n)
        n += len(part.vertices)
    return Mesh(np.concatenate(vertices), np.concatenate(faces))


def lofted(rings: Sequence[np.ndarray]) -> Mesh:
    """A surface over rings of corners, closed by flat ends.

    Args:
        rings: Corners of convex rings [m], each (k, 3), counter-clockwise seen from the last ring toward the first.
    """
    k = len(rings[0])
    faces = []
    for ring in range(len(rings) - 1):
        first, second = ring * k, (ring + 1) * k
        for i in range(k):
            j = (i + 1) % k
            faces += [(first + i, first + j, second + j), (first + i, second + j, second + i)]
    last = (len(rings) - 1) * k
    for i in range(1, k - 1):
        faces += [(0, i + 1, i), (last, last + i, last + i + 1)]
    return Mesh(np.concatenate(rings), np.array(faces))


def box(low: Sequence[float], high: Sequence[float]) -> Mesh:
    """A box between two corners [m]."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    ring = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return lofted([np.array([(x, y, z) for x, y in ring]) for z in (z0, z1)])


def ball(n_splits: int) -> Mesh:
    """A sphere of radius 0.5 m: an icosahedron with each triangle split in four, n_splits times."""
    g = (1.0 + 5.0**0.5) / 2.0
    corners = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    corners += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    vertices = [np.array(c) / np.linalg.norm(c) for c in corners]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4)]
    faces += [(11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8)]
    faces += [(3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(n_splits):
        middles: dict[tuple[int, int], int] = {}

        def middle(a: int, b: int, known: dict[tuple[int, int], int] = middles) -> int:
            key = (min(a, b), max(a, b))
            if key not in known:
                point = vertices[a] + vertices[b]
                known[key] = len(vertices)
                vertices.append(point / np.linalg.norm(point))
            return known[key]

        split = []
        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            split += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = split
    return Mesh(0.5 * np.array(vertices), np.array(faces))


def _disc(x: float, y: float, low: float, high: float, radius: float, k: int = 8) -> Mesh:
    """An upright cylinder."""
    angle = 2.0 * np.pi * (np.arange(k) + 0.5) / k
    east, north = x + radius * np.cos(angle), y + radius * np.sin(angle)
    return lofted([np.stack([east, north, np.full(k, z)], 1) for z in (low, high)])


def _wheel(x: float, y: float, z: float, radius: float, width: float, k: int = 8) -> Mesh:
    """A cylinder whose axis lies along y."""
    angle = 2.0 * np.pi * (np.arange(k) + 0.5) / k
    along, up = x + radius * np.cos(angle), z + radius * np.sin(angle)
    sides = (y + 0.5 * width, y - 0.5 * width)
    return lofted([np.stack([along, np.full(k, side), up], 1) for side in sides])


def _hexagon(x: float, width: float, height: float, z: float) -> np.ndarray:
    """A hexagon across the x axis."""
    w, h = 0.5 * width, 0.5 * height
    ring = [(w, 0.0), (0.5 * w, h), (-0.5 * w, h), (-w, 0.0), (-0.5 * w, -h), (0.5 * w, -h)]
    return np.array([(x, y, z + up) for y, up in ring])


def _slab(outline: Sequence[tuple[float, float]], low: float, high: float) -> Mesh:
    """An outline in x and y, counter-clockwise from above, extruded between two heights."""
    return lofted([np.array([(x, y, z) for x, y in outline]) for z in (low, high)])


def _aircraft() -> Mesh:
    fuselage = lofted(
        [
            _hexagon(x, width, height, z)
            for x, width, height, z in (
                (-0.50, 0.02, 0.03, 0.03),
                (-0.15, 0.09, 0.09, 0.01),
                (0.20, 0.11, 0.11, 0.0),
                (0.38, 0.09, 0.08, 0.0),
                (0.50, 0.02, 0.02, -0.01),
            )
        ]
    )
    right = [(0.20, 0.0), (-0.02, 0.0), (-0.14, -0.55), (-0.05, -0.55)]
    left = [(x, -y) for x, y in reversed(right)]
    tail_right = [(-0.36, 0.0), (-0.48, 0.0), (-0.52, -0.20), (-0.45, -0.20)]
    tail_left = [(x, -y) for x, y in reversed(tail_right)]
    side = [(-0.33, 0.03), (-0.48, 0.22), (-0.54, 0.22), (-0.50, 0.03)]
    fin = lofted([np.array([(x, y, z) for x, z in side]) for y in (0.012, -0.012)])
    wings = [_slab(outline, 0.0, 0.03) for outline in (right, left)]
    tails = [_slab(outline, 0.03, 0.05) for outline in (tail_right, tail_left)]
    return joined([fuselage, *wings, *tails, fin])


def _quadrotor() -> Mesh:
    parts = [box((-0.16, -0.10, -0.05), (0.14, 0.10, 0.06)), box((0.14, -0.05, -0.03), (0.24, 0.05, 0.03))]
    for x in (-0.33, 0.33):
        for y in (-0.33, 0.33):
            along = np.array([x, y]) / np.hypot(x, y)
            across = 0.025 * np.array([-along[1], along[0]])
            outer, inner = np.array([x, y]), 0.1 * along
            outline = [tuple(c) for c in (inner - across, outer - across, outer + across, inner + across)]
            parts += [_slab(outline, -0.01, 0.03), _disc(x, y, 0.05, 0.07, 0.20)]
            parts.append(_disc(x, y, 0.03, 0.05, 0.03, 4))
    return joined(parts)


def _car() -> Mesh:
    side = [(-0.50, -0.08), (0.48, -0.08), (0.50, 0.02), (0.24, 0.08), (-0.50, 0.08)]
    body = lofted([np.array([(x, y, z) for x, z in side]) for y in (0.21, -0.21)])
    roof = [(-0.42, 0.08), (0.24, 0.08), (0.06, 0.22), (-0.32, 0.22)]
    cabin = lofted([np.array([(x, y, z) for x, z in roof]) for y in (0.18, -0.18)])
    wheels = [_wheel(x, y, -0.08, 0.10, 0.07) for x in (-0.30, 0.30) for y in (-0.20, 0.20)]
    return joined([body, cabin, *wheels])


def _boat() -> Mesh:
    deck = [
        (-0.50, -0.16),
        (0.18, -0.18),
        (0.36, -0.12),
        (0.50, 0.0),
        (0.36, 0.12),
        (0.18, 0.18),
        (-0.50, 0.16),
    ]
    keel = [
        (-0.46, -0.09),
        (0.14, -0.09),
        (0.28, -0.05),
        (0.36, 0.0),
        (0.28, 0.05),
        (0.14, 0.09),
        (-0.46, 0.09),
    ]
    hull = lofted([np.array([(x, y, z) for x, y in ring]) for ring, z in ((keel, -0.14), (deck, 0.06))])
    house = [(-0.30, 0.06), (0.12, 0.06), (0.04, 0.20), (-0.28, 0.20)]
    cabin = lofted([np.array([(x, y, z) for x, z in house]) for y in (0.09, -0.09)])
    return joined([hull, cabin, box((-0.16, -0.012, 0.20), (-0.136, 0.012, 0.40))])


class _Models(Mapping[str, Mesh]):
    """Models by name, each made at its first use."""

    def __init__(self, makers: Mapping[str, Callable[[], Mesh]]) -> None:
        self._makers = {name: cache(make) for name, make in makers.items()}

    def __getitem__(self, name: str) -> Mesh:
        return self._makers[name]()

    def __iter__(self) -> Iterator[str]:
        return iter(self._makers)

    def __len__(self) -> int:
        return len(self._makers)


MODELS: Mapping[str, Mesh] = _Models(
    {
        "aircraft": _aircraft,
        "quadrotor": _quadrotor,
        "car": _car,
        "boat": _boat,
        "sphere": lambda: ball(2),
        "box": lambda: box((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5)),
    }
)
"""Models by name."""
