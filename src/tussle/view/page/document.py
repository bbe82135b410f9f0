"""The static description of a game for the page: names, colours, models, scenery, first view."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, Protocol

import numpy as np

import tussle
from tussle.documents import is_count
from tussle.mission import Mission
from tussle.view.frame import Event
from tussle.view.page.packing import ints
from tussle.view.scenery import Scenery
from tussle.view.shapes import MODELS, Mesh
from tussle.view.sight import Sight, range_of
from tussle.view.solids import MAX_FACES, Terrain
from tussle.view.style import Style
from tussle.world.rays.surfaces import MeshPart
from tussle.world.rays.textures import jpeg

FORMAT = 2
"""Version of the document and of the chunks, for programs that read them from a file."""
MAX_HEIGHTS = 250_000
"""Heights of the terrain on the page: with some half a million triangles a browser still draws without effort."""
HEIGHT_STEPS = 65_535


class Game(Protocol):
    """The common interface of live games, recordings and comparisons."""

    @property
    def name(self) -> str: ...
    @property
    def blocks(self) -> list[str]: ...
    @property
    def block_teams(self) -> list[int]: ...
    @property
    def teams(self) -> dict[int, str]: ...
    @property
    def style(self) -> Style: ...
    @property
    def scenery(self) -> Scenery: ...
    @property
    def notes(self) -> list[str]: ...


def game_document(
    game: Game,
    mission: Mission | None = None,
    viewer: Mapping[str, Any] | None = None,
    title: str | None = None,
) -> dict[str, Any]:
    """Return the part of the document that live and recorded games share.

    Args:
        game: The game.
        mission: The mission, whose plugins say how far they see; None where it is not known.
        viewer: What the mission file says for the viewer, see `tussle.mission.Loaded`.
        title: Heading of the page; None is the game's name.
    """
    viewer, style, scenery = viewer or {}, game.style, game.scenery
    notes = [*style.notes, *scenery.notes, *filter(None, [terrain_note(scenery)])]
    opening = opening_data(viewer.get("camera"), notes)
    models = {style.model(i) for i in range(len(game.blocks))} | {"sphere"}
    return {
        "format": FORMAT,
        "generator": f"tussle {tussle.__version__}",
        "title": game.name if title is None else title,
        "blocks": [
            {
                "name": name,
                "team": game.block_teams[i],
                "colour": list(style.block_colour(i)),
                "model": style.model(i),
                "lengths": style.lengths(i),
                "views": [view_data(view) for view in style.views(i)],
            }
            for i, name in enumerate(game.blocks)
        ],
        "teams": [
            {"id": team, "name": name, "colour": list(style.colour(team))}
            for team, name in game.teams.items()
        ],
        "models": {name: mesh_data(MODELS[name], 4) for name in MODELS if name in models},
        "scenery": scenery_data(scenery),
        "opening": opening,
        "reach": reach_of(mission),
        "scale": float(viewer.get("scale") or 1.0),
        "hasTrails": bool(viewer.get("plot_tracks", False)),
        "notes": list(dict.fromkeys([*notes, *game.notes])),
    }


def opening_data(said: Mapping[str, Any] | None, notes: list[str]) -> dict[str, Any] | None:
    """Return the first view from the mission's `<camera>`; None without one. Invalid values are added to `notes`.

    Args:
        said: The attributes of the tag.
        notes: Receives a line for each attribute that is left out.
    """
    if not said:
        return None

    def vector(name: str) -> list[float] | None:
        if name not in said:
            return None
        try:
            found = [float(part) for part in str(said[name]).replace(",", " ").split()]
        except ValueError:
            found = []
        if len(found) == 3 and all(map(math.isfinite, found)):
            return found
        notes.append(f"camera {name} {said[name]!r} is not x, y, z in m; it is left out")
        return None

    target, position = vector("focal_point"), vector("pos")
    mode = {"follow": "follow", "offset": "behind", "free": "free"}.get(str(said.get("mode", "free")).lower())
    if mode is None:
        notes.append(f"camera mode {said['mode']!r} is none of free, follow, offset; it is free")
    follow = str(said.get("follow_id", ""))
    if follow and not is_count(follow):
        notes.append(f"camera follow_id {follow!r} is no id; nobody is followed")
    who = int(follow) if is_count(follow) else 0
    return {"position": position, "target": target, "mode": mode or "free", "follow": who}


def reach_of(mission: Mission | None) -> float:
    """Return the range of communication or sight of the entities [m]; 0 if no plugin declares one.

    The first parameter that names a range counts, networks before others: a range of what is heard is what links are about.
    """
    plugins = [] if mission is None else [*mission.networks, *(p for b in mission.blocks for p in b.plugins)]
    return next((reach for p in plugins if (reach := range_of(p)) is not None and math.isfinite(reach)), 0.0)


def view_data(view: Sight) -> dict[str, Any]:
    """Return a field of view with angles in degrees, as missions have them; a range without end is None."""
    return {
        "plugin": view.plugin,
        "azimuth": math.degrees(view.azimuth),
        "elevation": None if view.elevation is None else math.degrees(view.elevation),
        "range": view.range if math.isfinite(view.range) else None,
        "pos": view.pos,
        "quat": view.quat,
    }


def rounded(values: Any, digits: int) -> list[Any]:
    """Return rounded numbers as nested lists of the array's shape."""
    flat: list[Any] = np.round(np.asarray(values, np.float64), digits).tolist()
    return flat


