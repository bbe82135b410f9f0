"""Mean number of entities of a team that is left, over time."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

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
