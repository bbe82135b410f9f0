"""Draws the pictures of a film with PyVista, without a display."""

from __future__ import annotations

import ctypes
import math
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Self

import numpy as np

from tussle.errors import MissingExtraError, ViewError
from tussle.view.export.film.cameras import VIEW_ANGLE, View
from tussle.view.export.film.ground import Tints, grid_lines, ground_width
from tussle.view.frame import Frame
from tussle.view.scenery import Scenery
from tussle.view.shapes import MODELS, Mesh, ball
from tussle.view.solids import Terrain
from tussle.view.style import Style
from tussle.world.rays.surfaces import MeshPart

WINDOW_VARIABLE = "VTK_DEFAULT_OPENGL_WINDOW"
"""Environment variable by which VTK chooses its window; the user's own value is kept."""
OSMESA, EGL = "vtkOSOpenGLRenderWindow", "vtkEGLRenderWindow"
LIBRARIES = {
    OSMESA: ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"),
    EGL: ("libEGL.so.1", "libEGL.so"),
}
MAX_SHADOWS = 600
"""Largest number of entities with shadows; more would hide the ground."""
NO_TEAM = (92, 104, 116)
"""Red, green, blue of boundaries that belong to no team."""
AXES = ((200, 70, 60), (70, 150, 70), (70, 110, 200))
"""Red, green, blue of the axes to east, north and up."""
TERRAIN_SHARES = (0.0, 0.5, 1.0)
TERRAIN = ((172, 190, 158), (205, 196, 166), (236, 234, 230))
"""Red, green, blue of low, middle and high terrain."""
GROUND_REACH = 4.0
"""Radius of the ground as a multiple of its width in the picture."""
FAR = 60.0
"""Far clipping distance as a multiple of the distance to the target."""

Lines = tuple[np.ndarray, np.ndarray]
"""Ends of lines [m], (2 k, 3), and red, green, blue, opacity of each end, (2 k, 4), 0 to 255."""


def find_window() -> str:
    """Name of VTK's window class for drawing without a display.

    A graphics card draws through EGL. Without one Mesa draws on the processor: by OSMesa, which is faster, or EGL.

    Raises:
        ViewError: Neither library is installed.
    """
    has_card = any(Path("/dev").glob("nvidia[0-9]*")) or any(Path("/dev/dri").glob("renderD*"))
    for name in (EGL, OSMESA) if has_card else (OSMESA, EGL):
        if any(is_installed(library) for library in LIBRARIES[name]):
            return name
    raise ViewError(
        "pictures need OSMesa or EGL to be drawn without a display, and neither is installed: "
        "apt-get install libosmesa6, or libegl1 with a graphics card's driver"
    )


def is_installed(library: str) -> bool:
    """Return True if a shared library can be loaded."""
    with suppress(OSError):
        ctypes.CDLL(library)
        return True
    return False


