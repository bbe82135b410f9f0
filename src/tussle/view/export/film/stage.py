"""The picture of one moment, drawn by VTK into memory."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.view.export.film import ground
from tussle.view.export.film.view import ANGLE, View
from tussle.view.export.film.window import drawing_window
from tussle.view.frame import Frame
from tussle.view.scenery import Scenery
from tussle.view.shapes import MODELS, Mesh, ball
from tussle.view.style import Style
from tussle.view.terrain import Terrain

MOST_SHADOWS = 600
"""Entities up to which each has a shadow; of more, they would hide the ground and take half of the time."""
EDGE = (92, 104, 116)
"""Red, green, blue of boundaries that belong to nobody."""
AXES = ((200, 70, 60), (70, 150, 70), (70, 110, 200))
"""Red, green, blue of the axes to east, north and up."""
TERRAIN_SHARES = (0.0, 0.5, 1.0)
TERRAIN = ((172, 190, 158), (205, 196, 166), (236, 234, 230))
"""Red, green, blue of low, middle and high terrain."""
FAR = 60.0
"""Distances to the target within which anything is drawn."""


class Stage:
    """A scene that is lit, and an eye.

    Ground and what lies on it are drawn first and hide nothing: where a mission has no ground, entities fly below it and stay
    visible.

    Args:
        style: Colours and models of the entities.
        scenery: What stands still.
        size: Width and height of the pictures [pixels].
        line_width: Width of lines [pixels].

    Raises:
        MissingExtraError: PyVista is not installed.
        ViewError: Nothing can draw without a display.
    """

    def __init__(
        self, style: Style, scenery: Scenery, size: tuple[int, int], line_width: float = 1.5
    ) -> None:
        with drawing_window():
            import pyvista

            pv: Any = pyvista
            self._plotter = pv.Plotter(off_screen=True, window_size=list(size), lighting="none")
        self.style, self.scenery, self.size = style, scenery, size
        self.tints = ground.Tints.on(scenery.background)
        self._line_width = line_width
        self._pyvista = pv
        plotter = self._plotter
        plotter.disable_anti_aliasing()
        plotter.ren_win.SetMultiSamples(0)
        self._below = plotter.renderer
        self._above = pv.Renderer(plotter, border=False)
        self._above.SetLayer(1)
        plotter.ren_win.SetNumberOfLayers(2)
        plotter.ren_win.AddRenderer(self._above)
        self._above.camera = plotter.camera
        for renderer in (self._below, self._above):
            # Sorting by weight takes three passes over the whole picture; here, what is drawn later lies above.
            renderer.SetUseOIT(False)
        self._above.add_light(pv.Light(position=(-0.5, -0.35, 1.0), light_type="scene light"))
        self._pixels = pv.convert_array(np.zeros((size[0] * size[1], 4), np.uint8))
        self._set_ground()
        self._set_scenery()
        self._models: dict[str, _Crowd] = {}
        self._lines = self._add_lines(self._above, 1.6)

    # -- what stands still ------------------------------------------------------------------------------------------------------

    def _mesh(self, points: np.ndarray, faces: np.ndarray) -> Any:
        return self._pyvista.PolyData.from_regular_faces(np.asarray(points, np.float32), faces)

    def _add(self, renderer: Any, mesh: Any, is_lit: bool = False, is_seen_through: bool = False) -> Any:
        """An actor for a mesh whose points have colours."""
        mapper = self._pyvista.DataSetMapper(mesh)
        mapper.scalar_visibility = True
        mapper.scalar_map_mode = "point_field"
        mapper.SelectColorArray("rgb")
        mapper.SetColorModeToDirectScalars()
        actor = self._pyvista.Actor(mapper=mapper)
        actor.prop.lighting = is_lit
        actor.prop.interpolation = "Flat"
        actor.prop.ambient, actor.prop.diffuse = (0.42, 0.68) if is_lit else (1.0, 0.0)
        if is_seen_through:
            actor.ForceTranslucentOn()
        renderer.AddActor(actor)
        return actor

    def _add_surface(
        self, renderer: Any, surface: tuple[np.ndarray, np.ndarray, np.ndarray], is_seen_through: bool = True
    ) -> Any:
        points, faces, colours = surface
        mesh = self._mesh(points, faces)
        mesh.point_data["rgb"] = np.round(colours).astype(np.uint8)
        return self._add(renderer, mesh, is_seen_through=is_seen_through)

    def _add_lines(self, renderer: Any, width: float = 1.0) -> Any:
        actor = self._add(renderer, self._pyvista.PolyData(), is_seen_through=True)
        actor.prop.line_width = width * self._line_width
        return actor

    def _set_lines(self, actor: Any, ends: np.ndarray, colours: np.ndarray) -> None:
        """Lines between each two points, (2 k, 3), with red, green, blue, opacity at each, (2 k, 4)."""
        mesh = actor.mapper.dataset
        n = len(ends) // 2
        actor.visibility = n > 0
        if n == 0:
            return
        if mesh.n_points != len(ends):
            mesh = self._pyvista.PolyData()
            mesh.points = ends.astype(np.float32)
            mesh.lines = np.column_stack([np.full(n, 2), np.arange(2 * n).reshape(n, 2)]).ravel()
            actor.mapper.dataset = mesh
        else:
            mesh.points = ends.astype(np.float32)
        mesh.point_data["rgb"] = np.clip(np.round(colours), 0, 255).astype(np.uint8)

    def _set_ground(self) -> None:
        # The sky after the ground, so that it is not painted where the ground will be.
        self._disc = self._add_surface(self._below, ground.ground_disc(self.tints), is_seen_through=False)
        self._dome = self._add_surface(self._below, ground.sky_dome(self.tints), is_seen_through=False)
        self._grid = self._add_lines(self._below)

    def _set_scenery(self) -> None:
        scenery, style = self.scenery, self.style
        low = max(scenery.size * 1e-4, 0.01)
        for base in scenery.bases:
            rgb = style.colour(base.team)
            dome = ball(3).placed(2.0 * base.radius, base.pos.tolist())
            self._add_surface(self._above, _tinted(dome, (*rgb, 70.0 * base.opacity)))
            circle = _circle(base.pos, base.radius)
            circle[:, 2] = max(scenery.ground, 0.0) + low
            self._set_lines(self._add_lines(self._below, 2.0), *_inked(circle, (*rgb, 220.0)))
        for region in scenery.boundaries:
            rgb = style.colour(region.team) if region.team else EDGE  # team 0 is nobody's
            # A plane has no edges but those of the piece that is shown.
            self._add_surface(self._above, _tinted(region.mesh, (*rgb, 60.0 if region.is_wall else 12.0)))
            ends = region.outline.reshape(-1, 3).astype(float)
            self._set_lines(self._add_lines(self._above, 1.4), *_inked(ends, (*rgb, 190.0)))
        if scenery.terrain is not None:
            self._set_terrain(scenery.terrain)
        axes = scenery.origin_length * np.eye(3)
        for axis, rgb in zip(axes, AXES, strict=True):
            ends = np.stack([np.zeros(3), axis]) + np.array([0.0, 0.0, low])
            self._set_lines(self._add_lines(self._below, 1.6), *_inked(ends, (*rgb, 200.0)))

    def _set_terrain(self, terrain: Terrain) -> None:
        mesh = terrain.mesh()
        height = mesh.vertices[:, 2]
        share = (height - height.min()) / max(float(np.ptp(height)), 1e-9)
        colours = np.stack([np.interp(share, TERRAIN_SHARES, c) for c in np.transpose(TERRAIN)], axis=1)
        surface = self._mesh(mesh.vertices, mesh.faces)
        surface.point_data["rgb"] = np.round(colours).astype(np.uint8)
        self._add(self._above, surface, is_lit=True)

    # -- what moves -------------------------------------------------------------------------------------------------------------

    def draw(
        self, frame: Frame, view: View, lines: tuple[np.ndarray, np.ndarray] | None = None
    ) -> np.ndarray:
        """The picture, (height, width, 4), uint8: red, green, blue, and nothing.

        Args:
            frame: The moment.
            view: From where it is seen.
            lines: Trails and marks: ends [m], (2 k, 3), and red, green, blue, opacity at each, (2 k, 4), 0 to 255.
        """
        self._look(view)
        self._place_ground(view)
        self._place_models(frame, view)
        if lines is not None:
            self._set_lines(self._lines, *lines)
        window = self._plotter.ren_win
        window.Render()
        # With the fourth value that nobody needs: taking it out is left to who reads it, for the graphics library takes longer.
        window.GetRGBACharPixelData(0, 0, self.size[0] - 1, self.size[1] - 1, 0, self._pixels)
        rows = self._pyvista.convert_array(self._pixels).reshape(self.size[1], self.size[0], 4)
        picture: np.ndarray = rows[::-1].copy()
        return picture

    def _look(self, view: View) -> None:
        camera = self._plotter.camera
        camera.position, camera.focal_point, camera.up = view.eye, view.target, view.up
        camera.parallel_projection = view.is_parallel
        camera.parallel_scale = view.half_height
        camera.view_angle = float(np.degrees(ANGLE))
        camera.clipping_range = (0.02 * view.distance, FAR * view.distance)

    def _place_ground(self, view: View) -> None:
        z = self.scenery.ground
        width = ground.ground_width(view, z, self.size[0] / self.size[1])
        self._dome.position, self._dome.scale = view.eye, 0.5 * FAR * view.distance
        self._dome.visibility = ground.sees_sky(view, z, ground.REACH * width)
        # Seen from straight above, ground has one colour, and painting it would take a quarter of the time.
        self._disc.visibility = not view.is_parallel
        behind = self.tints.ground if view.is_parallel else self.tints.haze
        self._below.SetBackground([c / 255.0 for c in behind])
        # So much lower that what lies on it is not lost in the rounding of depths.
        self._disc.position = (view.target[0], view.target[1], z - 0.003 * view.distance)
        self._disc.scale = ground.REACH * width
        self._set_lines(self._grid, *ground.grid_lines(view, z, width, self.tints.line))

    def _place_models(self, frame: Frame, view: View) -> None:
        names = [self.style.model(b) for b in range(int(frame.block.max(initial=-1)) + 1)]
        model_of = np.array([*names, ""])[frame.block]
        for name in sorted({*names, *self._models}):
            if name not in self._models:
                self._models[name] = _Crowd(self, name)
            rows = np.flatnonzero(model_of == name)
            self._models[name].place(frame, rows, view.model_length)

    def close(self) -> None:
        """Give the memory back."""
        self._plotter.close()


class _Crowd:
    """All entities that look alike, as one mesh: faster than an actor each by two orders."""

    def __init__(self, stage: Stage, model: str) -> None:
        self._stage = stage
        mesh = MODELS[model]
        self._vertices, self._faces = mesh.vertices, mesh.faces
        self._actor = stage._add(stage._above, stage._pyvista.PolyData(), is_lit=True)
        self._shadow = stage._add(stage._below, stage._pyvista.PolyData(), is_seen_through=True)
        self._drawn = np.zeros(0, np.int32)

    def place(self, frame: Frame, rows: np.ndarray, least: float) -> None:
        """Draw the entities in these rows, none shorter than this [m]."""
        self._actor.visibility = self._shadow.visibility = len(rows) > 0
        if not len(rows):
            return
        block, style = frame.block[rows], self._stage.style
        lengths = np.array([max(style.scale(b), least) for b in range(int(block.max()) + 1)])
        turned = self._vertices @ (rotations(frame.quat[rows]) * lengths[block, None, None]).transpose(
            0, 2, 1
        )
        points = (turned + frame.pos[rows, None]).reshape(-1, 3)
        if not np.array_equal(self._drawn, block):
            self._drawn = block.copy()
            self._rebuild(points)
        self._actor.mapper.dataset.points = points.astype(np.float32)
        self._shadow.visibility = len(rows) <= MOST_SHADOWS
        if self._shadow.visibility:
            points[:, 2] = self._stage.scenery.ground
            self._shadow.mapper.dataset.points = points.astype(np.float32)

    def _rebuild(self, points: np.ndarray) -> None:
        n, v = len(self._drawn), len(self._vertices)
        faces = (self._faces + v * np.arange(n)[:, None, None]).reshape(-1, 3)
        colours = np.array([self._stage.style.block_colour(int(b)) for b in self._drawn], np.uint8)
        for actor, rgb in (
            (self._actor, colours),
            (self._shadow, np.tile(np.array(self._stage.tints.shadow, np.uint8), (n, 1))),
        ):
            mesh = self._stage._mesh(points, faces)
            mesh.point_data["rgb"] = np.repeat(rgb, v, axis=0)
            actor.mapper.dataset = mesh


def _circle(middle: np.ndarray, radius: float, n: int = 64) -> np.ndarray:
    """A level circle as ends of lines [m], (2 n, 3)."""
    angle = 2.0 * np.pi * np.arange(n + 1) / n
    points = middle + radius * np.stack([np.cos(angle), np.sin(angle), np.zeros(n + 1)], axis=1)
    return np.stack([points[:-1], points[1:]], axis=1).reshape(-1, 3)


def _tinted(mesh: Mesh, rgba: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A surface in one colour: points, triangles, colours."""
    return mesh.vertices, mesh.faces, np.tile(rgba, (len(mesh.vertices), 1))


def _inked(ends: np.ndarray, rgba: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Lines in one colour: ends, colours."""
    return ends, np.tile(rgba, (len(ends), 1))


def rotations(quat: np.ndarray) -> np.ndarray:
    """Matrices of attitudes, (n, 3, 3), body to world."""
    w, x, y, z = quat.T
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)
