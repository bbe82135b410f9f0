"""How the eye moves through a film: over everything, straight down on it, or behind one entity."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from functools import partial

import numpy as np

from tussle.errors import ViewError
from tussle.view.export.film.moments import Moments
from tussle.view.export.film.survey import box_of, calm_width, crowd_of, evened, pose_of, reached, survey
from tussle.view.export.film.view import ANGLE, View

ELEVATION = math.radians(33.0)
"""Of the eye above what it looks at, seen from there."""
AZIMUTH = math.radians(-105.0)
"""Direction of the eye from what it looks at, from east toward north: a little west of south, so that north is away."""
FOLLOW_ELEVATION = math.radians(11.0)
MARGIN = 0.86
"""Share of the picture that what is to be seen may fill."""
LARGEST, SMALLEST, LEGIBLE = 0.026, 0.0085, 10.0
"""Bounds of a model's length as a share of the picture's width; the least it should have [pixels]."""
CROWDING = 1.3
"""Length of a model, where it lies between these bounds, as a share of the side of the square that each entity has of the picture; it
is not longer than the distance to the nearest other either."""
FOLLOWED = 0.075
"""Length of a followed model as a share of the picture's width."""
N_CROWDS = 200
"""Moments at which distances between entities are looked at."""
UP, NORTH = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])


class Camera(ABC):
    """A way of looking at all pictures of a film.

    Args:
        moments: The pictures.
        size: Their width and height [pixels].
        zoom: Factor by which it is nearer than it would be.
        scale: Factor by which models are larger than they would be.
    """

    def __init__(self, moments: Moments, size: tuple[int, int], zoom: float, scale: float) -> None:
        self.moments = moments
        self.aspect = size[0] / size[1]
        self.smallest = min(LARGEST, max(SMALLEST, LEGIBLE / size[0]))
        self.zoom = zoom
        self.scale = scale
        style, n = moments.recording.style, len(moments.recording.blocks)
        self.longest = max((style.scale(i) for i in range(n)), default=1.0)

    @abstractmethod
    def view(self, t: float) -> View:
        """From where it is seen at a time [s] of the film."""


