"""Checks that the tables of a batch directory agree with each other and with `batch.json`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from tussle.batch.quantities import Quantity, column_name
from tussle.batch.variables import Range
from tussle.batch.varied import variable_of
from tussle.errors import BatchError, ParameterError

MAX_EMPTY = 200
"""Cells of the table of runs, with a column for each quantity of each team, per row of the results: one where all games have the same
quantities. What plugins report may differ between points."""
MAX_METRICS = 10_000
MAX_VALUE = 1e100
"""Largest metric that counts as finite: sums of squares of larger ones, as variances take them, are not."""
MAX_NAME = 180
"""Characters of the name of a metric that a batch keeps; expressions with it may have a few more, see `quantities.MAX_TEXT`."""
ALWAYS_ALLOWED = 1_000_000
"""Largest number of cells of a batch."""


def check_design(design: pa.Table, info: Mapping[str, Any], file: Path) -> None:
    """Check that the planned runs have the numbers, points and seeds of `BatchPlan`.

    Raises:
        BatchError: A run does not.
    """
    n, n_points = design.num_rows, info["n_points"]
    if not 0 < n <= info["n_runs"] or n % n_points:
        raise BatchError(
            f"{file}: has {n:,} runs; batch.json says {info['n_runs']:,}, of {n_points:,} points"
        )
    run = np.arange(n)
    seed = np.uint64(info["first_seed"]) + (run if info["independent"] else run // n_points).astype(np.uint64)
    for name, wanted in (("run", run), ("point", run % n_points), ("seed", seed)):
        if (wrong := np.flatnonzero(design[name].to_numpy() != wanted)).size:
            raise BatchError(
                f"{file}: {name} = {design[name][int(wrong[0])]} in row {wrong[0]} is not allowed; it is {wanted[wrong[0]]}"
            )
    for variable in map(variable_of, info["variables"]):
        _check_varied(design, variable.name, isinstance(variable, Range), file)


def _check_varied(design: pa.Table, name: str, is_range: bool, file: Path) -> None:
    """Check that a variable has one column with a value in each row."""
    if design.column_names.count(name) != 1:
        raise BatchError(f"{file}: has no column {name!r}, which varies by batch.json")
    column = design[name]
    is_number = column.type in (pa.int64(), pa.float64())
    if not is_number and (is_range or column.type != pa.string()):
        raise BatchError(f"{file}: column {name!r} holds {column.type}, which no variable of batch.json has")
    if column.null_count or (column.type == pa.float64() and not pc.all(pc.is_finite(column)).as_py()):
        raise BatchError(f"{file}: column {name!r} lacks values")


def check_results(table: pa.Table, design: pa.Table, file: Path, last_run: int = -1) -> None:
    """Check that all rows belong to planned runs, in order behind a last one, and have their points and seeds.

    Raises:
        BatchError: A row does not.
    """
    run = table["run"].to_numpy()
    if len(run) and run.max() >= design.num_rows:
        raise BatchError(
            f"{file}: run = {run.max()} is not allowed; the batch has runs 0 to {design.num_rows - 1}"
        )
    if (np.diff(run, prepend=last_run) < 0).any():
        raise BatchError(f"{file}: the rows are not in the order of their runs")
    for name in ("point", "seed"):
        if name in table.column_names and (table[name].to_numpy() != design[name].to_numpy()[run]).any():
            raise BatchError(f"{file}: a run has another {name} than in the design")


def bounded(value: float) -> float:
    """A metric, also a whole number of any size, as a batch keeps it: infinite beyond `MAX_VALUE`."""
    if abs(value) > MAX_VALUE:
        return math.inf if value > 0 else -math.inf
    return float(value)


class MetricsCheck:
    """Checks the metrics of a batch, some runs at a time: their number, names and values, and that each team with "alive" has "start".

    The table of runs, with a column per metric and team, must not be much larger than the results.

    Args:
        file: Where they come from.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        self._metrics: set[str | None] = set()
        self._teams: set[int | None] = set()
        self._n_runs = self._n_rows = 0
        self._left: set[int | None] = set()
        self._begun: set[int | None] = set()

    def add(self, results: pa.Table) -> None:
        """Check further runs.

        Raises:
            BatchError: A check fails.
        """
        new = {*pc.unique(results["metric"]).to_pylist()} - self._metrics
        self._metrics |= new
        self._teams.update(pc.unique(results["team"]).to_pylist())
        self._n_runs, self._n_rows = (
            self._n_runs + len(pc.unique(results["run"])),
            self._n_rows + len(results),
        )
        n_metrics, n_teams, n_runs = len(self._metrics), len(self._teams), self._n_runs
        if (
            n_metrics > MAX_METRICS
            or n_metrics * n_teams * n_runs > ALWAYS_ALLOWED + MAX_EMPTY * self._n_rows
        ):
            raise BatchError(
                f"{self._file}: {n_metrics:,} metrics of {n_teams:,} teams in {n_runs:,} runs are too many for {self._n_rows:,} rows"
            )
        for metric in new:
            try:
                Quantity.parse(column_name(metric, 0))
            except ParameterError as error:
                raise BatchError(f"{self._file}: {error}") from None
        values = results["value"].to_numpy()
        with np.errstate(invalid="ignore"):
            wrong = np.flatnonzero(np.isfinite(values) & (np.abs(values) > MAX_VALUE))
        if len(wrong):
            raise BatchError(
                f"{self._file}: value = {values[wrong[0]]} of run {results['run'][int(wrong[0])]} is not allowed; "
                f"a metric is infinite, or {MAX_VALUE:g} at the most"
            )
        ended = results.filter(pc.not_equal(results["end"], "error"))
        for name, teams in (("alive", self._left), ("start", self._begun)):
            teams.update(pc.unique(ended.filter(pc.equal(ended["metric"], name))["team"]).to_pylist())

    def end(self) -> None:
        """Check what only all runs tell.

        Raises:
            BatchError: A check fails.
        """
        if self._left != self._begun:
            raise BatchError(
                f"{self._file}: team {min(self._left ^ self._begun, key=str)} has one of the metrics 'alive' and 'start', "
                "and not the other"
            )
