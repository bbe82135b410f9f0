"""Tables with one row per run, and the mean number of entities that is left over time."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from tussle.batch.default_quantities import COUNTED
from tussle.batch.quantities import column_name
from tussle.batch.schemas import CHANCE, OF_RUN, RESULTS

FACTS = ("end", "t", "steps", "winner", "error", "state_hash", "cpu_s", "host")
"""Columns of the results that are the same in all rows of a run, in the order in which the table of runs has them."""
KEYS = ("run", "point", "seed")


OF_RUNS = (*KEYS, *OF_RUN)


class RunColumns:
    """A row per run and a column per metric and team, of results that come some runs at a time.

    Args:
        most: Largest number of runs.

    Attributes:
        teams: Numbers of the teams that have metrics.
    """

    def __init__(self, most: int) -> None:
        self._most, self._n = most, 0
        self._runs = [RESULTS.empty_table().select(OF_RUNS)]
        self._values: dict[tuple[str, int | None], np.ndarray] = {}
        self._teams: set[int | None] = set()

    @property
    def teams(self) -> list[int]:
        return sorted(team for team in self._teams if team is not None)

    def add(self, results: pa.Table) -> None:
        """Append the rows of further runs: one per run, team and metric, in any order."""
        numbers, first, row = np.unique(results["run"].to_numpy(), return_index=True, return_inverse=True)
        self._runs.append(results.select(OF_RUNS).take(pa.array(first)))
        self._teams.update(pc.unique(results["team"]).to_pylist())
        metric = results["metric"].combine_chunks().dictionary_encode()
        team = results["team"].combine_chunks().dictionary_encode(null_encoding="encode")
        metrics, teams = metric.dictionary.to_pylist(), team.dictionary.to_pylist()
        code = (
            pc.fill_null(metric.indices, -1).to_numpy().astype(np.int64) * max(1, len(teams))
            + team.indices.to_numpy()
        )
        is_metric = code >= 0
        code, row = code[is_metric], row[is_metric]
        present, place = np.unique(code, return_inverse=True)
        values = np.full((len(present), len(numbers)), np.nan)
        values[place, row] = floats(results["value"])[is_metric]
        new = slice(self._n, self._n + len(numbers))
        for column in self._values.values():
            column[new] = np.nan
        for c, found in zip(present.tolist(), values, strict=True):
            self._column(metrics[c // len(teams)], teams[c % len(teams)])[new] = found
        self._n = new.stop

    def _column(self, metric: str, team: int | None) -> np.ndarray:
        """The values of a metric, of which only the memory that is written to is taken."""
        if (metric, team) not in self._values:
            self._values[metric, team] = np.empty(self._most)
            self._values[metric, team][: self._n] = np.nan
        return self._values[metric, team]

    @property
    def runs(self) -> pa.Table:
        """One row per run: its keys, and how it ended."""
        return pa.concat_tables(self._runs)

    @property
    def metrics(self) -> dict[str, np.ndarray]:
        """Name such as "score[2]" -> value for each run, (n_runs,); NaN where the run does not have it."""
        order = sorted(self._values, key=lambda each: (each[0], each[1] is not None, each[1] or 0))
        return {column_name(*key): self._values[key][: self._n] for key in order}


def floats(column: pa.ChunkedArray) -> np.ndarray:
    """A column of numbers as float64, (n,); NaN where it is empty."""
    array: np.ndarray = column.cast(pa.float64()).to_numpy()
    return array


def is_failed(runs: pa.Table) -> np.ndarray:
    """Return True for each failed run, (n_runs,)."""
    has_error = pc.fill_null(pc.not_equal(runs["error"], ""), False)
    failed: np.ndarray = pc.or_(has_error, pc.equal(runs["end"], "error")).to_numpy()
    return failed


def quantities(
    metrics: Mapping[str, np.ndarray], runs: pa.Table, teams: Sequence[int]
) -> dict[str, np.ndarray]:
    """All numbers of each run: metrics, wins and ties, losses, time and steps; NaN for runs that failed.

    Args:
        metrics: Name such as "score[2]" -> value for each run, (n_runs,).
        runs: One row per run.
        teams: Numbers of the teams.
    """
    columns: dict[str, np.ndarray] = {}
    scored = [team for team in teams if column_name("score", team) in metrics]
    winner = floats(runs["winner"])
    for team in scored:
        columns[column_name("wins", team)] = (winner == team).astype(np.float64)
    if scored:
        columns["ties"] = np.isnan(winner).astype(np.float64)
    for team in teams:
        start, left = (metrics.get(column_name(name, team)) for name in ("start", "alive"))
        if start is not None and left is not None:
            columns[column_name("lost", team)] = start - left
    columns["t"], columns["steps"] = (floats(runs[name]) for name in ("t", "steps"))
    columns = {**metrics, **columns}
    order = [column_name(metric, team) for metric in COUNTED for team in (*teams, None)]
    columns = {name: columns[name] for name in dict.fromkeys([*order, *columns]) if name in columns}
    if (failed := is_failed(runs)).any():
        columns = {name: np.where(failed, np.nan, values) for name, values in columns.items()}
    return columns


def with_values(
    runs: pa.Table, design: pa.Table, names: Sequence[str], taken: Collection[str]
) -> dict[str, pa.ChunkedArray]:
    """Keys, values of the variables and facts of each run; a variable whose name is taken stands as "varied NAME".

    Args:
        runs: One row per run.
        design: One row per planned run, in order.
        names: Of the variables.
        taken: Names of other columns, besides the facts.
    """
    place = np.searchsorted(design["run"].to_numpy(), runs["run"].to_numpy())
    values = design.select(list(names)).take(pa.array(place))
    columns = {name: runs[name] for name in KEYS}
    for name in names:
        columns[f"varied {name}" if name in FACTS or name in taken else name] = values[name]
    return columns | {name: runs[name] for name in FACTS}


def distinct_games(runs: pa.Table, failed: np.ndarray, quantities: Collection[np.ndarray] = ()) -> np.ndarray:
    """A number for each run, (n_runs,): one for all runs of a point where nothing in them depends on the seed, else its own.

    These are copies of one game: births do not draw, no plugin does, and all end in the same state with the same results.
    Games that draw are alike by chance, as those without a rare event are, or those in which nobody is left; each of them is an
    observation. Games that do not draw may still differ: a plugin may ask the world outside.

    Args:
        runs: One row per run.
        failed: Which runs failed, (n_runs,): none of them is a copy.
        quantities: Each result of the runs, (n_runs,).
    """
    game, point = np.arange(len(failed)), runs["point"].to_numpy()
    chance = runs[CHANCE].to_numpy()
    if failed.all() or chance.all():
        return game
    text = pc.fill_null(runs["state_hash"].combine_chunks(), "").dictionary_encode()
    hashes = text.indices.to_numpy().astype(np.int64)
    is_known = np.array([*text.dictionary.to_pylist(), ""], dtype=object)[hashes] != ""
    played = np.flatnonzero(~failed)
    played = played[np.argsort(point[played], kind="stable")]
    first = np.flatnonzero(np.diff(point[played], prepend=-1))  # of each point
    are_copies = np.logical_and.reduceat(is_known[played] & (chance[played] == 0), first)
    for bits in (hashes, *(np.asarray(values, np.float64).view(np.int64) for values in quantities)):
        are_copies &= np.minimum.reduceat(bits[played], first) == np.maximum.reduceat(bits[played], first)
    sizes = np.diff(first, append=len(played))
    game[played] = np.where(np.repeat(are_copies, sizes), np.repeat(played[first], sizes), played)
    return np.asarray(np.unique(game, return_inverse=True)[1]).ravel()


N_TIMES = 201


@dataclass(frozen=True)
class Survival:
    """Mean number of entities of a team over time.

    Attributes:
        label: Which runs; "" for all.
        team: The team.
        t: Times [s], (n_times,).
        mean: Mean number left, (n_times,).
        low: Lower end of the interval of each mean by itself, normal, 95 %; NaN for less than two runs, (n_times,).
        high: Its upper end, (n_times,).
        n: Runs.
    """

    label: str
    team: int
    t: np.ndarray
    mean: np.ndarray
    low: np.ndarray
    high: np.ndarray
    n: int


def survival_of(
    label: str, team: int, run: np.ndarray, t: np.ndarray, alive: np.ndarray, n: int, times: np.ndarray
) -> Survival:
    """Mean of the numbers left in some runs; each run is a step function of time and keeps its last value.

    Rather than look each run up at each time, the changes of the sum over runs are summed, of the numbers and of their squares, in
    whole numbers: exact, and one pass over the rows.

    Args:
        label: Which runs.
        team: The team.
        run: Run of each row, rising, (n_rows,).
        t: Time from which on there are `alive`, rising within a run [s], (n_rows,).
        alive: Entities left, (n_rows,).
        n: Runs.
        times: At which the mean is taken, rising [s], (n_times,).
    """
    before = np.zeros(len(alive), dtype=np.int64)
    is_same_run = run[1:] == run[:-1]
    before[1:][is_same_run] = alive[:-1][is_same_run]
    place = np.searchsorted(times, t, side="left")
    total = _sums_over_time(alive - before, place, len(times))
    squares = _sums_over_time(alive**2 - before**2, place, len(times))
    if n == 0:
        nothing = np.full(len(times), np.nan)
        return Survival(label, team, times, nothing, nothing, nothing, 0)
    mean = total / n
    half = np.full(len(times), np.nan)
    if n > 1:
        variance = np.maximum(squares / n - mean**2, 0.0) * n / (n - 1.0)
        half = NormalDist().inv_cdf(0.975) * np.sqrt(variance / n)
    return Survival(label, team, times, mean, np.maximum(mean - half, 0.0), mean + half, n)


def _sums_over_time(changes: np.ndarray, place: np.ndarray, n_times: int) -> np.ndarray:
    """Sum of all changes up to each time, (n_times,)."""
    at = np.zeros(n_times + 1, dtype=np.int64)
    np.add.at(at, place, changes)
    return np.cumsum(at[:-1])
