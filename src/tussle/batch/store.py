"""Reads and writes a batch directory: the plan, the results of finished runs, and the tables that are made of them."""

from __future__ import annotations

import contextlib
import math
import os
import shutil
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from tussle.batch.consistency import check_design, check_metrics, check_results
from tussle.batch.schemas import BATCH, CHANCE, GROUP, LATER, PLAYED_BY_CHANCE, RULES
from tussle.batch.tasks import Finished
from tussle.documents import is_count, json_text
from tussle.errors import BatchError, RecordError
from tussle.folders import lock, open_safely
from tussle.record.arrow_file import read_batches
from tussle.record.parquet_blocks import write_parquet
from tussle.record.parquet_file import read_parquet
from tussle.record.run_file import plain, put_whole
from tussle.record.stream import Stream
from tussle.record.table_values import check_values

BATCH_FILE, DESIGN_FILE = "batch.json", "design.parquet"
RESULTS_FILE, ALIVE_FILE = "results.parquet", "alive.parquet"
MAX_IN_PART = 2000
"""Runs in one file of parts: each is a record batch, which in memory takes ten times what the run takes in a table."""

PARTS, RUNS, MISSION, PLUGINS, LOCK = "parts", "runs", "mission", "plugins", "lock"

_METRIC = pa.struct([("team", pa.int32()), ("metric", pa.string()), ("value", pa.float64())])
_ALIVE = pa.struct([("team", pa.int32()), ("t", pa.float64()), ("alive", pa.int32())])

PLAYED = pa.schema(
    [
        ("run", pa.int64()),
        ("end", pa.string()),
        ("t", pa.float64()),
        ("steps", pa.int32()),
        ("winner", pa.int32()),
        ("state_hash", pa.string()),
        (GROUP, pa.int32()),
        (CHANCE, pa.uint8()),
        ("error", pa.string()),
        ("cpu_s", pa.float64()),
        ("host", pa.string()),
        ("metrics", pa.list_(_METRIC)),
        ("alive", pa.list_(_ALIVE)),
    ]
)
"""One row per finished run, as it is appended."""

IS_OWN = (BATCH_FILE, f"{BATCH_FILE}.part", LOCK)
"""Files that a directory may have before its batch has begun: a batch may have been killed then."""

OF_RUN = ("end", "t", "steps", "winner", "state_hash", GROUP, CHANCE, "error", "cpu_s", "host")

RESULTS = pa.schema(
    [
        ("run", pa.int64()),
        ("point", pa.int32()),
        ("seed", pa.uint64()),
        ("team", pa.int32()),
        ("metric", pa.string()),
        ("value", pa.float64()),
        *((name, PLAYED.field(name).type) for name in OF_RUN),
    ]
)
"""One row per run, team and metric, sorted by these; metrics of the world come before those of teams."""

ALIVE = pa.schema([("run", pa.int64()), ("team", pa.int32()), ("t", pa.float64()), ("alive", pa.int32())])
"""One row for each change of the number of a team's entities, from the start of the run to its end."""

DESIGN = pa.schema([("run", pa.int64()), ("point", pa.int32()), ("seed", pa.uint64())])
"""One row per planned run; a column for each variable follows."""

TABLES = {DESIGN_FILE: DESIGN, RESULTS_FILE: RESULTS, ALIVE_FILE: ALIVE}
"""Files of a complete batch, and their columns."""


@dataclass
class StoredBatch:
    """The contents of a batch directory, or of a batch in memory.

    Attributes:
        path: The directory; None in memory.
        info: Contents of `batch.json`.
        design: One row per planned run.
        table: `RESULTS` of the finished runs.
        alive: `ALIVE` of the finished runs.
        notes: What is missing, one line each.
    """

    path: Path | None
    info: dict[str, Any]
    design: pa.Table
    table: pa.Table
    alive: pa.Table
    notes: list[str] = field(default_factory=list)


def row(finished: Finished) -> pa.RecordBatch:
    """A finished run as one row."""
    f = finished
    values = {name: getattr(f, name) for name in OF_RUN} | {
        "run": f.number,
        "error": f.error or None,
        "metrics": [{"team": t, "metric": m, "value": None if math.isnan(v) else v} for t, m, v in f.metrics],
        "alive": [{"team": team, "t": t, "alive": n} for team, t, n in f.alive],
    }
    return pa.RecordBatch.from_pylist([values], PLAYED)


