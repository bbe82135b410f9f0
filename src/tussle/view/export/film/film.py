"""Films and pictures of recorded runs, made without a display."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

import numpy as np

from tussle.errors import ViewError
from tussle.view.export.film.cameras import CAMERAS, Camera, Follow
from tussle.view.export.film.caption import Caption
from tussle.view.export.film.encoders import Encoder, GifEncoder, mp4_encoder, png_encoder
from tussle.view.export.film.moments import Moments
from tussle.view.export.film.options import FilmOptions
from tussle.view.export.film.stage import Stage
from tussle.view.export.film.tracks import Tracks
from tussle.view.recording import Recording

FILM_LARGER, PICTURE_LARGER = 1.5, 2.5
"""Factors by which pictures of a film and a single picture are drawn larger than they are shown. Making them smaller smooths edges;
the graphics library takes twice the time for the same."""
LARGEST_DRAWN = 8192
"""Pixels that every graphics library can draw side by side."""
USUAL_LENGTH = 30.0
"""Length that a film has at most when no speed is said [s]."""
TRAIL = 9.0
"""Length of a trail when none is said, in lengths of a model at the usual speed."""


@dataclass
class FilmReport:
    """What came of a film.

    Attributes:
        n_pictures: Pictures of the film; 0 when only a single one was asked for.
        start: Time of the first [s].
        stop: Time of the last [s].
        speed: Simulated seconds per second of film.
        duration: Length of the film [s].
        seconds: Wall time of its parts [s]: "plan", "read", "draw", "write" and "encode", the last of which is waiting for what other
            processes do meanwhile.
        notes: What the user should know, one line each.
    """

    n_pictures: int = 0
    start: float = 0.0
    stop: float = 0.0
    speed: float = 1.0
    duration: float = 0.0
    seconds: dict[str, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    @contextmanager
    def timed(self, part: str) -> Iterator[None]:
        """Adds the wall time of what is done inside."""
        began = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[part] = self.seconds.get(part, 0.0) + time.perf_counter() - began

    @property
    def pictures_per_second(self) -> float:
        """How fast the film was made."""
        return self.n_pictures / max(sum(self.seconds.values()), 1e-9)


def write_film(
    recording: Recording,
    *,
    mp4: str | Path | None = None,
    gif: str | Path | None = None,
    png: str | Path | None = None,
    options: FilmOptions | None = None,
    show: Callable[[int, int], None] | None = None,
) -> FilmReport:
    """Film a recorded run; of one that was cut short, what there is.

    Args:
        recording: The run.
        mp4: File for a film in H.264, which browsers and slides play.
        gif: File for a film for places that take only pictures; smaller and with fewer pictures per second.
        png: File for one picture.
        options: How; the films share it.
        show: Told after each picture how many are done, and of how many.

    Raises:
        ViewError: There is nothing to film, who is to be followed is not there, nothing can draw, or a file cannot be written.
        MissingExtraError: A package is not installed.
    """
    options = options or FilmOptions()
    report = FilmReport()
    with report.timed("plan"):
        moments = plan(recording, options, report)
        camera = camera_of(moments, options)
    if png is not None:
        write_picture(Path(png), moments, camera, options, report)
    if mp4 is not None or gif is not None:
        files = [None if path is None else Path(path) for path in (mp4, gif)]
        write_pictures(files[0], files[1], moments, camera, options, report, show)
    return report


def plan(recording: Recording, options: FilmOptions, report: FilmReport) -> Moments:
    """The moments that are filmed; what is not as it was asked for goes into the report's notes.

    Raises:
        ViewError: There is nothing to film.
    """
    if not recording.n_frames:
        raise ViewError(f"{recording.path}: the run holds no states, so there is nothing to film")
    first, last = float(recording.t[0]), float(recording.t[-1])
    start = first if options.start is None else options.start
    stop = last if options.stop is None else options.stop
    if start > last or stop < first:
        what = f"begin at t = {start:g} s" if start > last else f"end at t = {stop:g} s"
        raise ViewError(
            f"{recording.path}: no film can {what}: the run is recorded from t = {first:g} s to {last:g} s"
        )
    if start < first:
        report.notes.append(
            f"the run is recorded from t = {first:g} s on; the film begins there, not at {start:g} s"
        )
    if stop > last:
        report.notes.append(
            f"the run is recorded until t = {last:g} s; the film ends there, not at {stop:g} s"
        )
    start, stop = max(start, first), min(stop, last)
    speed = usual_speed(stop - start) if options.speed is None else options.speed
    moments = Moments(recording, start, stop, speed, options.fps)
    report.start, report.stop, report.speed = start, stop, speed
    return moments


def usual_speed(span: float) -> float:
    """The least of 1, 2, 5, 10, 20, ... with which so many simulated seconds are a film of half a minute or less."""
    wanted = max(1.0, span / USUAL_LENGTH)
    power = 10.0 ** math.floor(math.log10(wanted) + 1e-9)
    return next(f * power for f in (1.0, 2.0, 5.0, 10.0) if f * power >= wanted * (1.0 - 1e-9))


def camera_of(moments: Moments, options: FilmOptions) -> Camera:
    """The eye of a film.

    Raises:
        ViewError: Who is to be followed is not there.
    """
    if options.camera == "follow":
        return Follow(moments, options.size, options.zoom, options.scale, options.follow)
    return CAMERAS[options.camera](moments, options.size, options.zoom, options.scale)


class Easel:
    """All that makes pictures of one size.

    Args:
        moments: The film.
        camera: Its eye.
        options: How it is made.
        larger: Factor by which pictures are drawn larger than they are shown.
        speed: What the caption says of it; 0 for a picture that stands still.
        report: Where wall times go.

    Attributes:
        drawn: Width and height of the pictures [pixels].
    """

    def __init__(
        self,
        moments: Moments,
        camera: Camera,
        options: FilmOptions,
        larger: float,
        speed: float,
        report: FilmReport,
    ) -> None:
        larger = min(larger, LARGEST_DRAWN / max(options.size))
        self.drawn = (round(larger * options.size[0]), round(larger * options.size[1]))
        recording = moments.recording
        self._moments, self._camera, self._report = moments, camera, report
        self._stage = Stage(recording.style, recording.scenery, self.drawn, larger)
        trail = usual_trail(moments, camera) if options.trails is None else options.trails
        self._tracks = Tracks(moments, trail)
        self._caption = Caption(recording, self.drawn, speed, options.captions, options.labels)

    def picture(self, t: float) -> np.ndarray:
        """What is seen at a time [s], (height, width, 4), uint8: red, green, blue, and nothing."""
        with self._report.timed("read"):
            frame, view = self._moments.at(t), self._camera.view(t)
            lines = self._tracks.lines(frame, view)
        with self._report.timed("draw"):
            picture = self._stage.draw(frame, view, lines)
        with self._report.timed("write"):
            self._caption.draw(picture, frame, view)
        return picture

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stage.close()


def usual_trail(moments: Moments, camera: Camera) -> float:
    """How much of the past is shown of entities at the usual speed [s]."""
    middle = float(moments.t[len(moments) // 2])
    vel = np.linalg.norm(moments.at(middle).vel, axis=1)
    speed = float(np.median(vel)) if len(vel) else 0.0
    return TRAIL * camera.view(middle).model_length / speed if speed > 1e-6 else 0.0


def write_picture(
    path: Path, moments: Moments, camera: Camera, options: FilmOptions, report: FilmReport
) -> None:
    """Write one picture.

    Raises:
        ViewError: It is of a time that is not recorded, or cannot be drawn or written.
    """
    first, last = float(moments.recording.t[0]), float(moments.recording.t[-1])
    at = 0.5 * (report.start + report.stop) if options.at is None else options.at
    if not first <= at <= last:
        raise ViewError(
            f"{moments.recording.path}: there is no picture of t = {at:g} s: the run is recorded from t = {first:g} s to {last:g} s"
        )
    with (
        Easel(moments, camera, options, PICTURE_LARGER, 0.0, report) as easel,
        png_encoder(path, easel.drawn, options.size) as encoder,
    ):
        encoder.put(easel.picture(at))


def write_pictures(
    mp4: Path | None,
    gif: Path | None,
    moments: Moments,
    camera: Camera,
    options: FilmOptions,
    report: FilmReport,
    show: Callable[[int, int], None] | None,
) -> None:
    """Write a film to one file or two.

    Raises:
        ViewError: It cannot be drawn, or a file cannot be written.
    """
    n = len(moments)
    with Easel(moments, camera, options, FILM_LARGER, moments.speed, report) as easel, ExitStack() as files:
        encoders: list[Encoder] = []
        if mp4 is not None:
            encoders.append(files.enter_context(mp4_encoder(mp4, easel.drawn, options.size, options.fps)))
        if gif is not None:
            encoders.append(files.enter_context(GifEncoder(gif, easel.drawn, options.size, options.fps)))
        for k, t in enumerate(moments.t):
            picture = easel.picture(float(t))
            with report.timed("encode"):
                for encoder in encoders:
                    encoder.put(picture)
            report.n_pictures, report.duration = k + 1, (k + 1) / options.fps
            if show is not None:
                show(k + 1, n)
        with report.timed("encode"):
            files.close()
