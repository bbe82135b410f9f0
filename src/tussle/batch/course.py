"""The course of a batch: what is missing is played, appended as it comes, and made into tables at the end."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from tussle.batch import store as files
from tussle.batch.executors import Executor, InProcess, Processes
from tussle.batch.plan import Plan
from tussle.batch.progress import Progress
from tussle.batch.results import Results
from tussle.batch.stopping import Stop
from tussle.batch.store import Store, Stored
from tussle.batch.tasks import Finished, Package, Run
from tussle.batch.trust import remember
from tussle.batch.until import Until
from tussle.batch.varied import said
from tussle.errors import BatchError
from tussle.record.run_file import Timings, plain, versions

MOST_AT_ONCE = 100_000
"""Runs that are handed to those who play at once, about: more would only lie in memory."""

FIRST_SEEDS = 20
"""Seeds after which a batch that may stop looks for the first time whether it may; from then on it plays as many again each time."""

IDENTITY = (
    "tussle", "name", "mission", "variables", "sample", "sample_seed", "n_points", "first_seed", "independent", "dt", "start", "end",
)  # fmt: skip
"""What `batch.json` says that tells one batch from another, for people: the fingerprint decides."""


class Playable(Protocol):
    """What is asked of a `Batch`, which stands above this module."""

    plan: Plan
    package: Package
    plugin_files: Any

    @property
    def fingerprint(self) -> str: ...
    def info(self) -> dict[str, Any]: ...
    def mission_files(self) -> dict[str, bytes]: ...
    def run(self, number: int) -> Run: ...
    def check(self, until: Until | None = None) -> None: ...
    def executor(self, *, n_runs: int) -> Executor: ...


class _Course:
    """One call of `Batch.play`.

    Args:
        batch: What is played.
        plan: Its runs.
        keep: Receives each finished run.
        stop: Says when it is enough.
        on_progress: Told how far it is.
        is_dangerous: A plugin may have killed who played before, so this process does not play itself unless it is told to.
    """

    def __init__(
        self,
        batch: Playable,
        plan: Plan,
        keep: Callable[[Finished], None],
        stop: Stop | None,
        on_progress: Callable[[Progress], None] | None,
        is_dangerous: bool = False,
    ) -> None:
        self.is_dangerous = is_dangerous
        self.batch, self.plan, self.keep, self.stop = batch, plan, keep, stop
        self.progress = Progress(plan.n_runs)
        self.tell = on_progress or (lambda _: None)

    @property
    def is_enough(self) -> bool:
        """What was to be known is known."""
        return self.stop is not None and self.stop.n_seeds is not None

    @property
    def final_plan(self) -> Plan:
        """The runs that count: fewer than planned where enough was enough."""
        if self.stop is None or self.stop.n_seeds is None:
            return self.plan
        return dataclasses.replace(self.plan, n_seeds=self.stop.n_seeds)

    def take_over(self, played: Iterable[Finished]) -> set[int]:
        """Count runs that were finished before; their numbers."""
        numbers = set()
        for finished in played:
            numbers.add(finished.number)
            self._count(finished)
        self.progress.n_before = self.progress.n_done
        return numbers

    def _count(self, finished: Finished) -> None:
        self.progress.count(finished)
        if self.stop is not None:
            self.stop.add(finished)

    def play(self, done: set[int], executor: Executor | None) -> None:
        """Play what is missing.

        Raises:
            TussleError: The mission cannot be played.
        """
        self.tell(self.progress)
        for runs in () if self.is_enough else self._rounds(done):
            self.batch.check(None if self.stop is None else self.stop.rule)
            who = executor or self.batch.executor(n_runs=len(runs))
            if self.is_dangerous and isinstance(who, InProcess) and who.is_replaceable:
                who = Processes(1, who.stack)
            with closing(who.play(self.batch.package, runs)) as messages:
                for message in messages:
                    if isinstance(message, Finished):
                        self.keep(message)
                        self._count(message)
                    else:
                        self.progress.beat(message)
                    self.tell(self.progress)
                    if self.is_enough:
                        return

    def _rounds(self, done: set[int]) -> Iterator[list[Run]]:
        """The missing runs, by seeds: all points of some, then all of the next.

        A batch that may stop is dealt out in small rounds at first, so that neither one group of points is played ahead of the others
        nor much more than is needed.
        """
        n_points, n_seeds = self.plan.n_points, self.plan.n_seeds
        most = max(1, MOST_AT_ONCE // n_points)
        first = 0
        while first < n_seeds:
            n = n_seeds - first if self.stop is None else self._seeds_from(first, self.stop.n_least)
            last = min(first + min(n, most), n_seeds)
            numbers = range(first * n_points, last * n_points)
            runs = [self.batch.run(number) for number in numbers if number not in done]
            if runs:
                yield runs
            first = last

    def _seeds_from(self, first: int, n_least: int) -> int:
        """How many more seeds to play before looking whether that is enough."""
        return n_least - first if first < n_least else max(FIRST_SEEDS, first)


def play_in_memory(
    batch: Playable,
    executor: Executor | None,
    until: Until | None,
    on_progress: Callable[[Progress], None] | None,
) -> Results:
    """Play a batch and keep nothing on disk."""
    timings, kept = Timings(), files.Kept()
    stop = None if until is None else Stop(until, batch.plan)
    course = _Course(batch, batch.plan, kept.add, stop, on_progress)
    course.play(set(), executor)
    plan = course.final_plan
    results, alive = files.tables(kept.played(), plan.table())
    info = _final_info(batch, course, timings, ["python"], None, results)
    return Results(Stored(None, info, plan.table(), results, alive))


def play_in_directory(
    batch: Playable,
    path: Path,
    executor: Executor | None,
    until: Until | None,
    command: Sequence[str],
    on_progress: Callable[[Progress], None] | None,
) -> Results:
    """Play what a batch directory lacks.

    Raises:
        TussleError: The mission cannot be played.
        BatchError: The directory holds another batch, or somebody else plays it.
        RecordError: It cannot be written.
    """
    timings = Timings()
    if batch.plugin_files:
        remember(batch.plugin_files)
    if not (path / files.BATCH_FILE).exists():
        batch.check(until)  # before anything is written
    store = Store(path)
    try:
        before = store.info
        if before is not None:
            _check_same(batch, path, before)
            if _has_all(before, batch.plan, until):
                if on_progress is not None:
                    on_progress(Progress(before["n_runs"], before["n_runs"], before["n_runs"]))
                return Results(files.load(path))
        played = store.played()
        n_kept = 0 if before is None else _seeds_to_keep(path, played, before, until)
        plan = dataclasses.replace(batch.plan, n_seeds=max(batch.plan.n_seeds, n_kept))
        _begin(store, batch, plan, n_kept, before, until, command)
        stop = None if until is None else Stop(until, plan, n_kept)
        course = _Course(batch, plan, store.add, stop, on_progress, store.was_killed)
        known, _ = files.merged(path, played, plan.table())
        done = course.take_over(files.finished_in(known))
        try:
            course.play(done, executor)
        finally:
            store.close_part()
        _end(store, batch, course, timings, command, before)
    finally:
        store.close()
    return Results(files.load(path))


def is_played(batch: Playable, path: Path, until: Until | None) -> bool:
    """All of a batch is in a directory already.

    Raises:
        BatchError: The directory holds another batch, or one that cannot be read.
    """
    if not (path / files.BATCH_FILE).exists():
        return False
    info = files.read_info(path)
    _check_same(batch, path, info)
    return _has_all(info, batch.plan, until)


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
    what = (
        f"it differs in {', '.join(differing)}"
        if differing
        else "the points, the mission or a plugin file have changed since"
    )
    raise BatchError(f"{path}: holds another batch: {what}; choose another directory, or remove it")


def _shown(name: str, info: dict[str, Any]) -> str:
    text = said(info[name]) if name == "variables" else str(info.get(name)) or "nothing"
    return text if len(text) <= 80 else text[:77] + "..."


def _has_all(before: dict[str, Any], plan: Plan, until: Until | None) -> bool:
    """Nothing is left to do."""
    if not before["is_complete"]:
        return False
    is_stopped = before.get("stopped_by") is not None
    if until is not None:
        return bool(before.get("until") == str(until) and (is_stopped or before["n_seeds"] >= plan.n_seeds))
    return bool(before["n_seeds"] >= plan.n_seeds)


def _seeds_to_keep(path: Path, played: pa.Table, before: dict[str, Any], until: Until | None) -> int:
    """Seeds that the batch has in any case, since games of them were asked for by another command and are finished.

    Those that the same command, before it was killed, had played beyond what is enough do not count: with them the batch would
    depend on when that was.
    """
    if before["is_complete"]:
        return int(before["n_seeds"])
    kept = int(before.get("n_seeds_kept", 0))
    if until is not None and before.get("until") == str(until):
        return kept
    old = files.read_table(path, files.RESULTS_FILE, files.RESULTS)
    last = [pc.max(table["run"]).as_py() for table in (played, old) if table is not None and table.num_rows]
    return max(kept, *(run // int(before["n_points"]) + 1 for run in last)) if last else kept


def _begin(
    store: Store,
    batch: Playable,
    plan: Plan,
    n_kept: int,
    before: dict[str, Any] | None,
    until: Until | None,
    command: Sequence[str],
) -> None:
    """Write down what is going to be played; `batch.json` first, so that it is known whose all that follows is."""
    store.write_info(
        {
            **batch.info(),
            "n_seeds": plan.n_seeds,
            "n_runs": plan.n_runs,
            "n_seeds_kept": n_kept,
            "until": None if until is None else str(until),
            "stopped_by": None,
            "command": list(command),
            "versions": versions(),
            "is_complete": False,
            "timings": {"wall_s": _wall_of(before), "cpu_s": 0.0},
        }
    )
    store.write_folder(files.MISSION, batch.mission_files())
    store.write_table(files.DESIGN_FILE, plan.table())


def _end(
    store: Store,
    batch: Playable,
    course: _Course,
    timings: Timings,
    command: Sequence[str],
    before: dict[str, Any] | None,
) -> None:
    """Make the tables; `batch.json` says last that they are all there."""
    plan = course.final_plan
    design = plan.table()
    results, alive = files.merged(store.path, store.played(), design)
    if plan != course.plan:
        results, alive = (t.filter(pc.less(t["run"], plan.n_runs)) for t in (results, alive))
    store.write_table(files.ALIVE_FILE, alive)
    store.write_table(files.RESULTS_FILE, results)
    store.write_table(files.DESIGN_FILE, design)
    store.drop_parts()
    store.write_info(_final_info(batch, course, timings, command, before, results))


def _final_info(
    batch: Playable,
    course: _Course,
    timings: Timings,
    command: Sequence[str],
    before: dict[str, Any] | None,
    results: pa.Table,
) -> dict[str, Any]:
    plan, until = course.final_plan, course.stop and course.stop.rule
    spent = timings.so_far()
    first_rows = np.flatnonzero(np.diff(results["run"].to_numpy(), prepend=-1))
    return {
        **batch.info(),
        "n_seeds": plan.n_seeds,
        "n_runs": plan.n_runs,
        "until": None if until is None else str(until),
        "stopped_by": str(until) if course.is_enough else None,
        "command": list(command),
        "versions": versions(),
        "is_complete": True,
        "timings": {
            "began": spent["began"],
            "wall_s": round(_wall_of(before) + spent["wall_s"], 3),
            "cpu_s": round(float(results["cpu_s"].to_numpy()[first_rows].sum()), 3),
        },
    }


def _wall_of(before: dict[str, Any] | None) -> float:
    """Wall time of earlier calls that came to their end [s]."""
    return float((before or {}).get("timings", {}).get("wall_s", 0.0))