def tables(played: pa.Table, design: pa.Table) -> tuple[pa.Table, pa.Table]:
    """`RESULTS` and `ALIVE` of finished runs; where a run is there twice, the first row counts."""
    runs, first = np.unique(played["run"].to_numpy(), return_index=True)
    is_planned = runs < design.num_rows  # a design has the runs 0, 1, 2 ...
    played = played.take(pa.array(first[is_planned])).combine_chunks()
    of_run = design.take(pa.array(runs[is_planned]))
    if not played.num_rows:
        return RESULTS.empty_table(), ALIVE.empty_table()
    index, found = _exploded(played["metrics"])
    columns = {name: found.field(name) for name in ("team", "metric", "value")}
    columns |= {name: of_run[name].combine_chunks().take(index) for name in ("run", "point", "seed")}
    columns |= {name: played[name].combine_chunks().take(index) for name in OF_RUN}
    results = pa.table([columns[c.name].cast(c.type) for c in RESULTS], schema=RESULTS)
    index, found = _exploded(played["alive"])
    alive = {"run": played["run"].combine_chunks().take(index)} | {n: found.field(n) for n in ALIVE.names[1:]}
    return _with_one_chance(_ordered(results, ("run", "team", "metric"))), pa.table(
        [alive[c.name].cast(c.type) for c in ALIVE], schema=ALIVE
    )


def _exploded(column: pa.ChunkedArray) -> tuple[pa.Array, pa.StructArray]:
    lists = column.combine_chunks()
    if isinstance(lists, pa.ChunkedArray):
        lists = lists.chunk(0)
    return pc.list_parent_indices(lists), pc.list_flatten(lists)


class MemoryStore:
    """Finished runs in memory."""

    def __init__(self) -> None:
        self._parts = [PLAYED.empty_table()]
        self._rows: list[pa.RecordBatch] = []

    def add(self, finished: Finished) -> None:
        """Append a finished run."""
        self._rows.append(row(finished))
        if len(self._rows) >= MAX_IN_PART:
            self._compact()

    def played(self) -> pa.Table:
        """All finished runs, in the order in which they ended."""
        self._compact()
        return pa.concat_tables(self._parts)

    def _compact(self) -> None:
        self._parts.append(pa.Table.from_batches(self._rows, PLAYED).combine_chunks())
        self._rows = []


class Store:
    """A batch directory that is open for writing, and locked for other processes.

    When `add` returns, the operating system has the run. Tables are written whole or not at all; a `batch.json` that says that the batch
    is complete is written last.

    Args:
        path: The directory; made where it does not exist.

    Attributes:
        was_killed: The process that played before was killed.

    Raises:
        BatchError: Another process plays this batch, or the directory holds something else.
        RecordError: It cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._stream: Stream | None = None
        with reported(path):
            path.mkdir(parents=True, exist_ok=True)
            if (path / BATCH_FILE).exists():
                read_info(path)
            elif foreign := [p.name for p in path.iterdir() if p.name not in IS_OWN]:
                raise BatchError(
                    f"{path}: holds something that is no batch ({min(foreign)}); choose another directory"
                )
        self._lock = locked(path, "playing this batch")
        with reported(path):
            self.was_killed = (path / LOCK).stat().st_size > 0
            self._lock.write(f"{os.getpid()}\n")
            self._lock.flush()

    @property
    def info(self) -> dict[str, Any] | None:
        """Contents of `batch.json`; None where there is none."""
        return read_info(self.path) if (self.path / BATCH_FILE).exists() else None

    def write_info(self, info: Mapping[str, Any]) -> None:
        """Write `batch.json`, as a whole."""
        with reported(self.path):
            put_whole(self.path / BATCH_FILE, json_text(plain(info)))

    def write_table(self, name: str, table: pa.Table) -> None:
        """Write a table, as a whole."""
        draft = self.path / f"{name}.part"
        with reported(self.path):
            try:
                draft.unlink(missing_ok=True)  # not what a link leads to
                write_parquet(table, draft)
                draft.replace(self.path / name)
            except OSError:
                draft.unlink(missing_ok=True)
                raise

    def write_folder(self, name: str, files: Mapping[str, bytes]) -> None:
        """Write a folder, as a whole, unless it exists or would be empty.

        Args:
            name: Of the folder.
            files: Path in the folder -> content.
        """
        target, draft = self.path / name, self.path / f"{name}.part"
        if target.exists() or not files:
            return
        with reported(self.path):
            shutil.rmtree(draft, ignore_errors=True)
            draft.mkdir()
            for inner, content in files.items():
                file = draft / inner
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_bytes(content)
            draft.replace(target)

    def add(self, finished: Finished) -> None:
        """Append a finished run."""
        if self._stream is not None and self._stream.rows >= MAX_IN_PART:
            self.close_part()
        if self._stream is None:
            with reported(self.path):
                (self.path / PARTS).mkdir(exist_ok=True)
                taken = [int(p.stem) for p in (self.path / PARTS).glob("*.arrow") if is_count(p.stem)]
                self._stream = Stream(self.path / PARTS / f"{max(taken, default=0) + 1:04d}.arrow", PLAYED)
        self._stream.write(row(finished))

    def close_part(self) -> None:
        """Close the file of this process, if it has one."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None

    def drop_parts(self) -> None:
        """Remove the files of finished runs that the tables hold."""
        with reported(self.path):
            for part in (self.path / PARTS).glob("*.arrow"):
                part.unlink()
            with contextlib.suppress(FileNotFoundError):
                (self.path / PARTS).rmdir()

    def close(self) -> None:
        """Unlock the directory."""
        try:
            self.close_part()
        finally:
            self._lock.truncate(0)
            self._lock.close()


