"""Draws where the entities have been."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np

from tussle.view.frame import Frame
from tussle.view.looks import Looks
from tussle.view.page.colours import BACKGROUND
from tussle.view.page.display import Display
from tussle.view.page.source import Source

MOST_LINES = 20_000
"""Lines of all trails together: what a browser rebuilds four times a second without a pause."""
MOST_POINTS = 60
"""Of one trail."""


class Trails:
    """Lines behind the entities, from looks back at what was, so that they are right after any jump in time.

    Points lie at fixed times, and each is looked up once.

    Args:
        scene: The server's scene.
        source: The game.
        looks: Colours.
        blocks: Number of blocks.
        display: What is shown.
    """

    def __init__(self, scene: Any, source: Source, looks: Looks, blocks: int, display: Display) -> None:
        self._scene, self._source, self._display = scene, source, display
        self._colours = np.array([looks.block_colour(b) for b in range(blocks)], np.float32).reshape(-1, 3)
        self._background = np.array(BACKGROUND, np.float32)
        self._points: dict[int, Frame] = {}
        self._spacing = 0.0
        self._epoch = -1
        self._handle: Any = None

    def show(self, frame: Frame) -> None:
        """Draw the trails that lead to a moment."""
        if not self._display.has_trails or not self._display.trail_time:
            self.hide()
            return
        lines, colours = self.lines(frame)
        if not len(lines):
            self.hide()
        elif self._handle is None:
            self._handle = self._scene.add_line_segments(
                "/trails", lines, colours, thickness=1.5, thickness_units="screen"
            )
        else:
            self._handle.points, self._handle.colors = lines, colours
            self._handle.visible = True

    def hide(self) -> None:
        """Draw none."""
        if self._handle is not None:
            self._handle.visible = False

    def lines(self, frame: Frame) -> tuple[np.ndarray, np.ndarray]:
        """Ends of all lines [m], (k, 2, 3), float32, and their colours, (k, 2, 3), uint8: the older, the nearer to the background."""
        moments = self._moments(frame)
        parts, shades = [], []
        length = self._display.trail_time
        for old, new in itertools.pairwise(moments):
            _, a, b = np.intersect1d(old.id, new.id, assume_unique=True, return_indices=True)
            parts.append(np.stack([old.pos[a], new.pos[b]], axis=1).astype(np.float32))
            colour = self._colours[new.block[b]]
            fade = [0.9 * min(1.0, max(0.0, frame.t - moment.t) / length) for moment in (old, new)]
            shades.append(np.stack([colour + f * (self._background - colour) for f in fade], axis=1))
        if not parts:
            return np.zeros((0, 2, 3), np.float32), np.zeros((0, 2, 3), np.uint8)
        return np.concatenate(parts), np.concatenate(shades).astype(np.uint8)

    def _moments(self, frame: Frame) -> list[Frame]:
        """Frames at the points of the trails, the oldest first, the last one now."""
        n_points = min(MOST_POINTS, max(2, MOST_LINES // max(len(frame), 1)))
        spacing = self._display.trail_time / n_points
        if spacing != self._spacing or self._source.epoch != self._epoch:
            self._points.clear()
            self._spacing, self._epoch = spacing, self._source.epoch
        first_time = max(self._source.span[0], frame.t - self._display.trail_time)
        first, last = math.ceil(first_time / spacing - 1e-9), math.ceil(frame.t / spacing - 1e-9) - 1
        self._points = {k: self._points[k] for k in range(first, last + 1) if k in self._points}
        for k in range(first, last + 1):
            if k not in self._points:
                self._points[k] = self._source.frame_at(k * spacing)
        moments = [self._points[k] for k in sorted(self._points)]
        kept = [m for i, m in enumerate(moments) if m.t < frame.t and (not i or m.t > moments[i - 1].t)]
        return [*kept, frame]
