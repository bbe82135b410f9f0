"""The analysis of a batch: shares, means, comparisons and sensitivity, for the terminal and as JSON."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from tussle.batch.results import Results
from tussle.batch.sensitivity import Effect
from tussle.batch.statistics import Mean, PairedComparison, Share
from tussle.batch.variables import Choice, Variable
from tussle.batch.varied import variable_entry
from tussle.errors import MissingExtraError, ParameterError

MAX_PAIRED_POINTS = 20
"""Largest number of points that are all compared with the first, if choices cannot be compared."""


@dataclass(frozen=True)
class PointResult:
    """Results of the runs of one point.

    Attributes:
        point: Its number.
        label: Its values.
        values: Its values by name.
        n: Finished runs that did not fail.
        n_failed: Runs that failed.
        shares: Share of the games that each team won.
        means: Of the quantities.
    """

    point: int
    label: str
    values: dict[str, Any]
    n: int
    n_failed: int
    shares: list[Share]
    means: list[Mean]


@dataclass(frozen=True)
class Failure:
    """Runs that failed with the same error.

    Attributes:
        error: The error.
        n: Number of runs.
        run: The first of them.
        seed: Its seed.
        point: Its values.
    """

    error: str
    n: int
    run: int
    seed: int
    point: str


@dataclass(frozen=True)
class Analysis:
    """The analysis of a batch.

    Attributes:
        name: Of the mission.
        path: The batch directory.
        n_runs: Finished runs, failed ones included.
        n_failed: Runs that failed; no other number counts them.
        n_planned: Planned runs.
        n_points: Points.
        n_seeds: Games of each point.
        first_seed: Of them.
        paired_by: "seed" where the runs of a pair share their seed, else "order".
        stopped_by: Rule that ended the batch before its last run; None for none.
        variables: What was varied.
        quantities: The quantities that are analysed.
        titles: Quantity -> its name with the teams' names.
        shares: Share of the games that each team won, over all points.
        means: Means over all points.
        points: Point by point; empty where nothing varies.
        comparisons: Paired by seed.
        sensitivity: Quantity -> what each variable does to it.
        failures: Most frequent first.
        notes: What the reader must know, one line each.
    """

    name: str
    path: str
    n_runs: int
    n_failed: int
    n_planned: int
    n_points: int
    n_seeds: int
    first_seed: int
    paired_by: str
    stopped_by: str | None
    variables: list[Variable]
    quantities: list[str]
    titles: dict[str, str]
    shares: list[Share]
    means: list[Mean]
    points: list[PointResult] = field(default_factory=list)
    comparisons: list[PairedComparison] = field(default_factory=list)
    sensitivity: dict[str, list[Effect]] = field(default_factory=dict)
    failures: list[Failure] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def as_dict(self) -> dict[str, Any]:
        """The same for JSON: None where a number is not known."""
        fields = dataclasses.asdict(self) | {"variables": [variable_entry(v) for v in self.variables]}
        plain: dict[str, Any] = _plain(fields)
        return plain


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def analyse(
    results: Results, quantities: Sequence[str] = (), compare: Sequence[tuple[int | str, int | str]] = ()
) -> Analysis:
    """Analyse a batch.

    Args:
        results: The batch.
        quantities: What is analysed; by default those of `Results.defaults`.
        compare: Pairs of points, or of values that select points; by default the values of each choice with its first.

    Raises:
        ParameterError: There is no such quantity or point.
    """
    asked = list(dict.fromkeys(map(results.canonical, quantities)))  # adds a note on recorded columns
    notes, info = list(results.notes), results.info
    chosen, looked_at = asked or results.defaults.all, asked or results.defaults.leading
    has_points = len(results.points) > 1
    return Analysis(
        name=str(info["name"]),
        path=str(results.path or ""),
        n_runs=results.n_runs,
        n_failed=results.n_failed,
        n_planned=results.n_planned,
        n_points=len(results.points),
        n_seeds=int(info["n_seeds"]),
        first_seed=int(info["first_seed"]),
        paired_by="order" if info["independent"] else "seed",
        stopped_by=info.get("stopped_by"),
        variables=results.variables,
        quantities=chosen,
        titles={name: results.title(name) for name in chosen},
        shares=results.shares(),
        means=results.means(chosen),
        points=_points(results, looked_at) if has_points else [],
        comparisons=_comparisons(results, looked_at, compare),
        sensitivity=_sensitivity(results, looked_at, notes) if has_points else {},
        failures=_failures(results),
        notes=notes,
    )


def _points(results: Results, quantities: Sequence[str]) -> list[PointResult]:
    shares = results.shares_by_point()
    means = [results.means_by_point(name) for name in quantities]
    n, n_failed = results.n_runs_by_point()
    return [
        PointResult(
            i, results.label(i), values, int(n[i]), int(n_failed[i]), shares[i], [m[i] for m in means]
        )
        for i, values in enumerate(results.points)
    ]


def _comparisons(
    results: Results, quantities: Sequence[str], asked: Sequence[tuple[int | str, int | str]]
) -> list[PairedComparison]:
    if asked:
        return [results.compare(name, a, b) for a, b in asked for name in quantities]
    choices = [v for v in results.variables if isinstance(v, Choice) and len(v.values) > 1]
    pairs = [(f"{v.name}={v.values[0]}", f"{v.name}={value}") for v in choices for value in v.values[1:]]
    found = []
    for a, b in pairs:
        try:
            found += [results.compare(name, a, b) for name in quantities]
        except ParameterError:  # points of a list may agree in nothing else
            continue
    if choices and not found and len(results.points) <= MAX_PAIRED_POINTS:
        found = [results.compare(name, 0, i) for i in range(1, len(results.points)) for name in quantities]
    return found


def _sensitivity(results: Results, quantities: Sequence[str], notes: list[str]) -> dict[str, list[Effect]]:
    found = {}
    for name in quantities:
        try:
            effects = results.sensitivity(name)
        except MissingExtraError as error:
            effects = results.rank_correlations(name)
            if str(error) not in notes:
                notes.append(str(error))
        if any(not math.isnan(e.rank_correlation) or e.first_order is not None for e in effects):
            found[name] = effects
    return found


def _failures(results: Results) -> list[Failure]:
    failed = results.failed()
    if not failed.num_rows:
        return []
    grouped = failed.group_by("error").aggregate([("run", "count"), ("run", "min")])
    rows = {row["run"]: row for row in failed.select(["run", "seed", "point", "error"]).to_pylist()}
    counts = zip(grouped["run_min"].to_pylist(), grouped["run_count"].to_pylist(), strict=True)
    found = [
        Failure(rows[run]["error"] or "", n, run, rows[run]["seed"], results.label(rows[run]["point"]))
        for run, n in counts
    ]
    return sorted(found, key=lambda failure: (-failure.n, failure.run))
