"""Cameras of a film: over all entities, straight above them, or behind one of them."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np

from tussle.errors import ViewError
from tussle.view.export.film.moments import Moments
from tussle.view.export.film.options import FilmOptions
from tussle.view.export.film.prescan import (
    box_of,
    crowd_of,
    local_maximum,
    pose_of,
    prescan,
    smoothed,
    smoothing_width,
)

VIEW_ANGLE = math.radians(32.0)
"""Vertical angle of view: that of a long lens, so that distant entities stay comparable to near ones."""
ELEVATION = math.radians(33.0)
"""Elevation of the overview camera above its target."""
AZIMUTH = math.radians(-105.0)
"""Direction from the target to the overview camera, from east toward north: a little west of south."""
FOLLOW_ELEVATION = math.radians(11.0)
MARGIN = 0.86
"""Share of the picture that the entities may fill."""
MAX_SIZE, MIN_SIZE, LEGIBLE = 0.026, 0.0085, 10.0
"""Limits of a model's length as a share of the picture's width; its least length [pixels]."""
CROWDING = 1.3
"""Length of a model between these limits, as a share of the side of the square that each entity has; never more than the distance
to the nearest neighbour."""
FOLLOWED = 0.075
"""Length of a followed model as a share of the picture's width."""
N_CROWD_SAMPLES = 200
UP, NORTH = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True, eq=False)
class View:
    """Pose of the camera in one picture.

    Attributes:
        eye: Position of the camera [m], (3,).
        target: Point in the middle of the picture [m], (3,).
        up: Direction that points up in the picture, (3,).
        half_height: Half of the height that is seen at the target [m].
        is_parallel: Parallel projection instead of perspective.
        model_length: Least length of a model [m].
    """

    eye: np.ndarray
    target: np.ndarray
    up: np.ndarray
    half_height: float
    is_parallel: bool = False
    model_length: float = 1.0

    @property
    def distance(self) -> float:
        """Distance from the camera to the target [m]."""
        return float(np.linalg.norm(self.eye - self.target))

    def axes(self) -> np.ndarray:
        """Unit vectors to the right, up and toward the camera, (3, 3), by rows."""
        back = (self.eye - self.target) / self.distance
        right = np.cross(self.up, back)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(back, right), back])


class Camera(ABC):
    """A camera of a film.

    Args:
        moments: The pictures.
        options: Size, zoom and scale of the film.
    """

    def __init__(self, moments: Moments, options: FilmOptions) -> None:
        self.moments, self.options = moments, options
        self.aspect = options.size[0] / options.size[1]
        style, n = moments.recording.style, len(moments.recording.blocks)
        self.longest = max((style.scale(i) for i in range(n)), default=1.0)

    @abstractmethod
    def view(self, t: float) -> View:
        """The pose of the camera at a time [s]."""


