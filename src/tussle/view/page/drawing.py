"""Converts the shapes drawn by plugins to arrays for the page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tussle.errors import ViewError, listed, nearest_name
from tussle.view.drawn import Shape

COMMON = ("colour", "color", "opacity", "lifetime")
ATTRIBUTES: Mapping[str, tuple[str, ...]] = {
    "points": ("pos", "size"),
    "cloud": ("pos", "size", "value", "low", "high"),
    "line": ("pos", "width"),
    "vectors": ("pos", "direction"),
    "sphere": ("pos", "radius"),
    "box": ("pos", "size", "quat"),
    "cone": ("pos", "direction", "length", "angle"),
    "text": ("pos", "text"),
    "mesh": ("vertices", "faces", "pos", "quat"),
}
"""Attributes of each kind of shape besides the common ones; the first is required."""

DRAWN = (230, 60, 160)
"""Colour of what is drawn without one: none of the teams'."""
MAX_TEXTS, MAX_MESHES = 100, 50

# Five colours of viridis (N. Smith and S. van der Walt, 2015, CC0): even steps of lightness, also without colour.
SCALE = np.array([(68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37)], float)


@dataclass
class Drawing:
    """The shapes of one step as numbers.

    Attributes:
        rows: Kind -> rows of numbers, see `drawing_message`; of a mesh one row.
        sizes: Numbers of vertices and of faces of each mesh.
        texts: Each text with its position [m].
        width: Of the lines [pixels].
        notes: What could not be drawn, and why.
    """

    rows: dict[str, list[np.ndarray]] = field(default_factory=dict)
    sizes: list[tuple[int, int]] = field(default_factory=list)
    texts: list[list[Any]] = field(default_factory=list)
    width: float = 2.0
    notes: list[str] = field(default_factory=list)

    def add(self, kind: str, *columns: np.ndarray) -> None:
        """Add rows of a kind: columns (n,) or (n, k) side by side."""
        self.rows.setdefault(kind, []).append(np.column_stack(columns))


def read_drawing(shapes: tuple[Shape, ...]) -> Drawing:
    """Convert the shapes of one step. A shape that cannot be drawn is reported in a note."""
    drawing = Drawing()
    for shape in shapes:
        try:
            _read(shape, drawing)
        except (ViewError, TypeError, ValueError, OverflowError) as error:
            note = f"a plugin drew {shape.kind}: {error}"
            if note not in drawing.notes:
                drawing.notes.append(note)
    return drawing


