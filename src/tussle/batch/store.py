"""A batch directory: what is planned, what has been played, and the tables that are made of it."""

from __future__ import annotations

import contextlib
import fcntl
import json
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import IO, Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from tussle.batch.tasks import Finished
from tussle.errors import BatchError, RecordError
from tussle.record.run_file import plain, put_whole
from tussle.record.stream import Stream, read_stream

FORMAT = 1
BATCH_FILE, DESIGN_FILE, RESULTS_FILE, ALIVE_FILE = (
    "batch.json",
    "design.parquet",
    "results.parquet",
    "alive.parquet",
)
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
        ("error", pa.string()),
        ("cpu_s", pa.float64()),
        ("host", pa.string()),
        ("metrics", pa.list_(_METRIC)),
        ("alive", pa.list_(_ALIVE)),
    ]
)
"""One row per finished run, as it is appended."""

OF_RUN = ("end", "t", "steps", "winner", "state_hash", "error", "cpu_s", "host")

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
"""One row per run, team and metric, sorted by these; what is of the world comes before the teams."""

ALIVE = pa.schema([("run", pa.int64()), ("team", pa.int32()), ("t", pa.float64()), ("alive", pa.int32())])
"""One row whenever the number of a team's entities changes, from the start of the run to its end."""


@dataclass
class Stored:
    """A batch as it lies on disk, or in memory.

    Attributes:
        path: Its directory; None in memory.
        info: What `batch.json` says.
        design: One row per planned run.
        table: `RESULTS` of the runs that are finished.
        alive: `ALIVE` of them.
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
    metrics = [{"team": t, "metric": m, "value": None if math.isnan(v) else v} for t, m, v in f.metrics]
    alive = [{"team": team, "t": t, "alive": n} for team, t, n in f.alive]
    values = [
        f.number,
        f.end,
        f.t,
        f.steps,
        f.winner,
        f.state_hash,
        f.error or None,
        f.cpu_s,
        f.host,
        metrics,
        alive,
    ]
    arrays = [pa.array([value], column.type) for value, column in zip(values, PLAYED, strict=True)]
    return pa.RecordBatch.from_arrays(arrays, schema=PLAYED)


def tables(played: pa.Table, design: pa.Table) -> tuple[pa.Table, pa.Table]:
    """`RESULTS` and `ALIVE` of finished runs; of a run that is there twice, the first row counts."""
    runs, first = np.unique(played["run"].to_numpy(), return_index=True)
    known = design["run"].to_numpy()
    place = np.searchsorted(known, runs)
    is_planned = (
        (place < len(known)) & (known[np.minimum(place, len(known) - 1)] == runs) if len(known) else runs < 0
    )
    played = played.take(pa.array(first[is_planned])).combine_chunks()
    of_run = design.take(pa.array(place[is_planned]))
    if not played.num_rows:
        return RESULTS.empty_table(), ALIVE.empty_table()
    index, found = _exploded(played["metrics"])
    columns = {name: found.field(name) for name in ("team", "metric", "value")}
    columns |= {name: of_run[name].combine_chunks().take(index) for name in ("run", "point", "seed")}
    columns |= {name: played[name].combine_chunks().take(index) for name in OF_RUN}
    results = pa.table([columns[c.name].cast(c.type) for c in RESULTS], schema=RESULTS)
    index, found = _exploded(played["alive"])
    alive = {"run": played["run"].combine_chunks().take(index)} | {n: found.field(n) for n in ALIVE.names[1:]}
    return _ordered(results, ("run", "team", "metric")), pa.table(
        [alive[c.name].cast(c.type) for c in ALIVE], schema=ALIVE
    )


def _exploded(column: pa.ChunkedArray) -> tuple[pa.Array, pa.StructArray]:
    lists = column.combine_chunks()
    if isinstance(lists, pa.ChunkedArray):
        lists = lists.chunk(0)
    return pc.list_parent_indices(lists), pc.list_flatten(lists)


class Store:
    """The directory of a batch that is being played; nobody else plays into it meanwhile.

    What `add` has returned from is with the operating system. The tables appear whole or not at all, and `batch.json` says last that the
    batch is complete.

    Args:
        path: The directory; made if need be.

    Raises:
        BatchError: Another process plays into it, or it holds something else.
        RecordError: It cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._stream: Stream | None = None
        with told(path):
            path.mkdir(parents=True, exist_ok=True)
            foreign = [p.name for p in path.iterdir() if p.name not in (BATCH_FILE, LOCK)]
            if foreign and not (path / BATCH_FILE).exists():
                raise BatchError(
                    f"{path}: holds something that is no batch ({min(foreign)}); choose another directory"
                )
            self._lock: IO[str] = (path / LOCK).open("w")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._lock.close()
            raise BatchError(f"{path}: another process is playing this batch") from None

    @property
    def info(self) -> dict[str, Any] | None:
        """What `batch.json` says; None without one."""
        return read_info(self.path) if (self.path / BATCH_FILE).exists() else None

    def write_info(self, info: Mapping[str, Any]) -> None:
        """Put `batch.json` in its place."""
        with told(self.path):
            put_whole(self.path / BATCH_FILE, json.dumps(plain(info), indent=1, allow_nan=False) + "\n")

    def write_table(self, name: str, table: pa.Table) -> None:
        """Put a table in its place."""
        draft = self.path / f"{name}.part"
        with told(self.path):
            try:
                pq.write_table(table, draft, compression="zstd")
                draft.replace(self.path / name)
            except OSError:
                draft.unlink(missing_ok=True)
                raise

    def played(self) -> pa.Table:
        """All runs that are finished, in the order in which they were."""
        return read_played(self.path)[0]

    def add(self, finished: Finished) -> None:
        """Append a finished run."""
        if self._stream is None:
            with told(self.path):
                (self.path / PARTS).mkdir(exist_ok=True)
                taken = [int(p.stem) for p in (self.path / PARTS).glob("*.arrow") if p.stem.isdigit()]
                self._stream = Stream(self.path / PARTS / f"{max(taken, default=0) + 1:04d}.arrow", PLAYED)
        self._stream.write(row(finished))

    def close_part(self) -> None:
        """End the stream of this process, so far as there is one."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None

    def drop_parts(self) -> None:
        """Remove what has been made into tables."""
        with told(self.path):
            for part in (self.path / PARTS).glob("*.arrow"):
                part.unlink()
            with contextlib.suppress(FileNotFoundError):
                (self.path / PARTS).rmdir()

    def close(self) -> None:
        """Leave the directory to others."""
        try:
            self.close_part()
        finally:
            self._lock.close()


@contextlib.contextmanager
def told(path: Path) -> Iterator[None]:
    """Errors of the operating system as those of records."""
    try:
        yield
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise RecordError(
            f"{error.filename or path}: cannot be written: {reason}; finished runs are kept"
        ) from error


def read_info(path: Path) -> dict[str, Any]:
    """What `batch.json` of a directory says.

    Raises:
        BatchError: There is no batch, or one that cannot be read.
    """
    file = path / BATCH_FILE
    if not path.is_dir():
        raise BatchError(f"{path}: there is no such batch directory")
    if not file.is_file():
        raise BatchError(f"{path}: this is no batch directory; it has no {BATCH_FILE}")
    try:
        info: Any = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BatchError(f"{file}: cannot be read: {error}") from None
    found = info.get("format") if isinstance(info, dict) else None
    if found != FORMAT:
        raise BatchError(f"{file}: the batch has format {found!r}; this tussle reads format {FORMAT}")
    return dict(info)


def read_played(path: Path) -> tuple[pa.Table, list[str]]:
    """Finished runs that are not in the tables yet, with what is missing; a file that was cut gives its whole batches."""
    parts, notes = [PLAYED.empty_table()], []
    for file in sorted((path / PARTS).glob("*.arrow")):
        table, note = read_stream(file, PLAYED)
        if table.schema.equals(PLAYED):
            parts.append(table)
        if note:
            notes.append(note)
    return pa.concat_tables(parts), notes


def read_table(path: Path, name: str) -> pa.Table | None:
    """A table of a batch directory; None where there is none.

    Raises:
        BatchError: It cannot be read.
    """
    file = path / name
    if not file.exists():
        return None
    try:
        return pq.read_table(file)
    except (OSError, pa.ArrowException) as error:
        raise BatchError(f"{file}: cannot be read: {error}") from None


def finished_in(results: pa.Table) -> Iterator[Finished]:
    """The runs of a table of results, without the numbers over time."""
    runs = results["run"].to_numpy()
    starts = np.flatnonzero(np.diff(runs, prepend=-1))
    for start, stop in pairwise([*starts, len(runs)]):
        rows = results.slice(start, stop - start).to_pylist()
        first = rows[0]
        metrics = [(r["team"], r["metric"], np.nan if r["value"] is None else r["value"]) for r in rows]
        of_run = {name: first[name] for name in OF_RUN} | {"error": first["error"] or ""}
        yield Finished(number=first["run"], metrics=metrics, alive=[], **of_run)


def load(path: str | Path) -> Stored:
    """A batch directory, complete or not.

    Raises:
        BatchError: There is no batch, or it cannot be read.
    """
    path = Path(path)
    info = read_info(path)
    design = read_table(path, DESIGN_FILE)
    if design is None:
        raise BatchError(
            f"{path}: {DESIGN_FILE} is not there: the batch was stopped before its first run; play it again"
        )
    played, notes = read_played(path)
    results, alive = merged(path, played, design)
    n = len(pc.unique(results["run"]))
    if not info.get("is_complete"):
        notes = [f"the batch is not complete: {n} of {design.num_rows} runs are finished"]
    return Stored(path, info, design, results, alive, notes)


def merged(path: Path, played: pa.Table, design: pa.Table) -> tuple[pa.Table, pa.Table]:
    """The tables of a directory with runs that have been played since."""
    old, old_alive = read_table(path, RESULTS_FILE), read_table(path, ALIVE_FILE)
    results, alive = tables(played, design)
    # Each by its own runs: a batch that is killed as it ends may have written one table and not the other.
    results = _with_new(old, results, ("run", "team", "metric"))
    return results, _with_new(old_alive, alive, ("run", "t", "team"))


def _with_new(old: pa.Table | None, new: pa.Table, order: tuple[str, ...]) -> pa.Table:
    """A table with the rows of runs that it does not have yet, in order."""
    if old is None:
        return new
    new = new.filter(pc.invert(pc.is_in(new["run"], pc.unique(old["run"]).cast(pa.int64()))))
    if not new.num_rows:
        return old
    return _ordered(pa.concat_tables([old, new]), order)


def _ordered(table: pa.Table, names: tuple[str, ...]) -> pa.Table:
    """A table in the order of some columns; what is of no team comes before the teams."""
    keys = pa.table({n: table[n].fill_null(-(2**31)) if n == "team" else table[n] for n in names})
    return table.take(pc.sort_indices(keys, sort_keys=[(name, "ascending") for name in names]))
