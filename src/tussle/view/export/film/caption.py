"""What a picture says in words: the time, who is left, how wide the grid is, and who is who."""

from __future__ import annotations

import numpy as np

from tussle.view.export.film.ground import Tints, grid_steps, ground_width
from tussle.view.export.film.lettering import Lettering, fill
from tussle.view.export.film.view import View
from tussle.view.frame import Frame
from tussle.view.recording import Recording

INK, FAINT, PAPER = (38, 44, 50), (96, 104, 112), (255, 255, 255)
MOST_TEAMS = 8
"""Teams that have a line of their own."""


class Caption:
    """Draws the words onto pictures.

    Args:
        recording: What is filmed.
        size: Width and height of the pictures [pixels]; letters are larger on larger ones.
        speed: Simulated seconds per second of film; 0 for a picture that stands still.
        has_panel: The time, the teams, the title and the size of the grid are written.
        has_labels: Each entity has its id beside it.
    """

    def __init__(
        self,
        recording: Recording,
        size: tuple[int, int],
        speed: float,
        has_panel: bool = True,
        has_labels: bool = False,
    ) -> None:
        self._recording = recording
        self._lettering = Lettering()
        self._unit = min(size[1] / 720.0, size[0] / 960.0)
        self._speed = speed
        r, g, b = Tints.on(recording.scenery.background).ink
        self._ink = (round(r), round(g), round(b))
        self._has_panel, self._has_labels = has_panel, has_labels
        self._teams = list(recording.teams.items())[:MOST_TEAMS]

    def draw(self, picture: np.ndarray, frame: Frame, view: View) -> None:
        """Write onto a picture, (rows, columns, 4), uint8."""
        if self._unit * 22.0 < 5.0:
            return  # nobody could read it
        picture = picture[..., :3]
        if self._has_labels:
            self._draw_labels(picture, frame, view)
        if self._has_panel:
            self._draw_panel(picture, frame)
            self._draw_foot(picture, view)

    def _draw_panel(self, picture: np.ndarray, frame: Frame) -> None:
        u, write = self._unit, self._lettering.write
        lines = [(team, name, int((frame.team == team).sum())) for team, name in self._teams]
        wide = max(
            [150.0, *(self._lettering.mask(n[:28], 15.0 * u, False)[0].shape[1] / u for _, n, _ in lines)]
        )
        width = wide + 98.0
        fill(picture, (16 * u, 16 * u, (16 + width) * u, (74 + 25 * len(lines)) * u), PAPER, 0.72)
        write(picture, f"t = {frame.t:.1f} s", (30 * u, 52 * u), 25.0 * u, INK, is_bold=True)
        if self._speed > 0.0:
            write(picture, f"{self._speed:g} ×", ((2 + width) * u, 52 * u), 15.0 * u, FAINT, anchor="right")
        for i, (team, name, n) in enumerate(lines):
            y = (81 + 25 * i) * u
            fill(picture, (30 * u, y - 12 * u, 44 * u, y + 2 * u), self._recording.style.colour(team), 1.0)
            write(picture, name[:28], (54 * u, y), 15.0 * u, INK)
            write(picture, f"{n:,}", ((2 + width) * u, y), 15.0 * u, INK, is_bold=True, anchor="right")

    def _draw_foot(self, picture: np.ndarray, view: View) -> None:
        u, write = self._unit, self._lettering.write
        rows, columns = picture.shape[:2]
        write(picture, self._recording.name[:90], (18 * u, rows - 18 * u), 14.0 * u, self._ink)
        fine, coarse, _ = grid_steps(ground_width(view, self._recording.scenery.ground, columns / rows))
        write(
            picture,
            f"grid {_length(fine)}, {_length(coarse)}",
            (columns - 18 * u, rows - 18 * u),
            14.0 * u,
            self._ink,
            anchor="right",
        )

    def _draw_labels(self, picture: np.ndarray, frame: Frame, view: View) -> None:
        rows, columns = picture.shape[:2]
        pixels, depth = view.project(frame.pos, (columns, rows))
        shown = (depth > 0.0) & (pixels > 0.0).all(axis=1) & (pixels < (columns, rows)).all(axis=1)
        size = 0.5 * view.model_length * rows / (2.0 * view.half_height)
        height = 11.5 * self._unit
        is_taken = np.zeros((rows // 4 + 1, columns // 4 + 1), bool)
        for k in np.flatnonzero(shown)[
            np.argsort(depth[shown])
        ]:  # nearest first; those of others may not cover them
            x, y = pixels[k][0], pixels[k][1] - size - 3.0 * self._unit
            text = str(frame.id[k])
            half = 0.5 * self._lettering.mask(text, height, False)[0].shape[1]
            place = np.s_[
                max(0, int(y - height)) // 4 : int(y) // 4 + 1,
                max(0, int(x - half)) // 4 : int(x + half) // 4 + 1,
            ]
            if y > 0.0 and not is_taken[place].any():
                is_taken[place] = True
                self._lettering.write(picture, text, (x, y), height, self._ink, anchor="middle")


def _length(meters: float) -> str:
    return f"{meters / 1000:g} km" if meters >= 1000.0 else f"{meters:g} m"
