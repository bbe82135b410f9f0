"""Text on pictures: time, entities left by team, title, size of the grid, ids."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tussle.errors import MissingExtraError, visible
from tussle.view.export.film.cameras import UP, View
from tussle.view.export.film.ground import grid_steps, ground_width
from tussle.view.export.film.options import FilmOptions
from tussle.view.export.film.renderer import Renderer
from tussle.view.frame import Frame
from tussle.view.recording import Recording

INK, PAPER = (38, 44, 50), (255, 255, 255)
MAX_TEAMS = 8
"""Teams that have a line."""


class Captions:
    """Text on the pictures of a renderer.

    Args:
        renderer: The renderer.
        recording: The recorded run.
        options: Whether captions and ids are shown.
        speed: Simulated seconds per second of film; 0 for a single picture.
    """

    def __init__(
        self, renderer: Renderer, recording: Recording, options: FilmOptions, speed: float = 0.0
    ) -> None:
        self._renderer, self._recording, self._speed = renderer, recording, speed
        width, height = renderer.size
        self._unit = min(height / 720.0, width / 960.0)
        # Smaller letters could not be read.
        is_legible = 22.0 * self._unit >= 5.0
        self._has_labels = options.labels and is_legible
        self._has_captions = options.captions and is_legible
        if self._has_captions:
            self._add_texts(recording)

    def _add_texts(self, recording: Recording) -> None:
        ink = tuple(round(c) for c in self._renderer.tints.ink)
        width, height, u = *self._renderer.size, self._unit
        self._time = self._text((20 * u, height - 52 * u), 28, INK, on_paper=True)
        self._teams: list[tuple[int, str, Any]] = []
        for i, (team, name) in enumerate(list(recording.teams.items())[:MAX_TEAMS]):
            at = (20 * u, height - (80 + 25 * i) * u)
            text = self._text(at, 17, recording.style.colour(team), on_paper=True)
            self._teams.append((team, _printable(name[:28]), text))
        self._text((18 * u, 14 * u), 15, ink).input = _printable(recording.name[:90])
        self._grid = self._text((width - 18 * u, 14 * u), 15, ink)
        self._grid.prop.justification_horizontal = "right"

    def _text(
        self, at: tuple[float, float], height: float, rgb: tuple[int, ...], on_paper: bool = False
    ) -> Any:
        """Add a text at a place [pixels], with letters of a height [units]."""
        text = self._renderer._pyvista.Text(position=at)
        text.prop.font_size = round(height * self._unit)
        text.prop.color = list(rgb)
        text.prop.set_font_file(_font("DejaVuSans-Bold" if on_paper else "DejaVuSans"))
        if on_paper:
            text.prop.background_color, text.prop.background_opacity = list(PAPER), 0.72
        self._renderer.plotter.add_actor(text, reset_camera=False, render=False)
        return text

    def show(self, frame: Frame, view: View) -> None:
        """Set the text to one moment."""
        if self._has_labels:
            self._label(frame, view)
        if not self._has_captions:
            return
        speed = f"   {self._speed:g} ×" if self._speed > 0.0 else ""
        self._time.input = f" t = {frame.t:.1f} s{speed} "
        for team, name, text in self._teams:
            text.input = f" {int((frame.team == team).sum()):,} {name} "
        width, height = self._renderer.size
        fine, coarse, _ = grid_steps(ground_width(view, self._recording.scenery.ground, width / height))
        self._grid.input = f"grid {_length(fine)}, {_length(coarse)}"

    def _label(self, frame: Frame, view: View) -> None:
        """Write ids above the entities, as far as they do not overlap."""
        plotter = self._renderer.plotter
        plotter.remove_actor("ids", render=False)
        if len(frame):
            up = view.up if view.is_parallel else UP
            plotter.add_point_labels(
                frame.pos + 0.7 * view.model_length * up, frame.id.astype(str).tolist(), name="ids", bold=False,
                font_file=_font("DejaVuSans"),
                font_size=round(13 * self._unit), text_color=[round(c) for c in self._renderer.tints.ink],
                show_points=False, shape=None, always_visible=True, reset_camera=False, render=False,
                justification_horizontal="center",
            )  # fmt: skip


def _font(name: str) -> str:
    """Path of one of Matplotlib's fonts.

    Raises:
        MissingExtraError: Matplotlib is not installed.
    """
    try:
        from matplotlib import get_data_path
    except ImportError as error:
        raise MissingExtraError(
            "text on pictures needs matplotlib, which is not installed: pip install 'tussle[view]'"
        ) from error
    return str(Path(get_data_path()) / "fonts" / "ttf" / f"{name}.ttf")


def _printable(text: str) -> str:
    return visible(" ".join(text.split()))


def _length(metres: float) -> str:
    return f"{metres / 1000:g} km" if metres >= 1000.0 else f"{metres:g} m"