@contextmanager
def _delayed_interrupt() -> Iterator[None]:
    """A context in which Ctrl-C takes effect at its end: VTK crashes if it is interrupted while it is loaded.

    Only the main thread receives Ctrl-C; in others, nothing changes.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    pressed: list[int] = []
    previous = signal.signal(signal.SIGINT, lambda number, _: pressed.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)
        if pressed:
            signal.raise_signal(signal.SIGINT)


@contextmanager
def _offscreen_window() -> Iterator[Any]:
    """PyVista, whose windows that are made inside need no display."""
    try:
        import pyvista
    except ImportError as error:
        raise MissingExtraError(
            "films and pictures need pyvista, which is not installed: pip install 'tussle[view]'"
        ) from error
    is_chosen = WINDOW_VARIABLE in os.environ
    if not is_chosen:
        os.environ[WINDOW_VARIABLE] = find_window()
    try:
        yield pyvista
    finally:
        if not is_chosen:
            del os.environ[WINDOW_VARIABLE]


class Renderer:
    """A scene with its light and camera.

    The ground and what lies on it are drawn first and hide nothing: entities below the ground stay visible.

    Args:
        style: Colours and models of the entities.
        scenery: Ground, bases, boundaries and terrain.
        size: Width and height of the pictures [pixels].
        line_width: Width of lines [pixels].

    Attributes:
        plotter: The PyVista plotter.

    Raises:
        MissingExtraError: PyVista is not installed.
        ViewError: Nothing can draw without a display.
    """

    def __init__(
        self, style: Style, scenery: Scenery, size: tuple[int, int], line_width: float = 1.5
    ) -> None:
        with _delayed_interrupt(), _offscreen_window() as pv:
            self.plotter = pv.Plotter(off_screen=True, window_size=list(size), lighting="none", border=False)
        self.style, self.scenery, self.size = style, scenery, size
        self.tints = Tints.on(scenery.background)
        self._pyvista: Any = pv
        self._line_width = line_width
        plotter = self.plotter
        plotter.disable_anti_aliasing()
        plotter.ren_win.SetMultiSamples(0)
        self._ground = pv.Renderer(plotter, border=False)
        self._ground.camera = plotter.camera
        plotter.ren_win.SetNumberOfLayers(2)
        plotter.renderer.SetLayer(1)
        plotter.ren_win.AddRenderer(self._ground)
        for renderer in (plotter.renderer, self._ground):
            renderer.SetUseOIT(
                False
            )  # translucent actors are drawn in their order, in one pass instead of three
        plotter.add_light(pv.Light(position=(-0.5, -0.35, 1.0), light_type="scene light"))
        self._disc = self._add_disc()
        self._grid = self._add_lines(1.0, on_ground=True)
        self._add_scenery()
        self._models: dict[str, _Model] = {}
        self._lines = self._add_lines(1.6)

    def _add(self, mesh: Any, *, on_ground: bool = False, is_lit: bool = False, **look: Any) -> Any:
        """Add a mesh, with PyVista's options; with the colours of its points where it has an array `rgba`."""
        if "rgba" in mesh.point_data:
            look |= {"scalars": "rgba", "rgba": True}
        actor = self.plotter.add_mesh(
            mesh, lighting=is_lit, ambient=0.42 if is_lit else 1.0, diffuse=0.68 if is_lit else 0.0,
            interpolate_before_map=False, reset_camera=False, render=False, copy_mesh=False, **look,
        )  # fmt: skip
        if on_ground:
            self.plotter.renderer.RemoveActor(actor)
            self._ground.AddActor(actor)
        return actor

    def _add_lines(self, width: float, on_ground: bool = False, lines: Lines | None = None) -> Any:
        nothing = np.zeros((2, 3)), np.zeros((2, 4))
        actor = self._add(
            self._segments(*(lines or nothing)), on_ground=on_ground, line_width=width * self._line_width
        )
        actor.ForceTranslucentOn()
        return actor

    def _segments(self, ends: np.ndarray, colours: np.ndarray) -> Any:
        """A mesh of lines."""
        mesh = self._pyvista.line_segments_from_points(ends.astype(np.float32))
        mesh.point_data["rgba"] = np.clip(np.round(colours), 0, 255).astype(np.uint8)
        return mesh

    def _surface(self, mesh: Mesh) -> Any:
        return self._pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.faces)

    def _add_disc(self) -> Any:
        """The ground: a disc of radius 1 that fades into the haze."""
        disc = self._pyvista.Disc(inner=0.0, outer=1.0, r_res=16, c_res=48)
        fade = np.clip((np.linalg.norm(disc.points, axis=1) - 0.12) / 0.6, 0.0, 1.0) ** 0.8
        ground, haze = np.array(self.tints.ground), np.array(self.tints.haze)
        rgba = np.column_stack([ground + fade[:, None] * (haze - ground), np.full(len(fade), 255.0)])
        disc.point_data["rgba"] = rgba.round().astype(np.uint8)
        return self._add(disc, on_ground=True)

    def _add_scenery(self) -> None:
        scenery, style = self.scenery, self.style
        lift = max(scenery.size * 1e-4, 0.01)
        for base in scenery.bases:
            rgb = style.colour(base.team)
            dome = ball(3).placed(2.0 * base.radius, list(base.position))
            self._add(self._surface(dome), color=rgb, opacity=0.27 * base.opacity)
            place = (base.position[0], base.position[1], max(scenery.ground, 0.0) + lift)
            circle = self._pyvista.Polygon(center=place, radius=base.radius, n_sides=64, fill=False)
            self._add(circle, on_ground=True, color=rgb, opacity=0.86, line_width=2.0 * self._line_width)
        for region in scenery.boundaries:
            rgb = style.colour(region.team) if region.team else NO_TEAM
            for part in region.parts:
                self._add_part(part)
            if not region.parts:
                self._add(self._surface(region.mesh), color=rgb, opacity=0.24 if region.is_wall else 0.05)
            self._add_outline(region.outline.reshape(-1, 3), rgb, 0.75, 1.4)
        if scenery.terrain is not None:
            self._add_terrain(scenery.terrain)
        for axis, rgb in zip(scenery.origin_length * np.eye(3), AXES, strict=True):
            ends = np.stack([np.zeros(3), axis]) + np.array([0.0, 0.0, lift])
            self._add_outline(ends, rgb, 0.8, 1.6, on_ground=True)

    def _add_outline(
        self, ends: np.ndarray, rgb: tuple[int, ...], opacity: float, width: float, on_ground: bool = False
    ) -> None:
        if len(ends):
            self._add_lines(width, on_ground, (ends, np.tile((*rgb, 255.0 * opacity), (len(ends), 1))))

    def _add_part(self, part: MeshPart) -> None:
        surface = self._surface(Mesh(part.vertices, part.faces))
        if part.image is None:
            opaque = np.full((len(part.colours), 1), 255, np.uint8)
            surface.point_data["rgba"] = np.hstack([part.colours, opaque])
            self._add(surface, is_lit=True)
        else:
            surface.active_texture_coordinates = np.asarray(part.uv, np.float32)
            self._add(surface, is_lit=True, texture=self._pyvista.numpy_to_texture(part.image))

    def _add_terrain(self, terrain: Terrain) -> None:
        if (part := terrain.part()) is not None:
            self._add_part(part)
            return
        mesh = terrain.mesh()
        height = mesh.vertices[:, 2]
        share = (height - height.min()) / max(float(np.ptp(height)), 1e-9)
        colours = [np.interp(share, TERRAIN_SHARES, c) for c in np.transpose(TERRAIN)]
        surface = self._surface(mesh)
        surface.point_data["rgba"] = np.column_stack([*colours, np.full(len(share), 255.0)]).astype(np.uint8)
        self._add(surface, is_lit=True)

    def show(self, frame: Frame, view: View, lines: Lines | None = None) -> None:
        """Arrange the scene as at one moment, seen from a camera pose, with trails and marks."""
        self._place_camera(view)
        self._place_ground(view)
        self._place_models(frame, view)
        if lines is not None:
            self._set_lines(self._lines, lines)

    def picture(self) -> np.ndarray:
        """Draw the scene, (height, width, 3), uint8."""
        self.plotter.render()
        return np.asarray(self.plotter.screenshot(return_img=True))

    def _place_camera(self, view: View) -> None:
        camera = self.plotter.camera
        self.plotter.camera_position = [view.eye, view.target, view.up]
        camera.parallel_projection = view.is_parallel
        camera.parallel_scale = view.half_height
        camera.view_angle = float(np.degrees(VIEW_ANGLE))
        camera.clipping_range = (0.02 * view.distance, FAR * view.distance)

    def _place_ground(self, view: View) -> None:
        z = self.scenery.ground
        width = ground_width(view, z, self.size[0] / self.size[1])
        # Drawing the disc and the gradient takes time; from straight above, or without a horizon, the picture is the same without.
        self._disc.visibility = not view.is_parallel
        below = self.tints.ground if view.is_parallel else self.tints.haze
        has_horizon = not view.is_parallel and view.axes()[2][2] < math.sin(0.5 * VIEW_ANGLE)
        above = [round(c) for c in self.tints.sky] if has_horizon else None
        self._ground.set_background([round(c) for c in below], top=above)
        # A little lower, so that depth rounding does not hide what lies on it.
        self._disc.position = (view.target[0], view.target[1], z - 0.003 * view.distance)
        self._disc.scale = GROUND_REACH * width
        self._set_lines(self._grid, grid_lines(view, z, width, self.tints.line))

    def _set_lines(self, actor: Any, lines: Lines) -> None:
        actor.visibility = len(lines[0]) > 0
        if len(lines[0]):
            actor.mapper.dataset = self._segments(*lines)

    def _place_models(self, frame: Frame, view: View) -> None:
        names = [self.style.model(b) for b in range(int(frame.block.max(initial=-1)) + 1)]
        model_of = np.array([*names, ""])[frame.block]
        for name in sorted({*names, *self._models}):
            if name not in self._models:
                self._models[name] = _Model(self, self._surface(MODELS[name]))
            self._models[name].place(frame, np.flatnonzero(model_of == name), view.model_length)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.plotter.close()


