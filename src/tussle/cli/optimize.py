"""`tussle optimize`: play a search, show its progress, then its results."""

from __future__ import annotations

import shlex
import time
from contextlib import ExitStack
from pathlib import Path

from rich.text import Text

from tussle.batch.points import settings_of
from tussle.batch.search.optimization import Optimization, SearchProgress
from tussle.batch.search.study import Study
from tussle.cli.batch import command_line, seeds_text, short_names
from tussle.cli.batch_options import OptimizeOptions
from tussle.cli.interrupt import Interrupt, Interrupted
from tussle.cli.options import show_notes
from tussle.cli.progress import ProgressMeter, clock, compiling
from tussle.cli.tables import estimate, fact_list, number_tables, title
from tussle.cli.terminal import OK, PLUGIN_FAILED, out, put, say, say_error, say_note

MAX_TRIALS = 5
"""Trials that the end of a search shows, the best first; trials.parquet has all."""
MAX_STEPS = 8
"""Improvements that the end of a search shows, the last ones."""
RUNS_AGAIN = 1000
"""Games of the command that plays the best values again."""


def optimize(options: OptimizeOptions) -> int:
    """Search, or continue an interrupted search, and show the results.

    Returns:
        The exit code.
    """
    began = time.perf_counter()
    optimization = Optimization(
        options.mission,
        options.objective,
        vary=tuple(options.vary),
        minimize=options.minimize,
        subject_to=tuple(options.subject_to),
        runs=options.runs,
        per_round=options.per_round,
        sampler=options.sampler,
        sample_seed=options.sample_seed,
        run_timeout=options.run_timeout,
        first_seed=1 if options.seed is None else options.seed,
        settings=options.given,
        plugin_files=tuple(options.plugin_files),
        ends_by_time=options.end is not None,
        strict=options.strict,
        allow_large=options.allow_large,
        compat=options.compat,
        search=list(map(str, options.data_path)),
    )
    show_notes(optimization.evaluator.corners.loaded)
    directory = options.directory or optimization.default_directory()
    with ExitStack() as stack:
        with compiling():
            optimization.check()
        interrupt = stack.enter_context(Interrupt())
        meter = stack.enter_context(SearchMeter(optimization, interrupt))
        try:
            study = optimization.play(
                directory,
                options.trials,
                processes=options.processes,
                stack=options.stack,
                command=command_line(),
                on_progress=meter.show_search,
            )
        except Interrupted:
            kept = f"{meter.n_done} trials are kept" if meter.n_done != 1 else "1 trial is kept"
            say("interrupted", f"{kept} in {directory}; the same command continues", "bold yellow")
            return interrupt.code
    if meter.n_before:
        say_note(f"{meter.n_before:,} of {len(study.trials):,} trials were there already, in {directory}")
    for note in study.notes:
        say_note(note)
    n_new = len(study.trials) - meter.n_before
    searched = f"{n_new:,} trials in {clock(time.perf_counter() - began)}" if n_new else ""
    return show_study(study, optimization, directory, searched, play_again(options, study))


class SearchMeter(ProgressMeter):
    """Shows the progress of a search and the best trial so far.

    Args:
        optimization: The search.
        interrupt: Has the flag that Ctrl-C sets.

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
            Interrupted: The user asked to stop.
        """
        self.before = self.n_before = progress.n_before
        self.n_done = progress.n_done
        self._interrupt.check()
        done = progress.n_done + progress.n_round * progress.played
        self.show(done, progress.n_trials, n_finished=progress.n_done, result=lambda: self._best(progress))

    def _best(self, progress: SearchProgress) -> str:
        parts = []
        if (best := progress.best) is not None:
            settings = settings_of(best.values, self._search.variables)
            values = ", ".join(f"{name}={value}" for name, value in settings.items())
            parts.append(f"best {estimate(best.objective, best.low, best.high)} with {values}")
        if progress.n_failed:
            parts.append(f"{progress.n_failed:,} failed")
        return ", ".join(parts)


