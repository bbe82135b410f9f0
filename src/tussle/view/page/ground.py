"""Draws what stands still: grid, origin, bases, boundaries, terrain."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.view.looks import Looks
from tussle.view.page.colours import BACKGROUND, GRID_LINE, GRID_SECTION, REGION, TERRAIN, WALL
from tussle.view.scenery import Base, Region, Scenery
from tussle.view.shapes import ball

ROOM = 1.6
"""How much wider the grid is than what is shown."""
LINES_PER_SECTION = 5
AMBIENT, SUN = 1.6, 2.0
"""Of the lights; pi in all shows a surface in its colour (three.js, from r155 on: radiance is light over pi)."""
SEEN_THROUGH = 0.06
"""Opacity of regions, which what is in them must be seen through."""


def draw_ground(scene: Any, scenery: Scenery, looks: Looks, root: str = "", *, has_grid: bool = True) -> None:
    """Draw all that stands still, once.

    Args:
        scene: The server's scene.
        scenery: What stands still.
        looks: Colours of the teams.
        root: Name of the node below which it is drawn; that node may stand elsewhere.
        has_grid: With the grid.
    """
    if has_grid:
        _grid(scene, scenery, root)
    if scenery.origin_length > 0.0:
        length = scenery.origin_length
        scene.add_frame(
            f"{root}/origin", axes_length=length, axes_radius=0.012 * length, origin_radius=0.03 * length
        )
    for i, base in enumerate(scenery.bases):
        _base(scene, base, looks, f"{root}/base {i}")
    for i, region in enumerate(scenery.boundaries):
        _region(scene, region, looks, f"{root}/region {i}")
    if scenery.terrain is not None:
        mesh = scenery.terrain.mesh()
        scene.add_mesh_simple(f"{root}/terrain", mesh.vertices, mesh.faces, color=TERRAIN, side="double")


def light(scene: Any) -> None:
    """Light that leaves the teams their colours: viser's own is so bright that what faces up is white."""
    scene.configure_default_lights(enabled=False, cast_shadow=False)
    scene.configure_environment_map(None)
    scene.add_light_ambient("/light", intensity=AMBIENT)
    scene.add_light_directional("/light/sun", intensity=SUN, position=(-1.0, -2.0, 3.0), cast_shadow=False)


def background_image(scenery: Scenery) -> np.ndarray:
    """One pixel of the background's colour, (1, 1, 3), uint8."""
    return np.array([[scenery.background or BACKGROUND]], np.uint8)


def _grid(scene: Any, scenery: Scenery, root: str) -> None:
    section = LINES_PER_SECTION * scenery.grid_step
    middle = 0.5 * (scenery.low + scenery.high)[:2]
    # Lines lie on whole multiples of their distance, so that they can be read as coordinates.
    east, north = (round(float(c) / section) * section for c in middle)
    half = 0.5 * ROOM * float((scenery.high - scenery.low)[:2].max())
    width = 2.0 * section * max(1.0, np.ceil(half / section))
    scene.add_grid(
        f"{root}/grid", width=width, height=width, plane="xy", position=(east, north, scenery.ground),
        cell_size=scenery.grid_step, section_size=section, cell_color=GRID_LINE, section_color=GRID_SECTION,
        cell_thickness=0.7, section_thickness=1.0, fade_distance=20.0 * width, fade_strength=0.0, shadow_opacity=0.0,
    )  # fmt: skip


def _base(scene: Any, base: Base, looks: Looks, name: str) -> None:
    mesh = ball(3).placed(2.0 * base.radius)
    scene.add_mesh_simple(
        name, mesh.vertices, mesh.faces, color=looks.colour(base.team), opacity=_seen(base.opacity),
        position=tuple(base.pos), cast_shadow=False, receive_shadow=False,
    )  # fmt: skip


def _seen(opacity: float) -> float | None:
    """Opacity as viser has it: None is opaque, which is drawn faster."""
    return None if opacity >= 1.0 else opacity


def _region(scene: Any, region: Region, looks: Looks, name: str) -> None:
    nobodys = WALL if region.is_wall else REGION
    colour = nobodys if region.team is None else looks.colour(region.team)
    if len(region.mesh.faces):
        scene.add_mesh_simple(
            name, region.mesh.vertices, region.mesh.faces, color=colour, side="double", flat_shading=True,
            opacity=0.35 if region.is_wall else SEEN_THROUGH, cast_shadow=False, receive_shadow=False,
        )  # fmt: skip
    if len(region.outline):
        scene.add_line_segments(
            f"{name}/outline", region.outline, colour, thickness=1.5, thickness_units="screen"
        )
