"""`tussle batch`: play many games, record some of them, and show who won how often."""

from __future__ import annotations

import math
import re
import shlex
import shutil
import sys
import time
from collections.abc import Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from pathlib import Path
from typing import Any

from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text

from tussle.batch import store
from tussle.batch.batch import Batch
from tussle.batch.executors import Executor
from tussle.batch.further import RUNS, further_runs
from tussle.batch.quantities import column_name
from tussle.batch.reload import planned_run
from tussle.batch.results import Results
from tussle.batch.selection import written
from tussle.batch.sequential import rule_of
from tussle.batch.statistics import Share, running_result, scipy_package
from tussle.batch.sweep_file import Sweep, read_sweep
from tussle.batch.target import estimate_text
from tussle.batch.tasks import Progress as BatchProgress
from tussle.batch.trust import digest
from tussle.batch.variables import Variable, parse_variable
from tussle.cli.batch_options import BatchOptions
from tussle.cli.interrupt import Interrupt, Interrupted
from tussle.cli.options import show_notes
from tussle.cli.play import check_hash, record, simulate
from tussle.cli.progress import ProgressMeter, clock, compiling, times
from tussle.cli.tables import estimate, fact_list, indented, number_tables, title
from tussle.cli.terminal import OK, PLUGIN_FAILED, RUNS_FAILED, put, say, say_error, say_note
from tussle.errors import BatchError, ParameterError, RecordError
from tussle.record import load_run
from tussle.record.plugin_columns import select

MAX_POINTS = 12
"""Points that the end of a batch shows; `tussle analyze` shows all."""


def batch(options: BatchOptions) -> int:
    """Play a batch, or the runs of it that are missing, and show the result.

    Returns:
        The exit code.
    """
    scipy_package()  # if it is missing, the user learns it before the games are played
    began = time.perf_counter()
    rule = rule_of(options.until, options.target, options.over)
    planned = batch_of(options)
    recorded = run_numbers(options.record_runs, planned.plan.n_runs)
    for number in recorded:
        select(planned.missions[planned.plan.point(number)], options.record_columns or "")
    directory = options.directory or planned.default_directory()
    with ExitStack() as stack:
        executor = None
        if not planned.is_played_in(directory, rule):
            with compiling():
                planned.check(rule)
            executor = stack.enter_context(_executor(options, planned))
        interrupt = stack.enter_context(Interrupt())
        try:
            with BatchMeter(planned, interrupt, has_total=rule is None) as meter:
                results = planned.play(
                    directory,
                    executor,
                    until=options.until,
                    target=options.target,
                    over=options.over,
                    command=command_line(),
                    on_progress=meter.show_batch,
                )
            if meter.n_before:
                n = min(meter.n_before, results.n_runs)
                say_note(f"{n:,} of {results.n_runs:,} runs were there already, in {directory}")
            for number in recorded:
                record_run(planned, options, directory, number, interrupt)
        except (Interrupted, BatchError):
            if not interrupt.code:
                raise
            # Worker processes that got the signal too may have failed.
            say(
                "interrupted",
                f"finished runs are kept in {directory}; the same command continues",
                "bold yellow",
            )
            return interrupt.code
    return show_batch(results, directory, time.perf_counter() - began, meter.n_new)


def command_line() -> list[str]:
    """Return the command that runs, as result directories record it."""
    return [Path(sys.argv[0]).name, *sys.argv[1:]]


