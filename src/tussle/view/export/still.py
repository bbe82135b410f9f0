"""What stands still and what entities look like, as the page's player reads it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tussle.view.export.packing import deflated, ints
from tussle.view.looks import Looks
from tussle.view.recording import Recording
from tussle.view.scenery import Base, Region, Scenery
from tussle.view.shapes import MODELS, Mesh
from tussle.view.terrain import Terrain

MOST_HEIGHTS = 250_000
"""Heights of the terrain on the page: with some half a million triangles a browser still draws without effort."""
HEIGHT_STEPS = 65_535


def rounded(values: np.ndarray, digits: int) -> list[Any]:
    """Numbers in as few characters as they need, in the array's shape."""
    flat: list[Any] = np.round(np.asarray(values, np.float64), digits).tolist()
    return flat


def digits_for(size: float) -> int:
    """Decimals of coordinates that are good to a hundred-thousandth of a size [m], and to a millimetre."""
    return max(3, 5 - math.floor(math.log10(max(size, 1e-9))))


def mesh_data(mesh: Mesh, digits: int) -> dict[str, Any]:
    """Corners and triangles, each as one list of numbers."""
    return {"vertices": rounded(mesh.vertices.ravel(), digits), "faces": mesh.faces.ravel().tolist()}


def models_data(names: set[str]) -> dict[str, Any]:
    """The models that a game needs, by name."""
    return {name: mesh_data(MODELS[name], 4) for name in MODELS if name in names}


def blocks_data(recording: Recording, looks: Looks) -> list[dict[str, Any]]:
    """Name, team, colour, model and scale of each block."""
    return [
        {
            "name": name,
            "team": recording.block_teams[i],
            "colour": list(looks.block_colour(i)),
            "model": looks.model(i),
            "scale": looks.scale(i),
        }
        for i, name in enumerate(recording.blocks)
    ]


def teams_data(recording: Recording, looks: Looks) -> list[dict[str, Any]]:
    """Number, name and colour of each team, in the order of their numbers."""
    return [
        {"id": team, "name": name, "colour": list(looks.colour(team))}
        for team, name in recording.teams.items()
    ]


def scenery_data(scenery: Scenery) -> dict[str, Any]:
    """Extent, grid, axes, bases, regions and background; of the terrain, what `terrain_bytes` leaves out."""
    digits = digits_for(scenery.size)
    return {
        "low": rounded(scenery.low, digits),
        "high": rounded(scenery.high, digits),
        "ground": scenery.ground,
        "gridStep": scenery.grid_step,
        "originLength": scenery.origin_length,
        "background": scenery.background and list(scenery.background),
        "bases": [_base_data(base, digits) for base in scenery.bases],
        "regions": [_region_data(region, digits) for region in scenery.boundaries],
        "terrain": scenery.terrain and _terrain_data(scenery.terrain.thinned(MOST_HEIGHTS)),
    }


def _base_data(base: Base, digits: int) -> dict[str, Any]:
    return {
        "team": base.team,
        "pos": rounded(base.pos, digits),
        "radius": base.radius,
        "opacity": base.opacity,
    }


def _region_data(region: Region, digits: int) -> dict[str, Any]:
    return {
        "name": region.name,
        "team": region.team,
        "isWall": region.is_wall,
        "mesh": mesh_data(region.mesh, digits),
        "outline": rounded(region.outline.ravel(), digits),
    }


# -- terrain --------------------------------------------------------------------------------------------------------------------


def _terrain_data(terrain: Terrain) -> dict[str, Any]:
    low, high = float(terrain.height.min()), float(terrain.height.max())
    return {
        "x": rounded(terrain.x, 3),
        "y": rounded(terrain.y, 3),
        "low": low,
        "step": (high - low) / HEIGHT_STEPS,
    }


def terrain_bytes(scenery: Scenery) -> bytes | None:
    """Heights in steps above the lowest, row by row as differences to the point before, deflated; None without a terrain."""
    if scenery.terrain is None:
        return None
    height = scenery.terrain.thinned(MOST_HEIGHTS).height
    low, high = float(height.min()), float(height.max())
    steps = np.rint((height - low) * (HEIGHT_STEPS / (high - low) if high > low else 0.0)).astype(np.int64)
    return deflated(ints(np.diff(steps.ravel(), prepend=np.int64(0))))


def terrain_note(scenery: Scenery) -> str:
    """What of the terrain is left out; "" where nothing is."""
    terrain = scenery.terrain
    thin = None if terrain is None else terrain.thinned(MOST_HEIGHTS)
    if terrain is None or thin is None or thin.height.size == terrain.height.size:
        return ""
    return f"the terrain has {_size(terrain)} heights; {_size(thin)} are shown"


def _size(terrain: Terrain) -> str:
    """Such as "300 x 200"."""
    return f"{len(terrain.x)} x {len(terrain.y)}"
