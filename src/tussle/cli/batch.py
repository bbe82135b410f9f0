"""`tussle batch`: many games, played, kept, and counted."""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tussle.batch import store
from tussle.batch.batch import Batch
from tussle.batch.executors import Executor
from tussle.batch.progress import Progress as BatchProgress
from tussle.batch.reload import planned_run
from tussle.batch.statistics import running_result, scipy_package
from tussle.batch.sweep_file import Sweep, read_sweep
from tussle.batch.trust import digest
from tussle.batch.until import Until
from tussle.batch.variables import parse_variable
from tussle.cli.batch_summary import compare_hash, show_batch
from tussle.cli.interrupt import Interrupt
from tussle.cli.play import FOR_VIEWER, Source, simulate
from tussle.cli.progress import ProgressMeter, compiling
from tussle.cli.settings import ending_by_time
from tussle.cli.terminal import say, say_note
from tussle.errors import BatchError, ParameterError, RecordError
from tussle.record import Recorder, load_run


@dataclass(frozen=True)
class BatchOptions:
    """What the command line says of a batch; None where it says nothing.

    Attributes:
        source: The mission and what is set in it.
        runs: Games of each point.
        vary: Texts of `--vary`.
        sweep: A sweep file.
        sample: How points are chosen.
        samples: How many points.
        sample_seed: Seed of the sampling.
        independent: Each game has a seed of its own.
        until: When it is enough.
        directory: Where it goes.
        processes: How many.
        stack: Worlds side by side.
        run_timeout: Wall time that a run may take [s].
        scheduler: Address of a Dask scheduler.
        slurm: What to ask of Slurm.
        log: Runs that are recorded in full.
    """

    source: Source
    runs: int | None = None
    vary: Sequence[str] = ()
    sweep: Path | None = None
    sample: str | None = None
    samples: int | None = None
    sample_seed: int | None = None
    independent: bool = False
    until: str | None = None
    directory: Path | None = None
    processes: int | None = None
    stack: int | None = None
    run_timeout: float | None = None
    scheduler: str | None = None
    slurm: str | None = None
    log: str | None = None

    def batch(self) -> Batch:
        """The batch that is meant; what the command line says comes before what the sweep file says.

        Raises:
            TussleError: Something in it is not allowed.
        """
        sweep = read_sweep(self.sweep) if self.sweep is not None else Sweep(())
        own = [parse_variable(text) for text in self.vary]
        if sweep.points is not None and own:
            raise ParameterError(f"{self.sweep} lists its points, so --vary means nothing beside it")
        names = [v.name for v in own]

        def first(*values: Any) -> Any:
            return next((v for v in values if v is not None), None)

        batch = Batch(
            self.source.mission,
            runs=first(self.runs, sweep.runs, None if self.until is not None else 100),
            vary=[*(v for v in sweep.variables if v.name not in names), *own] if sweep.points is None else (),
            points=sweep.points,
            sample=first(self.sample, sweep.sample, ""),
            samples=first(self.samples, sweep.samples),
            sample_seed=first(self.sample_seed, sweep.sample_seed, 0),
            first_seed=first(self.source.seed, sweep.first_seed, 1),
            independent=self.independent,
            settings=self.source.given,
            plugin_files=tuple(self.source.plugin_files),
            ends_by_time=self.source.end is not None,
            run_timeout=self.run_timeout,
            strict=self.source.strict,
            allow_large=self.source.allow_large,
        )
        if self.source.end is not None:
            ending_by_time(batch.mission)
        for note in batch.loaded.notes if batch.loaded is not None else ():
            if FOR_VIEWER not in note:
                say_note(note)
        return batch

    def executor(self, batch: Batch) -> AbstractContextManager[Executor | None]:
        """Who plays."""
        if self.scheduler is not None or self.slurm is not None:
            from tussle.batch.slurm import executor_for

            return executor_for(self.scheduler, self.slurm, self.stack)
        if self.processes is None and self.stack is None:
            return nullcontext()
        return nullcontext(batch.executor(self.processes, self.stack))