def batch_of(options: BatchOptions) -> Batch:
    """Return the batch that the options describe. They take precedence over the sweep file.

    Raises:
        TussleError: An option is not allowed.
    """
    sweep = read_sweep(options.sweep) if options.sweep is not None else Sweep(())
    own = [parse_variable(text) for text in options.vary]
    if sweep.points is not None and own:
        raise ParameterError(f"{options.sweep} lists its points, so --vary is not allowed with it")
    names = [v.name for v in own]

    def first(*values: Any) -> Any:
        return next((v for v in values if v is not None), None)

    made = Batch(
        options.mission,
        runs=first(options.runs, sweep.runs, _most_runs(options)),
        vary=[*(v for v in sweep.variables if v.name not in names), *own] if sweep.points is None else (),
        points=sweep.points,
        sample=first(options.sample, sweep.sample, ""),
        samples=first(options.samples, sweep.samples),
        sample_seed=first(options.sample_seed, sweep.sample_seed, 0),
        first_seed=first(options.seed, sweep.first_seed, 1),
        independent=options.independent,
        settings=options.given,
        plugin_files=tuple(options.plugin_files),
        ends_by_time=options.end is not None,
        run_timeout=options.run_timeout,
        strict=options.strict,
        allow_large=options.allow_large,
        compat=options.compat,
        search=list(map(str, options.data_path)),
    )
    show_notes(made.loaded)
    return made


def _most_runs(options: BatchOptions) -> int | None:
    """Games of each point where nobody says how many; None for as many as it takes."""
    return RUNS if options.target is not None else None if options.until is not None else 100


def _executor(options: BatchOptions, planned: Batch) -> AbstractContextManager[Executor | None]:
    if options.scheduler is not None or options.slurm is not None:
        from tussle.batch.slurm import executor_for

        return executor_for(options.scheduler, options.slurm, options.stack)
    if options.processes is None and options.stack is None:
        return nullcontext()
    return nullcontext(planned.executor(options.processes, options.stack))


def run_numbers(text: str | None, n_runs: int) -> list[int]:
    """Parse the numbers of `--record-runs`: "417,3,10:20", the last of a range included.

    Raises:
        ParameterError: The text has another form, or the batch has no such run.
    """
    found: list[int] = []
    for part in (text or "").split(",") if text is not None else ():
        low, colon, high = (item.strip() for item in part.partition(":"))
        if not re.fullmatch(r"[0-9]{1,18}", low) or (colon and not re.fullmatch(r"[0-9]{1,18}", high)):
            raise ParameterError(
                f"--record-runs {text!r} is not allowed; it takes numbers of runs, such as 417,3,10:20"
            )
        first, last = int(low), int(high or low)
        if not first <= last < n_runs:
            raise ParameterError(
                f"--record-runs {part.strip()!r} is not allowed; the batch has runs 0 to {n_runs - 1}"
            )
        found += range(first, last + 1)
    return list(dict.fromkeys(found))


def record_run(
    planned: Batch, options: BatchOptions, directory: Path, number: int, interrupt: Interrupt
) -> None:
    """Play a run again and record it, unless it is recorded with the same columns.

    Raises:
        BatchError: The run ended otherwise than in the batch.
        Interrupted: The user asked to stop.
    """
    target = directory / store.RUNS / f"{number:06d}"
    try:
        found = load_run(target)
        if found.is_complete and options.record_columns in (None, found.info.get("columns")):
            return
    except RecordError:  # there is no run, or a damaged one
        pass
    shutil.rmtree(target, ignore_errors=True)  # an incomplete record
    run = planned_run(
        directory,
        number,
        may_run=lambda code: digest(code.files) == digest(planned.plugin_files),
        allow_large=options.allow_large,
        search=options.data_path,
    )
    with (
        simulate(run.loaded, run.mission, run.seed) as simulation,
        record(simulation, target, run.loaded, columns=options.record_columns) as recorder,
    ):
        simulation.run_until(lambda _: bool(interrupt.code))
        interrupt.check()
        result = simulation.result()[0]
        check_hash(run, result.state_hash, str(number))
        recorder.close("" if result.error is None else str(result.error))


class BatchMeter(ProgressMeter):
    """Shows the progress of a batch and the result so far.

    Args:
        planned: The batch.
        interrupt: Has the flag that Ctrl-C sets.
        has_total: The number of runs is known.

    Attributes:
        n_new: Runs that were played since the start.
    """

    def __init__(self, planned: Batch, interrupt: Interrupt, has_total: bool = True) -> None:
        super().__init__(planned.name, "runs", speed_unit="runs/s")
        self.n_new = 0
        self._has_total, self._names, self._interrupt = has_total, planned.team_names, interrupt

    @property
    def n_before(self) -> int:
        """Runs that had been played before."""
        return int(self.before)

    def show_batch(self, progress: BatchProgress) -> None:
        """Show the progress of the batch.

        Raises:
            Interrupted: The user asked to stop.
        """
        self.before, self.n_new = progress.n_before, progress.n_done - progress.n_before
        self._interrupt.check()
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


