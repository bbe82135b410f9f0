"""What has just been, drawn as lines: trails behind the entities, and rings where one was lost."""

from __future__ import annotations

import math

import numpy as np

from tussle.view.export.film.moments import Moments
from tussle.view.export.film.view import View
from tussle.view.frame import Frame

N_POINTS = 28
"""Points of a trail."""
OPACITY = 0.75
"""Of a trail where it begins, of up to FEW entities; it fades to nothing."""
FEW = 200
RING_TIME = 0.8
"""How long a ring is seen [s of film]."""
N_CIRCLE = 20

Lines = tuple[np.ndarray, np.ndarray]
"""Ends of lines [m], (2 k, 3), and red, green, blue, opacity at each, (2 k, 4), 0 to 255."""


class Tracks:
    """Lines of the past of each moment.

    Args:
        moments: The film.
        length: How much of the past a trail shows [s]; 0 for no trails.
    """

    def __init__(self, moments: Moments, length: float) -> None:
        self._moments = moments
        self._length = length
        recording = moments.recording
        self._colours = np.array(
            [recording.style.block_colour(b) for b in range(len(recording.blocks))] or [(0, 0, 0)]
        )
        self._past: dict[int, Frame] = {}
        deaths = [h for h in recording.events if h.kind == "death"]
        self._deaths = deaths
        self._death_times = np.array([h.t for h in deaths])

    def lines(self, frame: Frame, view: View) -> Lines:
        """Trails and rings of a moment."""
        parts = [self._trails(frame), self._rings(frame.t, view)]
        return np.concatenate([ends for ends, _ in parts]), np.concatenate([colours for _, colours in parts])

    def _trails(self, frame: Frame) -> Lines:
        """Through where each was at whole multiples of a fixed time: points that stay where they are do not flicker."""
        if self._length <= 0.0 or not len(frame):
            return np.zeros((0, 3)), np.zeros((0, 4))
        step = self._length / N_POINTS
        newest = math.ceil(frame.t / step) - 1
        oldest = max(newest - N_POINTS, math.ceil(float(self._moments.recording.t[0]) / step))
        self._past = {k: f for k, f in self._past.items() if k >= oldest}
        points, ages = [frame.pos], [0.0]
        for k in range(newest, oldest - 1, -1):
            if k not in self._past:
                self._past[k] = self._moments.at(k * step)
            points.append(_places(self._past[k], frame.id))
            ages.append(frame.t - k * step)
        path = np.stack(points, axis=1)
        ends = np.stack([path[:, :-1], path[:, 1:]], axis=2)
        fade = np.clip(1.0 - np.array(ages) / self._length, 0.0, 1.0) ** 1.5
        colours = np.empty((*ends.shape[:3], 4))
        colours[..., :3] = self._colours[frame.block][:, None, None]
        opacity = OPACITY * min(1.0, (FEW / len(frame)) ** 0.35)
        colours[..., 3] = 255.0 * opacity * np.stack([fade[:-1], fade[1:]], axis=1)
        is_there = np.isfinite(ends).all(axis=(2, 3))
        far = np.linalg.norm(ends[:, :, 0] - ends[:, :, 1], axis=-1) > self._moments.leap
        kept = is_there & ~far
        return ends[kept].reshape(-1, 3), colours[kept].reshape(-1, 4)

    def _rings(self, t: float, view: View) -> Lines:
        """Rings that grow and fade where entities were lost."""
        time = RING_TIME * self._moments.speed
        first, last = np.searchsorted(self._death_times, [t - time, t], side="right")
        ends, colours = [np.zeros((0, 3))], [np.zeros((0, 4))]
        right, up, _ = view.axes()
        angle = 2.0 * np.pi * np.arange(N_CIRCLE + 1) / N_CIRCLE
        circle = np.outer(np.cos(angle), right) + np.outer(np.sin(angle), up)
        for death in self._deaths[first:last]:
            frame = self._moments.recording.at(death.t)
            row = frame.row_of(death.id)
            if row < 0:
                continue
            share = (t - death.t) / time
            ring = frame.pos[row] + view.model_length * (0.6 + 1.6 * share) * circle
            ends.append(np.stack([ring[:-1], ring[1:]], axis=1).reshape(-1, 3))
            colour = [*self._colours[frame.block[row]], 255.0 * (1.0 - share)]
            colours.append(np.tile(colour, (2 * N_CIRCLE, 1)))
        return np.concatenate(ends), np.concatenate(colours)


def _places(frame: Frame, ids: np.ndarray) -> np.ndarray:
    """Where entities with these ids are [m], (n, 3); nan for those that are not there."""
    places = np.full((len(ids), 3), np.nan)
    if len(frame):
        rows = np.minimum(np.searchsorted(frame.id, ids), len(frame) - 1)
        found = frame.id[rows] == ids
        places[found] = frame.pos[rows[found]]
    return places