def locked(path: Path, doing: str) -> IO[str]:
    """Lock a directory until the returned file is closed.

    Raises:
        BatchError: Another process holds it.
        RecordError: The file cannot be made, or is a link or no regular file.
    """
    with reported(path):
        file = os.fdopen(open_safely(path / LOCK, os.O_RDWR | os.O_CREAT, 0o666), "r+")
    try:
        lock(file, wait=False)
    except BlockingIOError:
        file.close()
        raise BatchError(f"{path}: another process is {doing}") from None
    except OSError as error:
        warnings.warn(
            f"{path}: this system has no locks ({error.strerror}); make sure that no other process is {doing}",
            RuntimeWarning,
            stacklevel=3,
        )
    return file


@contextlib.contextmanager
def reported(path: Path) -> Iterator[None]:
    """Turn errors of the operating system into record errors."""
    try:
        yield
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise RecordError(
            f"{error.filename or path}: cannot be written: {reason}; finished runs are kept"
        ) from error


def read_info(path: Path) -> dict[str, Any]:
    """Contents of `batch.json`.

    Raises:
        BatchError: There is no batch, or it cannot be read.
    """
    file = path / BATCH_FILE
    if not path.is_dir():
        raise BatchError(f"{path}: there is no such batch directory")
    if not file.exists():
        raise BatchError(f"{path}: this is no batch directory; it has no {BATCH_FILE}")
    return BATCH.read(file)


def read_played(path: Path) -> tuple[pa.Table, list[str]]:
    """Finished runs that are not in the tables yet, and notes on what is damaged; of each file the intact rows are read.

    Raises:
        BatchError: A file holds something else.
    """
    parts, notes = [PLAYED.empty_table()], list[str]()
    for file in sorted((path / PARTS).glob("*.arrow")):
        batches = list(read_batches(file, [], BatchError, PLAYED, RULES, damage=notes, optional=LATER))
        if batches:
            parts.append(_completed(pa.Table.from_batches(batches), PLAYED).combine_chunks())
    return pa.concat_tables(parts), notes


def read_table(path: Path, name: str, columns: pa.Schema, notes: list[str] | None = None) -> pa.Table | None:
    """A table of a batch directory, without its damaged parts; None where there is none.

    Args:
        path: The directory.
        name: Of the file.
        columns: Columns that it has at least.
        notes: Receives a line if it is damaged; None if that is an error.

    Raises:
        BatchError: It cannot be read, or is another table.
    """
    file = path / name
    if not file.exists():
        return None
    table = _completed(read_parquet(file, columns, BatchError, notes=notes, optional=LATER), columns)
    check_values(zip(table.column_names, table.columns, strict=True), RULES, file, BatchError)
    return table


def _completed(table: pa.Table, columns: pa.Schema) -> pa.Table:
    """A table of a batch, in which columns that a former version did not write are 0: its runs are copies if all of a point end alike."""
    for name in LATER:
        if name in columns.names and name not in table.column_names:
            place, column = columns.get_field_index(name), columns.field(name)
            table = table.add_column(place, column, pa.array(np.zeros(table.num_rows), column.type))
    return table


def finished_in(results: pa.Table) -> Iterator[Finished]:
    """The runs of a table of results, without the numbers of entities over time."""
    runs = results["run"].to_numpy()
    starts = np.flatnonzero(np.diff(runs, prepend=-1))
    named = [results[name].to_pylist() for name in ("team", "metric", "value")]
    of_run = results.select(["run", *OF_RUN]).take(pa.array(starts)).to_pylist()
    stops = np.append(starts, len(runs))[1:]
    for start, stop, first in zip(starts, stops, of_run, strict=True):
        metrics = [
            (team, name, math.nan if value is None else value)
            for team, name, value in zip(*(column[start:stop] for column in named), strict=True)
        ]
        number, error = first.pop("run"), first.pop("error") or ""
        yield Finished(number=number, error=error, metrics=metrics, alive=[], **first)


