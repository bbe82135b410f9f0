"""`tussle optimize`: plays a search, shows its progress, then its results."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from tussle.batch.points import settings_of
from tussle.batch.search.optimization import Optimization, SearchProgress
from tussle.cli.batch import Interrupted
from tussle.cli.interrupt import Interrupt
from tussle.cli.optimize_summary import interval, play_again, show_study
from tussle.cli.play import FOR_VIEWER, Source
from tussle.cli.progress import ProgressMeter, compiling
from tussle.cli.terminal import say, say_note


def search(
    source: Source,
    objective: str,
    directory: Path | None,
    trials: int,
    command: Sequence[str],
    *,
    processes: int | None,
    stack: int | None,
    **options: Any,
) -> int:
    """Search, or go on where a search was stopped, and show the results.

    Args:
        source: The mission and its settings.
        objective: The quantity.
        directory: Where trials are kept; None for the default directory.
        trials: Sets of values that are tried.
        command: The command that `study.json` names.
        processes: How many.
        stack: Worlds side by side.
        options: Further arguments of `Optimization`.

    Returns:
        The exit code.
    """
    began = time.perf_counter()
    optimization = Optimization(
        source.mission, objective, first_seed=1 if source.seed is None else source.seed, settings=source.given,
        plugin_files=tuple(source.plugin_files), ends_by_time=source.end is not None, strict=source.strict,
        allow_large=source.allow_large, **options,
    )  # fmt: skip
    loaded = optimization.evaluator.corners.loaded
    for note in loaded.notes if loaded is not None else ():
        if FOR_VIEWER not in note:
            say_note(note)
    directory = directory or optimization.default_directory()
    with ExitStack() as exits:
        with compiling():
            optimization.check()
        interrupt = exits.enter_context(Interrupt())
        meter = exits.enter_context(SearchMeter(optimization, interrupt))
        try:
            study = optimization.play(
                directory,
                trials,
                processes=processes,
                stack=stack,
                command=command,
                on_progress=meter.show_search,
            )
        except Interrupted:
            kept = f"{meter.n_done} trials are kept" if meter.n_done != 1 else "1 trial is kept"
            say("interrupted", f"{kept} in {directory}; the same command goes on", "bold yellow")
            return interrupt.code
    if meter.n_before:
        say_note(f"{meter.n_before:,} of {len(study.trials):,} trials were there already, in {directory}")
    for note in study.notes:
        say_note(note)
    n_new, again = len(study.trials) - meter.n_before, play_again(source, study)
    return show_study(study, optimization, directory, time.perf_counter() - began, n_new, again)


class SearchMeter(ProgressMeter):
    """Shows the progress of a search and the best trial so far.

    Args:
        optimization: The search.
        interrupt: Says whether the user pressed Ctrl-C.

    Attributes:
        n_before: Trials that had been evaluated before.
        n_done: Trials that are finished.
    """

    def __init__(self, optimization: Optimization, interrupt: Interrupt) -> None:
        super().__init__(optimization.name, "trials")
        self.n_before = self.n_done = 0
        self._search, self._interrupt = optimization, interrupt

    def show_search(self, progress: SearchProgress) -> None:
        """Show the progress of the search.

        Raises:
            Interrupted: The user pressed Ctrl-C.
        """
        self.before = self.n_before = progress.n_before
        self.n_done = progress.n_done
        if self._interrupt.code:
            raise Interrupted
        done = progress.n_done + progress.n_round * progress.played
        self.show(done, progress.n_trials, n_finished=progress.n_done, result=lambda: self._best(progress))

    def _best(self, progress: SearchProgress) -> str:
        parts = []
        if (best := progress.best) is not None:
            values = ", ".join(
                f"{name}={value}" for name, value in settings_of(best.values, self._search.variables).items()
            )
            parts.append(f"best {interval(best.objective, best.low, best.high)} with {values}")
        if progress.n_failed:
            parts.append(f"{progress.n_failed:,} failed")
        return ", ".join(parts)
