"""Export of a run's tables as CSV or Parquet, batch by batch."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
import pyarrow.parquet

from tussle.documents import DAMAGED, is_whole
from tussle.errors import ParameterError, RecordError, listed, nearest_name
from tussle.record.arrow_file import read_batches
from tussle.record.run import run_directory
from tussle.record.schema import (
    EVENTS,
    EVENTS_FILE,
    EVENTS_RULES,
    RUN,
    RUN_FILE,
    TRAJECTORY,
    TRAJECTORY_FILE,
    TRAJECTORY_RULES,
)
from tussle.view.export.whole_file import unwritable, whole_file

KINDS = ("csv", "parquet")
ROWS_OF_A_GROUP = 1 << 18
"""Rows of a Parquet row group: about 30 MB of memory."""


@dataclass
class TablesReport:
    """The files that were written.

    Attributes:
        paths: The files: states, events.
        rows: Rows of each.
        notes: Missing parts of the run, one line each.
    """

    paths: list[Path] = field(default_factory=list)
    rows: list[int] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def write_tables(
    run: str | Path,
    path: str | Path,
    kind: str,
    *,
    world: int | None = None,
    show: Callable[[int], None] | None = None,
) -> TablesReport:
    """Write the states of a run to a file and its events to a second file: to `states.events.csv` for `states.csv`.

    The tables have the columns of the recorded ones. One batch is in memory at a time. Of an incomplete run, the complete batches
    are written.

    Args:
        run: The run directory.
        path: The file of states; an existing one is replaced.
        kind: "csv" or "parquet".
        world: Only this world; None for all of them.
        show: Called after each batch with the number of rows of states read.

    Raises:
        ParameterError: The kind does not exist.
        RecordError: It is no run directory, or has no such world.
        ViewError: A file cannot be written.
    """
    if kind not in KINDS:
        raise ParameterError(f"kind = {kind!r} is not allowed{nearest_name(kind, KINDS)}; {listed(KINDS)}")
    place, target = run_directory(run), Path(path)
    report = TablesReport()
    _check(place, world, report)
    if not target.name:
        raise unwritable(target, "it is a directory")
    beside = target.with_name(f"{target.stem}.events{target.suffix or '.' + kind}")
    tables = (
        (TRAJECTORY_FILE, TRAJECTORY, TRAJECTORY_RULES, target, show),
        (EVENTS_FILE, EVENTS, EVENTS_RULES, beside, None),
    )
    for name, schema, rules, file, report_rows in tables:
        batches = read_batches(place / name, report.notes, RecordError, schema, rules, damage=report.notes)
        report.rows.append(_write(batches, schema, file, kind, world, report_rows))
        report.paths.append(file)
    return report


def _check(place: Path, world: int | None, report: TablesReport) -> None:
    """Check that the run and the world exist.

    Raises:
        RecordError: One of them does not.
    """
    if RUN.is_damaged(place / RUN_FILE):
        report.notes.append(f"{RUN_FILE} {DAMAGED}")
        return
    if (place / RUN_FILE).exists():
        worlds = RUN.read(place / RUN_FILE)["worlds"]
    else:
        report.notes.append(
            f"{RUN_FILE} is missing: the run is still going on or was killed; its states so far are exported"
        )
        return
    if world is not None and not (is_whole(world) and 0 <= world < len(worlds)):
        raise RecordError(f"{place}: there is no world {world}; there are worlds 0 to {len(worlds) - 1}")


def _write(
    batches: Iterator[pa.RecordBatch],
    schema: pa.Schema,
    path: Path,
    kind: str,
    world: int | None,
    show: Callable[[int], None] | None,
) -> int:
    """Write batches to a file; return the number of rows written."""
    first = next(batches, None)
    if first is not None:
        schema, batches = first.schema, chain([first], batches)
    plain = pa.schema(
        [pa.field(f.name, pa.string() if pa.types.is_dictionary(f.type) else f.type) for f in schema]
    )
    n_read = n_written = 0
    with whole_file(path) as part, pa.OSFile(str(part), "wb") as file:
        writer = (
            pa.csv.CSVWriter(file, plain, write_options=pa.csv.WriteOptions(quoting_style="needed"))
            if kind == "csv"
            else pa.parquet.ParquetWriter(file, plain, compression="zstd")
        )
        with writer:
            for table in _grouped(batches, plain, 1 if kind == "csv" else ROWS_OF_A_GROUP):
                kept = table if world is None else table.filter(pc.equal(table["world"], world))
                n_read, n_new = n_read + len(table), len(kept)
                if kind == "csv" and n_new and not n_written:
                    file.write(_first_line(kept.slice(0, 1).to_pylist()[0]).encode())
                    kept = kept.slice(1)
                writer.write_table(kept)
                n_written += n_new
                if show is not None:
                    show(n_read)
    return n_written


def _first_line(row: dict[str, Any]) -> str:
    """The first row of a table in CSV. Its real numbers have a point where Arrow writes "0": by the first rows, programs guess types."""

    def cell(value: Any) -> str:
        if isinstance(value, str):
            return '"' + value.replace('"', '""') + '"'
        return "" if value is None else str(value).lower() if isinstance(value, bool) else repr(value)

    return ",".join(map(cell, row.values())) + "\n"


def _grouped(batches: Iterator[pa.RecordBatch], schema: pa.Schema, n: int) -> Iterator[pa.Table]:
    """Batches joined to tables of at least n rows, with texts in place of dictionary indices."""
    waiting: list[pa.Table] = []
    for batch in batches:
        waiting.append(pa.table([batch[name].cast(schema.field(name).type) for name in schema.names], schema))
        if sum(map(len, waiting)) >= n:
            yield pa.concat_tables(waiting)
            waiting = []
    if waiting:
        yield pa.concat_tables(waiting)
