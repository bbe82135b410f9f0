"""The end of a search as tables: the best values, how sure they are, and the command that plays them again."""

from __future__ import annotations

import math
import shlex
from pathlib import Path

from rich import box
from rich.table import Table
from rich.text import Text

from tussle.batch.search.optimization import Optimization
from tussle.batch.search.study import Study
from tussle.batch.search.trials import Trial
from tussle.cli.play import Source
from tussle.cli.progress import clock
from tussle.cli.terminal import OK, PLUGIN_FAILED, out, put, say_error, say_note

MOST_TRIALS = 5
"""Trials that the end of a search shows, the best first; trials.parquet has all."""
MOST_STEPS = 8
"""Improvements that it shows, the last ones."""
RUNS_AGAIN = 1000
"""Games of the command that plays the best again."""


def interval(value: float, low: float, high: float) -> str:
    """A mean with its interval, to the digits that the interval leaves: "12.3 (11.9–12.8)"."""
    if math.isnan(low) or high == low:
        return f"{value:.6g}"
    digits = max(0, 1 - math.floor(math.log10(high - low)))
    to = "–" if low >= 0.0 else " to "
    return f"{value:.{digits}f} ({low:.{digits}f}{to}{high:.{digits}f})"


def play_again(source: Source, study: Study) -> str:
    """The command that plays the best values again, with seeds that the search has not met; "" where there are none."""
    if study.best is None:
        return ""
    words = ["tussle", "batch", source.mission]
    for name, text in {**source.settings, **study.settings(study.best.values)}.items():
        words += ["--set", f"{name}={text}"]
    words += [] if source.end is None else ["--end", source.end]
    words += ["--strict"] if source.strict else []
    for path in source.plugin_files:
        words += ["--plugin-path", str(path)]
    words += ["--allow-large"] if source.allow_large else []
    words += ["--seed", str(study.info["first_seed"] + study.info["runs"]), "-n", str(RUNS_AGAIN)]
    return shlex.join(words)


def show_study(
    study: Study, optimization: Optimization, directory: Path, wall: float, n_new: int, again: str
) -> int:
    """Print what came of a search.

    Returns:
        The exit code: that of a failed plugin where all trials failed.
    """
    loaded = optimization.evaluator.corners.loaded
    name = (loaded.mission.name if loaded is not None else "") or study.info["name"]
    title = Text.assemble(" ", (name, "bold"), (f"\n {_facts(study)}", "dim"))
    legend = Text(" the best first; in parentheses: 95 % intervals\n", style="dim italic")
    put("", title, trials_table(study), legend, _ending(study, directory, wall, n_new))
    if again:
        out().print(Text(f" {again}"), soft_wrap=True)  # one line, however long, so that it can be copied
    put("")
    failed = [t for t in study.trials if not t.is_complete]
    if failed and study.best is None:
        say_error(f"all trials failed; the first: {failed[0].error}")
        return PLUGIN_FAILED
    if failed:
        say_note(f"{len(failed):,} of {len(study.trials):,} trials failed; the first: {failed[0].error}")
    if study.lead is not None and not study.is_clear:
        say_note(
            "the best and the next best cannot be told apart by these games; more --runs, or the command above, tell more"
        )
    return OK


def _facts(study: Study) -> str:
    info = study.info
    n = f"{len(study.trials):,} trials" if len(study.trials) != 1 else "1 trial"
    points = f" of {study.n_points:,} different points" if study.n_points < len(study.trials) else ""
    last = info["first_seed"] + info["runs"] - 1
    seeds = f"seed {last}" if info["runs"] == 1 else f"seeds {info['first_seed']:,} to {last:,}"
    return f"{info['direction']} {study.objective} · {n}{points} · {seeds} · {info['sampler']}"


def trials_table(study: Study) -> Table:
    """The best trials: their values and objectives."""
    table = Table(box=box.SIMPLE_HEAD, header_style="bold", pad_edge=False, padding=(0, 1))
    table.add_column(" trial", justify="right")
    for variable in study.variables:
        table.add_column(Text(variable.name), justify="right", overflow="fold")
    table.add_column("objective", justify="right")
    for place, trial in enumerate(study.ranking[:MOST_TRIALS]):
        cells = [f" {trial.number}", *study.settings(trial.values).values(), _objective(trial)]
        table.add_row(*map(Text, cells), style="" if place else "green")
    return table


def _objective(trial: Trial) -> str:
    return interval(trial.objective, trial.low, trial.high)


def _ending(study: Study, directory: Path, wall: float, n_new: int) -> Table:
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="dim", no_wrap=True)
    grid.add_column(overflow="fold")
    rows: list[tuple[str, str]] = []
    if study.lead is not None:
        lead = study.lead
        told = "" if study.is_clear else ": within noise"
        rows.append(
            (
                " lead",
                f"{interval(lead.difference, lead.low, lead.high)} over the next best, seed by seed{told}",
            )
        )
    steps = [f"{t.objective:.4g} (trial {t.number})" for t in study.improvements]
    if steps:
        more = "… → " if len(steps) > MOST_STEPS else ""
        rows.append((" course", more + " → ".join(steps[-MOST_STEPS:])))
    importances = study.importances()
    if importances:
        parts = ", ".join(f"{name} {100 * share:.0f} %" for name, share in importances.items())
        rows.append((" depends on", f"{parts} (of being among the best quarter; PED-ANOVA)"))
    if n_new:
        rows.append((" searched", f"{n_new:,} trials in {clock(wall)}"))
    rows.append((" study", str(directory)))
    if study.best is not None:
        rows.append((" next", "play the best with seeds that the search has not met:"))
    for label, text in rows:
        grid.add_row(label, Text(text))
    return grid
