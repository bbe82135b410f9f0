"""What comes of sets of values: all games of a round are one batch, so that they fill whole stacks."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tussle.batch.batch import Batch
from tussle.batch.executors import Executor, InProcess
from tussle.batch.quantities import Quantity
from tussle.batch.search.searched_mission import Point, SearchedMission
from tussle.batch.search.trials import Trial, key_of_values
from tussle.batch.statistics import Mean, means_of
from tussle.errors import ParameterError, TussleError

if TYPE_CHECKING:
    from tussle.batch.progress import Progress
    from tussle.batch.results import Results


WORTH_PROCESSES = 4.0
"""CPU time of a round [s] below which processes would take longer to start than they save."""


@dataclass
class Crew:
    """Who plays the rounds of a search. No result depends on it.

    Attributes:
        executor: Plays all of them; None chooses for each round.
        processes: How many; None is one per core, or none where the round before was short.
        stack: Worlds side by side in each.
        cpu_s: CPU time of the round before [s].
    """

    executor: Executor | None = None
    processes: int | None = None
    stack: int | None = None
    cpu_s: float = math.inf

    def play(self, batch: Batch, on_progress: Callable[[Progress], None]) -> Results:
        """Play a round."""
        executor = self.executor
        if executor is None and self.processes is None and self.cpu_s < WORTH_PROCESSES:
            executor = InProcess(self.stack)
        if executor is None:
            executor = batch.executor(self.processes, self.stack)
        results = batch.play(executor=executor, on_progress=on_progress)
        self.cpu_s = results.info["timings"]["cpu_s"]
        return results


@dataclass(frozen=True)
class Outcome:
    """What came of a set of values: the part of a `Trial` that they alone decide."""

    objective: float
    low: float
    high: float
    n_failed: int
    error: str
    by_seed: tuple[float, ...]


@dataclass(frozen=True)
class Evaluator:
    """Plays sets of values of a search.

    Attributes:
        mission: What is played.
        quantity: What counts.
    """

    mission: SearchedMission
    quantity: Quantity

    def check(self, points: Sequence[Point]) -> None:
        """Begin a game with the first values that allow it, and see that the quantity is one of its results.

        Raises:
            TussleError: None of them does.
            ParameterError: There is no such quantity.
        """
        errors = []
        for point in points:
            try:
                batch = self.mission.batch([point])
                batch.check()
            except TussleError as error:
                errors.append(error)
            else:
                self._check_quantity(batch)
                return
        raise errors[0]

    def _check_quantity(self, batch: Batch) -> None:
        """Look for the quantity after one step, and where it is not there yet after a whole game."""
        mission = batch.mission
        short = mission.replace(end=mission.start + mission.dt).ending_by_time()
        unknown = None
        for game in (short, mission):
            one = Batch(game, runs=1, first_seed=self.mission.first_seed, run_timeout=batch.patience)
            results = one.play(executor=InProcess(1))
            if results.n_failed:
                return  # what failed is told with the trials
            try:
                self.quantity.names(results.quantities)
                return
            except ParameterError as error:
                unknown = error
        assert unknown is not None
        raise unknown

    def trials(
        self,
        points: Sequence[Point],
        round_: int,
        done: Sequence[Trial],
        crew: Crew,
        on_progress: Callable[[Progress], None],
    ) -> list[Trial]:
        """The trials of a round. Values that were tried before come out as before, so they are not played again.

        Args:
            points: Their values.
            round_: Its number.
            done: All trials before.
            crew: Who plays.
            on_progress: Called after each finished game, and now and then.
        """
        known = {
            t.key: Outcome(t.objective, t.low, t.high, t.n_failed, t.error, t.by_seed) for t in reversed(done)
        }
        new = {key: point for point in points if (key := key_of_values(point)) not in known}
        if new:
            known |= dict(zip(new, self._outcomes(list(new.values()), crew, on_progress), strict=True))
        outcomes = [known[key_of_values(point)] for point in points]
        return [
            Trial(
                len(done) + i, round_, dict(point), o.objective, o.low, o.high, o.n_failed, o.error, o.by_seed
            )
            for i, (point, o) in enumerate(zip(points, outcomes, strict=True))
        ]

    def _outcomes(
        self,
        points: Sequence[Point],
        crew: Crew,
        on_progress: Callable[[Progress], None],
    ) -> Iterable[Outcome]:
        """What comes of sets of values, in order."""
        batch, errors = self.mission.batch_of_playable(points)
        played = iter(self._outcomes_of(crew.play(batch, on_progress)) if batch is not None else ())
        return [self._unplayed(errors[i]) if i in errors else next(played) for i in range(len(points))]

    def _unplayed(self, error: str) -> Outcome:
        return Outcome(math.nan, math.nan, math.nan, self.mission.runs, error, ())

    def _outcomes_of(self, results: Results) -> list[Outcome]:
        """What came of each point of a batch."""
        text, error_of = str(self.quantity), dict[int, str]()
        for row in results.failed().select(["point", "seed", "error"]).to_pylist():
            error_of.setdefault(row["point"], f"seed {row['seed']}: {row['error']}")
        by_seed = np.full((self.mission.runs, len(results.points)), np.nan)
        unknown = ""
        if results.n_failed < results.n_runs:
            try:
                by_seed = results.by_seed(text)
            except ParameterError as error:  # a result that only games with other values have
                unknown = str(error)
        rows = list(by_seed.T)
        means = means_of(text, rows)
        return [self._outcome(rows[p], means[p], error_of.get(p, unknown)) for p in range(len(rows))]

    def _outcome(self, row: np.ndarray, mean: Mean, error: str) -> Outcome:
        """What came of a point.

        Args:
            row: The quantity in its games, (n_seeds,).
            mean: Of them.
            error: What failed, "" for nothing.
        """
        by_seed = tuple(row.tolist())
        bad = np.flatnonzero(~np.isfinite(row))
        if not len(bad):
            return Outcome(mean.value, mean.low, mean.high, 0, "", by_seed)
        said = f"seed {self.mission.first_seed + int(bad[0])}: {self.quantity} is {row[bad[0]]}"
        return Outcome(math.nan, math.nan, math.nan, len(bad), error or said, by_seed)
