"""The end of a batch as tables: who won how often, with intervals, and where it all lies."""

from __future__ import annotations

import math
import shlex
from pathlib import Path
from typing import Any

from rich import box
from rich.table import Table
from rich.text import Text

from tussle.batch.reload import PlannedRun
from tussle.batch.results import Results
from tussle.batch.statistics import Share
from tussle.cli.progress import clock, times
from tussle.cli.terminal import OK, PLUGIN_FAILED, RUNS_FAILED, put, say_error, say_note
from tussle.errors import BatchError

MOST_POINTS = 12
"""Points that the end of a batch shows; `tussle analyze` shows all."""


def compare_hash(run: PlannedRun, state_hash: str, number: int) -> None:
    """See that a run has come out as it did in its batch.

    Raises:
        BatchError: It has not.
    """
    if run.state_hash and state_hash != run.state_hash:
        raise BatchError(
            f"run {number} came out otherwise than in its batch: state hash {state_hash}, there {run.state_hash}; "
            "another version of tussle or of a plugin plays it, or a plugin is not deterministic"
        )


def show_batch(results: Results, directory: Path, wall: float, n_new: int) -> int:
    """Print what came of a batch.

    Returns:
        The exit code: that of a failed plugin where no run came to its end, another where only some failed.
    """
    info = results.info
    title = Text.assemble(" ", (info["name"], "bold"), (f"\n {_facts(results)}", "dim"))
    parts: list[Any] = ["", title]
    if len(results.points) > 1:
        parts.append(points_table(results))
    parts += [shares_table(results), _ending(results, directory, wall, n_new), ""]
    put(*parts)
    for note in results.notes:
        say_note(note)
    if results.n_failed == results.n_runs:
        say_error(f"all runs failed; the first: {results.failed()['error'][0].as_py()}")
        return PLUGIN_FAILED
    if results.n_failed:
        say_note(
            f"{results.n_failed:,} of {results.n_runs:,} runs failed and are left out above; tussle analyze tells which"
        )
        return RUNS_FAILED
    return OK


def _facts(results: Results) -> str:
    info = results.info
    n = f"{results.n_runs:,} runs" if results.n_runs != 1 else "1 run"
    points = f" · {info['n_points']:,} points" if info["n_points"] > 1 else ""
    n_seeds = info["n_runs"] if info["independent"] else info["n_seeds"]
    last = info["first_seed"] + n_seeds - 1
    seeds = f"seed {last}" if n_seeds == 1 else f"seeds {info['first_seed']:,} to {last:,}"
    return f"{n}{points} · {seeds}"


def shares_table(results: Results) -> Table:
    """One line per team: how often it won, what it scored, how many are left, each with its interval."""
    table = Table(box=box.SIMPLE_HEAD, header_style="bold", pad_edge=False, padding=(0, 1))
    table.add_column(" team", overflow="fold")
    shares = {share.team: share for share in results.shares()}
    has_scores = bool(shares)
    heads = ["won", "share of wins, %", "mean score", "left"] if has_scores else ["left"]
    for head in heads:
        table.add_column(head, justify="right")
    best = max((s.n for s in shares.values() if s.team is not None), default=0)
    for team, name in results.teams.items():
        cells = [f" {team} {name}"]
        share = shares.get(team)
        if has_scores:
            cells += ["", ""] if share is None else [f"{share.n:,}", _share(share)]
            cells.append(_mean(results, f"score[{team}]"))
        cells.append(_mean(results, f"alive[{team}]"))
        has_won = share is not None and share.n == best > 0
        table.add_row(*cells, style="green" if has_won else "")
    if None in shares:
        table.add_row("   ties", f"{shares[None].n:,}", _share(shares[None]), "", "", style="dim")
    table.caption, table.caption_justify = " in parentheses: 95 % intervals", "left"
    return table


def _share(share: Share) -> str:
    return f"{100 * share.value:.1f} ({100 * share.low:.1f}–{100 * share.high:.1f})"


def _mean(results: Results, name: str) -> str:
    """A mean with its interval, to the digits that the interval leaves."""
    if name not in results.quantities:
        return ""
    mean = results.means([name])[0]
    if not mean.n:
        return ""
    if not mean.high > mean.low:
        return f"{mean.value:.6g}"
    digits = max(0, 1 - math.floor(math.log10(mean.high - mean.low)))
    return f"{mean.value:.{digits}f} ({mean.low:.{digits}f}–{mean.high:.{digits}f})"


def points_table(results: Results) -> Table:
    """One line per point: its values, and who won how often there."""
    table = Table(box=box.SIMPLE_HEAD, header_style="bold", pad_edge=False, padding=(0, 1))
    for variable in results.variables:
        table.add_column(f" {variable.name}", justify="right", overflow="fold")
    winners = [share.team for share in results.shares() if share.n]
    for share in results.shares():
        if share.team in winners:
            table.add_column(f"{share.name} won, %", justify="right")
    for point, values in list(enumerate(results.points))[:MOST_POINTS]:
        cells = [f"{v:.6g}" if isinstance(v, float) else str(v) for v in values.values()]
        cells += [_share(share) for share in results.shares(point) if share.team in winners]
        table.add_row(*cells)
    if len(results.points) > MOST_POINTS:
        table.add_row(f" and {len(results.points) - MOST_POINTS:,} more", style="dim")
    return table


def _ending(results: Results, directory: Path, wall: float, n_new: int) -> Table:
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="dim", no_wrap=True)
    grid.add_column(overflow="fold")
    stopped = results.info.get("stopped_by")
    if stopped:
        grid.add_row(" stopped", f"{stopped} is reached with {results.info['n_seeds']:,} seeds")
    cpu = results.info["timings"]["cpu_s"]
    if n_new:
        grid.add_row(
            " played",
            f"{n_new:,} runs in {clock(wall)} ({times(n_new / wall)} runs/s), {cpu:,.1f} CPU s in all",
        )
    grid.add_row(" batch", str(directory))
    grid.add_row(" next", Text(shlex.join(["tussle", "analyze", str(directory)])))
    grid.add_row("", Text(shlex.join(["tussle", "report", str(directory)])))
    grid.add_row("", Text(shlex.join(["tussle", "run", "--from", f"{directory}:0"])))
    return grid
