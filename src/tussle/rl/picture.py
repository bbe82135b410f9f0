"""Pictures of a running world, by the renderer of films."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tussle.engine.simulation import Simulation
from tussle.view.export.film.cameras import (
    AZIMUTH,
    ELEVATION,
    MARGIN,
    MAX_SIZE,
    MIN_SIZE,
    UP,
    VIEW_ANGLE,
    View,
)
from tussle.view.export.film.renderer import Renderer
from tussle.view.frame import FrameReader
from tussle.view.scenery import scenery_of
from tussle.view.style import Style

SIZE = (640, 480)
MIN_HALF = 1.0
"""Least half of the height that a picture shows [m]."""


class WorldCamera:
    """Draws one world of a simulation from the south and above, with all its entities in the picture.

    Args:
        simulation: The simulation.
        world: Number of the world.
        size: Width and height of the pictures [pixels].

    Raises:
        MissingExtraError: The packages of `tussle[view]` are not installed.
        ViewError: Nothing can draw without a display.
    """

    def __init__(self, simulation: Simulation, world: int = 0, size: tuple[int, int] = SIZE) -> None:
        blocks = simulation.mission.blocks
        plugins = [[type(p).__name__ for p in b.plugins] for b in blocks]
        boxes = [b.box for b in blocks]
        style = Style([b.name for b in blocks], [b.team for b in blocks], plugins, boxes=boxes)
        self._reader, self._aspect = FrameReader(simulation, world), size[0] / size[1]
        self._renderer = Renderer(style, scenery_of(simulation.mission), size)
        flat = math.cos(ELEVATION)
        self._back = np.array([flat * math.cos(AZIMUTH), flat * math.sin(AZIMUTH), math.sin(ELEVATION)])

    def picture(self) -> Any:
        """The present state as red, green, blue, (height, width, 3), uint8."""
        frame = self._reader.frame()
        pos = frame.pos if len(frame) else np.zeros((1, 3))
        low, high = pos.min(axis=0), pos.max(axis=0)
        half = max(0.5 * float(np.linalg.norm(high - low)) / MARGIN, MIN_HALF)
        middle, seen = 0.5 * (low + high), 2.0 * half * self._aspect
        spacing = seen / math.sqrt(len(pos) + 1.0)
        length = float(np.clip(spacing, MIN_SIZE * seen, MAX_SIZE * seen))
        eye = middle + self._back * half / math.tan(0.5 * VIEW_ANGLE)
        self._renderer.show(frame, View(eye, middle, UP, half, model_length=length))
        return self._renderer.picture()

    def close(self) -> None:
        """Free the renderer."""
        self._renderer.__exit__(None, None, None)