class FitAll(Camera):
    """Shows all entities: `overview` from the south and above, `top` from straight above, north up."""

    def __init__(self, moments: Moments, options: FilmOptions) -> None:
        super().__init__(moments, options)
        self._is_top = options.camera == "top"
        flat = math.cos(ELEVATION)
        above = np.array([flat * math.cos(AZIMUTH), flat * math.sin(AZIMUTH), math.sin(ELEVATION)])
        self._back, self._up = (UP, NORTH) if self._is_top else (above, UP)
        self._t, boxes = prescan(moments, box_of, 6)
        if not np.isfinite(boxes).all():
            scenery = moments.recording.scenery
            boxes[:] = np.concatenate([scenery.low, scenery.high])
        low, high = boxes[:, :3], boxes[:, 3:]
        width = smoothing_width(moments, self._t)
        middle = smoothed(0.5 * (low + high), width)
        reaches = [self._reaches(*boxes) for boxes in zip(low, high, middle, strict=True)]
        needed = np.array([self._half_height(*reach) for reach in reaches])
        half = smoothed(local_maximum(needed, width)[:, None], width) / options.zoom
        area = np.array([np.ptp(right) * np.ptp(up) for right, up, _ in reaches])
        length = smoothed(self._lengths(2.0 * half[:, 0] * self.aspect, area)[:, None], width)
        self._curves = np.hstack([middle, half, options.scale * length])

    def _reaches(self, low: np.ndarray, high: np.ndarray, middle: np.ndarray) -> np.ndarray:
        """Coordinates of a box's corners to the right of, above and in front of the middle [m], (3, 8)."""
        corners = np.array(list(product(*zip(low, high, strict=True))))
        reaches: np.ndarray = View(middle + self._back, middle, self._up, 1.0).axes() @ (corners - middle).T
        return reaches

    def _half_height(self, right: np.ndarray, up: np.ndarray, back: np.ndarray) -> float:
        """Half of the height that has to be seen at the middle for these corners to be in the picture [m]."""
        needed = np.maximum(np.abs(right) / self.aspect, np.abs(up)) / MARGIN
        # Corners in front of the middle look larger.
        toward = 0.0 if self._is_top else back * math.tan(0.5 * VIEW_ANGLE)
        # From nearer than this, models would look larger than MAX_SIZE.
        return max(float((needed + toward).max()), 0.5 * self.longest / MAX_SIZE / self.aspect)

    def _lengths(self, seen: np.ndarray, area: np.ndarray) -> np.ndarray:
        """Length of models [m], (m,), from the width seen [m] and the area of all entities [m^2] at each sample."""
        t, crowds = prescan(self.moments, crowd_of, 2, N_CROWD_SAMPLES)
        spacing, count = (np.interp(self._t, t, column) for column in crowds.T)
        length = np.fmin(spacing, CROWDING * np.sqrt(area / count))
        smallest = min(MAX_SIZE, max(MIN_SIZE, LEGIBLE / self.options.size[0]))
        return np.clip(np.where(np.isfinite(length), length, np.inf), smallest * seen, MAX_SIZE * seen)

    def view(self, t: float) -> View:
        *middle, half, length = (float(np.interp(t, self._t, curve)) for curve in self._curves.T)
        eye = middle + self._back * half / math.tan(0.5 * VIEW_ANGLE)
        return View(eye, np.array(middle), self._up, half, self._is_top, length)


class Follow(Camera):
    """Flies behind one entity and stays where it was removed.

    Raises:
        ViewError: The entity is never there.
    """

    def __init__(self, moments: Moments, options: FilmOptions) -> None:
        super().__init__(moments, options)
        entity = self._first_entity() if options.follow is None else options.follow
        self._t, poses = prescan(moments, partial(pose_of, entity=entity), 6)
        if not np.isfinite(poses[:, 0]).any():
            raise self._missing(entity)
        nose = smoothed(poses[:, 3:5], smoothing_width(moments, self._t))
        self._curves = np.hstack([poses[:, :3], nose])
        near = 0.45 * float(np.median(poses[:, 5])) if np.isfinite(poses[:, 5]).all() else 0.0
        self._half = max(near, 0.5 * self.longest / FOLLOWED / self.aspect) / options.zoom

    def _first_entity(self) -> int:
        """The smallest id of the first frame that has entities."""
        found = (self.moments.at(float(t)).id for t in self.moments.t)
        return next((int(ids[0]) for ids in found if len(ids)), 0)

    def _missing(self, entity: int) -> ViewError:
        t = self.moments.t
        ids = np.unique(np.concatenate([self.moments.at(float(moment)).id for moment in (t[0], t[-1])]))
        there = f"there are {ids[0]} to {ids[-1]}" if len(ids) else "there are no entities"
        return ViewError(
            f"{self.moments.recording.path}: entity {entity} cannot be followed: it does not exist between t = {t[0]:g} s "
            f"and {t[-1]:g} s; {there}"
        )

    def view(self, t: float) -> View:
        *at, east, north = (float(np.interp(t, self._t, curve)) for curve in self._curves.T)
        length = max(math.hypot(east, north), 1e-9)
        flat = math.cos(FOLLOW_ELEVATION)
        back = np.array([-flat * east / length, -flat * north / length, math.sin(FOLLOW_ELEVATION)])
        target = at + 0.2 * self._half * UP
        eye = target + back * self._half / math.tan(0.5 * VIEW_ANGLE)
        model_length = self.options.scale * FOLLOWED * 2.0 * self._half * self.aspect
        return View(eye, target, UP, self._half, False, model_length)


def camera_of(moments: Moments, options: FilmOptions) -> Camera:
    """The camera that the options name.

    Raises:
        ViewError: The entity to be followed is never there.
    """
    return (Follow if options.camera == "follow" else FitAll)(moments, options)