def load(path: str | Path) -> StoredBatch:
    """Read a batch directory, complete or not.

    Raises:
        BatchError: There is no batch, or it cannot be read.
    """
    path = Path(path)
    info = read_info(path)
    needed = TABLES if info["is_complete"] else (DESIGN_FILE,)
    lacking = [f"{name} is missing" for name in needed if not (path / name).exists()]
    design = read_table(path, DESIGN_FILE, DESIGN, lacking)
    if design is None or lacking:
        raise BatchError(
            f"{path}: {lacking[0]}; the command of the batch writes it again, and plays only runs that are lost"
        )
    check_design(design, info, path / DESIGN_FILE)
    played, notes = read_played(path)
    results, alive = merged(path, played, design, notes)
    n = len(pc.unique(results["run"]))
    if not info["is_complete"]:
        notes.insert(0, f"the batch is not complete: {n} of {design.num_rows} runs are finished")
    elif notes:
        notes.append(
            f"{n} of {design.num_rows} runs are intact; the command of the batch plays the others again"
        )
    return StoredBatch(path, info, design, results, alive, notes)


def damage(path: Path, info: dict[str, Any]) -> list[str]:
    """Describe what is damaged in the tables of a directory, or missing in that of a complete batch, one line each.

    Raises:
        BatchError: A table is another one.
    """
    notes: list[str] = []
    for name, columns in TABLES.items():
        if read_table(path, name, columns, notes) is None and info["is_complete"]:
            notes.append(f"{name} is missing")
    return notes


def merged(path: Path, played: pa.Table, design: pa.Table, notes: list[str]) -> tuple[pa.Table, pa.Table]:
    """The tables of a directory, with the runs that are not in them yet, and without those that are damaged in one of the two.

    Args:
        path: The directory.
        played: Finished runs of the parts.
        design: The planned runs.
        notes: Receives a line for each table that is damaged.

    Raises:
        BatchError: A table is another one.
    """
    old = read_table(path, RESULTS_FILE, RESULTS, notes)
    n_notes = len(notes)
    old_alive = read_table(path, ALIVE_FILE, ALIVE, notes)
    if old is not None and old_alive is not None and len(notes) > n_notes:
        old = old.filter(pc.is_in(old["run"], pc.unique(old_alive["run"]).cast(pa.int64())))
    if old is not None and old_alive is None:
        notes.append(f"{ALIVE_FILE} is missing")
        old = None
    for table, name in ((old, RESULTS_FILE), (old_alive, ALIVE_FILE)):
        if table is not None:
            check_results(table, design, path / name)
    results, alive = tables(played, design)
    for table in (results, alive):
        check_values(zip(table.column_names, table.columns, strict=True), RULES, path / PARTS, BatchError)
    # Each by its own runs: a batch that was killed at its end may have written one of the two.
    results = _with_one_chance(_with_new(old, results, ("run", "team", "metric")))
    check_metrics(results, path / RESULTS_FILE)
    alive = _with_new(old_alive, alive, ("run", "t", "team"))
    return results, alive.filter(
        pc.is_in(alive["run"], pc.unique(results["run"]).cast(pa.int64()))
    ) if notes else alive


def _with_one_chance(results: pa.Table) -> pa.Table:
    """A table of results in which plugins of all runs of a group draw if those of one do: which were in one stack is not told."""
    chance, group = (results[name].to_numpy() for name in (CHANCE, GROUP))
    is_drawn = np.isin(group, np.unique(group[chance == PLAYED_BY_CHANCE]))
    place = results.schema.get_field_index(CHANCE)
    column = pa.array(np.where(is_drawn, np.uint8(PLAYED_BY_CHANCE), chance))
    return results.set_column(place, results.schema.field(place), column)


def _with_new(old: pa.Table | None, new: pa.Table, order: tuple[str, ...]) -> pa.Table:
    """A table with the rows of further runs, sorted."""
    if old is None:
        return new
    new = new.filter(pc.invert(pc.is_in(new["run"], pc.unique(old["run"]).cast(pa.int64()))))
    if not new.num_rows:
        return old
    return _ordered(pa.concat_tables([old, new]), order)


def _ordered(table: pa.Table, names: tuple[str, ...]) -> pa.Table:
    """A table sorted by some columns; rows without a team come before those of teams."""
    keys = pa.table({n: table[n].fill_null(-(2**31)) if n == "team" else table[n] for n in names})
    return table.take(pc.sort_indices(keys, sort_keys=[(name, "ascending") for name in names]))
