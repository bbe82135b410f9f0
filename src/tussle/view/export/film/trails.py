"""Trails behind entities, and rings where entities were removed."""

from __future__ import annotations

import math

import numpy as np

from tussle.view.export.film.cameras import View
from tussle.view.export.film.moments import Moments
from tussle.view.export.film.renderer import Lines
from tussle.view.frame import Frame

N_POINTS = 28
"""Points of a trail."""
OPACITY = 0.75
"""Opacity of a trail at the entity, of up to FEW entities; it fades to 0."""
FEW = 200
RING_TIME = 0.8
"""Duration of a ring [s of film]."""
N_CIRCLE = 20
NO_LINES: Lines = np.zeros((0, 3)), np.zeros((0, 4))


class Trails:
    """Trails and rings of a film.

    Args:
        moments: The pictures.
        length: Duration that a trail shows [s]; 0 for no trails.
    """

    def __init__(self, moments: Moments, length: float) -> None:
        self._moments, self._length = moments, length
        recording = moments.recording
        colours = [recording.style.block_colour(b) for b in range(len(recording.blocks))]
        self._colours = np.array(colours or [(0, 0, 0)])
        self._past: dict[int, Frame] = {}
        self._deaths = [event for event in recording.events if event.kind == "death"]
        self._death_times = np.array([event.t for event in self._deaths])

    def lines(self, frame: Frame, view: View) -> Lines:
        """Trails and rings at one moment."""
        parts = [self._trails(frame), *self._rings(frame.t, view)]
        return np.concatenate([ends for ends, _ in parts]), np.concatenate([colours for _, colours in parts])

    def _trails(self, frame: Frame) -> Lines:
        """Lines through the positions at multiples of a fixed time: points that do not move do not flicker."""
        if self._length <= 0.0 or not len(frame):
            return NO_LINES
        step = self._length / N_POINTS
        newest = math.ceil(frame.t / step) - 1
        oldest = max(newest - N_POINTS, math.ceil(float(self._moments.recording.t[0]) / step))
        self._past = {k: f for k, f in self._past.items() if k >= oldest}
        points, ages = [frame.pos], [0.0]
        for k in range(newest, oldest - 1, -1):
            if k not in self._past:
                self._past[k] = self._moments.at(k * step)
            points.append(_positions(self._past[k], frame.id))
            ages.append(frame.t - k * step)
        path = np.stack(points, axis=1)
        ends = np.stack([path[:, :-1], path[:, 1:]], axis=2)
        fade = np.clip(1.0 - np.array(ages) / self._length, 0.0, 1.0) ** 1.5
        colours = np.empty((*ends.shape[:3], 4))
        colours[..., :3] = self._colours[frame.block][:, None, None]
        opacity = OPACITY * min(1.0, (FEW / len(frame)) ** 0.35)
        colours[..., 3] = 255.0 * opacity * np.stack([fade[:-1], fade[1:]], axis=1)
        is_jump = np.linalg.norm(ends[:, :, 0] - ends[:, :, 1], axis=-1) > self._moments.jump
        kept = np.isfinite(ends).all(axis=(2, 3)) & ~is_jump
        return ends[kept].reshape(-1, 3), colours[kept].reshape(-1, 4)

    def _rings(self, t: float, view: View) -> list[Lines]:
        """Rings that grow and fade where entities were removed."""
        duration = RING_TIME * self._moments.speed
        first, last = np.searchsorted(self._death_times, [t - duration, t], side="right")
        right, up, _ = view.axes()
        angle = 2.0 * np.pi * np.arange(N_CIRCLE + 1) / N_CIRCLE
        circle = np.outer(np.cos(angle), right) + np.outer(np.sin(angle), up)
        rings = []
        for death in self._deaths[first:last]:
            frame = self._moments.recording.at(death.t)
            row = frame.row_of(death.id)
            if row < 0:
                continue
            share = (t - death.t) / duration
            ring = frame.pos[row] + view.model_length * (0.6 + 1.6 * share) * circle
            colour = [*self._colours[frame.block[row]], 255.0 * (1.0 - share)]
            ends = np.stack([ring[:-1], ring[1:]], axis=1).reshape(-1, 3)
            rings.append((ends, np.tile(colour, (2 * N_CIRCLE, 1))))
        return rings


def _positions(frame: Frame, ids: np.ndarray) -> np.ndarray:
    """Positions of entities with these ids [m], (n, 3); nan where they do not exist."""
    pos = np.full((len(ids), 3), np.nan)
    if len(frame):
        rows = np.minimum(np.searchsorted(frame.id, ids), len(frame) - 1)
        found = frame.id[rows] == ids
        pos[found] = frame.pos[rows[found]]
    return pos
