"""Searches for mission values that maximize or minimize a quantity."""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tussle.arguments import explained
from tussle.batch.design_points import check_source, with_whole_numbers
from tussle.batch.executors import Executor
from tussle.batch.quantities import Quantity
from tussle.batch.search.evaluation import Evaluator, RoundPlayer
from tussle.batch.search.proposals import Proposer
from tussle.batch.search.study import Study, best_of
from tussle.batch.search.study_store import StudyStore, notes_on_versions, versions_of_samplers
from tussle.batch.search.trials import MAX_TRIALS, Point, Trial
from tussle.batch.target import Target
from tussle.batch.variables import Variable
from tussle.batch.varied import as_variables, variable_entry
from tussle.documents import Whole, check_argument, several
from tussle.errors import ParameterError
from tussle.mission import Mission
from tussle.record.run_file import versions

if TYPE_CHECKING:
    from tussle.batch.tasks import Progress


@dataclass
class SearchProgress:
    """The progress of a search.

    Attributes:
        n_trials: Trials to play.
        n_before: Trials from before this call.
        n_done: Finished trials, those included.
        n_failed: Failed trials.
        best: The best so far.
        n_round: Trials of the running round.
        played: Part of the round that is played, 0 to 1.
    """

    n_trials: int
    n_before: int
    n_done: int
    n_failed: int = 0
    best: Trial | None = None
    n_round: int = 0
    played: float = 0.0


