"""Records a simulation into a run directory while it runs."""

from __future__ import annotations

import shutil
import time
import warnings
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any, Protocol, Self

import numpy as np
import pyarrow as pa

from tussle.documents import POSITIVE, Maybe, check_argument
from tussle.errors import MissionError, RecordError
from tussle.folders import real_path
from tussle.mission import PluginFile, to_xml
from tussle.mission.write import with_seed
from tussle.record import run_file
from tussle.record.arrow_values import arrow_array
from tussle.record.events import BIRTH, END, Events
from tussle.record.input_table import batch_of
from tussle.record.inputs import ExternalInput
from tussle.record.plugin_columns import ColumnReader, select
from tussle.record.plugin_copies import plugin_copies
from tussle.record.results import ResultRows
from tussle.record.row_buffer import RowBuffer, RowSelection
from tussle.record.schema import (
    EVENTS,
    EVENTS_FILE,
    FILES,
    INPUTS,
    INPUTS_FILE,
    LINKS,
    LINKS_FILE,
    MISSION_FILE,
    RESULTS,
    RESULTS_FILE,
    SHAPES,
    SHAPES_FILE,
    TRAJECTORY_FILE,
)
from tussle.record.shapes import ShapeRows
from tussle.record.stream import Stream
from tussle.record.traffic import Traffic, check_file_names

MAX_RESULTS = 100_000
"""Changes of results that are collected between two flushes."""
MAX_CHARACTERS = 4_000_000
"""Characters of shapes that are collected between two flushes."""


class Recorded(Protocol):
    """The part of a simulation that the recorder uses. The engine is a higher layer, so its class cannot be imported here."""

    mission: Any
    n_worlds: int
    observers: list[Any]
    events: Any
    state: Any

    @property
    def grade(self) -> str: ...

    def result(self, *, is_hashed: bool = True) -> list[Any]: ...