def play_again(options: OptimizeOptions, study: Study) -> str:
    """Return the command that plays the best values with other seeds than the search; "" if all trials failed."""
    if study.best is None:
        return ""
    settings = options.given | study.settings(study.best.values)
    settings.pop("run.end", None)
    words = ["tussle", "batch", options.mission]
    words += [word for name, text in settings.items() for word in ("--set", f"{name}={text}")]
    words += ["--end", options.end] if options.end is not None else []
    words += [] if options.strict is None else ["--strict" if options.strict else "--lenient"]
    words += [word for path in options.plugin_files for word in ("--plugin-path", str(path))]
    words += ["--allow-large"] if options.allow_large else []
    words += [word for path in options.data_path for word in ("--data-path", str(path))]
    words += ["--compat", options.compat] if options.compat is not None else []
    words += ["--seed", str(study.info["first_seed"] + study.info["runs"]), "-n", str(RUNS_AGAIN)]
    return shlex.join(words)


def show_study(study: Study, optimization: Optimization, directory: Path, searched: str, command: str) -> int:
    """Print the result of a search.

    Returns:
        The exit code: that of a failed plugin if all trials failed.
    """
    info, loaded = study.info, optimization.evaluator.corners.loaded
    name = (loaded.mission.name if loaded is not None else "") or info["name"]
    n = f"{len(study.trials):,} trials" if len(study.trials) != 1 else "1 trial"
    points = f" of {study.n_points:,} different points" if study.n_points < len(study.trials) else ""
    seeds = seeds_text(info["first_seed"], info["runs"])
    rows = [
        (
            "" if place else "green",
            [
                str(trial.number),
                *study.settings(trial.values).values(),
                estimate(trial.objective, trial.low, trial.high),
                *(f"{mean:.4g}" for mean in study.constrained(trial).values()),
            ],
        )
        for place, trial in enumerate(study.ranking[:MAX_TRIALS])
    ]
    quantities = [str(constraint.quantity) for constraint in study.constraints]
    kept = "".join(f", subject to {constraint}" for constraint in study.constraints)
    put(
        "",
        title(
            name, f"{info['direction']} {study.objective}{kept} · {n}{points} · {seeds} · {info['sampler']}"
        ),
        *number_tables(["trial", *short_names(study.variables), "objective", *quantities], rows),
        Text(" the best first; in parentheses: 95 % intervals", "dim italic"),
        fact_list(
            [
                *_facts(study),
                ("searched", searched),
                ("study", Text(str(directory))),
                ("next", "play the best values with seeds that the search did not use:" if command else ""),
            ]
        ),
    )
    if command:
        out().print(Text(f" {command}"), soft_wrap=True)  # on one line, so that it can be copied
    put("")
    failed = [t for t in study.trials if not t.is_complete]
    if study.best is None and study.nearest is not None:
        off = ", ".join(
            f"{quantity} {mean:.4g}" for quantity, mean in study.constrained(study.nearest).items()
        )
        say_note(
            f"no trial keeps the constraints; the nearest, {study.label(study.nearest.values)}, has {off}"
        )
        return OK
    if failed and study.best is None:
        say_error(f"all trials failed; the first: {failed[0].error}")
        return PLUGIN_FAILED
    if failed:
        say_note(f"{len(failed):,} of {len(study.trials):,} trials failed; the first: {failed[0].error}")
    if study.lead is not None and not study.is_clear:
        say_note(
            "these games do not show a difference of the best and the next best; play more --runs, or the command above"
        )
    return OK


def _facts(study: Study) -> list[tuple[str, str]]:
    """Return the lead of the best trial, the improvements, and the importance of the variables."""
    facts, lead = [], study.lead
    if lead is not None:
        noise = "" if study.is_clear else ": within noise"
        difference = estimate(lead.difference, lead.low, lead.high)
        facts.append(("lead", f"{difference} over the next best, paired by seed{noise}"))
    steps = [f"{t.objective:.4g} (trial {t.number})" for t in study.improvements]
    more = "… → " if len(steps) > MAX_STEPS else ""
    facts.append(("improved", more + " → ".join(steps[-MAX_STEPS:])))
    shares = ", ".join(f"{name} {100 * share:.0f} %" for name, share in study.importances().items())
    facts.append(("depends on", f"{shares} (of being among the best quarter; PED-ANOVA)" if shares else ""))
    return facts
