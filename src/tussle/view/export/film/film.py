"""Films and pictures of recorded runs, made without a display."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from tussle.errors import MissingExtraError, ViewError
from tussle.view.export.film.cameras import Camera, camera_of
from tussle.view.export.film.captions import Captions
from tussle.view.export.film.moments import Moments
from tussle.view.export.film.options import FilmOptions
from tussle.view.export.film.renderer import Renderer
from tussle.view.export.film.trails import Trails
from tussle.view.export.whole_file import whole_file
from tussle.view.recording import Recording
from tussle.view.scenery import round_up

FILM_SCALE, PICTURE_SCALE = 1.5, 2.5
"""Factors by which pictures are drawn larger than they are written; reducing them smooths edges at half the cost of VTK's smoothing."""
MAX_DRAWN = 8192
"""Width and height [pixels] that every graphics library can draw."""
DEFAULT_DURATION = 30.0
"""Longest film at the default speed [s]."""
TRAIL = 9.0
"""Default length of a trail, in lengths of a model at the median speed."""
GIF_WIDTH, GIF_FPS, GIF_COLOURS = 640, 12.5, 128
"""Largest width, pictures per second and colours of a GIF, which has no motion compression."""
N_PALETTE_SAMPLES = 4
PART = ".part.mp4"
"""Suffix of an unfinished film, by which imageio chooses ffmpeg."""
H264 = ("-preset", "veryfast", "-crf", "23", "-movflags", "+faststart")

Arrange = Callable[[float], None]
"""Arranges a scene as at a time [s]."""
Count = Callable[[], None]
"""Called after each picture."""
_Writer = Callable[[Path, Renderer, Moments, FilmOptions, Arrange, Count], None]


@dataclass
class FilmReport:
    """A film that was written.

    Attributes:
        n_pictures: Pictures of the film; of the MP4 if a GIF was written too.
        start: Time of the first picture [s].
        stop: Time of the last picture [s].
        speed: Simulated seconds per second of film.
        duration: Length of the film [s].
        notes: What the user should know, one line each.
    """

    n_pictures: int = 0
    start: float = 0.0
    stop: float = 0.0
    speed: float = 1.0
    duration: float = 0.0
    notes: list[str] = field(default_factory=list)


def write_film(
    recording: Recording,
    *,
    mp4: str | Path | None = None,
    gif: str | Path | None = None,
    png: str | Path | None = None,
    options: FilmOptions | None = None,
    show: Callable[[int, int], None] | None = None,
) -> FilmReport:
    """Film a recorded run, complete or not.

    Args:
        recording: The run.
        mp4: File of a film in H.264, which browsers and slides play.
        gif: File of a GIF: smaller, with fewer pictures per second.
        png: File of one picture.
        options: How to film.
        show: Called after each picture with the numbers of pictures drawn and to draw.

    Raises:
        ViewError: There is nothing to film or draw with, the followed entity is never there, or a file cannot be written.
        MissingExtraError: A package is not installed.
    """
    options = options or FilmOptions()
    report = FilmReport()
    moments = plan(recording, options, report)
    if png is not None:
        _write_picture(Path(png), moments, options, report)
    wanted: list[tuple[str | Path | None, FilmOptions, _Writer]] = [
        (mp4, options, _write_mp4),
        (gif, gif_options(options), _write_gif),
    ]
    films = [
        (Path(path), chosen, write, Moments(recording, report.start, report.stop, report.speed, chosen.fps))
        for path, chosen, write in wanted
        if path is not None
    ]
    n_pictures = sum(len(moments) for *_, moments in films)

    drawn = itertools.count(1)

    def count() -> None:
        n = next(drawn)
        if show is not None:
            show(n, n_pictures)

    for path, chosen, write, moments in films:
        camera = camera_of(moments, chosen)
        with (
            whole_file(path, PART) as part,
            _scene(moments, camera, chosen, FILM_SCALE, report.speed) as (renderer, arrange),
        ):
            write(part, renderer, moments, chosen, arrange, count)
            if not part.stat().st_size:
                raise ViewError(f"{path}: cannot be written: ffmpeg wrote nothing")
        if not report.n_pictures:
            report.n_pictures, report.duration = len(moments), len(moments) / chosen.fps
    return report


def plan(recording: Recording, options: FilmOptions, report: FilmReport) -> Moments:
    """The pictures of a film; limits that differ from the wanted ones go into the report's notes.

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
    report.start, report.stop = max(start, first), min(stop, last)
    report.speed = options.speed or default_speed(report.stop - report.start)
    return Moments(recording, report.start, report.stop, report.speed, options.fps)


def default_speed(span: float) -> float:
    """The least of 1, 2, 5, 10, 20, ... with which a film of so many simulated seconds takes half a minute or less."""
    return round_up(max(1.0, span / DEFAULT_DURATION))


def gif_options(options: FilmOptions) -> FilmOptions:
    """Options of a GIF: one picture in a whole number of the film's, at most `GIF_WIDTH` wide."""
    share = min(1.0, GIF_WIDTH / options.size[0])
    width, height = (max(16, 2 * round(0.5 * share * n)) for n in options.size)
    return replace(options, size=(width, height), fps=options.fps / max(1, round(options.fps / GIF_FPS)))