# -- the result -------------------------------------------------------------------------------------------------------------


def show_batch(results: Results, directory: Path, wall: float, n_new: int) -> int:
    """Print the result of a batch.

    Returns:
        The exit code: that of a failed plugin if all runs failed, another one if only some failed.
    """
    info = results.info
    has_points = info["n_points"] > 1
    over = " over the seeds, of the mean over these points" if has_points else ""
    facts = f"{results.n_runs:,} runs" if results.n_runs != 1 else "1 run"
    facts += f" · {info['n_points']:,} points" if has_points else ""
    n_seeds = info["n_runs"] if info["independent"] else info["n_seeds"]
    command = [
        shlex.join(["tussle", *words])
        for words in (
            ("analyze", str(directory)),
            ("report", str(directory)),
            ("run", "--from", f"{directory}:0"),
        )
    ]
    cpu = info["timings"]["cpu_s"]
    played = f"{n_new:,} runs in {clock(wall)} ({times(n_new / wall)} runs/s), {cpu:,.1f} CPU s in all"
    put(
        "",
        title(info["name"], f"{facts} · {seeds_text(info['first_seed'], n_seeds)}"),
        *answer_tables(results),
        *(point_tables(results) if has_points else []),
        *share_tables(results),
        Text(f" in parentheses: 95 % intervals{over}", "dim italic"),
        fact_list(
            [
                ("stopped", _stopped(results)),
                ("played", played if n_new else ""),
                ("batch", Text(str(directory))),
                ("next", Text("\n".join(command))),
            ]
        ),
        "",
    )
    for note in results.notes:
        if note not in (info["mission"].get("notes") or ()):  # those were shown before the games
            say_note(note)
    if results.n_failed == results.n_runs:
        say_error(f"all runs failed; the first: {results.failed()['error'][0].as_py()}")
        return PLUGIN_FAILED
    if results.n_failed:
        say_note(
            f"{results.n_failed:,} of {results.n_runs:,} runs failed and are not counted above; tussle analyze lists them"
        )
        return RUNS_FAILED
    return OK


def _stopped(results: Results) -> str:
    """What ended the batch early; "" for nothing."""
    rule, n = results.info.get("stopped_by"), results.info["n_seeds"]
    if not rule:
        return ""
    if not results.info.get("is_partial"):
        return f"{rule} is reached with {n:,} seeds"
    return f"{rule} is known, with up to {n:,} seeds at a point; it holds whenever the batch stops (confidence sequences)"


def seeds_text(first: int, n: int) -> str:
    """Format a range of seeds: "seed 3", "seeds 1 to 1,000"."""
    return f"seed {first}" if n == 1 else f"seeds {first:,} to {first + n - 1:,}"


def short_names(variables: Sequence[Variable]) -> list[str]:
    """Return the last part of the name of each variable if these differ, else the names."""
    last = [v.name.rpartition(".")[2] for v in variables]
    return last if len(set(last)) == len(last) else [v.name for v in variables]


