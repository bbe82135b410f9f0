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
"""What each kind of shape is drawn with, beside what all have; the first is needed."""

DRAWN = (230, 60, 160)
"""Colour of what is drawn without one: none of the teams'."""
MOST_TEXTS, MOST_MESHES = 100, 50

# Five colours of viridis (N. Smith and S. van der Walt, 2015, CC0): even steps of lightness, also without colour.
SCALE = np.array([(68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37)], float)


@dataclass
class Drawing:
    """All shapes of one step, grouped by kind; n is the number of shapes of a group.

    Attributes:
        points: Position [m], (n, 3), colour, (n, 3), and size of each [m], (n,); those of clouds too.
        lines: Ends [m], (n, 2, 3), and colour of each end, (n, 2, 3).
        width: Of the lines [pixels].
        arrows: Ends [m], (n, 2, 3), and colours, (n, 3).
        solids: Kind "sphere", "box" or "cone" -> position (n, 3), attitude (n, 4), scale (n, 3), colour (n, 3), opacity (n,).
        texts: Text, position [m], (3,), and colour.
        meshes: Vertices (v, 3), faces (f, 3), position (3,), attitude (4,), colour, opacity.
        notes: What could not be drawn, and why.
    """

    points: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = field(default_factory=list)
    lines: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)
    width: float = 2.0
    arrows: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)
    solids: dict[str, list[tuple[np.ndarray, ...]]] = field(default_factory=dict)
    texts: list[tuple[str, np.ndarray]] = field(default_factory=list)
    meshes: list[tuple[Any, ...]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def read_drawing(shapes: tuple[Shape, ...], size: float) -> Drawing:
    """Convert the shapes of one step. A shape that cannot be drawn is reported in a note.

    Args:
        shapes: The shapes.
        size: Of points without a size of their own [m].
    """
    drawing = Drawing()
    for shape in shapes:
        try:
            _read(shape, drawing, size)
        except (ViewError, TypeError, ValueError, OverflowError) as error:
            note = f"a plugin drew {shape.kind}: {error}"
            if note not in drawing.notes:
                drawing.notes.append(note)
    return drawing


def drawing_message(shapes: tuple[Shape, ...]) -> tuple[dict[str, Any], bytes, list[str]]:
    """Encode shapes for the page: header, 32-bit numbers, notes.

    The header has `parts`, each with its kind, the number of things n and the place of its numbers in the data; `width` of lines
    [pixels]; `texts` with their places. Numbers of one thing: of points place, size [m] (0 where nothing is said), colour (7); of lines
    and arrows both ends and colour (9); of spheres, boxes and cones place, attitude, three lengths, colour, opacity (14); a mesh, one
    part each, has place, attitude, colour and opacity (11), then its vertices and the numbers of its faces' corners.
    """
    drawing = read_drawing(shapes, 0.0)
    parts: list[dict[str, Any]] = []
    arrays: list[np.ndarray] = []

    def put(kind: str, rows: np.ndarray, **more: int) -> None:
        if len(rows):
            parts.append({"kind": kind, "n": len(rows), "at": sum(a.size for a in arrays), **more})
            arrays.append(rows)

    for kind, columns in (
        ("points", [np.column_stack([p, s, c]) for p, c, s in drawing.points]),
        ("lines", [np.column_stack([e.reshape(-1, 6), c[:, 0]]) for e, c in drawing.lines]),
        ("arrows", [np.column_stack([e.reshape(-1, 6), c]) for e, c in drawing.arrows]),
        *((kind, [np.column_stack(part) for part in found]) for kind, found in drawing.solids.items()),
    ):
        if columns:
            put(kind, np.concatenate(columns))
    for vertices, faces, pos, quat, colour, opacity in drawing.meshes[:MOST_MESHES]:
        sizes = {"nVertices": len(vertices), "nFaces": len(faces)}
        head = np.concatenate([pos, quat, colour, [opacity], vertices.ravel(), faces.ravel()])
        put("mesh", head[None], **sizes)
    texts = [[text, *pos.tolist()] for text, pos in drawing.texts[:MOST_TEXTS]]
    data = b"".join(np.ascontiguousarray(a, "<f4").tobytes() for a in arrays)
    return {"parts": parts, "width": drawing.width, "texts": texts}, data, drawing.notes


def _read(shape: Shape, drawing: Drawing, size: float) -> None:
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
    opacity = _numbers(given, "opacity", n, 1.0)
    if kind in ("points", "cloud"):
        drawing.points.append((pos, _cloud_colours(given, n), _numbers(given, "size", n, size)))
    elif kind == "line":
        colour = _colours(given, n)
        drawing.lines.append((np.stack([pos[:-1], pos[1:]], 1), np.stack([colour[:-1], colour[1:]], 1)))
        drawing.width = float(given.get("width", drawing.width))
    elif kind == "vectors":
        drawing.arrows.append((np.stack([pos, pos + _vectors(given, "direction", n)], 1), _colours(given, n)))
    elif kind == "text":
        drawing.texts.extend((str(given.get("text", "?")), p) for p in pos)
    else:
        quat, scale = _SOLIDS[kind](given, n)
        drawing.solids.setdefault(kind, []).append((pos, quat, scale, _colours(given, n), opacity))


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
    pos = _vectors(given, "pos", 1)[0] if "pos" in given else np.zeros(3)
    quat = _quats(given, 1)[0]
    opacity = float(_numbers(given, "opacity", 1, 1.0)[0])
    drawing.meshes.append((vertices, faces, pos, quat, _colours(given, 1)[0], opacity))


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