class Recorder:
    """Records states and events of a simulation into a directory, until it is closed.

    Flushed data is with the operating system: killing the process loses at most what was recorded since the last flush. The state
    of a step is recorded at its beginning; the last state of each world is always recorded. `run.json` is written last.

    Args:
        sim: The simulation; recording starts with its present state.
        directory: Run directory; created if it does not exist. It must not hold a run.
        period: Time between recorded states [s]; None records every step.
        mission_text: Mission file with all its values, saved as `mission.xml`, of a single world with its seed; by default the mission of
            the simulation is written, if a mission file can hold it.
        parameters: Values that were set in addition to the mission, for `run.json`.
        mission_notes: Notes about the mission file, for `run.json`, see `tussle.mission.Loaded`.
        flush_every: Wall time between flushes [s].
        shapes: Whether the shapes that plugins draw are recorded, too; of every step, whatever the period.
        columns: `State` and `Output` columns of plugins that are recorded with the states: "prey.Boids.goal", or "Boids.goal" for all
            blocks; `*` stands for any characters, and a text may name several, separated by commas. Columns that are declared with
            `recorded=True` are always recorded.
        results: Whether scores and results of metrics, interactions and networks are recorded after each step, whatever the period.
        scene_files: Files of terrain, meshes and textures that the mission's text names, which are copied, by name: see
            `tussle.mission.Loaded`.
        plugin_files: Python files with the mission's plugins, which are copied: see `tussle.mission.Loaded`.

    Raises:
        RecordError: The directory holds a run, or cannot be written.
        ParameterError: `period` or `flush_every` is not positive and finite, a network's `csv_filename` is no plain file name, or one of
            `columns` does not exist.
    """

    def __init__(
        self,
        sim: Recorded,
        directory: str | Path,
        *,
        period: float | None = None,
        mission_text: str | None = None,
        parameters: Mapping[str, Any] | None = None,
        mission_notes: Sequence[str] = (),
        flush_every: float = 1.0,
        shapes: bool = False,
        columns: str | Iterable[str] = (),
        results: bool = False,
        scene_files: Mapping[str, Path] | None = None,
        plugin_files: Sequence[PluginFile] = (),
    ) -> None:
        check_argument("period", period, Maybe(POSITIVE))
        check_argument("flush_every", flush_every, Maybe(POSITIVE))
        check_file_names(sim.mission.networks)
        self.sim, self.directory = sim, Path(directory)
        self.period, self.flush_every = period, flush_every
        self.parameters = dict(parameters or {})
        self.mission_notes = list(mission_notes)
        self.is_closed = False
        self._timings = run_file.Timings()
        clock, mission = sim.state.context.clock, sim.mission
        per_step = 1 if period is None else Fraction(str(mission.dt)) / Fraction(str(period))
        # A step times the numerator or denominator must fit into 64 bits.
        least = Fraction(1, 10**9)
        self._per_step = None if per_step >= 1 else max(Fraction(per_step).limit_denominator(10**9), least)
        self.columns = columns if isinstance(columns, str) else ",".join(columns)
        self._columns = ColumnReader(sim, select(mission, self.columns))
        recorded = [source.column for source in self._columns.sources]
        self._buffer = RowBuffer([b.name for b in mission.blocks], clock.start, clock.dt, recorded)
        self._events: list[Events] = []
        self._inputs: list[tuple[int, ExternalInput]] = []
        self._input_stream: Stream | None = None
        self._rows_source: np.ndarray | None = None
        self._rows: RowSelection
        self._common_step = -1
        self._steps = np.full(sim.n_worlds, -1, np.int64)
        self._others: list[str] = []
        self._open(mission_text, shapes, results, scene_files or {}, plugin_files)
        self._flush_at = time.monotonic() + flush_every
        self._begin()

    def _open(
        self,
        mission_text: str | None,
        shapes: bool,
        results: bool,
        scene_files: Mapping[str, Path],
        plugin_files: Sequence[PluginFile],
    ) -> None:
        try:
            self.directory.mkdir(parents=True, exist_ok=True)
            held = [name for name in FILES if (self.directory / name).exists()]
            if held:
                raise self._held(held[0])
            home, copies = real_path(self.directory), plugin_copies(plugin_files)
            inside = {
                name: file for name, file in scene_files.items()
                if real_path(home / name).is_relative_to(home) and name not in FILES
            }  # fmt: skip
            for name in (*inside, *copies):
                if (home / name).exists() and not (name in inside and inside[name].samefile(home / name)):
                    raise RecordError(
                        f"{self.directory}: holds another file {name!r}, which belongs to a run of this mission; choose another directory"
                    )
            # Of recorders that begin here at the same time, one makes this file.
            (self.directory / TRAJECTORY_FILE).touch(exist_ok=False)
            seeds = self.sim.state.context.seeds
            if mission_text and len(seeds) == 1:
                mission_text = with_seed(mission_text, int(seeds[0]))
            mission_text = mission_text or self._written_back()
            if mission_text:
                (self.directory / MISSION_FILE).write_text(mission_text, encoding="utf-8")
                self._others.append(MISSION_FILE)
            for name, file in inside.items():
                place = self.directory / name
                place.parent.mkdir(parents=True, exist_ok=True)
                if not place.exists():  # else the mission lies where it is recorded
                    shutil.copyfile(file, place)
                self._others.append(name)
            for name, text in copies.items():
                (self.directory / name).parent.mkdir(parents=True, exist_ok=True)
                (self.directory / name).write_text(text, encoding="utf-8")
                self._others.append(name)
        except OSError as error:
            if isinstance(error, FileExistsError) and error.filename == str(self.directory / TRAJECTORY_FILE):
                raise self._held(TRAJECTORY_FILE) from None
            raise RecordError(
                f"{self.directory}: cannot record a run there: {error.strerror or error}"
            ) from error
        self._trajectory = Stream(self.directory / TRAJECTORY_FILE, self._buffer.schema)
        self._event_stream = Stream(self.directory / EVENTS_FILE, EVENTS)
        self._streams = [self._trajectory, self._event_stream]
        self._shapes: ShapeRows | None = None
        if shapes:
            self._shapes, self._shape_stream = (
                ShapeRows(self.sim),
                Stream(self.directory / SHAPES_FILE, SHAPES),
            )
            self._streams.append(self._shape_stream)
        self._results = ResultRows(self.sim) if results else None
        if results:
            self._result_stream = Stream(self.directory / RESULTS_FILE, RESULTS)
            self._streams.append(self._result_stream)
        self._traffic = Traffic(self.sim.mission.networks, self.directory, self.sim.n_worlds)

    def _held(self, name: str) -> RecordError:
        return RecordError(
            f"{self.directory}: holds a run already ({name}); choose another directory, or remove it"
        )

    def _written_back(self) -> str:
        seeds = self.sim.state.context.seeds
        try:
            return to_xml(self.sim.mission, int(seeds[0]) if len(seeds) == 1 else None)
        except MissionError:  # there is no tag for something in it
            return ""

    def _begin(self) -> None:
        """Attach to the simulation, and record the births of the entities that exist."""
        sim = self.sim
        bodies, clock = sim.state.population.bodies, sim.state.context.clock
        names = sim.state.context.block_names
        rows = RowSelection(bodies.ints, sim.state.running)
        world, ids, _, block = rows.columns
        nobody = np.zeros(rows.n, np.int64)
        self._events.append(Events(BIRTH, world, clock.step[world], ids, nobody, [names[b] for b in block]))
        # Written even without rows: this writes the file headers, so that a full disk is noticed before the game starts.
        self._write(self._event_stream, self._take_events())
        self._write(self._trajectory, self._buffer.take())
        sim.observers.append(self._observe)
        sim.events.listen(self._on_events)
        sim.events.traffic.append(self._traffic)
        sim.events.inputs.append(self._on_input)

    # -- during the game ------------------------------------------------------------------------------------------------------

    def _observe(self, sim: Recorded) -> None:
        """Record the states at the beginning of a step, if it is due."""
        if self._results:
            self._results.read()
        clock = sim.state.context.clock
        step = clock.common
        if step < 0:
            self._observe_apart(sim)
        else:
            if step <= self._common_step:
                self._refuse_past()
            self._common_step = step
            due = self._per_step
            if (
                due is None
                or (step * due.numerator) // due.denominator
                != ((step - 1) * due.numerator) // due.denominator
            ):
                bodies = sim.state.population.bodies
                if bodies.ints is not self._rows_source:
                    self._rows_source, self._rows = bodies.ints, RowSelection(bodies.ints)
                self._add(self._rows, step)
        n_characters = self._shapes.n_characters if self._shapes else 0
        n_results = self._results.n if self._results else 0
        if time.monotonic() >= self._flush_at or n_characters > MAX_CHARACTERS or n_results > MAX_RESULTS:
            self.flush()

    def _observe_apart(self, sim: Recorded) -> None:
        """Record the worlds that are due, if their step numbers differ."""
        step = sim.state.context.clock.step
        last = np.maximum(self._steps, self._common_step)
        if (step <= last)[sim.state.running].any():
            self._refuse_past()
        self._steps = np.where(sim.state.running, step, last)
        due = sim.state.running.copy()
        if self._per_step is not None:
            p, q = self._per_step.numerator, self._per_step.denominator
            due &= (step * p) // q != ((step - 1) * p) // q
        rows = RowSelection(sim.state.population.bodies.ints, due)
        self._add(rows, step[rows.world])

    def _refuse_past(self) -> None:
        self.close("a world was reset or restored to an earlier step during the recording")
        raise RecordError(
            f"{self.directory}: a world was reset or restored to an earlier step, but a run directory holds one game per world; "
            "close the recorder before `reset` or `restore`, and make another"
        )

    def _add(self, rows: RowSelection, step: Any, parked: Any = None) -> None:
        """Record rows of the body table, or of that of a world that has ended."""
        if not self._buffer.has_room(rows.n):
            self._write(self._trajectory, self._buffer.take())
        bodies = self.sim.state.population.bodies if parked is None else parked.bodies
        self._buffer.add(
            bodies.floats, rows, step, self._columns.read(parked) if self._columns.sources else ()
        )

    def _on_events(self, events: Events) -> None:
        """Keep events; at the end of a world, also record its last state."""
        self._events.append(events)
        if events.kind == END:
            for world, step in zip(events.world, events.step, strict=True):
                parked = self.sim.state.parked[int(world)]
                self._add(RowSelection(parked.bodies.ints), int(step), parked)

    def _on_input(self, world: int, given: ExternalInput) -> None:
        """Keep what came from outside."""
        self._inputs.append((world, given))

    def _write_inputs(self) -> None:
        if self._input_stream is None:
            self._input_stream = Stream(self.directory / INPUTS_FILE, INPUTS)
            self._streams.append(self._input_stream)
        clock = self.sim.state.context.clock
        inputs, self._inputs = self._inputs, []
        self._write(self._input_stream, batch_of(inputs, lambda step: clock.start + step * clock.dt))

    def _write(self, stream: Stream, batch: pa.RecordBatch) -> None:
        try:
            stream.write(batch)
        except RecordError:
            self._detach()
            self.is_closed = True
            for other in self._streams:
                other.abandon()
            raise

    def flush(self) -> None:
        """Write everything recorded so far to the operating system."""
        if self._events:
            self._write(self._event_stream, self._take_events())
        if self._buffer.n:
            self._write(self._trajectory, self._buffer.take())
        if self._shapes and (drawn := self._shapes.take()):
            self._write(self._shape_stream, drawn)
        if self._results and (changes := self._results.take()):
            self._write(self._result_stream, changes)
        if self._inputs:
            self._write_inputs()
        self._flush_at = time.monotonic() + self.flush_every

    def _take_events(self) -> pa.RecordBatch:
        events, self._events = self._events, []
        clock = self.sim.state.context.clock
        step = np.concatenate([e.step for e in events])
        columns: dict[str, Any] = {
            "world": np.concatenate([e.world for e in events]).astype(np.int32),
            "t": clock.start + step * clock.dt,
            "step": step.astype(np.int32),
            "kind": [e.kind for e in events for _ in range(len(e))],
            "id": np.concatenate([e.id for e in events]).astype(np.int32),
            "other": np.concatenate([e.other for e in events]).astype(np.int32),
            "text": [text for e in events for text in e.text],
        }
        arrays = [arrow_array(columns[field.name], field.type) for field in EVENTS]
        return pa.RecordBatch.from_arrays(arrays, schema=EVENTS)

    # -- the end --------------------------------------------------------------------------------------------------------------

    def close(self, interrupted: str = "") -> None:
        """Record the last states, and write the summary and `run.json`. A second call does nothing.

        Args:
            interrupted: Why the game stops early; the run then counts as incomplete.

        Raises:
            RecordError: The files cannot be written.
        """
        if self.is_closed:
            return
        self.is_closed = True
        self._detach()
        sim, step = self.sim, self.sim.state.context.clock.step
        if self._results:
            self._results.read()
        last = np.maximum(self._steps, self._common_step)
        unrecorded = sim.state.running & (step > last)
        if unrecorded.any():
            rows = RowSelection(sim.state.population.bodies.ints, unrecorded)
            self._add(rows, step[rows.world])
        self.flush()
        if self._traffic.has_links:
            self._streams.append(Stream(self.directory / LINKS_FILE, LINKS))
            self._write(self._streams[-1], self._traffic.take_links())
        for text in [*self._traffic.unknown_topics(sim.state.message_bus.topics), *self._columns.left_out()]:
            warnings.warn(text, RuntimeWarning, stacklevel=2)
        for stream in self._streams:
            stream.close()
        run_file.write(
            self.directory,
            sim,
            self._timings,
            self._streams,
            [*self._others, *self._traffic.file_names],
            {
                "period": self.period,
                "parameters": self.parameters,
                "mission_notes": self.mission_notes,
                "columns": self.columns,
                "interrupted": interrupted,
            },
        )

    def _detach(self) -> None:
        if self._observe in self.sim.observers:
            self.sim.observers.remove(self._observe)
        self.sim.events.forget(self._on_events)
        if self._on_input in self.sim.events.inputs:
            self.sim.events.inputs.remove(self._on_input)
        if self._traffic in self.sim.events.traffic:
            self.sim.events.traffic.remove(self._traffic)
        self._traffic.close()
        if self._shapes is not None:
            self._shapes.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None:
        self.close("" if kind is None else f"{kind.__name__}: {error}" if str(error) else kind.__name__)
