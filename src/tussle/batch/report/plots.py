"""The plots of a report. Each function takes numbers and returns a figure; `house_style` must be around the calls."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.batch.report.drawing import blank, legend_above, rule_x, rule_y, shortened
from tussle.batch.report.formatting import estimate, percent
from tussle.palette import INK, MUTED, NEUTRAL, PAPER, SEQUENTIAL, mixed
from tussle.record.event_texts import end_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from tussle.batch.response import FittedVariable
    from tussle.batch.sensitivity import Effect
    from tussle.batch.statistics import Share

MAX_TICKS = 8
"""Largest number of values that are all written at an axis."""
END_COLOURS = dict(zip(("time", "one_team", "all_dead"), NEUTRAL, strict=True))
"""Colours of the reasons for which games end."""
Limits = tuple[float, float] | None
"""Ends of an axis of values; None to fit the values."""


@dataclass(frozen=True)
class Series:
    """Values with intervals, with a colour and a marker.

    Args:
        name: Name of the series.
        colour: Colour of its marks or its line.
        marker: Matplotlib's marker, or its line style.
        mean: The values, (n,); NaN if unknown.
        low: Lower ends of the intervals, (n,); NaN if unknown.
        high: Upper ends, (n,).
        x: Positions of the values, (n,); None if all series share them.
    """

    name: str
    colour: str
    marker: Any
    mean: np.ndarray
    low: np.ndarray
    high: np.ndarray
    x: np.ndarray | None = None


def series_of(name: str, colour: str, marker: str, rows: Any) -> Series:
    """Return a series from (value, low, high) for each place; None is unknown."""
    table = np.array(rows, dtype=float).reshape(-1, 3)
    return Series(name, colour, marker, *table.T)


# -- who won, how much, how long --------------------------------------------------------------------------------------------


def share_bars(shares: Sequence[Share], colours: Sequence[str]) -> Figure:
    """Shares as horizontal bars with their intervals and numbers."""
    figure, ((plot,),) = blank(0.55 + 0.34 * len(shares))
    rows = np.arange(len(shares))[::-1]
    value, low, high = (np.array([getattr(s, name) for s in shares]) for name in ("value", "low", "high"))
    plot.barh(rows, value, height=0.62, color=list(colours))
    for colour, width in ((PAPER, 3.0), (INK, 1.1)):
        plot.hlines(rows, low, high, color=colour, linewidth=width)
    for row, share in zip(rows, shares, strict=True):
        text = f"{percent(share.value)}  ({share.n:,})"
        plot.text(1.02, row, text, va="center", transform=plot.get_yaxis_transform())
    _name_rows(plot, [s.name for s in shares])
    plot.set_xlim(0.0, min(math.ceil(high.max() * 10.0 + 0.2) / 10.0, 1.0))
    _value_axis(plot.xaxis, "share of the games", is_share=True)
    return figure


def distributions(
    values: Sequence[np.ndarray], names: Sequence[str], colours: Sequence[str], label: str
) -> Figure:
    """Histograms one below the other on one axis, with the mean as a dot and the middle half of the games as a line.

    Where values have both signs, as differences have, a line marks 0.
    """
    figure, axes = blank(0.5 + 0.72 * len(values), len(values), sharex=True, gridspec_kw={"hspace": 0.05})
    every = np.concatenate(values)
    edges = edges_for(every)
    tallest = max(np.histogram(v, edges)[0].max() for v in values)
    for plot, some, name, colour in zip(axes.flat, values, names, colours, strict=True):
        plot.hist(some, edges, color=colour, alpha=0.75, histtype="stepfilled", linewidth=0)
        below = -0.14 * tallest
        plot.hlines(below, *np.quantile(some, [0.25, 0.75]), color=colour, linewidth=2.4)
        plot.plot([some.mean()], [below], "o", color=INK, markersize=3.6, markeredgecolor=PAPER)
        plot.set_ylim(-0.26 * tallest, 1.05 * tallest)
        plot.set_yticks([])
        plot.set_ylabel(shortened(name, 16), rotation=0, ha="right", va="center")
        spread = f"\nsd {estimate(some.std(ddof=1))}" if len(some) > 1 else ""
        plot.text(
            1.02,
            0.5,
            f"mean {estimate(some.mean())}{spread}",
            va="center",
            transform=plot.transAxes,
            fontsize=8,
        )
        if every.min() < 0.0 < every.max():
            plot.axvline(0.0, color=MUTED, linewidth=0.8)
        rule_x(plot)
    axes[-1, 0].set_xlim(edges[0], edges[-1])
    axes[-1, 0].set_xlabel(label)
    return figure


def lengths(ends: Mapping[str, np.ndarray]) -> Figure:
    """When games ended, stacked by the reason.

    Args:
        ends: Reason -> times [s] of the games that ended for it.
    """
    figure, ((plot,),) = blank(2.4)
    edges = edges_for(np.concatenate(list(ends.values())))
    colours = [END_COLOURS.get(end, MUTED) for end in ends]
    *_, patches = plot.hist(list(ends.values()), edges, stacked=True, histtype="stepfilled", color=colours)
    shown = patches if len(ends) > 1 else [patches]
    names = (f"{end_text(end)} ({len(t):,})" for end, t in ends.items())
    legend_above(figure, [(patch[0], name) for patch, name in zip(shown, names, strict=True)])
    plot.set_xlabel("length of the game [s]")
    plot.set_ylabel("games")
    rule_y(plot)
    return figure


def over_time(curves: Sequence[Series], label: str) -> Figure:
    """Means over time [s], each with its interval as a band."""
    figure, ((plot,),) = blank(2.7)
    handles = []
    for curve in curves:
        plot.fill_between(curve.x, curve.low, curve.high, color=curve.colour, alpha=0.22, linewidth=0)
        (line,) = plot.plot(curve.x, curve.mean, color=curve.colour, linestyle=curve.marker)
        handles.append((line, curve.name))
    plot.margins(x=0.0)
    plot.set_ylim(bottom=0.0)
    plot.set_xlabel("time [s]")
    plot.set_ylabel(label)
    rule_y(plot)
    legend_above(figure, handles)
    return figure


def inside(values: np.ndarray) -> np.ndarray:
    """Return the values without outliers: at most 1 % at each end, if they would more than double the axis."""
    low, high = np.quantile(values, [0.01, 0.99])
    span = max(float(high - low), 1e-300)
    if values.max() - high <= span and low - values.min() <= span:
        return values
    return np.asarray(values[(values >= low - span) & (values <= high + span)])


def edges_for(values: np.ndarray) -> np.ndarray:
    """Return the ends of the bins of a histogram, by the rule of Freedman and Diaconis, at most 50; bins of whole numbers are whole."""
    values = inside(values)
    low, high = float(values.min()), float(values.max())
    if not 0.0 < (high - low) / 50.0 < math.inf:
        return np.array([low - 0.5, low + 0.5])
    is_whole = bool(np.all(values == np.round(values)))
    found = np.histogram_bin_edges(values, "fd")
    width = max(float(found[1] - found[0]), (high - low) / 50.0)
    if is_whole:
        width = max(float(np.round(width)), 1.0)
        low -= 0.5
    else:
        width = min(width, (high - low) / 8.0)
    n_bins = math.ceil((high - low + (0.5 if is_whole else 0.0)) / width - 1e-9)
    return np.asarray(low + width * np.arange(n_bins + 1))


# -- what the varied values do ----------------------------------------------------------------------------------------------


def response_curves(
    axis: FittedVariable,
    curves: Sequence[Series],
    dots: Sequence[Series],
    label: str,
    *,
    is_share: bool = False,
    limits: Limits = None,
) -> Figure:
    """Fits along a variable as lines with bands, and the means of the points as dots, with bars where their intervals are known.

    Args:
        axis: The variable.
        curves: The fits, each with its positions; none for too few points.
        dots: The means of the points, each with their positions.
        label: What it is.
        is_share: Values are shares of games.
        limits: Of the values.
    """
    figure, ((plot,),) = blank(2.9)
    handles, has_bars = [], any(np.isfinite(each.low).any() for each in dots)
    for each in dots:
        bars = np.nan_to_num(np.maximum([each.mean - each.low, each.high - each.mean], 0.0))
        drawn = plot.errorbar(
            each.x, each.mean, bars if has_bars else None, color=each.colour, marker=each.marker, linestyle="none",
            elinewidth=0.9, markersize=4.0 if has_bars else 3.2, alpha=0.9 if has_bars else 0.55, markeredgecolor=PAPER,
            markeredgewidth=0.4,
        )  # fmt: skip
        handles.append([drawn, each.name])
    for i, each in enumerate(curves):
        plot.fill_between(each.x, each.low, each.high, color=each.colour, alpha=0.18, linewidth=0)
        (line,) = plot.plot(each.x, each.mean, color=each.colour, linestyle=each.marker)
        handles[i][0] = (handles[i][0], line)
    if axis.is_log:
        _make_log(plot, "x")
    elif len(axis.values) <= MAX_TICKS:
        plot.set_xticks([float(v) for v in axis.values], [f"{v:.6g}" for v in axis.values])
    plot.set_xlabel(axis_label(axis))
    _value_axis(plot.yaxis, label, is_share=is_share)
    if limits is not None:
        plot.set_ylim(*limits)
    rule_y(plot)
    legend_above(figure, [(handle, name) for handle, name in handles])
    return figure


def in_rows(
    names: Sequence[str], series: Sequence[Series], label: str, *,
    is_share: bool = False, limits: Limits = None,
) -> Figure:  # fmt: skip
    """Means in rows that have names, with their intervals."""
    figure, ((plot,),) = blank(0.75 + len(names) * (0.15 + 0.15 * len(series)))
    _rows_of_marks(figure, plot, series, len(names))
    _name_rows(plot, names)
    _value_axis(plot.xaxis, label, is_share=is_share)
    if limits is not None:
        plot.set_xlim(*limits)
    return figure


def effect_strengths(effects: Sequence[Effect]) -> Figure:
    """Plot the influence of each variable on a quantity: rank correlation, and parts of the variance if they are known."""
    parts = [
        series_of("alone", INK, "s", [(e.first_order, e.first_low, e.first_high) for e in effects]),
        series_of("with others", MUTED, "D", [(e.total, e.total_low, e.total_high) for e in effects]),
    ]
    ranks = [series_of("", INK, "o", [(e.rank_correlation, e.rank_low, e.rank_high) for e in effects])]
    kinds = [
        (found, label)
        for some, label in ((ranks, "rank correlation"), (parts, "share of the variance"))
        if (found := [s for s in some if np.isfinite(s.mean).any()])
    ]
    figure, axes = blank(0.85 + 0.3 * len(effects), 1, len(kinds), sharey=True)
    figure.set_layout_engine("constrained", wspace=0.08)
    for plot, (series, label) in zip(axes.flat, kinds, strict=True):
        plot.axvline(0.0, color=MUTED, linewidth=0.8)
        _rows_of_marks(figure, plot, series, len(effects))
        lowest = -1.05 if label == "rank correlation" else -0.05
        plot.set_xlim(min(lowest, plot.get_xlim()[0]), max(1.05, plot.get_xlim()[1]))
        plot.xaxis.set_major_formatter(lambda v, _: f"{v:g}".replace("-", "−"))
        plot.set_xlabel(label)
        rule_x(plot)
    _name_rows(axes[0, 0], [e.variable for e in effects])
    return figure


@dataclass(frozen=True)
class Surface:
    """A quantity over two variables: its fit on a grid, and the means of the points.

    Args:
        name: Of the panel; empty for one.
        x: Positions of the grid from left to right, (nx,).
        y: From below to above, (ny,).
        value: The fit, (ny, nx).
        dots: Positions and means of the points, (3, n).
    """

    name: str
    x: np.ndarray
    y: np.ndarray
    value: np.ndarray
    dots: np.ndarray


def response_maps(
    across: FittedVariable,
    up: FittedVariable,
    surfaces: Sequence[Surface],
    label: str,
    ends: tuple[str, ...] = (),
    *,
    is_share: bool = False,
) -> Figure:
    """A quantity over two variables: contours of its fit, and the points in its colour, on one scale.

    Args:
        across: The variable from left to right.
        up: The variable from below to above.
        surfaces: One panel each, one below the other.
        label: What it is.
        ends: Colours of the two sides of a difference; empty for what is no difference.
        is_share: Values are shares of games.
    """
    from matplotlib.colors import LinearSegmentedColormap, Normalize
    from matplotlib.ticker import MaxNLocator

    every = np.concatenate([v for s in surfaces for v in (s.value.ravel(), s.dots[2])])
    low, high = float(np.nanmin(every)), float(np.nanmax(every))
    colours = list(SEQUENTIAL)
    if ends:
        high = max(abs(low), abs(high), 1e-9)
        low, colours = -high, [mixed(ends[0], INK, 0.12), "#f4f4f2", mixed(ends[1], INK, 0.12)]
    colour_map = LinearSegmentedColormap.from_list("tussle", colours)
    norm = Normalize(low, high if high > low else low + 1.0)
    planes = np.concatenate([s.value.ravel() for s in surfaces])
    levels = MaxNLocator(7).tick_values(float(planes.min()), float(planes.max()))
    figure, axes = blank(0.6 + 2.5 * len(surfaces), len(surfaces), sharex=True)
    for plot, surface in zip(axes.flat, surfaces, strict=True):
        plot.contourf(
            surface.x, surface.y, surface.value, levels, cmap=colour_map, norm=norm, alpha=0.45, extend="both"
        )
        lines = plot.contour(surface.x, surface.y, surface.value, levels, colors=[MUTED], linewidths=0.7)
        plot.clabel(
            lines, fontsize=7, fmt=(lambda v: percent(abs(v) if ends else v, 0)) if is_share else _plain
        )
        plot.scatter(
            *surface.dots[:2], c=surface.dots[2], cmap=colour_map, norm=norm, s=20, edgecolors=INK, linewidths=0.5, zorder=3, clip_on=False
        )  # fmt: skip
        plot.set_title(surface.name, fontsize=8.5, loc="left")
        plot.set_ylabel(axis_label(up))
        for axis, which in ((across, "x"), (up, "y")):
            if axis.is_log:
                _make_log(plot, which)
    axes.flat[-1].set_xlabel(axis_label(across))
    mappable = axes.flat[0].collections[-1]
    bar = figure.colorbar(mappable, ax=list(axes.flat), aspect=28, pad=0.02, label=label)
    bar.outline.set_visible(False)
    if bar.solids is not None:
        bar.solids.set_rasterized(True)
    if is_share:
        bar.ax.yaxis.set_major_formatter(lambda v, _: percent(abs(v) if ends else v, 0))
    return figure


# -- parts of plots ---------------------------------------------------------------------------------------------------------


def axis_label(axis: FittedVariable) -> str:
    """Name of a variable with its unit."""
    return shortened(axis.variable.name, 44) + (f" [{shortened(axis.unit, 12)}]" if axis.unit else "")


def _rows_of_marks(figure: Figure, plot: Axes, series: Sequence[Series], n_rows: int) -> None:
    """Marks in rows from the top, those of several series beside each other, with a legend."""
    rows, handles = np.arange(n_rows)[::-1].astype(float), []
    for i, each in enumerate(series):
        shift = 0.36 * (0.5 - i / (len(series) - 1)) if len(series) > 1 else 0.0
        handles.append((_marks(plot, each, rows + shift, is_flat=True), each.name))
    legend_above(figure, handles)


def _marks(plot: Axes, each: Series, place: np.ndarray, *, is_flat: bool = False) -> Any:
    """Markers with bars; lying where `is_flat`, else joined by a line."""
    bars = np.nan_to_num(np.maximum([each.mean - each.low, each.high - each.mean], 0.0))
    x, y = (each.mean, place) if is_flat else (place, each.mean)
    return plot.errorbar(
        x, y, xerr=bars if is_flat else None, yerr=None if is_flat else bars, color=each.colour, marker=each.marker, elinewidth=1.0,
        linestyle="none" if is_flat else "-", linewidth=0.9, markeredgecolor=PAPER, markeredgewidth=0.5,
    )  # fmt: skip


def _name_rows(plot: Axes, names: Sequence[str]) -> None:
    plot.set_yticks(range(len(names))[::-1], [shortened(name, 28) for name in names])
    plot.set_ylim(-0.6, len(names) - 0.4)
    rule_x(plot)


def _value_axis(axis: Any, label: str, *, is_share: bool) -> None:
    axis.set_label_text(label)
    if is_share:
        axis.set_major_formatter(lambda v, _: percent(v, 0))


def _plain(value: float) -> str:
    return f"{value:.4g}".replace("-", "−")


def _make_log(plot: Axes, which: str) -> None:
    """A logarithmic axis whose numbers are written out."""
    from matplotlib.ticker import LogLocator, NullFormatter

    plot.set(**{f"{which}scale": "log"})
    axis = plot.xaxis if which == "x" else plot.yaxis
    low, high = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=(1.0,) if high > 30.0 * low else (1.0, 2.0, 5.0), numticks=8))
    axis.set_major_formatter(lambda v, _: f"{v:g}")
    axis.set_minor_formatter(NullFormatter())
