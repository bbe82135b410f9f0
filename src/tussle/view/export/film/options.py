"""Options of a film."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tussle.errors import ParameterError, listed, nearest_name

CAMERAS = ("overview", "top", "follow")
MIN_SIZE, MAX_SIZE = 16, 7680
MAX_FPS = 240.0
MIN_FACTOR, MAX_FACTOR = 1e-6, 1e6


@dataclass(frozen=True)
class FilmOptions:
    """Options of a film.

    Args:
        camera: "overview", "top" or "follow".
        follow: Id of the entity that "follow" flies behind; by default the first.
        start: Time at which the film begins [s]; by default that of the first record.
        stop: Time at which it ends [s]; by default that of the last record.
        speed: Simulated seconds per second of film; by default the least of 1, 2, 5, 10, ... with which it lasts half a minute.
        fps: Pictures per second.
        size: Width and height [pixels], even numbers.
        at: Time of a single picture [s]; by default the middle of the film.
        trails: Duration that a trail shows [s], 0 for none; by default chosen by speed and size of the entities.
        labels: Show ids of entities.
        captions: Show time, teams, title and size of the grid.
        zoom: Zoom factor.
        scale: Factor by which models are enlarged.

    Raises:
        ParameterError: A value is not allowed.
    """

    camera: str = "overview"
    follow: int | None = None
    start: float | None = None
    stop: float | None = None
    speed: float | None = None
    fps: float = 25.0
    size: tuple[int, int] = (1280, 720)
    at: float | None = None
    trails: float | None = None
    labels: bool = False
    captions: bool = True
    zoom: float = 1.0
    scale: float = 1.0

    def __post_init__(self) -> None:
        if self.camera not in CAMERAS:
            raise ParameterError(
                f"camera = {self.camera!r} is not allowed{nearest_name(self.camera, CAMERAS)}; {listed(CAMERAS)}"
            )
        if self.follow is not None and self.camera != "follow":
            raise ParameterError(
                f"follow = {self.follow} means nothing to camera = {self.camera!r}; it takes 'follow'"
            )
        for name in ("speed", "fps", "zoom", "scale"):
            value = getattr(self, name)
            if value is not None and not MIN_FACTOR <= value <= MAX_FACTOR:
                raise ParameterError(
                    f"{name} = {value!r} is not allowed; it takes a number from {MIN_FACTOR:g} to {MAX_FACTOR:g}"
                )
        if self.fps > MAX_FPS:
            raise ParameterError(f"fps = {self.fps:g} is not allowed; it takes up to {MAX_FPS:g}")
        if self.trails is not None and self.trails != 0.0 and not MIN_FACTOR <= self.trails < math.inf:
            raise ParameterError(
                f"trails = {self.trails!r} is not allowed; it takes 0 or a number of seconds >= {MIN_FACTOR:g}"
            )
        for name in ("start", "stop", "at"):
            value = getattr(self, name)
            if value is not None and not math.isfinite(value):
                raise ParameterError(f"{name} = {value!r} is not allowed; it takes a time in seconds")
        if self.start is not None and self.stop is not None and not self.start <= self.stop:
            raise ParameterError(
                f"stop = {self.stop:g} s is not allowed; it takes a time after start = {self.start:g} s"
            )
        if not all(MIN_SIZE <= n <= MAX_SIZE and n % 2 == 0 for n in self.size):
            raise ParameterError(
                f"size = {self.size[0]}x{self.size[1]} is not allowed; it takes even numbers of pixels "
                f"from {MIN_SIZE} to {MAX_SIZE}"
            )
