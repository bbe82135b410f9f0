"""Reads the finished runs of a batch directory some at a time, so that memory does not grow with the number of runs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from tussle.batch.consistency import MetricsCheck, check_results
from tussle.batch.schemas import (
    ALIVE,
    ALIVE_FILE,
    CHANCE,
    GROUP,
    LATER,
    OF_RUN,
    PARTS,
    PLAYED,
    PLAYED_BY_CHANCE,
    RESULTS,
    RESULTS_FILE,
    RULES,
)  # fmt: skip
from tussle.batch.tasks import Finished
from tussle.errors import BatchError
from tussle.record.arrow_file import read_batches
from tussle.record.parquet_file import ParquetTable
from tussle.record.table_values import check_values

RUNS_AT_ONCE = 2048
MAX_OPEN_PARTS = 8
"""Files of finished runs that are held in memory: runs end about in the order of their numbers, so that a file serves few ranges."""


class FinishedRuns:
    """The finished runs of a batch directory, sorted: those of its tables, and those that are not in them yet.

    Iterating yields the rows of `RESULTS` and of `ALIVE` of some runs after another. Runs that are damaged in one of the two are left
    out. A run that is there twice is read where it is found first.

    Args:
        path: The directory.
        design: The planned runs.
        notes: Receives a line for whatever is damaged.

    Raises:
        BatchError: A file holds something else.
    """

    def __init__(self, path: Path, design: pa.Table, notes: list[str]) -> None:
        self._path, self._design, self._notes = path, design, notes
        self._parts = _Parts(path, design.num_rows, notes)
        self._results, n_notes = _opened(path, RESULTS_FILE, RESULTS, notes), len(notes)
        self._alive = _opened(path, ALIVE_FILE, ALIVE, notes)
        self._is_alive_damaged = len(notes) > n_notes
        if self._results is not None and self._alive is None:
            notes.append(f"{ALIVE_FILE} is missing")
            self._results = None
        self._drawn = self._parts.drawn_groups() | self._drawn_in_results()

    def _drawn_in_results(self) -> set[int]:
        if self._results is None or not {*LATER} <= {*self._results.schema.names}:
            return set()
        table = ParquetTable(self._path / RESULTS_FILE, RESULTS, BatchError, only=LATER, notes=[])
        return set().union(*(_drawn_groups(b[GROUP].to_numpy(), b[CHANCE].to_numpy()) for b in table))

    def __iter__(self) -> Iterator[tuple[pa.Table, pa.Table]]:
        results, alive = self._sorted(RESULTS_FILE, RESULTS), self._sorted(ALIVE_FILE, ALIVE)
        n, check = self._design.num_rows, MetricsCheck(self._path / RESULTS_FILE)
        for first in range(0, n, RUNS_AT_ONCE):
            last = min(first + RUNS_AT_ONCE, n)
            old, old_alive = (None if rows is None else rows.until(last) for rows in (results, alive))
            merged = self._merged(old, old_alive, self._parts.take(first, last))
            check.add(merged[0])
            yield merged
        for rows in (results, alive):
            if rows is not None:
                rows.until(2**62)  # which checks those that are not planned
        check.end()

    def _sorted(self, name: str, columns: pa.Schema) -> _SortedRows | None:
        """The rows of a table of the directory; None if it is not there."""
        table = self._results if name == RESULTS_FILE else self._alive
        file = self._path / name
        return (
            None
            if table is None
            else _SortedRows(_checked(table, columns, file), self._design, file, columns)
        )

    def _merged(
        self, old: pa.Table | None, old_alive: pa.Table | None, played: pa.Table
    ) -> tuple[pa.Table, pa.Table]:
        """Rows of the tables with those of runs that are not in them."""
        if old is not None and old_alive is not None and self._is_alive_damaged:
            old = old.filter(pc.is_in(old["run"], pc.unique(old_alive["run"]).cast(pa.int64())))
        results, alive = tables(played, self._design)
        for table in (results, alive):
            check_rows(table, self._path / PARTS)
        # Each by its own runs: a batch that was killed at its end may have written one of the two.
        results = self._with_one_chance(_with_new(old, results, ("run", "team", "metric")))
        alive = _with_new(old_alive, alive, ("run", "t", "team"))
        if self._notes:
            alive = alive.filter(pc.is_in(alive["run"], pc.unique(results["run"]).cast(pa.int64())))
        return results, alive

    def _with_one_chance(self, results: pa.Table) -> pa.Table:
        """Results in which plugins of all runs of a group draw if those of one do: which were in one stack is not told."""
        is_drawn = np.isin(results[GROUP].to_numpy(), list(self._drawn))
        column = np.where(is_drawn, np.uint8(PLAYED_BY_CHANCE), results[CHANCE].to_numpy())
        place = results.schema.get_field_index(CHANCE)
        return results.set_column(place, results.schema.field(place), pa.array(column))


def _opened(path: Path, name: str, columns: pa.Schema, notes: list[str]) -> ParquetTable | None:
    """A table of the directory; None if it is not there."""
    file = path / name
    return ParquetTable(file, columns, BatchError, notes=notes, optional=LATER) if file.exists() else None


def _checked(table: ParquetTable, columns: pa.Schema, file: Path) -> Iterator[pa.Table]:
    """The rows of a table, some at a time, with the columns that a former version did not write."""
    for batch in table:
        rows = completed(pa.Table.from_batches([batch]), columns)
        check_rows(rows, file)
        yield rows


def check_rows(rows: pa.Table, file: Path) -> None:
    """Check the values of a table of a batch.

    Raises:
        BatchError: One is out of its bounds.
    """
    check_values(zip(rows.column_names, rows.columns, strict=True), RULES, file, BatchError)


def _drawn_groups(group: np.ndarray, chance: np.ndarray) -> set[int]:
    return set(np.unique(group[chance == PLAYED_BY_CHANCE]).tolist())


class _SortedRows:
    """Rows that come in the order of their runs, taken by ranges of runs.

    Args:
        batches: The rows.
        design: The planned runs, against which they are checked.
        file: Where they come from.
        columns: Their schema.
    """

    def __init__(self, batches: Iterator[pa.Table], design: pa.Table, file: Path, columns: pa.Schema) -> None:
        self._batches, self._design, self._file = batches, design, file
        self._held, self._last = columns.empty_table(), -1

    def until(self, run: int) -> pa.Table:
        """The rows of runs below a number that were not taken before."""
        taken = []
        while True:
            cut = int(np.searchsorted(self._held["run"].to_numpy(), run))
            taken.append(self._held.slice(0, cut))
            self._held = self._held.slice(cut)
            if len(self._held) or (following := next(self._batches, None)) is None:
                return pa.concat_tables(taken)
            check_results(following, self._design, self._file, self._last)
            self._held = following
            self._last = following["run"][-1].as_py() if len(following) else self._last


class _Parts:
    """Finished runs that are not in the tables yet, in the files of parts.

    Args:
        path: The directory.
        n_planned: Planned runs.
        notes: Receives a line for each file that is damaged.

    Attributes:
        end: Number of the last run plus one.
    """

    def __init__(self, path: Path, n_planned: int, notes: list[str]) -> None:
        self._files = sorted((path / PARTS).glob("*.arrow"))
        self._open: dict[int, pa.Table] = {}
        found = [self._facts(number, notes) for number in range(len(self._files))]
        run, part, row, group, chance = np.concatenate([np.empty((5, 0), np.int64), *found], axis=1)
        self.end = int(run.max(initial=-1)) + 1
        _, first = np.unique(run, return_index=True)  # sorted by run
        first = first[run[first] < n_planned]
        self._run, self._part, self._row = run[first], part[first], row[first]
        self._group, self._chance = group[first], chance[first]

    def _facts(self, number: int, notes: list[str]) -> np.ndarray:
        """Run, file, row, group and chance of each run of a file, (5, n)."""
        table = self._read(number, notes)
        n = table.num_rows
        columns = (table[name].to_numpy() for name in ("run", GROUP, CHANCE))
        run, group, chance = (column.astype(np.int64) for column in columns)
        return np.stack([run, np.full(n, number), np.arange(n), group, chance])

    def _read(self, number: int, notes: list[str]) -> pa.Table:
        """A file, of which the intact rows are read; those read last are kept."""
        if number not in self._open:
            if len(self._open) == MAX_OPEN_PARTS:
                del self._open[next(iter(self._open))]
            file = self._files[number]
            batches = list(read_batches(file, [], BatchError, PLAYED, damage=notes, optional=LATER))
            rows = completed(pa.Table.from_batches(batches), PLAYED) if batches else PLAYED.empty_table()
            check_rows(rows, file)
            self._open[number] = rows.combine_chunks()
        return self._open[number]

    def drawn_groups(self) -> set[int]:
        """The groups in a run of which plugins draw."""
        return _drawn_groups(self._group, self._chance)

    def take(self, first: int, last: int) -> pa.Table:
        """The runs from a number up to, and without, another."""
        here = slice(*np.searchsorted(self._run, (first, last)).tolist())
        part, row = self._part[here], self._row[here]
        rows = [
            self._read(number, []).take(pa.array(row[part == number])) for number in np.unique(part).tolist()
        ]
        return pa.concat_tables([PLAYED.empty_table(), *rows])


def _with_new(old: pa.Table | None, new: pa.Table, order: tuple[str, ...]) -> pa.Table:
    """A table with the rows of further runs, sorted."""
    if old is None:
        return new
    new = new.filter(pc.invert(pc.is_in(new["run"], pc.unique(old["run"]).cast(pa.int64()))))
    if not new.num_rows:
        return old
    return ordered(pa.concat_tables([old, new]), order)


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
    return ordered(results, ("run", "team", "metric")), pa.table(
        [alive[c.name].cast(c.type) for c in ALIVE], schema=ALIVE
    )


def _exploded(column: pa.ChunkedArray) -> tuple[pa.Array, pa.StructArray]:
    lists = column.combine_chunks()
    if isinstance(lists, pa.ChunkedArray):
        lists = lists.chunk(0)
    return pc.list_parent_indices(lists), pc.list_flatten(lists)


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


def run_seconds(results: pa.Table) -> float:
    """CPU time of all runs of a table of results [s]."""
    first_rows = np.flatnonzero(np.diff(results["run"].to_numpy(), prepend=-1))
    return float(results["cpu_s"].to_numpy()[first_rows].sum())


def last_finished(path: Path) -> int:
    """Number of the last finished run of a directory, plus one; 0 where none is finished."""
    found = [_Parts(path, 0, []).end]
    if (path / RESULTS_FILE).exists():
        table = ParquetTable(
            path / RESULTS_FILE, RESULTS, BatchError, only=("run",), notes=[], optional=LATER
        )
        found += [int(batch["run"].to_numpy().max(initial=-1)) + 1 for batch in table]
    return max(found)


def completed(table: pa.Table, columns: pa.Schema) -> pa.Table:
    """A table of a batch, in which columns that a former version did not write are 0: its runs are copies if all of a point end alike."""
    for name in LATER:
        if name in columns.names and name not in table.column_names:
            place, column = columns.get_field_index(name), columns.field(name)
            table = table.add_column(place, column, pa.array(np.zeros(table.num_rows), column.type))
    return table


def ordered(table: pa.Table, names: tuple[str, ...]) -> pa.Table:
    """A table sorted by some columns; rows without a team come before those of teams."""
    keys = pa.table({n: table[n].fill_null(-(2**31)) if n == "team" else table[n] for n in names})
    return table.take(pc.sort_indices(keys, sort_keys=[(name, "ascending") for name in names]))