class _Model:
    """All entities of one model, and their shadows, as glyphs."""

    def __init__(self, renderer: Renderer, source: Any) -> None:
        from vtkmodules.vtkRenderingCore import vtkGlyph3DMapper

        self._renderer, pv = renderer, renderer._pyvista
        self._mappers = [vtkGlyph3DMapper() for _ in range(2)]
        self._actor, self._shadow = (pv.Actor() for _ in range(2))
        for actor, mapper in zip((self._actor, self._shadow), self._mappers, strict=True):
            mapper.SetSourceData(source)
            mapper.SetOrientationArray("quat")
            mapper.SetOrientationModeToQuaternion()
            mapper.SetScaleArray("lengths")
            mapper.SetScaleModeToScaleByVectorComponents()
            mapper.SetScalarModeToUsePointFieldData()
            mapper.SelectColorArray("rgb")
            mapper.SetColorModeToDirectScalars()
            actor.SetMapper(mapper)
            actor.prop.interpolation = "Flat"
        self._actor.prop.ambient, self._actor.prop.diffuse = 0.42, 0.68
        self._mappers[1].ScalarVisibilityOff()
        self._shadow.prop.lighting = False
        self._shadow.prop.color = [round(c) for c in renderer.tints.shadow]
        self._shadow.scale, self._shadow.position = (1.0, 1.0, 1e-6), (0.0, 0.0, renderer.scenery.ground)
        renderer.plotter.renderer.AddActor(self._actor)
        renderer._ground.AddActor(self._shadow)

    def place(self, frame: Frame, rows: np.ndarray, least: float) -> None:
        """Draw the entities in these rows, none shorter than this [m] unless it is a box of known lengths."""
        self._actor.visibility = len(rows) > 0
        self._shadow.visibility = 0 < len(rows) <= MAX_SHADOWS
        if not len(rows):
            return
        style, block = self._renderer.style, frame.block[rows]
        n_blocks = int(block.max()) + 1
        points = self._renderer._pyvista.PolyData(frame.pos[rows].astype(np.float32))
        points.point_data["quat"] = frame.quat[rows]
        lengths = [
            np.multiply(style.lengths(b), 1.0 if style.is_true_box(b) else max(1.0, least / style.scale(b)))
            for b in range(n_blocks)
        ]
        points.point_data["lengths"] = np.array(lengths)[block]
        points.point_data["rgb"] = np.array([style.block_colour(b) for b in range(n_blocks)], np.uint8)[block]
        for mapper in self._mappers:
            mapper.SetInputData(points)
