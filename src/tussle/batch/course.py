"""The course of a batch: what is missing is played, appended as it comes, and made into tables at the end."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Callable, Iterable, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from tussle.batch import store as files
from tussle.batch.plan import Plan
from tussle.batch.progress import Progress
from tussle.batch.results import Results
from tussle.batch.store import PLAYED, Store, Stored
from tussle.batch.tasks import Finished
from tussle.errors import BatchError
from tussle.record.run_file import Timings, plain, versions

if TYPE_CHECKING:
    from tussle.batch.batch import Batch
    from tussle.batch.executors import Executor
    from tussle.batch.until import Until

ROUND = 10
"""Seeds between two looks at whether enough has been played."""


class _Stop:
    """Watches the runs of a batch until a result is known well enough.

    It looks only at whole rounds of seeds, so that the answer does not depend on the order in which runs are finished.

    Args:
        rule: When it is enough.
        plan: The runs.
    """

    def __init__(self, rule: Until, plan: Plan) -> None:
        self.rule, self.plan = rule, plan
        self.n_seeds: int | None = None
        self._rows: dict[int, dict[str, float]] = {}
        self._whole = 0  # runs from the first on, without a gap

    def add(self, number: int, values: dict[str, float]) -> bool:
        """A run is finished; true when it is enough."""
        self._rows[number] = values
        before = self._whole
        while self._whole in self._rows:
            self._whole += 1
        per_round = ROUND * self.plan.n_points
        for n in range(before // per_round + 1, self._whole // per_round + 1):
            if self._is_met(n * per_round):
                self.n_seeds = n * ROUND
                return True
        return False

    def _is_met(self, n_runs: int) -> bool:
        names = list(dict.fromkeys(name for run in range(n_runs) for name in self._rows[run]))
        columns = [
            {
                name: np.array(
                    [self._rows[run].get(name, np.nan) for run in range(point, n_runs, self.plan.n_points)]
                )
                for name in names
            }
            for point in range(self.plan.n_points)
        ]
        return bool(self.rule.is_met(columns))


def quantities_of(finished: Finished) -> dict[str, float]:
    """All named results of a run, as they are called in expressions; NaN where it failed."""
    values = {f"{name}[{team}]" if team is not None else name: v for team, name, v in finished.metrics}
    scores = [team for team, name, _ in finished.metrics if name == "score"]
    values |= {f"wins[{team}]": float(team == finished.winner) for team in scores}
    if scores:
        values["ties"] = float(finished.winner is None)
    values |= {"t": finished.t, "steps": float(finished.steps)}
    return dict.fromkeys(values, np.nan) if finished.end == "error" else values


class _Course:
    """One call of `Batch.play`.

    Args:
        batch: What is played.
        n_seeds: Games of each point.
        keep: Receives each finished run.
        until: When it is enough.
        on_progress: Told how far it is.
    """

    def __init__(
        self,
        batch: Batch,
        plan: Plan,
        keep: Callable[[Finished], None],
        until: Until | None,
        on_progress: Callable[[Progress], None] | None,
    ) -> None:
        self.batch, self.plan, self.keep, self.until = batch, plan, keep, until
        self.stop = None if until is None else _Stop(until, plan)
        self.progress = Progress(plan.n_runs)
        self.tell = on_progress or (lambda _: None)

    @property
    def final_plan(self) -> Plan:
        """The runs that count: fewer than planned where enough was enough."""
        if self.stop is None or self.stop.n_seeds is None:
            return self.plan
        return dataclasses.replace(self.plan, n_seeds=self.stop.n_seeds)

    def take_over(self, played: Iterable[Finished]) -> set[int]:
        """Runs that were finished before; their numbers, and true for enough."""
        numbers = set()
        for finished in played:
            numbers.add(finished.number)
            self._count(finished)
        self.progress.n_before = self.progress.n_done
        return numbers

    def _count(self, finished: Finished) -> bool:
        self.progress.count(finished)
        return self.stop is not None and self.stop.add(finished.number, quantities_of(finished))

    def play(self, done: set[int], executor: Executor | None) -> None:
        """Play what is missing."""
        self.tell(self.progress)
        if self.stop is not None and self.stop.n_seeds is not None:
            return
        runs = [self.batch.run(number) for number in range(self.plan.n_runs) if number not in done]
        if not runs:
            return
        executor = executor or self.batch.executor(n_runs=len(runs))
        with closing(executor.play(self.batch.package, runs)) as messages:
            for message in messages:
                if isinstance(message, Finished):
                    self.keep(message)
                    is_enough = self._count(message)
                    self.tell(self.progress)
                    if is_enough:
                        break
                else:
                    self.progress.beat(message)
                    self.tell(self.progress)


def play_in_memory(
    batch: Batch,
    executor: Executor | None,
    until: Until | None,
    on_progress: Callable[[Progress], None] | None,
) -> Results:
    """Play a batch and keep nothing on disk."""
    timings, rows = Timings(), []
    course = _Course(batch, batch.plan, lambda f: rows.append(files.row(f)), until, on_progress)
    course.play(set(), executor)
    plan = course.final_plan
    results, alive = files.tables(pa.Table.from_batches(rows, PLAYED), plan.table())
    info = _final_info(batch, course, timings, ["python"], None, results)
    return Results(Stored(None, info, plan.table(), results, alive))


def play_in_directory(
    batch: Batch,
    path: Path,
    executor: Executor | None,
    until: Until | None,
    command: Sequence[str],
    on_progress: Callable[[Progress], None] | None,
) -> Results:
    """Play what a batch directory lacks.

    Raises:
        BatchError: It holds another batch, or somebody else plays it.
        RecordError: It cannot be written.
    """
    timings = Timings()
    store = Store(path)
    try:
        before = store.info
        plan = _agreed_plan(batch, path, before)
        if before is not None and _has_all(before, plan, until):
            if on_progress is not None:
                on_progress(Progress(before["n_runs"], before["n_runs"], before["n_runs"]))
            return Results(files.load(path))
        _begin(store, batch, plan, before, until, command)
        course = _Course(batch, plan, store.add, until, on_progress)
        known, _ = files.merged(path, store.played(), plan.table())
        done = course.take_over(files.finished_in(known))
        try:
            course.play(done, executor)
        finally:
            store.close_part()
        design = course.final_plan.table()
        results, alive = files.merged(path, store.played(), design)
        if course.final_plan != plan:
            results, alive = (t.filter(pc.less(t["run"], course.final_plan.n_runs)) for t in (results, alive))
        store.write_table(files.DESIGN_FILE, design)
        store.write_table(files.ALIVE_FILE, alive)
        store.write_table(files.RESULTS_FILE, results)
        store.drop_parts()
        store.write_info(_final_info(batch, course, timings, command, before, results))
    finally:
        store.close()
    return Results(files.load(path))


def _agreed_plan(batch: Batch, path: Path, before: dict[str, Any] | None) -> Plan:
    """The plan, with as many seeds as the directory has already.

    Raises:
        BatchError: The directory holds another batch.
    """
    if before is None:
        return batch.plan
    if before["fingerprint"] != batch.fingerprint:
        now = plain(batch.info())
        names = (
            "tussle",
            "name",
            "mission",
            "variables",
            "n_points",
            "first_seed",
            "independent",
            "dt",
            "end",
        )
        differing = [name for name in names if before.get(name) != now.get(name)]
        what = (
            f"it differs in {', '.join(differing)}"
            if differing
            else "the mission file or a plugin file has changed since"
        )
        raise BatchError(f"{path}: holds another batch ({what}); choose another directory, or remove it")
    return dataclasses.replace(batch.plan, n_seeds=max(batch.plan.n_seeds, before["n_seeds_planned"]))


def _has_all(before: dict[str, Any], plan: Plan, until: Until | None) -> bool:
    """Nothing is left to do."""
    if not before["is_complete"]:
        return False
    is_stopped = before["stopped_by"] is not None
    if until is not None:
        return bool(before["until"] == str(until) and (is_stopped or before["n_seeds"] >= plan.n_seeds))
    return bool(before["n_seeds"] >= plan.n_seeds)


def _begin(
    store: Store,
    batch: Batch,
    plan: Plan,
    before: dict[str, Any] | None,
    until: Until | None,
    command: Sequence[str],
) -> None:
    """Write down what is going to be played."""
    if before is None:
        _keep_mission(store, batch)
    store.write_table(files.DESIGN_FILE, plan.table())
    info = {**batch.info(), "n_seeds": plan.n_seeds, "n_runs": plan.n_runs, "n_seeds_planned": plan.n_seeds}
    so_far = before or {"timings": {"wall_s": 0.0, "cpu_s": 0.0}}
    store.write_info(
        {
            **info,
            "until": None if until is None else str(until),
            "stopped_by": None,
            "command": list(command),
            "versions": versions(),
            "is_complete": False,
            "timings": so_far["timings"],
        }
    )


def _keep_mission(store: Store, batch: Batch) -> None:
    """Copy the mission and all that it is made of, so that each run can be played again."""
    if batch.loaded is None:
        return
    folder = store.path / files.MISSION
    with files.told(store.path):
        shutil.rmtree(folder, ignore_errors=True)
        home = batch.loaded.path.parent.resolve()
        for file in batch.loaded.files:
            source = file.resolve()
            # What lies elsewhere, on a search path, is found there again.
            if source.is_relative_to(home):
                target = folder / source.relative_to(home)
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, target)
        for number, plugin_file in enumerate(batch.plugin_files):
            target = folder / files.PLUGINS / str(number) / Path(plugin_file.path).name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(plugin_file.text, encoding="utf-8")


def _final_info(
    batch: Batch,
    course: _Course,
    timings: Timings,
    command: Sequence[str],
    before: dict[str, Any] | None,
    results: pa.Table,
) -> dict[str, Any]:
    plan, until = course.final_plan, course.until
    spent = timings.so_far()
    earlier = (before or {}).get("timings", {}).get("wall_s", 0.0)
    first_rows = np.flatnonzero(np.diff(results["run"].to_numpy(), prepend=-1))
    return {
        **batch.info(),
        "n_seeds": plan.n_seeds,
        "n_runs": plan.n_runs,
        "n_seeds_planned": course.plan.n_seeds,
        "until": None if until is None else str(until),
        "stopped_by": None if plan == course.plan else str(until),
        "command": list(command),
        "versions": versions(),
        "is_complete": True,
        "timings": {
            "began": spent["began"],
            "wall_s": round(earlier + spent["wall_s"], 3),
            "cpu_s": round(float(results["cpu_s"].to_numpy()[first_rows].sum()), 3),
        },
    }