class Whole(Camera):
    """Sees all entities from one direction, and goes with them; abstract.

    Args:
        moments: The pictures.
        size: Their width and height [pixels].
        zoom: Factor by which it is nearer than it would be.
        scale: Factor by which models are larger than they would be.
        back: Direction from what it looks at to the eye, (3,).
        up: What points up in the picture, (3,).
        is_parallel: Nothing looks smaller for being farther away.
    """

    def __init__(
        self, moments: Moments, size: tuple[int, int], zoom: float, scale: float,
        back: np.ndarray, up: np.ndarray, is_parallel: bool,
    ) -> None:  # fmt: skip
        super().__init__(moments, size, zoom, scale)
        self._back, self._up, self._is_parallel = back, up, is_parallel
        self._t, boxes = survey(moments, box_of, 6)
        if not np.isfinite(boxes).all():
            scenery = moments.recording.scenery
            boxes[:] = np.concatenate([scenery.low, scenery.high])
        low, high = boxes[:, :3], boxes[:, 3:]
        width = calm_width(moments, self._t)
        self._middle = evened(0.5 * (low + high), width)
        reaches = [self._reaches(*boxes) for boxes in zip(low, high, self._middle, strict=True)]
        needed = [self._half_height(*reach) for reach in reaches]
        self._half = evened(reached(np.array(needed), width)[:, None], width)[:, 0] / zoom
        area = np.array([np.ptp(right) * np.ptp(up) for right, up, _ in reaches])
        self._length = self._lengths(2.0 * self._half * self.aspect, area)

    def _reaches(self, low: np.ndarray, high: np.ndarray, middle: np.ndarray) -> np.ndarray:
        """How far the corners of a box are to the right of the middle, above it and nearer than it [m], (3, 8)."""
        sides = np.array([low, high])
        corners = np.array(
            [[sides[i, 0], sides[j, 1], sides[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)]
        )
        reaches: np.ndarray = View(middle + self._back, middle, self._up, 1.0).axes() @ (corners - middle).T
        return reaches

    def _half_height(self, right: np.ndarray, up: np.ndarray, back: np.ndarray) -> float:
        """Half of the height that has to be seen at the middle for corners to be in the picture [m]."""
        needed = np.maximum(np.abs(right) / self.aspect, np.abs(up)) / MARGIN
        # What is nearer than the middle looks larger.
        toward = 0.0 if self._is_parallel else back * math.tan(0.5 * ANGLE)
        # From nearer than this, models would look larger than LARGEST.
        return max(float((needed + toward).max()), 0.5 * self.longest / LARGEST / self.aspect)

    def _lengths(self, seen: np.ndarray, area: np.ndarray) -> np.ndarray:
        """Length of models at each surveyed moment, (m,), of which so much is seen across and in which all are in so large an area."""
        t, crowds = survey(self.moments, crowd_of, 2, N_CROWDS)
        spacing, count = (np.interp(self._t, t, column) for column in crowds.T)
        length = np.fmin(spacing, CROWDING * np.sqrt(area / count))
        length = np.clip(np.where(np.isfinite(length), length, np.inf), self.smallest * seen, LARGEST * seen)
        return self.scale * evened(length[:, None], calm_width(self.moments, self._t))[:, 0]

    def view(self, t: float) -> View:
        middle = np.array([np.interp(t, self._t, column) for column in self._middle.T])
        half, length = (float(np.interp(t, self._t, column)) for column in (self._half, self._length))
        eye = middle + self._back * half / math.tan(0.5 * ANGLE)
        return View(eye, middle, self._up, half, self._is_parallel, length)


class Overview(Whole):
    """Sees all entities from the south and above."""

    def __init__(
        self, moments: Moments, size: tuple[int, int], zoom: float = 1.0, scale: float = 1.0
    ) -> None:
        flat = math.cos(ELEVATION)
        back = np.array([flat * math.cos(AZIMUTH), flat * math.sin(AZIMUTH), math.sin(ELEVATION)])
        super().__init__(moments, size, zoom, scale, back, UP, False)


class Top(Whole):
    """Looks straight down on all entities, north up."""

    def __init__(
        self, moments: Moments, size: tuple[int, int], zoom: float = 1.0, scale: float = 1.0
    ) -> None:
        super().__init__(moments, size, zoom, scale, UP, NORTH, True)


class Follow(Camera):
    """Flies behind one entity; stays where it was lost.

    Args:
        moments: The pictures.
        size: Their width and height [pixels].
        zoom: Factor by which it is nearer than it would be.
        scale: Factor by which models are larger than they would be.
        who: Id of the entity; by default the first that there is.

    Raises:
        ViewError: It is never there.
    """

    def __init__(
        self,
        moments: Moments,
        size: tuple[int, int],
        zoom: float = 1.0,
        scale: float = 1.0,
        who: int | None = None,
    ) -> None:
        super().__init__(moments, size, zoom, scale)
        self.who = self._first() if who is None else who
        self._t, poses = survey(moments, partial(pose_of, who=self.who), 6)
        if not np.isfinite(poses[:, 0]).any():
            raise self._missing()
        width = calm_width(moments, self._t)
        self._at, self._nose = poses[:, :3], evened(poses[:, 3:5], width)
        near = 0.45 * float(np.median(poses[:, 5])) if np.isfinite(poses[:, 5]).all() else 0.0
        self._half = max(near, 0.5 * self.longest / FOLLOWED / self.aspect) / zoom

    def _first(self) -> int:
        """The smallest id that is there when somebody first is."""
        found = (self.moments.at(float(t)).id for t in self.moments.t)
        return next((int(ids[0]) for ids in found if len(ids)), 0)

    def _missing(self) -> ViewError:
        t = self.moments.t
        ids = np.unique(np.concatenate([self.moments.at(float(moment)).id for moment in (t[0], t[-1])]))
        there = f"there are {ids[0]} to {ids[-1]}" if len(ids) else "there is nobody"
        return ViewError(
            f"{self.moments.recording.path}: entity {self.who} cannot be followed: it is not there between t = {t[0]:g} s "
            f"and {t[-1]:g} s; {there}"
        )

    def view(self, t: float) -> View:
        at = np.array([np.interp(t, self._t, column) for column in self._at.T])
        east, north = (float(np.interp(t, self._t, column)) for column in self._nose.T)
        length = max(math.hypot(east, north), 1e-9)
        flat = math.cos(FOLLOW_ELEVATION)
        back = np.array([-flat * east / length, -flat * north / length, math.sin(FOLLOW_ELEVATION)])
        target = at + 0.2 * self._half * UP
        eye = target + back * self._half / math.tan(0.5 * ANGLE)
        return View(
            eye, target, UP, self._half, False, self.scale * FOLLOWED * 2.0 * self._half * self.aspect
        )


CAMERAS: dict[str, type[Camera]] = {"overview": Overview, "top": Top, "follow": Follow}
