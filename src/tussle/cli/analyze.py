"""`tussle analyze` and `tussle report`: the results of a batch, as tables on the terminal, as JSON or as a page."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence

import typer
from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text

from tussle.batch.analysis import Analysis, PointResult, analyse
from tussle.batch.reload import load_batch
from tussle.batch.selection import written
from tussle.batch.sensitivity import Effect
from tussle.batch.statistics import PairedComparison, Share
from tussle.batch.variables import Range, Variable
from tussle.cli.batch import answer_tables, short_names
from tussle.cli.batch_options import AnalyzeOptions, ReportOptions
from tussle.cli.operators import analyze_operators, is_folder_of_runs
from tussle.cli.orders import analyze_run, is_run
from tussle.cli.progress import home_short
from tussle.cli.tables import Cell, Row, indented, number_tables, title
from tussle.cli.terminal import out, put, say_note
from tussle.declare.displays import decimals
from tussle.errors import ParameterError

MAX_POINTS = 20
MAX_FAILURES = 10
BAR = 20  # characters for a share of 1


def report(options: ReportOptions) -> None:
    """Write the report of a batch, and print its place."""
    from tussle.batch.report import write_report

    directory = options.directory or options.batch / "report"
    written_report = write_report(
        load_batch(options.batch), directory, options.quantities, options.target, options.over
    )
    for note in written_report.notes:
        say_note(note)
    n = len(written_report.plots)
    plots = "1 plot" if n == 1 else f"{n} plots"
    out().print(
        f"{home_short(written_report.index)} ({plots}, each also as SVG and PNG file)", soft_wrap=True
    )


def analyze(options: AnalyzeOptions) -> None:
    """Print the analysis of a batch, the result of a recorded run and the orders in it, or the operators of several.

    Raises:
        BatchError: The directory holds no batch.
        RecordError: A run cannot be read.
        ParameterError: There is no such quantity or point, an option is for batches, or directories cannot be compared.
    """
    directory = options.directories[0]
    are_several = len(options.directories) > 1 or is_folder_of_runs(directory)
    if are_several or is_run(directory):
        of_batches = {
            "--quantity": options.quantities and not are_several,
            "--compare": options.compare,
            "--target": options.target,
            "--over": options.over,
            "--by-point": options.by_point,
        }
        if given := [name for name, value in of_batches.items() if value]:
            what = "and the others are recorded runs" if are_several else "is a recorded run"
            raise ParameterError(f"{directory} {what}, and {given[0]} is for batches")
        if are_several:
            analyze_operators(options.directories, options.quantities, options.as_json)
        else:
            analyze_run(directory, options.as_json)
        return
    compare = [options.compare] if options.compare else []
    results = load_batch(directory)
    found = analyse(results, options.quantities, compare)
    if options.as_json:
        answers = results.answers(options.target, options.over)
        target = {} if answers is None else {"target": answers.as_dict()}
        typer.echo(json.dumps(found.as_dict() | target, indent=1, allow_nan=False))
        return
    heading, *parts = _parts(found, options.by_point)
    put("", heading, *answer_tables(results, options.target, options.over), *parts, "")
    for note in found.notes:
        say_note(note)


def _parts(found: Analysis, shows_all_points: bool) -> Iterable[RenderableType]:
    n_runs = f"{found.n_runs:,}" + (f" of {found.n_planned:,}" if found.n_runs != found.n_planned else "")
    facts = [
        f"{n_runs} runs",
        f"{found.n_points:,} points × {found.n_seeds:,} seeds" if found.n_points > 1 else "",
        f"{found.n_failed:,} failed" if found.n_failed else "",
        f"ended by {found.stopped_by}" if found.stopped_by else "",
    ]
    yield title(found.name, " · ".join(filter(None, facts)), found.path)
    over = f"over all {found.n_points:,} points" if found.n_points > 1 else ""
    if found.shares:
        yield _heading("who won", over)
        yield from _shares(found.shares)
    if any(mean.n for mean in found.means):
        yield _heading("means", f"{over}; sd: of the runs of a point" if over else "")
        yield from _means(found)
    if found.points:
        won = "games won in %, " if _winners(found) else ""
        yield _heading("points", f"{won}means ± half of their intervals")
        yield from _points(found, shows_all_points)
    for pairs in _by_quantity(found.comparisons):
        quantity = found.titles.get(pairs[0].quantity, pairs[0].quantity)
        yield _heading("compared", f"{quantity} against {pairs[0].a}, paired by {found.paired_by}")
        yield from _comparisons(pairs)
    for name, effects in found.sensitivity.items():
        yield _heading(f"what {found.titles.get(name, name)} depends on")
        yield from _effects(effects, found.variables)
    if found.failures:
        yield _heading("failed", f"{found.n_failed:,} runs, not counted above")
        yield from _failures(found)


def _heading(text: str, remark: str = "") -> Padding:
    return indented(Text.assemble((text, "bold cyan"), (f"  {remark}" if remark else "", "dim")))


def _shares(shares: Sequence[Share]) -> Iterable[RenderableType]:
    best = max((share.n for share in shares if share.team is not None), default=0)
    rows: list[Row] = []
    for share in shares:
        is_best = share.team is not None and share.n == best > 0
        name = share.name if share.team is None else f"{share.team} {share.name}"
        bar = "█" * round(BAR * share.value) if share.of else ""
        interval = _interval(100.0 * share.low, 100.0 * share.high, 1)
        value = f"{100.0 * share.value:.1f} %" if math.isfinite(share.value) else ""
        cells: list[Cell] = [
            name,
            f"{share.n:,}",
            f"{share.of:,}",
            value,
            interval,
            Text(bar, justify="left"),
        ]
        rows.append(("green" if is_best else "" if share.team is not None else "dim", cells))
    return number_tables(["", "won", "of", "share", "95 % interval", ""], rows)


def _means(found: Analysis) -> Iterable[RenderableType]:
    """Return means with their intervals; with points their extremes, else the quantiles of the runs; games, where some have no value."""
    rows: list[Row] = []
    lacks = any(mean.n < found.n_runs - found.n_failed for mean in found.means)
    for mean in found.means:
        digits = _digits(mean.high - mean.low, mean.value)
        metric, _, team = found.titles[mean.name].partition(" of ")
        is_of_team = team and mean.name == f"{metric}[{mean.name.rpartition('[')[2]}"
        cells: list[Cell] = [
            Text.assemble(mean.name, (f" {team}" if is_of_team else "", "dim")),
            _number(mean.value, digits),
            _interval(mean.low, mean.high, digits) if mean.high > mean.low else "",
        ]
        if found.points:
            of_points = [m for point in found.points for m in point.means if m.name == mean.name and m.n]
            spread = [m.sd**2 for m in of_points if m.n > 1]
            sd = math.sqrt(sum(spread) / len(spread)) if spread else math.nan
            extremes = [m.value for m in of_points] or [math.nan]
            numbers = (sd, min(extremes), max(extremes))
            cells += [_number(number, digits) for number in numbers]
        else:
            cells.append(_number(mean.sd, digits))
            values = (mean.quantiles[q] for q in (0.05, 0.5, 0.95))
            cells += [f"{value:.4g}" if math.isfinite(value) else "" for value in values]
        rows.append(("", [*cells, f"{mean.n:,}"] if lacks else cells))
    more = ["lowest point", "highest point"] if found.points else ["q 5 %", "median", "q 95 %"]
    return number_tables(["", "mean", "95 % interval", "sd", *more, *(["games"] if lacks else [])], rows)


# -- points -----------------------------------------------------------------------------------------------------------------


def _points(found: Analysis, shows_all: bool) -> Iterable[RenderableType]:
    winners = _winners(found)
    names = [mean.name for mean in found.points[0].means]
    units = [v.unit if isinstance(v, Range) else "" for v in found.variables]
    variables = [
        f"{name}\n[{unit}]" if unit else name
        for name, unit in zip(short_names(found.variables), units, strict=True)
    ]
    head = [
        "point",
        *variables,
        *(f"{name}\n%" for name in winners),
        *(found.titles.get(n, n).replace(" of ", "\nof ") for n in names),
    ]
    shown, n_between = _selected(found.points, shows_all)
    rows: list[Row] = [
        ("", [str(p.point), *map(written, p.values.values()), *_point_cells(p, winners)]) for p in shown
    ]
    if n_between:
        rows.insert(MAX_POINTS // 2, ("dim", ["...", *[""] * (len(head) - 1)]))
    yield from number_tables(head, rows)
    if n_between:
        text = f"{n_between:,} points between the highest and the lowest {names[0]} are left out; --by-point shows all"
        yield indented(Text(text, "dim"))


def _winners(found: Analysis) -> list[str]:
    """Return the teams that won, and ties; nothing if nobody won."""
    has_winner = any(share.n for share in found.shares if share.team is not None)
    return [share.name for share in found.shares if share.n and has_winner]


def _selected(points: Sequence[PointResult], shows_all: bool) -> tuple[Sequence[PointResult], int]:
    """Return the points to show, and how many lie between their two halves."""
    if shows_all or len(points) <= MAX_POINTS:
        return points, 0
    known = sorted((p for p in points if p.means[0].n), key=lambda p: -p.means[0].value)
    n_between = max(len(known) - MAX_POINTS, 0)
    return (known[: MAX_POINTS // 2] + known[-MAX_POINTS // 2 :] if n_between else known), n_between


def _point_cells(point: PointResult, winners: Sequence[str]) -> Iterable[str]:
    shares = {share.name: share for share in point.shares}
    for share in (shares[name] for name in winners):
        ends = f" ({100.0 * share.low:.0f}–{100.0 * share.high:.0f})"
        yield f"{100.0 * share.value:.0f}{ends}" if share.of else ""
    for mean in point.means:
        half = (mean.high - mean.low) / 2.0
        digits = _digits(2.0 * half, mean.value)
        value = _number(mean.value, digits)
        yield f"{value} ±{_number(half, digits)}" if half > 0.0 else value


# -- differences ------------------------------------------------------------------------------------------------------------


def _by_quantity(comparisons: Sequence[PairedComparison]) -> list[list[PairedComparison]]:
    """Group comparisons by quantity and reference."""
    found: dict[tuple[str, str], list[PairedComparison]] = {}
    for comparison in comparisons:
        found.setdefault((comparison.quantity, comparison.a), []).append(comparison)
    return list(found.values())


def _comparisons(pairs: Sequence[PairedComparison]) -> Iterable[RenderableType]:
    rows: list[Row] = []
    for c in pairs:
        digits = _digits(c.high - c.low, c.difference)
        p = "" if not c.n else f"{c.p:.3f}" if c.p >= 0.001 else "< 0.001"
        counts = (f"{n:,}" for n in (c.n_greater, c.n_less, c.n_equal))
        rows.append(
            ("", [c.b, _number(c.difference, digits, "+"), _interval(c.low, c.high, digits), *counts, p])
        )
    return number_tables(["", "difference", "95 % interval", "more", "less", "equal", "p (signs)"], rows)


def _effects(effects: Sequence[Effect], variables: Sequence[Variable]) -> Iterable[RenderableType]:
    short = dict(zip((v.name for v in variables), short_names(variables), strict=True))
    rows: list[Row] = [
        (
            "",
            [
                short.get(e.variable, e.variable),
                _estimate(e.rank_correlation, e.rank_low, e.rank_high, "+"),
                _estimate(e.first_order, e.first_low, e.first_high),
                _estimate(e.total, e.total_low, e.total_high),
            ],
        )
        for e in effects
    ]
    yield from number_tables(["", "rank correlation", "first order", "total"], rows)
    notes = dict.fromkeys(part for e in effects for part in e.note.split("; "))
    yield indented(Text("\n".join(notes), "dim"))


def _estimate(value: float | None, low: float | None, high: float | None, sign: str = "") -> str:
    """Format a number between -1 and 1 with its interval: "0.80 [0.70, 0.90]"."""
    if low is None or high is None or math.isnan(low):
        return _number(value, 2, sign)
    return f"{_number(value, 2, sign)} [{low:z.2f}, {high:z.2f}]"


def _failures(found: Analysis) -> Iterable[RenderableType]:
    rows: list[Row] = []
    for failure in found.failures[:MAX_FAILURES]:
        where = f" ({failure.point})" if failure.point else ""
        cells = [f"{failure.error}{where}", f"{failure.n:,}", f"{failure.run:,}", str(failure.seed)]
        rows.append(("red", cells))
    if len(found.failures) > MAX_FAILURES:
        rows.append(("dim", [f"and {len(found.failures) - MAX_FAILURES:,} others", "", "", ""]))
    return number_tables(["error", "runs", "first", "its seed"], rows)


# -- numbers ----------------------------------------------------------------------------------------------------------------


def _digits(width: float, value: float) -> int:
    """Return significant decimals: two digits of the width of an interval, or four of the value if the width is not known."""
    if math.isfinite(width) and width > 0.0:
        return max(1 - math.floor(math.log10(width)), 0)
    if not math.isfinite(value) or value == 0.0 or float(value).is_integer():
        return 0
    return max(3 - math.floor(math.log10(abs(value))), 0)


def _number(value: float | None, digits: int, sign: str = "") -> str:
    return "" if value is None or not math.isfinite(value) else decimals(value, digits, sign)


def _interval(low: float, high: float, digits: int) -> str:
    if not (math.isfinite(low) and math.isfinite(high)):
        return ""
    return f"{decimals(low, digits)} – {decimals(high, digits)}"