def play_batch(asked: BatchOptions, command: Sequence[str]) -> int:
    """Play a batch, or what is missing of it, and show what came of it.

    Returns:
        The exit code.
    """
    scipy_package()  # if it is missing, the user learns it before the games are played
    began = time.perf_counter()
    until = None if asked.until is None else Until.parse(asked.until)
    batch = asked.batch()
    logged = _numbers(asked.log, batch.plan.n_runs)
    directory = asked.directory or batch.default_directory()
    with ExitStack() as stack:
        executor = None
        if not batch.is_played_in(directory, until):
            with compiling():
                batch.check(until)
            executor = stack.enter_context(asked.executor(batch))
        interrupt = stack.enter_context(Interrupt())
        try:
            with BatchMeter(batch, interrupt, has_total=until is None) as meter:
                results = batch.play(
                    directory, executor, until=until, command=command, on_progress=meter.show_batch
                )
            if meter.n_before:
                n = min(meter.n_before, results.n_runs)
                say_note(f"{n:,} of {results.n_runs:,} runs were there already, in {directory}")
            for number in logged:
                record_run(batch, asked.source, directory, number, interrupt)
        except (Interrupted, BatchError):
            if not interrupt.code:
                raise
            # Whatever became of processes that heard the signal too.
            say(
                "interrupted",
                f"finished runs are kept in {directory}; the same command goes on",
                "bold yellow",
            )
            return interrupt.code
    return show_batch(results, directory, time.perf_counter() - began, meter.n_new)


def _numbers(text: str | None, n_runs: int) -> list[int]:
    """Runs that `--log` names: "417,3,10:20", the last of a range included.

    Raises:
        ParameterError: It is written otherwise, or the batch has no such run.
    """
    found: list[int] = []
    for part in (text or "").split(",") if text is not None else ():
        low, colon, high = (item.strip() for item in part.partition(":"))
        if not re.fullmatch(r"[0-9]{1,18}", low) or (colon and not re.fullmatch(r"[0-9]{1,18}", high)):
            raise ParameterError(
                f"--log {text!r} is not allowed; it takes numbers of runs, such as 417,3,10:20"
            )
        first, last = int(low), int(high or low)
        if not first <= last < n_runs:
            raise ParameterError(
                f"--log {part.strip()!r} is not allowed; the batch has runs 0 to {n_runs - 1}"
            )
        found += range(first, last + 1)
    return list(dict.fromkeys(found))


def record_run(batch: Batch, source: Source, directory: Path, number: int, interrupt: Interrupt) -> None:
    """Play a run again and record all of it, unless that has been done.

    Raises:
        BatchError: It came out otherwise than in the batch.
        Interrupted: The user has asked for an end.
    """
    target = directory / store.RUNS / f"{number:06d}"
    if _is_recorded(target):
        return
    shutil.rmtree(target, ignore_errors=True)  # cut short
    run = planned_run(
        directory,
        number,
        may_run=lambda code: digest(code.files) == digest(batch.plugin_files),
        allow_large=source.allow_large,
    )
    with (
        simulate(run.loaded, run.mission, run.seed) as simulation,
        Recorder(
            simulation, target, mission_text=run.loaded.text, parameters=run.loaded.settings
        ) as recorder,
    ):
        simulation.run_until(lambda _: bool(interrupt.code))
        if interrupt.code:
            raise Interrupted
        result = simulation.result()[0]
        compare_hash(run, result.state_hash, number)
        recorder.close("" if result.error is None else str(result.error))


def _is_recorded(target: Path) -> bool:
    try:
        return load_run(target).is_complete
    except RecordError:
        return False


class Interrupted(Exception):  # noqa: N818 - it is no error
    """The user wants the batch to stop."""


class BatchMeter(ProgressMeter):
    """Shows the progress of a batch and the result so far.

    Args:
        batch: The batch.
        interrupt: Says whether the user pressed Ctrl-C.
        has_total: The number of runs is known.

    Attributes:
        n_new: Runs that were played since the start.
    """

    def __init__(self, batch: Batch, interrupt: Interrupt, has_total: bool = True) -> None:
        super().__init__(batch.name, "runs", speed_unit="runs/s")
        self.n_new = 0
        self._has_total, self._names, self._interrupt = has_total, batch.team_names, interrupt

    @property
    def n_before(self) -> int:
        """Runs that had been played before."""
        return int(self.before)

    def show_batch(self, progress: BatchProgress) -> None:
        """Show the progress of the batch.

        Raises:
            Interrupted: The user pressed Ctrl-C.
        """
        self.before, self.n_new = progress.n_before, progress.n_done - progress.n_before
        if self._interrupt.code:
            raise Interrupted
        self.show(
            progress.n_done + progress.under_way,
            progress.n_runs if self._has_total else None,
            n_finished=progress.n_done,
            result=lambda: self._result(progress),
        )

    def _result(self, progress: BatchProgress) -> str:
        wins = {
            self._names.get(team, f"team {team}"): n
            for team, n in sorted((t, n) for t, n in progress.wins.items() if t is not None)
        }
        text = running_result(wins, sum(progress.wins.values()))
        return f"{text}, {progress.n_failed} failed" if progress.n_failed else text
