"""Plays a batch: the missing runs are played, each result is appended to a file as it comes, and tables are written at the end."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import pyarrow as pa

from tussle.batch import store as files
from tussle.batch.executors import Executor, InProcess, Processes
from tussle.batch.finished_runs import FinishedRuns, finished_in, last_finished, run_seconds, tables
from tussle.batch.plan import BatchPlan
from tussle.batch.results import Results
from tussle.batch.schemas import ALIVE, ALIVE_FILE, BATCH_FILE, DESIGN_FILE, RESULTS, RESULTS_FILE
from tussle.batch.sequential import Question, Rule, SequentialStop
from tussle.batch.stopping import Stop
from tussle.batch.store import Store, StoredBatch
from tussle.batch.tasks import BatchRun, Finished, Package, Progress
from tussle.batch.trust import remember
from tussle.batch.variables import Variable
from tussle.batch.varied import entries_text
from tussle.errors import BatchError
from tussle.record.run_file import Timings, plain, versions

MAX_AT_ONCE = 100_000
"""Runs that an executor gets at once, about: more would only take memory."""

LONG_ROUND = 4.0
"""CPU time of a round [s] from which on other processes are worth their start."""

FIRST_SEEDS = 20
"""Seeds of the first round of a batch that may stop; each further round doubles them."""

IDENTITY = (
    "tussle", "name", "mission", "variables", "sample", "sample_seed", "n_points", "first_seed", "independent", "dt", "start", "end",
)  # fmt: skip
"""Entries of `batch.json` that an error names where two batches differ; the fingerprint decides whether they do."""


class Playable(Protocol):
    """The interface of `Batch` that this module uses; importing it would make a circle."""

    plan: BatchPlan
    package: Package
    plugin_files: Any

    variables: list[Variable]

    @property
    def fingerprint(self) -> str: ...
    def info(self) -> dict[str, Any]: ...
    def mission_files(self) -> dict[str, bytes]: ...
    def run(self, number: int) -> BatchRun: ...
    def check(self, until: Rule | None = None) -> None: ...
    def executor(self, *, n_runs: int) -> Executor: ...


@dataclass
class _Runner:
    """One call of `Batch.play`.

    Attributes:
        batch: The batch.
        plan: Its runs.
        keep: Called with each finished run.
        stop: Decides when enough runs are played; None plays all.
        on_progress: Called with the progress.
        may_crash: Playing killed a process before, so runs are not played in this process.
        n_asked: Seeds that are played at all points without a rule; None for all of the plan.
    """

    batch: Playable
    plan: BatchPlan
    keep: Callable[[Finished], None]
    stop: Stop | SequentialStop | None
    on_progress: Callable[[Progress], None] | None
    may_crash: bool = False
    n_asked: int | None = None

    def __post_init__(self) -> None:
        self.progress = Progress(self.plan.n_runs)
        self._cpu_s = 0.0  # of all finished runs [s]

    @property
    def is_enough(self) -> bool:
        """The result that `until` asks for is known."""
        return self.stop is not None and self.stop.n_seeds is not None

    @property
    def final_plan(self) -> BatchPlan:
        """The runs that count: fewer than planned where a batch has stopped early."""
        if self.stop is None or self.stop.n_seeds is None:
            return self.plan
        return dataclasses.replace(self.plan, n_seeds=self.stop.n_seeds)

    @property
    def is_partial(self) -> bool:
        """Some points are played with fewer seeds than others."""
        if isinstance(self.stop, SequentialStop):
            return True
        return self.n_asked is not None and self.n_asked < self.final_plan.n_seeds

    @property
    def is_met(self) -> bool:
        """The rule ended the batch."""
        return self.stop.is_met if isinstance(self.stop, SequentialStop) else self.is_enough

    def play(self, played: Iterable[Finished], executor: Executor | None) -> None:
        """Play the missing runs.

        Args:
            played: Runs that were finished before.
            executor: Who plays; None chooses.

        Raises:
            TussleError: The mission cannot be played.
        """
        done = set()
        for finished in played:
            done.add(finished.number)
            self._count(finished)
        self.progress.n_before = self.progress.n_done
        self._report()
        for runs in () if self.is_enough else self._rounds(done):
            self.batch.check(None if self.stop is None else self.stop.rule)
            player = executor or self._executor(len(runs))
            if self.may_crash and isinstance(player, InProcess):
                player = Processes(1, player.stack)
            with closing(player.play(self.batch.package, runs)) as messages:
                for message in messages:
                    if isinstance(message, Finished):
                        self.keep(message)
                        self._count(message)
                    else:
                        self.progress.under_way = message.under_way
                    self._report()
                    if self.is_enough:
                        return

    def _executor(self, n_runs: int) -> Executor:
        """This process for a round that is shorter, by the games so far, than it takes to start others; else what the batch chooses."""
        n = self.progress.n_done
        if n and n_runs * self._cpu_s / n < LONG_ROUND:
            return InProcess()
        return self.batch.executor(n_runs=n_runs)

    def _report(self) -> None:
        if self.on_progress is not None:
            self.on_progress(self.progress)

    def _count(self, finished: Finished) -> None:
        self.progress.count(finished)
        self._cpu_s += finished.cpu_s
        if self.stop is not None:
            self.stop.add(finished)

    def _rounds(self, done: set[int]) -> Iterator[list[BatchRun]]:
        """The missing runs, by seeds: all points of some, then all of the next.

        A batch that may stop is played in small rounds at first, so that neither one group of points is played before the others
        nor many more runs than needed.
        """
        if isinstance(self.stop, SequentialStop):
            for needed in self.stop.rounds():
                if runs := [self.batch.run(number) for number in needed if number not in done]:
                    yield runs
                done.update(needed)
            return
        n_points, n_seeds = self.plan.n_points, self.n_asked or self.plan.n_seeds
        most = max(1, MAX_AT_ONCE // n_points)
        first = 0
        while first < n_seeds:
            n = n_seeds - first
            if self.stop is not None:
                n_least = self.stop.n_least
                n = min(n, n_least - first if first < n_least else max(FIRST_SEEDS, first))
            last = first + min(n, most)
            numbers = range(first * n_points, last * n_points)
            if runs := [self.batch.run(number) for number in numbers if number not in done]:
                yield runs
            first = last


def play_in_memory(
    batch: Playable,
    executor: Executor | None,
    until: Rule | None,
    on_progress: Callable[[Progress], None] | None,
) -> Results:
    """Play a batch and write nothing to disk."""
    timings, kept = Timings(), files.MemoryStore()
    runner = _Runner(batch, batch.plan, kept.add, _stop_of(until, batch, batch.plan), on_progress)
    runner.play((), executor)
    design = runner.final_plan.table()
    finished = tables(kept.played(), design)
    cpu_s = run_seconds(finished[0])
    return Results(
        StoredBatch(None, _final_info(runner, timings, ["python"], None, cpu_s), design, [finished])
    )


def play_in_directory(
    batch: Playable,
    path: Path,
    executor: Executor | None,
    until: Rule | None,
    command: Sequence[str],
    on_progress: Callable[[Progress], None] | None,
) -> Results:
    """Play the runs that a batch directory lacks.

    Raises:
        TussleError: The mission cannot be played.
        BatchError: The directory holds another batch, or another process plays it.
        RecordError: It cannot be written.
    """
    timings = Timings()
    if batch.plugin_files:
        remember(batch.plugin_files)
    if not (path / BATCH_FILE).exists():
        batch.check(until)  # before anything is written
    with closing(Store(path)) as store:
        before = store.info
        if is_played(batch, path, until):
            assert before is not None
            if on_progress is not None:
                on_progress(Progress(before["n_runs"], before["n_runs"], before["n_runs"]))
            return Results(files.load(path))
        notes: list[str] = []
        n_kept = 0 if before is None else _seeds_to_keep(path, before, until)
        plan = dataclasses.replace(batch.plan, n_seeds=max(batch.plan.n_seeds, n_kept))
        n_asked = batch.plan.n_seeds if before is not None and before.get("is_partial") else None
        stop = _stop_of(until, batch, plan, n_kept)
        runner = _Runner(batch, plan, store.add, stop, on_progress, store.was_killed, n_asked)
        started = {
            "n_seeds_kept": n_kept,
            "is_complete": False,
            "timings": {"wall_s": _wall_of(before), "cpu_s": 0.0},
        }
        # First batch.json, so that all other files are known to be of this batch.
        store.write_info(_info(runner, plan, command) | started)
        store.write_folder(files.MISSION, batch.mission_files())
        store.write_table(DESIGN_FILE, plan.table())
        known = FinishedRuns(path, plan.table(), notes)
        for note in notes:
            warnings.warn(
                f"{path}: {note}; the runs that it lacks are played again", RuntimeWarning, stacklevel=2
            )
        try:
            runner.play((run for results, _ in known for run in finished_in(results)), executor)
        finally:
            store.close_part()
        _write_tables(store, runner, timings, command, before)
    return Results(files.load(path))


def _stop_of(
    rule: Rule | None, batch: Playable, plan: BatchPlan, n_kept: int = 0
) -> Stop | SequentialStop | None:
    if isinstance(rule, Question):
        return SequentialStop(rule, plan, batch.variables, n_kept)
    return None if rule is None else Stop(rule, plan, n_kept)


def is_played(batch: Playable, path: Path, until: Rule | None) -> bool:
    """All of a batch is in a directory already, undamaged.

    Raises:
        BatchError: The directory holds another batch, or one that cannot be read.
    """
    if not (path / BATCH_FILE).exists():
        return False
    info = files.read_info(path)
    _check_same(batch, path, info)
    return _has_all(info, batch.plan, until) and not files.damage(path, info)


def _check_same(batch: Playable, path: Path, before: dict[str, Any]) -> None:
    """See that a directory holds this batch, whatever its number of seeds.

    Raises:
        BatchError: It holds another one.
    """
    if before.get("fingerprint") == batch.fingerprint:
        return
    now = plain(batch.info())
    differing = [
        f"{name} (there {_shown(name, before)}, now {_shown(name, now)})"
        for name in IDENTITY
        if before.get(name) != now.get(name)
    ]
    then, code = before.get("code") or {}, now["code"]
    if changed := [name for name in (then | code) if then.get(name) != code.get(name)]:
        differing.append(f"the code of {', '.join(changed)} or values that it uses, which have changed since")
    what = (
        f"it differs in {', '.join(differing)}"
        if differing
        else "the points, the mission or a plugin file have changed since"
    )
    raise BatchError(f"{path}: holds another batch: {what}; choose another directory, or remove it")


def _shown(name: str, info: dict[str, Any]) -> str:
    text = entries_text(info[name]) if name == "variables" else str(info.get(name)) or "nothing"
    return text if len(text) <= 80 else text[:77] + "..."


def _has_all(before: dict[str, Any], plan: BatchPlan, until: Rule | None) -> bool:
    """Nothing is left to do."""
    if not before["is_complete"]:
        return False
    is_stopped = before.get("stopped_by") is not None
    if until is not None:
        return bool(before.get("until") == str(until) and (is_stopped or before["n_seeds"] >= plan.n_seeds))
    return not before.get("is_partial") and bool(before["n_seeds"] >= plan.n_seeds)


def _seeds_to_keep(path: Path, before: dict[str, Any], until: Rule | None) -> int:
    """Seeds that the batch has in any case, since games of them were asked for by another command and are finished.

    Those that the same command, before it was killed, had played beyond what is enough do not count: with them the batch would
    depend on when that was.
    """
    if before["is_complete"]:
        return int(before["n_seeds"])
    kept = int(before.get("n_seeds_kept", 0))
    if until is not None and before.get("until") == str(until):
        return kept
    return max(kept, -(-last_finished(path) // int(before["n_points"])))


def _write_tables(
    store: Store, runner: _Runner, timings: Timings, command: Sequence[str], before: dict[str, Any] | None
) -> None:
    """Write the tables, and last the `batch.json` that says that they are there."""
    design, cpu_s = runner.final_plan.table(), 0.0

    def rows() -> Iterator[tuple[pa.Table, pa.Table]]:
        nonlocal cpu_s
        for results, alive in FinishedRuns(store.path, design, []):
            cpu_s += run_seconds(results)
            yield alive, results

    store.write_tables({ALIVE_FILE: ALIVE, RESULTS_FILE: RESULTS}, rows())
    store.write_table(DESIGN_FILE, design)
    store.drop_parts()
    store.write_info(_final_info(runner, timings, command, before, cpu_s))


def _info(runner: _Runner, plan: BatchPlan, command: Sequence[str]) -> dict[str, Any]:
    """The entries of `batch.json` that are known when a batch begins."""
    question = runner.stop.rule if isinstance(runner.stop, SequentialStop) else None
    return {
        **runner.batch.info(),
        "n_seeds": plan.n_seeds,
        "n_runs": plan.n_runs,
        "until": None if runner.stop is None else str(runner.stop.rule),
        "stopped_by": str(runner.stop.rule) if runner.stop is not None and runner.is_met else None,
        "target": None if question is None or question.target is None else str(question.target),
        "over": None if question is None else question.over,
        "is_partial": runner.is_partial,
        "command": list(command),
        "versions": versions(),
    }


def _final_info(
    runner: _Runner,
    timings: Timings,
    command: Sequence[str],
    before: dict[str, Any] | None,
    cpu_s: float,
) -> dict[str, Any]:
    spent = timings.so_far()
    return _info(runner, runner.final_plan, command) | {
        "is_complete": True,
        "timings": {
            "began": spent["began"],
            "wall_s": round(_wall_of(before) + spent["wall_s"], 3),
            "cpu_s": round(cpu_s, 3),
        },
    }


def _wall_of(before: dict[str, Any] | None) -> float:
    """Wall time of earlier calls that were not killed [s]."""
    return float((before or {}).get("timings", {}).get("wall_s", 0.0))