def share_tables(results: Results) -> list[Padding]:
    """Return one line per team, how often it won, its mean score, how many are left, and one per other quantity; with intervals."""
    shares = {share.team: share for share in results.shares()}
    word = "lost" if any(name.startswith("lost[") for name in results.defaults.all) else "left"
    left = {team: column_name("lost" if word == "lost" else "alive", team) for team in results.diminished}
    teams = results.teams if shares else {team: results.teams[team] for team in left}
    best = max((s.n for s in shares.values() if s.team is not None), default=0)
    rows = []
    for team, name in teams.items():
        share, cells = shares.get(team), [f"{team} {name}"]
        if shares:
            cells += ["", ""] if share is None else [f"{share.n:,}", _share(share)]
            cells.append(_mean(results, column_name("score", team)))
        style = "green" if share is not None and share.n == best > 0 else ""
        rows.append((style, [*cells, *([_mean(results, left.get(team, ""))] if left else [])]))
    head = ["team", *(["won", "share of wins, %", "mean score"] if shares else []), *([word] if left else [])]
    if None in shares:
        cells = ["  ties", f"{shares[None].n:,}", _share(shares[None])]
        rows.append(("dim", [*cells, *[""] * (len(head) - len(cells))]))
    in_rows = [*left.values(), *(column_name("score", team) for team in teams if shares)]
    others = [
        ("", [results.title(name), _mean(results, name)])
        for name in results.defaults.all
        if name not in in_rows
    ]
    return [
        *(number_tables(head, rows) if rows else []),
        *(number_tables(["", "mean"], others) if others else []),
    ]


def _share(share: Share) -> str:
    interval = f" ({100 * share.low:.1f}–{100 * share.high:.1f})" if math.isfinite(share.low) else ""
    return f"{100 * share.value:.1f}{interval}"


def _mean(results: Results, name: str) -> str:
    if name not in results.quantities:
        return ""
    mean = results.means([name])[0]
    return estimate(mean.value, mean.low, mean.high) if mean.n else ""


def answer_tables(
    results: Results, target: str | None = None, over: str | None = None
) -> list[RenderableType]:
    """Return the answer to the question of a target, the values behind it, and the commands that would narrow it; nothing without one."""
    answers = results.answers(target, over)
    if answers is None:
        return []
    names = list(answers.answers[0].values)
    head = [
        *names,
        *([answers.over.name] if answers.over else []),
        "games",
        answers.title,
        "95 % interval",
        "target",
    ]
    rows = []
    for answer in answers.answers:
        for level in answer.levels:
            mean, _, interval = estimate_text(level).partition(" (")
            style = "green" if level is answer.smallest else "dim" if level.state == "missed" else ""
            cells = [*map(written, answer.values.values()), *([level.text] if answers.over else [])]
            rows.append((style, [*cells, f"{level.n:,}", mean, interval.removesuffix(")"), level.state]))
    held = "the intervals of a choice hold together, and whenever one stops, with 95 % (confidence sequences, Bonferroni)"
    found: list[RenderableType] = [indented(Text(s, "bold")) for s in answers.sentences()]
    found += [
        *number_tables(head, rows),
        *(indented(Text(note, "dim italic")) for note in (held, *answers.notes)),
    ]
    for what, command in further_runs(answers, results.info, results.path):
        found += [indented(Text(f"{what}:", "dim")), Text(f" {command}", no_wrap=True)]
    return found


def point_tables(results: Results) -> list[Padding]:
    """Return one line per point: its values, who won how often there, and the leading quantities, without scores where somebody wins."""
    shares = results.shares()
    has_winner = any(share.n for share in shares if share.team is not None)
    winners = [share for share in shares if share.n and has_winner]
    teams = [share.team for share in winners]
    names = [n for n in results.defaults.leading if not (winners and n.startswith("score["))]
    means = {name: results.means_by_point(name) for name in names}
    head = ["point", *short_names(results.variables), *(f"{share.name} won, %" for share in winners)]
    head += map(results.title, means)
    rows = [
        (
            "",
            [
                str(point),
                *map(written, values.values()),
                *(_share(share) for share in results.shares(point) if share.team in teams),
                *(
                    estimate(m[point].value, m[point].low, m[point].high) if m[point].n else ""
                    for m in means.values()
                ),
            ],
        )
        for point, values in list(enumerate(results.points))[:MAX_POINTS]
    ]
    if len(results.points) > MAX_POINTS:
        more = f"and {len(results.points) - MAX_POINTS:,} more"
        rows.append(("dim", [more, *[""] * (len(head) - 1)]))
    return number_tables(head, rows)
