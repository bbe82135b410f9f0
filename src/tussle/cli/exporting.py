"""Write the outputs of `tussle export`."""

from __future__ import annotations

import re
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import typer

from tussle.cli.progress import ProgressMeter, home_short
from tussle.cli.settings import read_time
from tussle.cli.terminal import INTERRUPTED, NOT_WRITTEN, OK, out, say, say_error, say_note
from tussle.errors import ParameterError, ViewError
from tussle.view.export.film import FilmOptions
from tussle.view.recording import Recording

TIMES = {"start": "--from", "stop": "--to", "at": "--at"}


@dataclass(frozen=True)
class Source:
    """The run to export.

    Attributes:
        run: The run directory.
        world: Number of the world; None if not given.
        plugin_files: Python files with plugins of the run's mission.
    """

    run: Path
    world: int | None = None
    plugin_files: tuple[Path, ...] = field(default=())

    @cached_property
    def recording(self) -> Recording:
        """The run in memory. Tables are written without it."""
        recording = Recording(self.run, self.world or 0, self.plugin_files)
        n_worlds = len(recording.run.info.get("worlds", ()))
        if self.world is None and n_worlds > 1:
            say_note(f"the run has {n_worlds} worlds; world 0 is shown, --world selects another")
        # Style and scenery are read now, so that their notes are printed once, before the outputs.
        for note in dict.fromkeys([*recording.style.notes, *recording.scenery.notes, *recording.notes]):
            say_note(note)
        return recording


def film_options(**asked: Any) -> FilmOptions:
    """Build the film options from the command line options; None means the default.

    Raises:
        typer.BadParameter: A value is not allowed.
    """
    given = {name: value for name, value in asked.items() if value is not None}
    try:
        for name in TIMES.keys() & given.keys():
            given[name] = read_time(TIMES[name], given[name])
        if "size" in given:
            given["size"] = read_size(given["size"])
        return FilmOptions(**given)
    except ParameterError as error:
        raise typer.BadParameter(str(error)) from None


def read_size(text: str) -> tuple[int, int]:
    """Parse width and height [pixels].

    Raises:
        ParameterError: The text has another form.
    """
    found = re.fullmatch(r"\s*(\d{1,6})\s*[x×]\s*(\d{1,6})\s*", text, re.IGNORECASE)
    if found is None:
        raise ParameterError(f"--size {text!r} does not have the form WIDTHxHEIGHT, such as 1280x720")
    return int(found[1]), int(found[2])


def write_outputs(
    source: Source, files: Mapping[str, Path], options: FilmOptions, period: float | None
) -> int:
    """Write all files, fast outputs first, and return the exit code."""
    writers = {
        ("csv",): _write_tables, ("parquet",): _write_tables, ("html",): _write_html, ("mcap",): _write_mcap,
        ("png", "mp4", "gif"): _write_films,
    }  # fmt: skip
    try:
        for kinds, write in writers.items():
            asked = {kind: files[kind] for kind in kinds if kind in files}
            if asked:
                write(source, asked, options, period)
    except ViewError as error:
        say_error(str(error))
        return NOT_WRITTEN
    except KeyboardInterrupt:
        say("interrupted", "files listed above are complete, the others were not written", "bold yellow")
        return INTERRUPTED
    return OK


def _report(path: Path, text: str) -> None:
    out().print(f"{home_short(path)}: {text}, {size_of(path)}", soft_wrap=True)


def size_of(path: Path) -> str:
    """Format the size of a file: "812 B", "4.5 kB", "12 MB"."""
    n = float(path.stat().st_size)
    for unit in ("B", "kB", "MB"):
        if n < 1000.0:
            return f"{n:.3g} {unit}"
        n /= 1000.0
    return f"{n:.3g} GB"


def _write_tables(source: Source, files: Mapping[str, Path], _: FilmOptions, __: float | None) -> None:
    from tussle.view.export.tables import write_tables

    for kind, path in files.items():
        with ProgressMeter(kind, "states") as meter:
            report = write_tables(source.run, path, kind, world=source.world, show=meter.show)
        for note in report.notes:
            say_note(note)
        for file, rows, what in zip(report.paths, report.rows, ("states", "events"), strict=True):
            _report(file, f"{rows:,} {what}")


def _write_html(source: Source, files: Mapping[str, Path], _: FilmOptions, period: float | None) -> None:
    from tussle.view.export.html import write_html

    report = write_html(source.recording, files["html"], period=period)
    _report(report.path, f"{report.n_frames:,} states of {report.n_entities:,} entities")


def _write_mcap(
    source: Source, files: Mapping[str, Path], options: FilmOptions, period: float | None
) -> None:
    from tussle.view.export.mcap_file import write_mcap

    recording = source.recording
    with ProgressMeter("mcap", "states") as meter:
        report = write_mcap(recording, files["mcap"], period=period, scale=options.scale, show=meter.show)
    for note in report.notes:
        say_note(note)
    _report(report.path, f"{report.n_frames:,} states, {sum(report.n_messages.values()):,} messages")


def _write_films(source: Source, files: Mapping[str, Path], options: FilmOptions, _: float | None) -> None:
    from tussle.view.export.film import write_film

    recording = source.recording
    began = time.perf_counter()
    with ProgressMeter("film", "pictures") as meter:
        report = write_film(recording, options=options, show=meter.show, **files)
    wall = time.perf_counter() - began
    for note in report.notes:
        say_note(note)
    width, height = options.size
    for kind, path in files.items():
        if kind == "png":
            _report(path, f"{width}×{height}")
        else:
            film = f"{report.n_pictures:,} pictures, {report.duration:.1f} s at {report.speed:g} × real time"
            _report(path, f"{film}, {report.n_pictures / wall:.1f} pictures/s")