def digits_for(size: float) -> int:
    """Decimals of coordinates that are good to a hundred-thousandth of a size [m], and to a millimetre."""
    return max(3, 5 - math.floor(math.log10(max(size, 1e-9))))


def mesh_data(mesh: Mesh, digits: int) -> dict[str, Any]:
    """Corners and triangles, each as one list of numbers."""
    return {"vertices": rounded(mesh.vertices.ravel(), digits), "faces": mesh.faces.ravel().tolist()}


def event_rows(events: Iterable[Event]) -> list[list[Any]]:
    """Time, kind, both ids and text of each event."""
    return [[e.t, e.kind, e.id, e.other, e.text] for e in events]


def scenery_data(scenery: Scenery) -> dict[str, Any]:
    """Extent, grid, axes, bases, regions and background; of the terrain, what `scenery_blobs` adds."""
    digits, origin = digits_for(scenery.size), scenery.origin
    return {
        "origin": None
        if origin.is_default
        else [math.degrees(origin.latitude), math.degrees(origin.longitude), origin.altitude],
        "low": rounded(scenery.low, digits),
        "high": rounded(scenery.high, digits),
        "ground": scenery.ground,
        "hasGround": scenery.has_ground,
        "gridStep": scenery.grid_step,
        "originLength": scenery.origin_length,
        "background": scenery.background and list(scenery.background),
        "bases": [
            {"team": b.team, "pos": rounded(b.position, digits), "radius": b.radius, "opacity": b.opacity}
            for b in scenery.bases
        ],
        "regions": [
            {
                "name": r.name,
                "team": r.team,
                "isWall": r.is_wall,
                "mesh": mesh_data(r.mesh, digits),
                "outline": rounded(r.outline.ravel(), digits),
                "nParts": len(r.parts),
            }
            for r in scenery.boundaries
        ],
        "terrain": scenery.terrain and _terrain_data(scenery.terrain.thinned(MAX_HEIGHTS)),
    }


# -- terrain --------------------------------------------------------------------------------------------------------------------


def _terrain_data(terrain: Terrain) -> dict[str, Any]:
    low, high = float(terrain.height.min()), float(terrain.height.max())
    return {
        "x": rounded(terrain.x, 3),
        "y": rounded(terrain.y, 3),
        "low": low,
        "step": (high - low) / HEIGHT_STEPS,
        "hasTexture": terrain.texture is not None,
    }


def scenery_blobs(scenery: Scenery) -> dict[str, bytes]:
    """Heights and texture of the terrain, and the coloured parts of meshes with their images, by name."""
    blobs: dict[str, bytes] = {}
    if scenery.terrain is not None:
        blobs["terrain"] = _height_bytes(scenery.terrain)
        if scenery.terrain.texture is not None:
            blobs["texture"] = jpeg(scenery.terrain.texture)
    middle = 0.5 * (scenery.low + scenery.high)
    for i, part in enumerate(part for region in scenery.boundaries for part in region.parts):
        blobs[f"part-{i}"] = _part_bytes(part, np.array(rounded(middle, digits_for(scenery.size))))
        if part.image is not None:
            blobs[f"image-{i}"] = jpeg(part.image)
    return blobs


def _part_bytes(part: MeshPart, middle: np.ndarray) -> bytes:
    """A part as arrays: head, corners and triangles.

    The head is the numbers of corners and of triangles and whether there is an image, uint32; a corner is its place from the middle [m],
    uv and colour, float32; triangles are uint32.
    """
    faces = part.faces[:MAX_FACES]
    uv = np.zeros((len(part.vertices), 2)) if part.uv is None else part.uv
    corners = np.hstack([part.vertices - middle, uv, part.colours / 255.0])
    head = np.array([len(corners), len(faces), part.image is not None], "<u4")
    return head.tobytes() + corners.astype("<f4").tobytes() + faces.astype("<u4").tobytes()


def _height_bytes(terrain: Terrain) -> bytes:
    """Heights in steps above the lowest, row by row as differences to the point before."""
    height = terrain.thinned(MAX_HEIGHTS).height
    low, high = float(height.min()), float(height.max())
    steps = np.rint((height - low) * (HEIGHT_STEPS / (high - low) if high > low else 0.0)).astype(np.int64)
    return ints(np.diff(steps.ravel(), prepend=np.int64(0)))


def terrain_note(scenery: Scenery) -> str:
    """Return a note on the part of the terrain that is not shown, or ""."""
    terrain = scenery.terrain
    thin = None if terrain is None else terrain.thinned(MAX_HEIGHTS)
    if terrain is None or thin is None or thin.height.size == terrain.height.size:
        return ""
    return f"the terrain has {_size(terrain)} heights; {_size(thin)} are shown"


def _size(terrain: Terrain) -> str:
    """Write a size: "300 x 200"."""
    return f"{len(terrain.x)} x {len(terrain.y)}"