@contextmanager
def _scene(
    moments: Moments, camera: Camera, options: FilmOptions, scale: float, speed: float
) -> Iterator[tuple[Renderer, Arrange]]:
    """A renderer, and a function that arranges its scene as at a time [s]."""
    scale = min(scale, MAX_DRAWN / max(options.size))
    width, height = (round(scale * n) for n in options.size)
    recording = moments.recording
    with Renderer(recording.style, recording.scenery, (width, height), scale) as renderer:
        length = default_trail(moments, camera) if options.trails is None else options.trails
        trails = Trails(moments, length)
        captions = Captions(renderer, recording, options, speed)

        def arrange(t: float) -> None:
            frame, view = moments.at(t), camera.view(t)
            renderer.show(frame, view, trails.lines(frame, view))
            captions.show(frame, view)

        yield renderer, arrange


def default_trail(moments: Moments, camera: Camera) -> float:
    """Duration of the trail of an entity at the median speed [s]."""
    middle = float(moments.t[len(moments) // 2])
    vel = np.linalg.norm(moments.at(middle).vel, axis=1)
    speed = float(np.median(vel)) if len(vel) else 0.0
    return TRAIL * camera.view(middle).model_length / speed if speed > 1e-6 else 0.0


def _write_picture(path: Path, moments: Moments, options: FilmOptions, report: FilmReport) -> None:
    """Write one picture.

    Raises:
        ViewError: Its time is not recorded, or it cannot be drawn or written.
    """
    first, last = float(moments.recording.t[0]), float(moments.recording.t[-1])
    at = 0.5 * (report.start + report.stop) if options.at is None else options.at
    if not first <= at <= last:
        raise ViewError(
            f"{moments.recording.path}: there is no picture of t = {at:g} s: the run is recorded from t = {first:g} s to {last:g} s"
        )
    camera = camera_of(moments, options)
    with (
        whole_file(path) as part,
        _scene(moments, camera, options, PICTURE_SCALE, 0.0) as (renderer, arrange),
    ):
        arrange(at)
        _reduced(renderer.picture(), options).save(part, format="png")


def _reduced(picture: np.ndarray, options: FilmOptions) -> Any:
    """A picture in the size of the file, as an image of Pillow."""
    from PIL import Image

    return Image.fromarray(picture).resize(options.size, Image.Resampling.BOX)


def _write_mp4(
    path: Path, renderer: Renderer, moments: Moments, options: FilmOptions, arrange: Arrange, count: Count
) -> None:
    """Write a film in H.264.

    Raises:
        MissingExtraError: A package that PyVista needs is not installed.
        ViewError: There is no ffmpeg for this machine.
    """
    try:
        import imageio  # noqa: F401
        import imageio_ffmpeg  # type: ignore[import-untyped]

        imageio_ffmpeg.get_ffmpeg_exe()
    except ImportError as error:
        raise MissingExtraError(
            "films need imageio and imageio-ffmpeg, which are not installed: pip install 'tussle[view]'"
        ) from error
    except RuntimeError as error:
        raise ViewError(f"films need ffmpeg, and imageio-ffmpeg brings none here: {error}") from error
    plotter, (width, height) = renderer.plotter, options.size
    plotter.open_movie(
        path, framerate=options.fps, quality=None, macro_block_size=1, ffmpeg_log_level="error",
        output_params=["-vf", f"scale={width}:{height}:flags=area", *H264],
    )  # fmt: skip
    for t in moments.t:
        arrange(float(t))
        try:
            plotter.write_frame()
        except OSError as error:
            raise OSError(f"ffmpeg failed: {str(error).splitlines()[0]}") from error
        count()
    plotter.mwriter.close()


def _write_gif(
    path: Path, renderer: Renderer, moments: Moments, options: FilmOptions, arrange: Arrange, count: Count
) -> None:
    """Write a GIF with one palette, that of some of its pictures: a palette for each would double its size."""
    from PIL import Image

    def picture(t: float) -> Any:
        arrange(float(t))
        return _reduced(renderer.picture(), options)

    def pictures() -> Iterator[Any]:
        for t in moments.t:
            yield picture(t).quantize(palette=palette, dither=Image.Dither.NONE)
            count()

    samples = moments.t[np.linspace(0, len(moments) - 1, N_PALETTE_SAMPLES).astype(int)]
    together = Image.fromarray(np.concatenate([np.asarray(picture(t)) for t in samples]))
    palette = together.quantize(
        GIF_COLOURS, Image.Quantize.FASTOCTREE
    )  # the other methods lose teams, or the ground
    images = pictures()
    next(images).save(
        path, format="gif", save_all=True, append_images=images, duration=1000.0 / options.fps, loop=0
    )