class Optimization:
    """A search for mission values that maximize or minimize the mean of a quantity.

    Args:
        mission: A mission file, the name of one that ships, a `Mission`, or a function of the varied values that makes one.
        objective: The quantity, such as "score[3]-score[2]"; its mean over the runs counts.
        vary: What varies, as for `Batch`.
        minimize: Smaller is better.
        runs: Games of each trial. All trials meet the same seeds (common random numbers).
        per_round: Trials that are proposed together and played side by side, each without knowing the others.
        sampler: Optuna's sampler that proposes: tpe, cmaes, or random.
        sample_seed: Seed of what is proposed.
        first_seed: Seeds of the games count up from here.
        settings: Values that are set in all trials, as for `read_mission` or by path.
        plugin_files: Python files whose plugins the mission file may name.
        ends_by_time: The game ends at its end time whatever the mission says.
        run_timeout: Wall time that a game may take [s], as for `Batch`.
        subject_to: Constraints on means over the runs of a trial, such as "lost[1] / start[1] < 0.2".
        options: Further options of `read_mission`.

    Raises:
        ParameterError: A variable, the quantity or a number is not allowed.
        MissionError: The mission cannot be read.
        MissingExtraError: Optuna is not installed.
    """

    def __init__(
        self,
        mission: str | Path | Mission | Callable[..., Mission],
        objective: str,
        *,
        vary: Mapping[str, Any] | Iterable[str | Variable],
        minimize: bool = False,
        runs: int = 32,
        per_round: int = 8,
        sampler: str = "tpe",
        sample_seed: int = 0,
        first_seed: int = 1,
        settings: Mapping[str, Any] | None = None,
        plugin_files: Sequence[str | Path] = (),
        ends_by_time: bool = False,
        run_timeout: float | None = None,
        subject_to: Sequence[str] = (),
        **options: Any,
    ) -> None:
        check_source(mission, "Optimization")
        check_argument("runs", runs, Whole(1))
        check_argument("per_round", per_round, Whole(1, MAX_TRIALS))
        check_argument("sample_seed", sample_seed, Whole())
        check_argument("first_seed", first_seed, Whole(0, 2**64 - 1))
        settings = dict(settings or {})
        variables = tuple(as_variables(vary))
        if not variables:
            raise ParameterError("nothing varies, so there is nothing to search; vary at least one value")
        for variable in variables:
            if variable.name in settings:
                raise ParameterError(f"{variable.name} is set and varies; say one of the two")
        if isinstance(mission, (str, Path)):
            reading = {**options, "plugin_files": several(plugin_files)}
            variables = tuple(with_whole_numbers(mission, settings, variables, **reading))
        self.quantity = Quantity.parse(objective)
        self.variables, self.sampler, self.is_minimized = variables, sampler, minimize
        self.sample_seed, self.per_round = sample_seed, per_round
        self.constraints = tuple(Target.parse(text, "subject_to") for text in several(subject_to))
        self._first = self._proposer().propose()
        options |= {"settings": settings, "plugin_files": several(plugin_files), "ends_by_time": ends_by_time}
        options["run_timeout"] = run_timeout
        self.evaluator = Evaluator(
            mission, variables, self.quantity, runs, first_seed, options, self.constraints
        )

    # -- what is searched ---------------------------------------------------------------------------------------------------

    @property
    def name(self) -> str:
        """Short name of the mission, fit for a file."""
        return self.evaluator.corners.default_directory().name.rpartition("-")[0]

    @property
    def info(self) -> dict[str, Any]:
        """The content of `study.json`."""
        contents = {
            "tussle": versions()["tussle"],
            "name": self.name,
            "mission": self.evaluator.corners.info()["mission"],
            "objective": str(self.quantity),
            "direction": "minimize" if self.is_minimized else "maximize",
            "variables": [variable_entry(v) for v in self.variables],
            "runs": self.evaluator.runs,
            "first_seed": self.evaluator.first_seed,
            "sampler": self.sampler,
            "sample_seed": self.sample_seed,
            "per_round": self.per_round,
        }
        if self.constraints:
            contents["constraints"] = list(map(str, self.constraints))
        text = json.dumps([contents, self.evaluator.corners.fingerprint], default=str)
        fingerprint = hashlib.blake2b(text.encode(), digest_size=16).hexdigest()
        return {"format": 2, "fingerprint": fingerprint, **contents, "versions": versions_of_samplers()}

    @property
    def fingerprint(self) -> str:
        """Hash of all that the trials depend on, except how many there are."""
        return str(self.info["fingerprint"])

    def default_directory(self) -> Path:
        """The directory of this search unless another is given; the same for the same search."""
        return Path("optimizations") / f"{self.name}-{self.fingerprint[:8]}"

    # -- the search ---------------------------------------------------------------------------------------------------------

    def check(self) -> None:
        """Begin a game with the values that are proposed first, and look for the quantity among its results.

        Raises:
            TussleError: None of them can be played.
            ParameterError: There is no such quantity.
        """
        self.evaluator.check(self._first)

    def play(
        self,
        directory: str | Path | None = None,
        trials: int = 100,
        *,
        executor: Executor | None = None,
        processes: int | None = None,
        stack: int | None = None,
        command: Sequence[str] | None = None,
        on_progress: Callable[[SearchProgress], None] | None = None,
    ) -> Study:
        """Search until the given number of trials is reached.

        Args:
            directory: Where trials are kept, and from where the search goes on; None keeps them in memory.
            trials: How many.
            executor: Plays the games; by default all cores of this machine.
            processes: How many, instead of one per core.
            stack: Worlds side by side in each.
            command: The command that `study.json` names.
            on_progress: Called after each finished run, and now and then.

        Raises:
            BatchError: The directory holds another search, another process searches there, or a file has changed meanwhile.
            RecordError: The directory cannot be written.
        """
        check_argument("trials", trials, Whole(1, MAX_TRIALS))
        player, proposer = RoundPlayer(executor, processes, stack), self._proposer()
        info = {**self.info, "command": list(command or sys.argv)}
        path = None if directory is None else Path(directory)
        with nullcontext() if path is None else StudyStore(path, info) as store:
            done = [] if store is None else list(store.trials)
            notes = [] if store is None else notes_on_versions(store.info, info, len(done))
            progress = SearchProgress(trials, len(done), len(done))
            tell = on_progress or (lambda _: None)
            self._count(progress, done)
            tell(progress)
            n_learned = 0
            while len(done) < trials:
                n_whole = len(done) // self.per_round * self.per_round
                proposer.learn(done[n_learned:n_whole])
                n_learned = n_whole
                points = proposer.propose()[len(done) - n_whole : trials - n_whole]
                new = self._round(points, done, progress, player, tell)
                if store is not None:
                    store.add(new)
                done += new
                self._count(progress, done)
                tell(progress)
            return Study(path, info if store is None else store.info, self.variables, tuple(done), notes)

    def _proposer(self) -> Proposer:
        return Proposer(
            self.variables,
            self.sampler,
            self.sample_seed,
            self.per_round,
            self.is_minimized,
            len(self.constraints),
        )

    def _round(
        self,
        points: Sequence[Point],
        done: Sequence[Trial],
        progress: SearchProgress,
        player: RoundPlayer,
        tell: Callable[[SearchProgress], None],
    ) -> list[Trial]:
        """Play some values of the current round."""
        self.evaluator.check_same()
        progress.n_round = len(points)

        def on_progress(batch: Progress) -> None:
            progress.played = (batch.n_done + batch.under_way) / batch.n_runs
            tell(progress)

        return self.evaluator.trials(points, len(done) // self.per_round, done, player, on_progress)

    def _count(self, progress: SearchProgress, done: Sequence[Trial]) -> None:
        progress.n_done, progress.n_round, progress.played = len(done), 0, 0.0
        progress.n_failed = sum(not t.is_complete for t in done)
        progress.best = best_of(done, self.is_minimized)


@explained
def optimize(
    mission: str | Path | Mission | Callable[..., Mission],
    objective: str,
    *,
    vary: Mapping[str, Any] | Iterable[str | Variable],
    trials: int = 100,
    directory: str | Path | None = None,
    executor: Executor | None = None,
    processes: int | None = None,
    stack: int | None = None,
    on_progress: Callable[[SearchProgress], None] | None = None,
    **search: Any,
) -> Study:
    """Search for mission values that maximize or minimize the mean of a quantity.

    Args:
        mission: As for `Optimization`, like all that is not listed here.
        objective: The quantity.
        vary: What varies.
        trials: How many sets of values are tried.
        directory: Where trials are kept, and from where the same search goes on; None keeps them in memory.
        executor: Plays the games; by default all cores of this machine.
        processes: How many, instead of one per core.
        stack: Worlds side by side in each.
        on_progress: Called after each finished run, and now and then.
        search: Further arguments of `Optimization`, such as minimize, subject_to, runs, per_round, sampler and sample_seed.

    Raises:
        ParameterError: A variable, the quantity or a number is not allowed.
        MissionError: The mission cannot be read, or cannot be played with any of the values that are proposed first.
        MissingExtraError: Optuna is not installed.
        BatchError: The directory holds another search, or another process is searching there.
        RecordError: The directory cannot be written.
    """
    optimization = Optimization(mission, objective, vary=vary, **search)
    optimization.check()
    return optimization.play(
        directory, trials, executor=executor, processes=processes, stack=stack, on_progress=on_progress
    )
