"""Plays the values of trials: all games of a round are one batch, so that they fill whole stacks."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.batch.batch import Batch, check_quantity
from tussle.batch.executors import Executor, InProcess
from tussle.batch.points import settings_of
from tussle.batch.quantities import Quantity
from tussle.batch.search.trials import Point, Trial, key_of_values
from tussle.batch.statistics import means_of
from tussle.batch.target import Target
from tussle.batch.variables import Value, Variable
from tussle.errors import BatchError, ParameterError, TussleError
from tussle.mission import Mission

if TYPE_CHECKING:
    from tussle.batch.results import Results
    from tussle.batch.tasks import Progress

WORTH_PROCESSES = 4.0
"""CPU time of a round [s] below which processes would take longer to start than they save."""


@dataclass
class RoundPlayer:
    """Plays rounds of a search. No result depends on it.

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


class Evaluator:
    """Plays sets of values of a mission and makes trials of them.

    Args:
        source: A mission file, the name of one that ships, a `Mission`, or a function of the varied values that makes one.
        variables: What varies.
        quantity: Its mean over the games is the objective.
        runs: Games of each set of values.
        first_seed: Seeds of the games count up from here.
        options: Further arguments of `Batch`.
        constraints: Bounds that means over the games are to keep.

    Attributes:
        corners: A batch of low, middle and high values, so far as they can be played; its fingerprint is that of the mission.

    Raises:
        TussleError: The mission cannot be read, or cannot be played with any of these values.
    """

    def __init__(
        self,
        source: str | Path | Mission | Callable[..., Mission],
        variables: Sequence[Variable],
        quantity: Quantity,
        runs: int,
        first_seed: int,
        options: Mapping[str, Any],
        constraints: Sequence[Target] = (),
    ) -> None:
        self.constraints = constraints
        self.source, self.variables, self.quantity = source, variables, quantity
        self.runs, self.first_seed, self.options = runs, first_seed, options
        self.corners = self._corners()

    def _corners(self) -> Batch:
        points = [{v.name: v.value_at(share) for v in self.variables} for share in (0.0, 0.5, 1.0)]
        return self._playable(points)[0] or self.batch(points)

    def check_same(self) -> None:
        """Read the mission again and compare.

        Raises:
            BatchError: It, or a plugin file, has changed.
        """
        if self._corners().fingerprint != self.corners.fingerprint:
            raise BatchError(
                f"{self.corners.name}: the mission or a plugin file has changed during the search; finished rounds are kept"
            )

    def batch(self, points: Sequence[Point]) -> Batch:
        """All games of some sets of values.

        Raises:
            TussleError: The mission cannot be played with one of them.
        """
        return Batch(
            self.source, points=list(map(self._settings, points)), runs=self.runs, first_seed=self.first_seed, **self.options
        )  # fmt: skip

    def _settings(self, point: Point) -> dict[str, Value]:
        return settings_of(point, self.variables, is_argument=callable(self.source))

    def _playable(self, points: Sequence[Point]) -> tuple[Batch | None, dict[int, str]]:
        """A batch of those sets of values that can be played, and the errors of the others, by place."""
        try:
            return self.batch(points), {}
        except TussleError:
            errors = {}
        for i, point in enumerate(points):
            try:
                self.batch([point])
            except TussleError as error:
                values = ", ".join(f"{k}={v}" for k, v in self._settings(point).items())
                errors[i] = str(error).removeprefix(f"point 0 ({values}): ")
        playable = [point for i, point in enumerate(points) if i not in errors]
        return self.batch(playable) if playable else None, errors

    def check(self, points: Sequence[Point]) -> None:
        """Begin a game with the first values that allow it, and look for the quantity among its results.

        Raises:
            TussleError: None of the values can be played.
            ParameterError: There is no such quantity.
        """
        errors = []
        for point in points:
            try:
                batch = self.batch([point])
                batch.check()
            except TussleError as error:
                errors.append(error)
            else:
                check_quantity(
                    [batch.mission],
                    self.first_seed,
                    batch.patience,
                    lambda results: [
                        q.names(results.quantities)
                        for q in (self.quantity, *(c.quantity for c in self.constraints))
                    ],
                )
                return
        raise errors[0]

    def trials(
        self,
        points: Sequence[Point],
        round_: int,
        done: Sequence[Trial],
        player: RoundPlayer,
        on_progress: Callable[[Progress], None],
    ) -> list[Trial]:
        """The trials of a round. Values that were tried before are not played again.

        Args:
            points: Their values.
            round_: Its number.
            done: All trials before.
            player: Plays the games.
            on_progress: Called after each finished game, and now and then.
        """
        known = {trial.key: trial for trial in reversed(done)}
        new = {key: point for point in points if (key := key_of_values(point)) not in known}
        if new:
            known |= dict(zip(new, self._played(list(new.values()), player, on_progress), strict=True))
        found = [known[key_of_values(point)] for point in points]
        return [replace(t, number=len(done) + i, round=round_) for i, t in enumerate(found)]

    def _played(
        self, points: Sequence[Point], player: RoundPlayer, on_progress: Callable[[Progress], None]
    ) -> list[Trial]:
        """Trials of different values, not numbered yet."""
        batch, errors = self._playable(points)
        playable = [point for i, point in enumerate(points) if i not in errors]
        played = iter(self._trials_of(playable, player.play(batch, on_progress)) if batch is not None else ())
        nan, n, nothing = math.nan, self.runs, (math.nan,) * len(self.constraints)
        return [
            Trial(0, 0, dict(point), nan, nan, nan, n, errors[i], (), nothing)
            if i in errors
            else next(played)
            for i, point in enumerate(points)
        ]

    def _trials_of(self, points: Sequence[Point], results: Results) -> list[Trial]:
        """Trials of the points of a batch that has been played."""
        text, error_of = str(self.quantity), dict[int, str]()
        for row in results.failed().select(["point", "seed", "error"]).to_pylist():
            error_of.setdefault(row["point"], f"seed {row['seed']}: {row['error']}")
        by_seed = np.full((self.runs, len(points)), np.nan)
        unknown = ""
        if results.n_failed < results.n_runs:
            try:
                by_seed = results.by_seed(text)
            except ParameterError as error:  # only games with other values have this result
                unknown = str(error)
        violations = np.full((len(points), len(self.constraints)), np.nan)
        for j, constraint in enumerate(
            self.constraints if not unknown and results.n_failed < results.n_runs else ()
        ):
            try:
                means = results.by_seed(str(constraint.quantity)).mean(axis=0)
            except ParameterError as error:
                unknown = str(error)
                break
            violations[:, j] = constraint.bound - means if constraint.is_lower else means - constraint.bound
        found = []
        for i, (row, mean) in enumerate(zip(by_seed.T, means_of(text, list(by_seed.T)), strict=True)):
            bad = np.flatnonzero(~np.isfinite(row))
            failure, numbers = "", (mean.value, mean.low, mean.high)
            if len(bad):
                failure = (
                    error_of.get(i, unknown)
                    or f"seed {self.first_seed + int(bad[0])}: {text} is {row[bad[0]]}"
                )
                numbers = (math.nan,) * 3
            elif not np.isfinite(violations[i]).all():
                place = int(np.flatnonzero(~np.isfinite(violations[i]))[0])
                failure = unknown or f"{self.constraints[place].quantity} has no value in some game"
                numbers = (math.nan,) * 3
            games, amiss = tuple(row.tolist()), tuple(violations[i].tolist())
            found.append(Trial(0, 0, dict(points[i]), *numbers, len(bad), failure, games, amiss))
        return found
