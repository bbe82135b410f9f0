"""What came of a batch, as tables on the terminal or as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from pathlib import Path

import typer
from rich import box
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from tussle.batch.analysis import Analysis, PointResult, analyse
from tussle.batch.reload import load_batch
from tussle.batch.selection import written
from tussle.batch.sensitivity import Effect
from tussle.batch.statistics import Comparison, Share
from tussle.batch.variables import Range, Variable
from tussle.cli.terminal import put, say_note

MOST_POINTS = 20
MOST_FAILURES = 10
POINTS_REMARK = "games won in %, means ± half of their intervals"
BAR = 20  # characters for a share of 1


def show_analysis(
    path: Path,
    quantities: Sequence[str],
    compare: Sequence[tuple[str, str]],
    shows_all_points: bool,
    is_json: bool,
) -> None:
    """Print what came of a batch.

    Args:
        path: The batch directory.
        quantities: What to look at; empty for the usual.
        compare: Points or values to be compared.
        shows_all_points: However many there are.
        is_json: For programs.

    Raises:
        BatchError: There is no batch there.
        ParameterError: There is no such quantity or point.
    """
    found = analyse(load_batch(path), quantities, compare)
    if is_json:
        typer.echo(json.dumps(found.as_dict(), indent=1, allow_nan=False))
        return
    parts: list[RenderableType] = [_head(found)]
    if found.shares:
        parts += [_title("who won", _over(found)), _shares(found.shares)]
    if any(mean.n for mean in found.means):
        parts += [_title("means", _over(found)), _means(found)]
    if found.points:
        parts += [_title("points", POINTS_REMARK), *_points(found, shows_all_points)]
    for pairs in _by_quantity(found.comparisons):
        what = f"{found.titles.get(pairs[0].quantity, pairs[0].quantity)} against {pairs[0].a}"
        parts += [
            _title("compared", f"{what}, paired by {found.paired_by}; p by signs"),
            _comparisons(pairs),
        ]
    for quantity, effects in found.sensitivity.items():
        parts += [
            _title(f"what matters for {found.titles.get(quantity, quantity)}"),
            *_effects(effects, found.variables),
        ]
    if found.failures:
        parts += [_title("failed", f"{found.n_failed:,} runs, in none of the above"), _failures(found)]
    put("", *parts)
    for note in found.notes:
        say_note(note)


def _title(text: str, remark: str = "") -> Text:
    return Text.assemble(" ", (text, "bold cyan"), (f"  {remark}" if remark else "", "dim"))


def _table(first: str, *numbers: str) -> Table:
    """A first column of words, then columns of numbers."""
    made = Table(box=box.SIMPLE_HEAD, header_style="bold", pad_edge=False, padding=(0, 1))
    made.add_column(f" {first}".rstrip(), overflow="fold")
    for name in numbers:
        made.add_column(name, justify="right", no_wrap=True)
    return made


def _head(found: Analysis) -> Text:
    n_done = (
        f"{found.n_runs:,}" if found.n_runs == found.n_planned else f"{found.n_runs:,} of {found.n_planned:,}"
    )
    parts = [f"{n_done} runs"]
    if found.n_points > 1:
        parts.append(f"{found.n_points:,} points × {found.n_seeds:,} seeds")
    if found.n_failed:
        parts.append(f"{found.n_failed:,} failed")
    if found.stopped_by:
        parts.append(f"ended by {found.stopped_by}")
    return Text.assemble(" ", (found.name, "bold"), (f"\n {' · '.join(parts)}\n {found.path}\n", "dim"))


def _over(found: Analysis) -> str:
    return f"over all {found.n_points:,} points" if found.n_points > 1 else ""


def _shares(shares: Sequence[Share]) -> Table:
    table = _table("", "won", "of", "share", "95 % interval")
    table.add_column("")
    best = max((share.n for share in shares if share.team is not None), default=0)
    for share in shares:
        is_best = share.team is not None and share.n == best > 0
        bar = "█" * round(BAR * share.value) if share.of else ""
        name = share.name if share.team is None else f"{share.team} {share.name}"
        table.add_row(
            Text(f" {name}"), f"{share.n:,}", f"{share.of:,}", _percent(share.value),
            _interval(100.0 * share.low, 100.0 * share.high, 1), bar,
            style="green" if is_best else "" if share.team is not None else "dim",
        )  # fmt: skip
    return table


def _named(quantity: str, found: Analysis) -> Text:
    """A quantity as it is asked for, and whose it is."""
    metric, _, team = found.titles[quantity].partition(" of ")
    whose = f" {team}" if team and quantity == f"{metric}[{quantity.rpartition('[')[2]}" else ""
    return Text.assemble(f" {quantity}", (whose, "dim"))


def _means(found: Analysis) -> Table:
    table = _table("", "mean", "95 % interval", "sd", "q 5 %", "median", "q 95 %")
    for mean in found.means:
        digits = _digits(mean.high - mean.low, mean.value)
        values = (mean.quantiles[q] for q in (0.05, 0.5, 0.95))
        table.add_row(
            _named(mean.name, found), _number(mean.value, digits),
            _interval(mean.low, mean.high, digits) if mean.sd > 0.0 else "", _number(mean.sd, digits),
            *(f"{value:.4g}" if math.isfinite(value) else "" for value in values),
        )  # fmt: skip
    return table


# -- points ---------------------------------------------------------------------------------------------------------------


WIDEST_VALUE = 11
"""Values of variables up to this long are not folded."""


def _points(found: Analysis, shows_all: bool) -> Iterable[RenderableType]:
    winners = [share.name for share in found.shares if share.n]
    names = [mean.name for mean in found.points[0].means]
    heads = [
        *_with_units(_short(found.variables), found.variables),
        *(f"{name}\n%" for name in winners),
        *(found.titles.get(n, n) for n in names),
    ]
    table = Table(box=box.SIMPLE_HEAD, header_style="bold", pad_edge=False, padding=(0, 1))
    rows, n_between = _chosen(found.points, shows_all)
    for head in [" point", *heads]:
        column = len(table.columns) - 1
        texts = (
            [written(list(point.values.values())[column]) for point in rows]
            if 0 <= column < len(found.variables)
            else []
        )
        # Words stay whole where there is room for them.
        table.add_column(
            Text(head),
            justify="right",
            overflow="fold",
            min_width=min(WIDEST_VALUE, max(map(len, texts), default=1)),
        )
    for i, point in enumerate(rows):
        if n_between and i == MOST_POINTS // 2:
            table.add_row(" ...", style="dim")
        table.add_row(
            f" {point.point}", *(Text(written(v)) for v in point.values.values()), *_cells(point, winners)
        )
    yield table
    if n_between:
        yield Text(
            f" {n_between:,} points between the highest and the lowest {names[0]} are left out; --by-point shows all\n",
            "dim",
        )


def _chosen(points: Sequence[PointResult], shows_all: bool) -> tuple[Sequence[PointResult], int]:
    """The points to be shown, and how many lie between their two halves."""
    if shows_all or len(points) <= MOST_POINTS:
        return points, 0
    known = sorted((p for p in points if p.means[0].n), key=lambda p: -p.means[0].value)
    n_between = len(known) - MOST_POINTS
    return (
        (known, 0) if n_between <= 0 else (known[: MOST_POINTS // 2] + known[-MOST_POINTS // 2 :], n_between)
    )


def _short(variables: Sequence[Variable]) -> list[str]:
    """The last part of each path, where that is enough to tell them apart."""
    last = [v.name.rpartition(".")[2] for v in variables]
    return last if len(set(last)) == len(variables) else [v.name for v in variables]


def _with_units(names: Sequence[str], variables: Sequence[Variable]) -> list[str]:
    """Names with the units of their variables under them."""
    units = [v.unit if isinstance(v, Range) else "" for v in variables]
    return [f"{name}\n[{unit}]" if unit else name for name, unit in zip(names, units, strict=True)]


def _cells(point: PointResult, winners: Sequence[str]) -> Iterable[str]:
    shares = {share.name: share for share in point.shares}
    for name in winners:
        share = shares[name]
        ends = f" ({100.0 * share.low:.0f}–{100.0 * share.high:.0f})"
        yield f"{100.0 * share.value:.0f}{ends}" if share.of else ""
    for mean in point.means:
        half = (mean.high - mean.low) / 2.0
        digits = _digits(2.0 * half, mean.value)
        value = _number(mean.value, digits)
        yield f"{value} ±{_number(half, digits)}" if half > 0.0 else value


# -- differences ----------------------------------------------------------------------------------------------------------


def _by_quantity(comparisons: Sequence[Comparison]) -> list[list[Comparison]]:
    """Comparisons of one quantity with one thing, together."""
    found: dict[tuple[str, str], list[Comparison]] = {}
    for comparison in comparisons:
        found.setdefault((comparison.quantity, comparison.a), []).append(comparison)
    return list(found.values())


def _comparisons(pairs: Sequence[Comparison]) -> Table:
    table = _table("", "difference", "95 % interval", "more", "less", "equal", "p")
    for c in pairs:
        digits = _digits(c.high - c.low, c.difference)
        table.add_row(
            Text(f" {c.b}"), _number(c.difference, digits, "+"), _interval(c.low, c.high, digits),
            f"{c.n_greater:,}", f"{c.n_less:,}", f"{c.n_equal:,}", _probability(c.p) if c.n else "",
        )  # fmt: skip
    return table


def _effects(effects: Sequence[Effect], variables: Sequence[Variable]) -> Iterable[RenderableType]:
    table = _table("", "rank correlation", "first order", "total")
    short = dict(zip((v.name for v in variables), _short(variables), strict=True))
    for e in effects:
        table.add_row(
            Text(f" {short.get(e.variable, e.variable)}"), Text(_estimate(e.rank_correlation, e.rank_low, e.rank_high, "+")),
            Text(_estimate(e.first_order, e.first_low, e.first_high)), Text(_estimate(e.total, e.total_low, e.total_high)),
        )  # fmt: skip
    yield table
    notes = dict.fromkeys(part for e in effects for part in e.note.split("; "))
    yield Text("".join(f" {note}\n" for note in notes), "dim")


def _estimate(value: float | None, low: float | None, high: float | None, sign: str = "") -> str:
    """A number between -1 and 1 with its interval: "0.80 [0.70, 0.90]"."""
    if low is None or high is None or math.isnan(low):
        return _number(value, 2, sign)
    return f"{_number(value, 2, sign)} [{low:z.2f}, {high:z.2f}]"


def _failures(found: Analysis) -> Table:
    table = _table("error", "runs", "first", "its seed")
    for failure in found.failures[:MOST_FAILURES]:
        where = f" ({failure.point})" if failure.point else ""
        table.add_row(
            Text(f" {failure.error}{where}"),
            f"{failure.n:,}",
            f"{failure.run:,}",
            str(failure.seed),
            style="red",
        )
    if len(found.failures) > MOST_FAILURES:
        table.add_row(Text(f" and {len(found.failures) - MOST_FAILURES:,} others", "dim"))
    return table


# -- numbers --------------------------------------------------------------------------------------------------------------


def _digits(width: float, value: float) -> int:
    """Decimals that count: two digits of the width of an interval; where that is not known, four of the value."""
    if math.isfinite(width) and width > 0.0:
        return min(max(1 - math.floor(math.log10(width)), 0), 9)
    if not math.isfinite(value) or value == 0.0:
        return 0
    return 0 if float(value).is_integer() else min(max(3 - math.floor(math.log10(abs(value))), 0), 9)


def _number(value: float | None, digits: int, sign: str = "") -> str:
    return "" if value is None or not math.isfinite(value) else f"{value:{sign}z,.{digits}f}"


def _interval(low: float | None, high: float | None, digits: int) -> str:
    if low is None or high is None or not (math.isfinite(low) and math.isfinite(high)):
        return ""
    return f"{low:z,.{digits}f} – {high:z,.{digits}f}"


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %" if math.isfinite(share) else ""


def _probability(p: float) -> str:
    return f"{p:.3f}" if p >= 0.001 else "< 0.001"
