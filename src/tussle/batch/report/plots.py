"""Plots of what came out: who won, by how much, how scores spread, how long games took, who was left when.

Each takes plain numbers and gives a figure; `house_style` is to be around them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.batch.report.drawing import INK, MUTED, PAPER, blank, legend_above, rule_x, rule_y, shortened
from tussle.batch.report.words import estimate, percent

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROW = 0.34
"""Height of a row of a plot whose rows have names [inch]."""

END_COLOURS = {"time": "#8d97a3", "one_team": "#4a78a8", "all_dead": "#b5894b"}
"""Shades for why games ended; no team has them."""
END_WORDS = {
    "time": "the end time was reached",
    "one_team": "one team was left",
    "all_dead": "nobody was left",
}


@dataclass(frozen=True)
class Bar:
    """A share with its interval, as one row.

    Args:
        name: Of the row.
        colour: Of the bar.
        share: What it shows, from 0 to 1.
        low: Lower end of the interval.
        high: Upper end.
        text: What stands beside it.
    """

    name: str
    colour: str
    share: float
    low: float
    high: float
    text: str


@dataclass(frozen=True)
class Spread:
    """Values of one quantity, one per run.

    Args:
        name: Of the row.
        colour: Of the bars.
        values: The values, (n,).
    """

    name: str
    colour: str
    values: np.ndarray


@dataclass(frozen=True)
class Curve:
    """A mean over time with its interval.

    Args:
        name: Of the line.
        colour: Of the line.
        dashes: How it is drawn, as Matplotlib says it: "-", "--", ...
        t: Times [s], (n,).
        mean: Mean at these times, (n,).
        low: Lower end, (n,).
        high: Upper end, (n,).
    """

    name: str
    colour: str
    dashes: str
    t: np.ndarray
    mean: np.ndarray
    low: np.ndarray
    high: np.ndarray


def share_bars(bars: Sequence[Bar]) -> Figure:
    """Shares as horizontal bars with thin intervals, and what there is to say to the right of them."""
    figure, axes = blank(0.55 + ROW * len(bars))
    (plot,) = axes.flat
    rows = np.arange(len(bars))[::-1]
    plot.barh(rows, [b.share for b in bars], height=0.62, color=[b.colour for b in bars])
    for row, bar in zip(rows, bars, strict=True):
        plot.plot([bar.low, bar.high], [row, row], color=PAPER, linewidth=3.0, solid_capstyle="butt")
        plot.plot([bar.low, bar.high], [row, row], color=INK, linewidth=1.1, solid_capstyle="butt")
        plot.text(1.02, row, bar.text, va="center", transform=plot.get_yaxis_transform())
    _name_rows(plot, rows, [b.name for b in bars])
    _shares(plot.xaxis)
    plot.set_xlim(0.0, _round_share(max(b.high for b in bars)))
    plot.set_xlabel("share of the games")
    rule_x(plot)
    return figure


def stacked_shares(names: Sequence[str], parts: Sequence[tuple[str, str, np.ndarray]]) -> Figure:
    """Each row a whole, divided.

    Args:
        names: Names of the rows.
        parts: Name, colour and shares (n_rows,) of each part, from left to right.
    """
    figure, axes = blank(0.8 + 0.24 * len(names))
    (plot,) = axes.flat
    rows = np.arange(len(names))[::-1]
    left = np.zeros(len(names))
    handles = []
    for name, colour, shares in parts:
        bars = plot.barh(rows, shares, left=left, height=0.72, color=colour, edgecolor=PAPER, linewidth=0.5)
        handles.append((bars[0], name))
        left = left + shares
    _name_rows(plot, rows, names)
    _shares(plot.xaxis)
    plot.set_xlim(0.0, 1.0)
    plot.set_xlabel("share of the games")
    rule_x(plot)
    legend_above(figure, handles)
    return figure


def distributions(spreads: Sequence[Spread], label: str) -> Figure:
    """Histograms one below the other on the same axis; a dot for the mean, a line for the middle half of the games."""
    figure, axes = blank(0.5 + 0.72 * len(spreads), len(spreads), sharex=True, gridspec_kw={"hspace": 0.05})
    edges = edges_for(inside(np.concatenate([s.values for s in spreads])))
    tallest = max(np.histogram(s.values, edges)[0].max() for s in spreads)
    for plot, spread in zip(axes.flat, spreads, strict=True):
        counts = np.histogram(spread.values, edges)[0]
        plot.stairs(counts, edges, fill=True, color=spread.colour, alpha=0.75, linewidth=0)
        quarter, three = np.quantile(spread.values, [0.25, 0.75])
        below = -0.14 * tallest
        plot.plot([quarter, three], [below, below], color=spread.colour, linewidth=2.4, solid_capstyle="butt")
        plot.plot([spread.values.mean()], [below], "o", color=INK, markersize=3.6, markeredgecolor=PAPER)
        plot.set_ylim(-0.26 * tallest, 1.05 * tallest)
        plot.set_yticks([])
        plot.spines["left"].set_visible(False)
        plot.grid(True, axis="x")
        plot.set_ylabel(shortened(spread.name, 16), rotation=0, ha="right", va="center")
        told = f"mean {estimate(spread.values.mean())}"
        if len(spread.values) > 1:
            told += f"\nsd {estimate(spread.values.std(ddof=1))}"
        plot.text(1.02, 0.5, told, va="center", transform=plot.transAxes, fontsize=8, linespacing=1.4)
    axes[-1, 0].set_xlabel(label)
    return figure


def margins(values: np.ndarray, first: tuple[str, str], second: tuple[str, str], label: str) -> Figure:
    """Histogram of a difference, its two sides in the colours of who was ahead.

    Args:
        values: Second minus first, (n,).
        first: Name and colour of the side that leads where it is negative.
        second: Name and colour of the other.
        label: Of the axis.
    """
    figure, axes = blank(2.5)
    (plot,) = axes.flat
    edges = edges_for(inside(values), is_about_zero=True)
    counts = np.histogram(values, edges)[0]
    centre = (edges[1:] + edges[:-1]) / 2.0
    is_middle = (edges[:-1] < 0.0) & (edges[1:] > 0.0)
    colours = np.where(centre < 0.0, first[1], second[1]).astype(object)
    colours[is_middle] = END_COLOURS["time"]
    plot.bar(centre, counts, width=np.diff(edges), color=list(colours), edgecolor=PAPER, linewidth=0.3)
    plot.axvline(values.mean(), color=INK, linewidth=1.0)
    plot.set_ylabel("games")
    plot.set_xlabel(label)
    for (name, colour), x, side in ((first, 0.0, "left"), (second, 1.0, "right")):
        mark = f"◂ {shortened(name, 16)} ahead" if side == "left" else f"{shortened(name, 16)} ahead ▸"
        plot.text(x, 1.03, mark, ha=side, va="bottom", color=colour, transform=plot.transAxes)
    rule_y(plot)
    return figure


def lengths(ends: Mapping[str, np.ndarray]) -> Figure:
    """When games ended, stacked by why.

    Args:
        ends: Times [s] of the games that ended for each reason.
    """
    figure, axes = blank(2.4)
    (plot,) = axes.flat
    edges = edges_for(np.concatenate(list(ends.values())), fewest=20)
    base = np.zeros(len(edges) - 1)
    handles = []
    for end, t in ends.items():
        counts = np.histogram(t, edges)[0]
        colour = END_COLOURS.get(end, MUTED)
        patch = plot.stairs(base + counts, edges, baseline=base, fill=True, color=colour, linewidth=0)
        handles.append((patch, f"{END_WORDS.get(end, end)} ({len(t):,})"))
        base = base + counts
    plot.set_xlabel("length of the game [s]")
    plot.set_ylabel("games")
    rule_y(plot)
    legend_above(figure, handles)
    return figure


def curves_over_time(curves: Sequence[Curve], label: str) -> Figure:
    """Means over time, each with its interval as a band."""
    figure, axes = blank(2.7)
    (plot,) = axes.flat
    handles = []
    for curve in curves:
        plot.fill_between(curve.t, curve.low, curve.high, color=curve.colour, alpha=0.22, linewidth=0)
        (line,) = plot.plot(curve.t, curve.mean, color=curve.colour, linestyle=curve.dashes)
        handles.append((line, curve.name))
    plot.set_xlim(min(c.t[0] for c in curves), max(c.t[-1] for c in curves))
    plot.set_ylim(bottom=0.0)
    plot.set_xlabel("time [s]")
    plot.set_ylabel(label)
    rule_y(plot)
    legend_above(figure, handles)
    return figure


def inside(values: np.ndarray) -> np.ndarray:
    """Values without the few, one in a hundred at each end at the most, that would press all others into a corner.

    They are left out where the axis would be more than twice as long with them.
    """
    low, high = np.quantile(values, [0.01, 0.99])
    span = max(float(high - low), 1e-300)
    if values.max() - high <= span and low - values.min() <= span:
        return values
    return np.asarray(values[(values >= low - span) & (values <= high + span)])


def edges_for(values: np.ndarray, *, fewest: int = 8, is_about_zero: bool = False) -> np.ndarray:
    """Ends of the bins of a histogram: the width by Freedman and Diaconis (1981), whole numbers for whole numbers.

    Args:
        values: What is counted, (n,).
        fewest: Number of bins that there are at least, unless the values are whole numbers.
        is_about_zero: One bin lies about 0, so that what is positive and what is negative fall apart.
    """
    low, high = float(values.min()), float(values.max())
    spread = float(np.subtract(*np.quantile(values, [0.75, 0.25])))
    width = 2.0 * spread / len(values) ** (1.0 / 3.0)
    span = high - low
    if not 0.0 < span / 50.0 < math.inf:
        return np.array([low - 0.5, low + 0.5])
    is_whole = bool(np.all(values == np.round(values)))
    width = min(max(width, span / 50.0), span / fewest)
    if is_whole:
        width = max(float(np.round(width)), 1.0)
        if is_about_zero and width % 2.0 == 0.0:
            width += 1.0  # the bin about 0 takes as many from both sides
    if is_about_zero:
        below, above = np.ceil(max(-low, 0.0) / width - 0.5), np.ceil(max(high, 0.0) / width - 0.5)
        return np.asarray((np.arange(-max(below, 0.0), max(above, 0.0) + 2.0) - 0.5) * width)
    start = low - 0.5 if is_whole else low
    n_bins = int(np.ceil((high - start + (0.5 if is_whole else 0.0)) / width - 1e-9))
    return np.asarray(start + width * np.arange(n_bins + 1))


def _name_rows(plot: Axes, rows: Any, names: Sequence[str]) -> None:
    plot.set_yticks(rows, [shortened(name) for name in names])
    plot.set_ylim(-0.6, len(names) - 0.4)


def _shares(axis: Any) -> None:
    axis.set_major_formatter(lambda x, _: percent(x, 0))


def _round_share(largest: float) -> float:
    """The next tenth above a share, but 1 at the most."""
    return min(max(math.ceil(largest * 10.0 + 0.2) / 10.0, 0.1), 1.0)
