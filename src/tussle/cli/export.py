"""`tussle export` and `tussle plot`: convert and plot recorded runs."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from copy import copy
from datetime import datetime
from functools import cached_property
from pathlib import Path

import typer

from tussle.cli.export_options import GEOGRAPHIC, IMAGES, ExportOptions, PlotOptions
from tussle.cli.options import read_time
from tussle.cli.progress import ProgressMeter, home_short
from tussle.cli.terminal import INTERRUPTED, NOT_WRITTEN, OK, code_of, out, say, say_error, say_note
from tussle.errors import ParameterError, TussleError, ViewError
from tussle.folders import real_path
from tussle.record.schema import FILES
from tussle.view.export.film import FilmOptions
from tussle.view.recording import Recording

FAST_FIRST = ("csv", "parquet", "html", *GEOGRAPHIC, "mcap", "rerun", "rosbag2")
TIMES = {"start": "--from", "stop": "--to", "at": "--at"}


def plot(options: PlotOptions) -> int:
    """Write the plots of a run, and print their names.

    Returns:
        The exit code.
    """
    from tussle.view.plots import Selection, runs_of, write_plots

    start = -math.inf if options.start is None else read_time("--from", options.start)
    stop = math.inf if options.stop is None else read_time("--to", options.stop)
    selection = Selection(tuple(options.teams), tuple(options.entities), start, stop)
    runs = [run for path in (options.run, *(options.others or ())) for run in runs_of(path)]
    recording, *others = [Recording(run, options.world, tuple(options.plugin_files)) for run in runs]
    directory = options.directory or options.run / "plots"
    failures = _Failures()
    notes: dict[str, None] = {}
    columns = [((), None, [name]) for name in dict.fromkeys(options.columns)]
    others_too = bool(options.kinds or options.between or not columns)
    for kinds, between, names in [*columns, *[(options.kinds, options.between, [])] * others_too]:
        with failures.told():
            written = write_plots(
                recording, directory, kinds, selection, between, options.form, names, others
            )
            notes |= dict.fromkeys(written.notes)
            for file in written.files:
                out().print(home_short(file), soft_wrap=True)
    for note in notes:
        say_note(note)
    return failures.code


def export(options: ExportOptions) -> int:
    """Write all files that are asked for, fast outputs first.

    Returns:
        The exit code.
    """
    exporter, failures, missing = _Exporter(options), _Failures(), list[str]()
    alone = [kind for kind in options.files if kind not in IMAGES]
    todo: list[tuple[str, ...]] = [(kind,) for kind in sorted(alone, key=FAST_FIRST.index)]
    if films := tuple(kind for kind in options.files if kind in IMAGES):
        todo.append(films)  # rendered once
    try:
        while todo:
            kinds = todo.pop(0)
            try:
                exporter.write({kind: options.files[kind] for kind in kinds})
            except TussleError as error:
                if len(kinds) > 1:
                    todo += [(kind,) for kind in kinds]  # those that can be written are
                    continue
                failures.tell(error)
                missing += [f"--{kind}" for kind in kinds]
    except KeyboardInterrupt:
        say("interrupted", "files listed above are complete, the others were not written", "bold yellow")
        return INTERRUPTED
    if len(options.files) > 1 and missing:
        say_note(f"not written: {', '.join(missing)}")
    return failures.code


class _Failures:
    """Tells of outputs that cannot be written, after which the others are; `code` is the exit code.

    The same error, such as that of a run that cannot be read, is told once.
    """

    def __init__(self) -> None:
        self.code = OK
        self._told: set[str] = set()

    @contextmanager
    def told(self) -> Iterator[None]:
        try:
            yield
        except TussleError as error:
            self.tell(error)

    def tell(self, error: TussleError) -> None:
        self.code = max(self.code, NOT_WRITTEN if isinstance(error, ViewError) else code_of(error))
        if str(error) not in self._told:
            self._told.add(str(error))
            say_error(str(error))


def film_options(options: ExportOptions) -> FilmOptions:
    """Return the options of films and images.

    Raises:
        typer.BadParameter: A value is not allowed.
    """
    names = ("camera", "follow", "start", "stop", "at", "speed", "fps", "size", "trails", "zoom", "scale")
    given = {name: value for name in names if (value := getattr(options, name)) is not None}
    given.setdefault("camera", "overview" if options.follow is None else "follow")
    try:
        for name in TIMES.keys() & given.keys():
            given[name] = read_time(TIMES[name], given[name])
        if "size" in given:
            given["size"] = read_size(given["size"])
        return FilmOptions(**given, labels=options.labels, captions=not options.no_caption)
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


def read_date(text: str) -> datetime:
    """Parse a date and time.

    Raises:
        ParameterError: It has another form.
    """
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        raise ParameterError(
            f"--epoch {text!r} is no date as ISO 8601 writes it, such as 2026-05-04T09:30:00Z"
        ) from None


def size_of(path: Path) -> str:
    """Format the size of a file: "812 B", "4.5 kB", "12 MB"."""
    n = float(path.stat().st_size)
    for unit in ("B", "kB", "MB"):
        if n < 1000.0:
            return f"{n:.3g} {unit}"
        n /= 1000.0
    return f"{n:.3g} GB"


class _Exporter:
    """Writes the outputs of a run, and prints what it has written."""

    def __init__(self, options: ExportOptions) -> None:
        self._options, self._film = options, film_options(options)
        self._notes: set[str] = set()
        self._recorded = {real_path(options.run / name) for name in FILES}
        self._written: dict[Path, str] = {}

    @cached_property
    def recording(self) -> Recording:
        """The run in memory. Tables are written without it."""
        world = self._options.world
        options = self._options
        recording = Recording(
            options.run, world or 0, tuple(options.plugin_files), ground_map=options.ground_map
        )
        n_worlds = len(recording.run.info.get("worlds", ()))
        if world is None and n_worlds > 1:
            say_note(f"the run has {n_worlds} worlds; world 0 is shown, --world selects another")
        # Style and scenery are read now, so that their notes are printed once, before the outputs.
        self._say_notes([*recording.style.notes, *recording.scenery.notes, *recording.notes])
        return recording

    def write(self, files: Mapping[str, Path]) -> None:
        """Write an output, or films and pictures, which are rendered once.

        Raises:
            TussleError: One cannot be written; it may be a file of the recording or of another output.
        """
        for kind, path in files.items():
            self._check(kind, path, [other for other in files.values() if other is not path])
        if files.keys() & set(IMAGES):
            self._write_films(files)
            return
        ((kind, path),) = files.items()
        writers = {
            **dict.fromkeys(("csv", "parquet"), self._write_table), **dict.fromkeys(GEOGRAPHIC, self._write_geographic),
            "html": self._write_html, "mcap": self._write_mcap, "rerun": self._write_rerun, "rosbag2": self._write_rosbag2,
        }  # fmt: skip
        writers[kind](kind, path)

    def _check(self, kind: str, path: Path, others: Iterable[Path]) -> None:
        place = real_path(path)
        owner = "the recording" if place in self._recorded else self._written.get(place)
        if owner or place in [real_path(other) for other in others]:
            raise ViewError(f"{path}: cannot be written: it is a file of {owner}; name another for --{kind}")

    def _report(self, kind: str, path: Path, text: str) -> None:
        self._written[real_path(path)] = f"--{kind}"
        out().print(f"{home_short(path)}: {text}, {size_of(path)}", soft_wrap=True)

    def _say_notes(self, notes: Iterable[str]) -> None:
        """Print notes that no other output has had."""
        for note in dict.fromkeys(notes):
            if note not in self._notes:
                self._notes.add(note)
                say_note(note)

    def _write_table(self, kind: str, path: Path) -> None:
        from tussle.view.export.tables import write_tables

        with ProgressMeter(kind, "states") as meter:
            report = write_tables(self._options.run, path, kind, world=self._options.world, show=meter.show)
        self._say_notes(report.notes)
        for file, rows, what in zip(report.paths, report.rows, ("states", "events"), strict=True):
            self._report(kind, file, f"{rows:,} {what}")

    def _write_html(self, kind: str, path: Path) -> None:
        from tussle.cli.view import annotate
        from tussle.view.export.html import write_html
        from tussle.view.page.compare import Comparison

        # A copy: what is said of the game on the page is no event of other outputs.
        options, runs = self._options, [copy(self.recording)]
        if options.other is not None:
            runs.append(Recording(options.other, options.world or 0, tuple(options.plugin_files)))
        annotate(runs, options)
        game = Comparison(*runs, is_over_each_other=options.over) if len(runs) == 2 else runs[0]
        report = write_html(game, path, period=options.period)
        self._report(kind, report.path, f"{report.n_frames:,} states of {report.n_entities:,} entities")

    def _write_geographic(self, kind: str, path: Path) -> None:
        from tussle.view.export.geographic import DEFAULT_EPOCH, write_geographic

        recording, options = self.recording, self._options
        epoch = DEFAULT_EPOCH if options.epoch is None else read_date(options.epoch)
        with ProgressMeter(kind, "tracks") as meter:
            report = write_geographic(
                recording, path, kind, period=options.period, epoch=epoch, show=meter.show
            )
        self._say_notes(report.notes)
        self._report(kind, path, f"{report.n_tracks:,} tracks, {report.n_areas:,} areas")

    def _write_mcap(self, kind: str, path: Path) -> None:
        from tussle.view.export.mcap_file import write_mcap

        recording = self.recording
        with ProgressMeter(kind, "states") as meter:
            report = write_mcap(
                recording, path, period=self._options.period, scale=self._film.scale, show=meter.show
            )
        self._say_notes(report.notes)
        self._report(
            kind, report.path, f"{report.n_frames:,} states, {sum(report.n_messages.values()):,} messages"
        )

    def _write_rerun(self, kind: str, path: Path) -> None:
        from tussle.view.export.rerun_file import write_rerun

        recording = self.recording
        with ProgressMeter(kind, "states") as meter:
            report = write_rerun(
                recording, path, period=self._options.period, scale=self._film.scale, show=meter.show
            )
        self._report(kind, report.path, f"{report.n_frames:,} states of {report.n_entities:,} entities")

    def _write_rosbag2(self, kind: str, path: Path) -> None:
        from tussle.view.export.rosbag2 import write_rosbag2

        recording, storage = self.recording, self._options.storage or "mcap"
        with ProgressMeter(kind, "states") as meter:
            report = write_rosbag2(
                recording, path, period=self._options.period, storage=storage, show=meter.show
            )
        self._say_notes(report.notes)
        self._report(kind, report.path, f"{report.n_frames:,} states, {report.n_messages:,} messages")

    def _write_films(self, files: Mapping[str, Path]) -> None:
        from tussle.view.export.film import write_film

        recording = self.recording
        began = time.perf_counter()
        with ProgressMeter("film", "pictures") as meter:
            report = write_film(recording, options=self._film, show=meter.show, **files)
        wall = time.perf_counter() - began
        self._say_notes(report.notes)
        width, height = self._film.size
        for kind, path in files.items():
            film = f"{report.n_pictures:,} pictures, {report.duration:.1f} s at {report.speed:g} × real time"
            rate = f"{report.n_pictures / wall:.1f} pictures/s"
            self._report(kind, path, f"{width}×{height}" if kind == "png" else f"{film}, {rate}")
