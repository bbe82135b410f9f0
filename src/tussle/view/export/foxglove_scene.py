"""What stands and moves in a run, as entities of Foxglove's scenes."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from tussle.view.export.foxglove_schemas import LINE_LIST, PRIMITIVES
from tussle.view.recording import Recording
from tussle.view.scenery import Scenery
from tussle.view.shapes import Mesh
from tussle.view.style import Colour

Json = dict[str, Any]

WORLD = "world"
"""Name of the frame that stands still."""
NOBODYS: Colour = (92, 104, 116)
"""Red, green, blue of boundaries that belong to no team."""
GROUND: Colour = (196, 200, 172)
"""Red, green, blue of terrain."""
MOST_HEIGHTS = 20_000
"""Heights of terrain that are told: each is some fifty bytes."""
IDENTITY: Json = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}


def stamp(ns: int) -> Json:
    """A time or a duration [ns] as seconds and nanoseconds."""
    return {"sec": ns // 1_000_000_000, "nsec": ns % 1_000_000_000}


def entity(
    name: str, frame: str, ns: int, lifetime: int = 0, notes: Iterable[tuple[str, str]] = (), **parts: Any
) -> Json:
    """An entity of a scene.

    Args:
        name: Its id in the topic.
        frame: The frame it moves with.
        ns: Time from which it is there [ns].
        lifetime: How long [ns]; 0 until the end.
        notes: What is told of it when it is clicked.
        parts: Its primitives, a list of each kind.
    """
    return {
        "timestamp": stamp(ns),
        "frame_id": frame,
        "id": name,
        "lifetime": stamp(lifetime),
        "frame_locked": True,
        "metadata": [{"key": key, "value": value} for key, value in notes],
        **{kind: parts.get(kind, []) for kind in PRIMITIVES},
    }


def colour(rgb: Colour, opacity: float = 1.0) -> Json:
    """A colour as Foxglove has it, 0 to 1."""
    r, g, b = (round(v / 255.0, 4) for v in rgb)
    return {"r": r, "g": g, "b": b, "a": opacity}


def pose(at: Sequence[float] = (0.0, 0.0, 0.0)) -> Json:
    """A place, not turned."""
    return {"position": vector(at), "orientation": IDENTITY}


def vector(v: Iterable[float]) -> Json:
    """A point or a vector, to a tenth of a millimetre."""
    x, y, z = (round(float(c), 4) for c in v)
    return {"x": x, "y": y, "z": z}


def triangles(mesh: Mesh, rgb: Colour, opacity: float = 1.0) -> Json:
    """A surface in one colour."""
    return {
        "pose": pose(),
        "points": [vector(v) for v in mesh.vertices],
        "color": colour(rgb, opacity),
        "colors": [],
        "indices": mesh.faces.ravel().tolist(),
    }


def lines(ends: np.ndarray, rgb: Colour, thickness: float = 2.0) -> Json:
    """Lines between ends (k, 2, 3) [m], so many pixels wide."""
    return {
        "type": LINE_LIST,
        "pose": pose(),
        "thickness": thickness,
        "scale_invariant": True,
        "points": [vector(p) for p in ends.reshape(-1, 3)],
        "color": colour(rgb),
        "colors": [],
        "indices": [],
    }


def text(words: str, rgb: Colour, at: Sequence[float]) -> Json:
    """A word that faces the reader."""
    return {
        "pose": pose(at),
        "billboard": True,
        "font_size": 12.0,
        "scale_invariant": True,
        "color": colour(rgb),
        "text": words,
    }


def standing(recording: Recording, ns: int) -> list[Json]:
    """Bases, boundaries, terrain and origin of a run."""
    scenery, style = recording.scenery, recording.style
    found = [_origin(scenery, ns)] if scenery.origin_length > 0.0 else []
    for i, base in enumerate(scenery.bases, 1):
        size = {"x": 2.0 * base.radius, "y": 2.0 * base.radius, "z": 2.0 * base.radius}
        sphere = {
            "pose": pose(base.pos.tolist()),
            "size": size,
            "color": colour(style.colour(base.team), 0.35 * base.opacity),
        }
        found.append(entity(f"base {i}", WORLD, ns, notes=[("team", str(base.team))], spheres=[sphere]))
    for region in scenery.boundaries:
        rgb = style.colour(region.team) if region.team else NOBODYS  # team 0 is nobody's
        surface = triangles(region.mesh, rgb, 0.3 if region.is_wall else 0.06)
        found.append(entity(region.name, WORLD, ns, triangles=[surface], lines=[lines(region.outline, rgb)]))
    if scenery.terrain is not None:
        found.append(
            entity("terrain", WORLD, ns, triangles=[triangles(scenery.terrain.mesh(MOST_HEIGHTS), GROUND)])
        )
    return found


def _origin(scenery: Scenery, ns: int) -> Json:
    axes = scenery.origin_length * np.eye(3)
    shades: tuple[Colour, ...] = ((200, 70, 60), (70, 150, 70), (70, 110, 200))
    parts = [lines(np.stack([np.zeros(3), axis])[None], rgb) for axis, rgb in zip(axes, shades, strict=True)]
    place = scenery.origin
    notes = [
        ("latitude [deg]", f"{math.degrees(place.latitude):.9g}"),
        ("longitude [deg]", f"{math.degrees(place.longitude):.9g}"),
        ("altitude [m]", f"{place.altitude:g}"),
    ]
    return entity("origin", WORLD, ns, notes=notes, lines=parts)


def as_json(value: Any) -> bytes:
    """A message as it stands in the file."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False).encode()