def drawing_message(shapes: tuple[Shape, ...]) -> tuple[dict[str, Any], bytes, list[str]]:
    """Encode shapes for the page: header, 32-bit numbers, notes.

    The header has `parts`, each with its kind, the number of rows n and the place of its numbers in the data; `width` of lines
    [pixels]; `texts` with their places. Numbers of a row: of points place, size [m] (0 where nothing is said), colour (7); of lines
    and arrows both ends and colour (9); of spheres, boxes and cones place, attitude, three lengths, colour, opacity (14); a mesh, one
    part each, has place, attitude, colour and opacity (11), then its vertices and the numbers of its faces' corners.
    """
    drawing = read_drawing(shapes)
    meshes = drawing.rows.pop("mesh", [])[:MAX_MESHES]
    found: list[tuple[str, np.ndarray, dict[str, int]]]
    found = [(kind, np.concatenate(rows), {}) for kind, rows in drawing.rows.items()]
    found += [
        ("mesh", row, {"nVertices": n_vertices, "nFaces": n_faces})
        for row, (n_vertices, n_faces) in zip(meshes, drawing.sizes, strict=False)
    ]
    parts: list[dict[str, Any]] = []
    data = b""
    for kind, rows, more in found:
        if len(rows):
            parts.append({"kind": kind, "n": len(rows), "at": len(data) // 4, **more})
            data += np.ascontiguousarray(rows, "<f4").tobytes()
    return {"parts": parts, "width": drawing.width, "texts": drawing.texts[:MAX_TEXTS]}, data, drawing.notes


def _read(shape: Shape, drawing: Drawing) -> None:
    kind, given = shape.kind, shape.attributes
    allowed = ATTRIBUTES[kind]
    for name in given:
        if name not in allowed and name not in COMMON:
            known = (*allowed, *COMMON)
            raise ViewError(f"it has no attribute {name!r}{nearest_name(name, known)}; {listed(known)}")
    if allowed[0] not in given:
        raise ViewError(f"it needs {allowed[0]!r}")
    if kind == "mesh":
        _read_mesh(given, drawing)
        return
    pos = _vectors(given, "pos")
    n = len(pos)
    if kind in ("points", "cloud"):
        drawing.add("points", pos, _numbers(given, "size", n, 0.0), _cloud_colours(given, n))
    elif kind == "line":
        drawing.add("lines", pos[:-1], pos[1:], _colours(given, n)[:-1])
        drawing.width = float(given.get("width", drawing.width))
    elif kind == "vectors":
        drawing.add("arrows", pos, pos + _vectors(given, "direction", n), _colours(given, n))
    elif kind == "text":
        drawing.texts.extend([str(given.get("text", "?")), *p] for p in pos.tolist())
    else:
        quat, scale = _SOLIDS[kind](given, n)
        drawing.add(kind, pos, quat, scale, _colours(given, n), _numbers(given, "opacity", n, 1.0))


def _read_mesh(given: Mapping[str, Any], drawing: Drawing) -> None:
    vertices = _vectors(given, "vertices")
    faces = np.asarray(given.get("faces", ()), np.int64)
    if (
        faces.ndim != 2
        or faces.shape[1] != 3
        or faces.min(initial=0) < 0
        or faces.max(initial=0) >= len(vertices)
    ):
        raise ViewError(f"faces must be numbers of three vertices each, (f, 3), below {len(vertices)}")
    pos = _vectors(given, "pos", 1) if "pos" in given else np.zeros((1, 3))
    opacity = _numbers(given, "opacity", 1, 1.0)
    corners = vertices.reshape(1, -1), faces.reshape(1, -1)
    drawing.add("mesh", pos, _quats(given, 1), _colours(given, 1), opacity, *corners)
    drawing.sizes.append((len(vertices), len(faces)))


def _sphere(given: Mapping[str, Any], n: int) -> tuple[np.ndarray, np.ndarray]:
    radius = _numbers(given, "radius", n, 1.0)
    return _quats({}, n), np.repeat(2.0 * radius[:, None], 3, axis=1)


def _box(given: Mapping[str, Any], n: int) -> tuple[np.ndarray, np.ndarray]:
    size = np.asarray(given.get("size", 1.0), float)
    scale = np.full((n, 3), float(size)) if size.ndim == 0 else _vectors(given, "size", n)
    return _quats(given, n), scale


def _cone(given: Mapping[str, Any], n: int) -> tuple[np.ndarray, np.ndarray]:
    length = _numbers(given, "length", n, 1.0)
    half = 0.5 * np.clip(_numbers(given, "angle", n, np.pi / 6), 1e-3, np.pi - 1e-3)
    rim = length * np.tan(half)
    direction = _vectors(given, "direction", n) if "direction" in given else np.tile([1.0, 0.0, 0.0], (n, 1))
    return _turning_x_to(direction), np.stack([length, rim, rim], 1)


_SOLIDS = {"sphere": _sphere, "box": _box, "cone": _cone}


def _turning_x_to(direction: np.ndarray) -> np.ndarray:
    """Return quaternions that rotate the x axis to directions (n, 3): half turns about the bisectors."""
    length = np.linalg.norm(direction, axis=1, keepdims=True)
    unit = np.where(length > 0.0, direction / np.where(length > 0.0, length, 1.0), [1.0, 0.0, 0.0])
    middle = unit + np.array([1.0, 0.0, 0.0])
    norm = np.linalg.norm(middle, axis=1, keepdims=True)
    middle = np.where(norm > 1e-6, middle / np.where(norm > 1e-6, norm, 1.0), [0.0, 0.0, 1.0])
    return np.concatenate([np.zeros((len(unit), 1)), middle], 1)


# -- attributes ---------------------------------------------------------------------------------------------------------------


def _vectors(given: Mapping[str, Any], name: str, n: int | None = None) -> np.ndarray:
    """An attribute (3,) or (3, n) as (n, 3); one stands for all."""
    if name not in given:
        raise ViewError(f"it needs {name!r}")
    array = np.asarray(given[name], float)
    if array.ndim == 1:
        array = array[:, None]
    if array.ndim != 2 or len(array) != 3 or (n is not None and array.shape[1] not in (1, n)):
        wanted = "(3,) or (3, n)" if n is None else f"(3,) or (3, {n})"
        raise ViewError(f"{name} must be {wanted}, not {np.shape(given[name])}")
    if not np.isfinite(array).all():
        raise ViewError(f"{name} has values that are not finite")
    return np.array(np.broadcast_to(array.T, (n or array.shape[1], 3)))


def _numbers(given: Mapping[str, Any], name: str, n: int, default: float) -> np.ndarray:
    """An attribute that is a number or (n,), as (n,)."""
    array = np.asarray(given.get(name, default), float)
    if array.shape not in ((), (1,), (n,)) or not np.isfinite(array).all():
        raise ViewError(f"{name} must be a number or ({n},), and finite")
    return np.array(np.broadcast_to(array, (n,)))


def _quats(given: Mapping[str, Any], n: int) -> np.ndarray:
    """Attitudes (4,) or (4, n) as (n, 4)."""
    array = np.asarray(given.get("quat", (1.0, 0.0, 0.0, 0.0)), float)
    array = array[:, None] if array.ndim == 1 else array
    if array.ndim != 2 or len(array) != 4 or array.shape[1] not in (1, n) or not np.isfinite(array).all():
        raise ViewError(f"quat must be (4,) or (4, {n}), not {np.shape(given['quat'])}")
    return np.array(np.broadcast_to(array.T, (n, 4)))


def _colours(given: Mapping[str, Any], n: int) -> np.ndarray:
    """Colours (3,) or (3, n), 0 to 255, as (n, 3), uint8."""
    name = "colour" if "colour" in given else "color"
    if name not in given:
        return np.tile(np.array(DRAWN, np.uint8), (n, 1))
    return np.clip(np.round(_vectors(given, name, n)), 0, 255).astype(np.uint8)


def _cloud_colours(given: Mapping[str, Any], n: int) -> np.ndarray:
    """Colours as they are given, or by a value of each point between `low` and `high`, or the least and the largest of them."""
    if "value" not in given:
        return _colours(given, n)
    value = _numbers(given, "value", n, 0.0)
    if not n:
        return np.zeros((0, 3), np.uint8)
    low, high = float(given.get("low", value.min())), float(given.get("high", value.max()))
    share = np.clip((value - low) / (high - low), 0.0, 1.0) if high > low else np.zeros(n)
    place = share * (len(SCALE) - 1)
    return np.stack([np.interp(place, np.arange(len(SCALE)), SCALE[:, c]) for c in range(3)], 1).astype(
        np.uint8
    )
