"""The runs of a batch: points × seeds, numbered so that more seeds only append."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from tussle.documents import Whole, check_argument
from tussle.errors import ParameterError
from tussle.mission.codecs import written

MAX_RUNS = 10_000_000


@dataclass(frozen=True)
class BatchPlan:
    """The runs of a batch.

    Run r plays point r modulo the number of points. All points have the same seeds (common random numbers), unless `independent`.

    Attributes:
        points: Values by name, of each point.
        n_seeds: Games of each point.
        first_seed: Seeds count up from here.
        independent: Each run has a seed of its own.
    """

    points: Sequence[Mapping[str, Any]]
    n_seeds: int
    first_seed: int = 1
    independent: bool = False

    def __post_init__(self) -> None:
        check_argument("runs", self.n_seeds, Whole(1))
        check_argument("first_seed", self.first_seed, Whole(0, 2**64 - 1))
        if not self.points:
            raise ParameterError("a batch needs at least one point")
        if self.n_runs > MAX_RUNS:
            raise ParameterError(
                f"{len(self.points):,} points with {self.n_seeds:,} seeds each are {self.n_runs:,} runs; allowed are {MAX_RUNS:,}"
            )
        if self.seed(self.n_runs - 1) >= 2**64:
            raise ParameterError(
                f"seeds count up from {self.first_seed}, but the largest is 2^64 - 1, so there are fewer than this batch needs; "
                "begin with a smaller one"
            )

    @property
    def n_points(self) -> int:
        return len(self.points)

    @property
    def n_runs(self) -> int:
        return self.n_points * self.n_seeds

    def point(self, run: int) -> int:
        """Point that a run plays."""
        return run % self.n_points

    def seed(self, run: int) -> int:
        """Seed of a run."""
        return self.first_seed + (run if self.independent else run // self.n_points)

    def table(self) -> pa.Table:
        """One row per run: run, point, seed, and each varied value."""
        run = np.arange(self.n_runs, dtype=np.int64)
        point = (run % self.n_points).astype(np.int32)
        step = run if self.independent else run // self.n_points
        seed = np.uint64(self.first_seed) + step.astype(np.uint64)
        columns: dict[str, Any] = {"run": run, "point": point, "seed": seed}
        names = list(dict.fromkeys(name for p in self.points for name in p))
        for name in names:
            columns[name] = _column([p.get(name) for p in self.points]).take(pa.array(point))
        return pa.table(columns)


def _column(values: list[Any]) -> pa.Array:
    """Return the values as integers, real numbers, or texts."""
    numbers = [v for v in values if v is not None]
    if all(isinstance(v, int) and not isinstance(v, bool) for v in numbers):
        return pa.array(values, pa.int64())
    if all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in numbers):
        return pa.array([None if v is None else float(v) for v in values], pa.float64())
    return pa.array([None if v is None else written(v) for v in values], pa.string())
