"""Plots of what the varied values do: means along a variable or in rows, maps of two variables, strengths of effects.

Each takes plain numbers and gives a figure; `house_style` is to be around them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.batch.report.binning import Lane
from tussle.batch.report.drawing import (
    INK,
    MUTED,
    PAPER,
    blank,
    legend_above,
    mixed,
    rule_x,
    rule_y,
    shortened,
)
from tussle.batch.report.words import percent, signed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from tussle.batch.sensitivity import Effect


MOST_TICKS = 8
"""Values that are all written at an axis."""


@dataclass(frozen=True)
class Series:
    """Means with intervals, of one team or whatever is told apart by colour.

    Args:
        name: Of the series.
        colour: Of its marks.
        marker: Shape of its marks, as Matplotlib says it.
        mean: Means, (n_places,); NaN where there is none.
        low: Lower ends, (n_places,); NaN where there is no interval.
        high: Upper ends, (n_places,).
        dots: Positions and values of single points, each (n,), which are shown faintly; empty for none.
    """

    name: str
    colour: str
    marker: str
    mean: np.ndarray
    low: np.ndarray
    high: np.ndarray
    dots: tuple[np.ndarray, np.ndarray] = (np.empty(0), np.empty(0))


@dataclass(frozen=True)
class Field:
    """A quantity over two variables.

    Args:
        across: The variable from left to right.
        up: The variable from below to above.
        value: Means, (up.n_places, across.n_places); NaN where there are no games.
        label: What it is.
        ends: Names and colours of the two sides of a difference; empty for what has no sides.
        is_share: Values are shares.
    """

    across: Lane
    up: Lane
    value: np.ndarray
    label: str
    ends: tuple[tuple[str, str], ...] = ()
    is_share: bool = False


Limits = tuple[float, float] | None
"""Ends of an axis of values; None where they are as the values need."""


def along(
    lane: Lane, series: Sequence[Series], label: str, *, is_share: bool = False, limits: Limits = None
) -> Figure:
    """Means along a range, joined by a thin line, with their intervals as bars."""
    figure, axes = blank(2.7)
    (plot,) = axes.flat
    handles = []
    for each in series:
        plot.plot(
            *each.dots, "o", color=each.colour, alpha=0.28, markersize=2.0, markeredgewidth=0, zorder=1.5
        )
        handles.append((_marks(plot, each, lane.position, is_line=True), each.name))
    if lane.is_log:
        _make_log(plot, "x")
    if 0 < len(lane.texts) <= MOST_TICKS:
        plot.set_xticks(lane.position, lane.texts)
    plot.set_xlabel(axis_label(lane))
    _value_axis(plot.yaxis, label, is_share)
    if limits is not None:
        plot.set_ylim(*limits)
    rule_y(plot)
    legend_above(figure, handles)
    return figure


def in_rows(
    names: Sequence[str],
    series: Sequence[Series],
    label: str,
    *,
    is_share: bool = False,
    is_difference: bool = False,
    limits: Limits = None,
) -> Figure:
    """Means in rows that have names, with their intervals; differences with a line at 0.

    Args:
        names: Names of the rows, the first one at the top.
        series: What stands in each row.
        label: Of the axis.
        is_share: Values are shares.
        is_difference: Values are differences.
        limits: Ends of the axis.
    """
    n_series = len(series)
    figure, axes = blank(0.75 + len(names) * (0.15 + 0.15 * n_series))
    (plot,) = axes.flat
    rows = np.arange(len(names))[::-1].astype(float)
    if is_difference:
        plot.axvline(0.0, color=MUTED, linewidth=0.8)
    handles = []
    for i, each in enumerate(series):
        place = rows + (0.0 if n_series == 1 else 0.36 * (0.5 - i / (n_series - 1)))
        handles.append((_marks(plot, each, place, is_line=False, is_flat=True), each.name))
    plot.set_yticks(rows, [shortened(name, 30) for name in names])
    plot.set_ylim(-0.6, len(names) - 0.4)
    _value_axis(plot.xaxis, label, is_share, is_difference)
    if limits is not None:
        plot.set_xlim(*limits)
    rule_x(plot)
    legend_above(figure, handles)
    return figure


def heat_map(field: Field) -> Figure:
    """A quantity over two variables as colour; grey where there are no games."""
    from matplotlib.colors import LinearSegmentedColormap, Normalize

    value = np.ma.masked_invalid(field.value)
    if field.ends:
        largest = max(float(np.abs(value).max()), 1e-9)
        colours = [mixed(field.ends[0][1], INK, 0.12), "#f4f4f2", mixed(field.ends[1][1], INK, 0.12)]
        norm = Normalize(-largest, largest)
    else:
        # Dark is much in the light page and in print alike; the shades are those of ColorBrewer's "YlGnBu", which the colour-blind
        # read as lightness.
        colours = ["#f7fbd5", "#a1dab4", "#41b6c4", "#2c7fb8", "#253494"]
        norm = Normalize(0.0 if field.is_share else float(value.min()), float(value.max()))
    colour_map = LinearSegmentedColormap.from_list("tussle", colours)
    figure, axes = blank(3.5)
    (plot,) = axes.flat
    x, y = (
        lane.edges if not lane.texts else np.arange(lane.n_places + 1) - 0.5
        for lane in (field.across, field.up)
    )
    plot.set_facecolor(mixed(MUTED, "#ffffff", 0.55))
    mesh = plot.pcolormesh(x, y, value, cmap=colour_map, norm=norm, edgecolors=PAPER, linewidth=0.4)
    _map_axes(plot, field)
    if value.size <= 64 and all(lane.texts for lane in (field.across, field.up)):
        _write_cells(plot, field, mesh)
    bar = figure.colorbar(mesh, ax=plot, aspect=28, pad=0.02)
    bar.outline.set_visible(False)
    if bar.solids is not None:
        bar.solids.set_rasterized(True)
    bar.set_label(field.label)
    if field.is_share:
        bar.ax.yaxis.set_major_formatter(lambda v, _: percent(abs(v), 0))
    return figure


def effect_strengths(effects: Sequence[Effect]) -> Figure:
    """How strongly a quantity follows each variable: correlation of ranks, and shares of its variance where they are known."""
    has_shares = any(e.first_order is not None or e.total is not None for e in effects)
    has_ranks = any(np.isfinite(e.rank_correlation) for e in effects)
    n_columns = int(has_shares) + int(has_ranks)
    figure, axes = blank(0.85 + 0.3 * len(effects), 1, n_columns, sharey=True)
    rows = np.arange(len(effects))[::-1].astype(float)
    columns = list(axes.flat)
    figure.set_layout_engine("constrained", wspace=0.08)
    if has_ranks:
        plot = columns[0]
        plot.axvline(0.0, color=MUTED, linewidth=0.8)
        each = series_of("rank", INK, "o", [(e.rank_correlation, e.rank_low, e.rank_high) for e in effects])
        _marks(plot, each, rows, is_line=False, is_flat=True)
        plot.set_xticks([-1.0, -0.5, 0.0, 0.5, 1.0], ["−1", "−0.5", "0", "0.5", "1"])
        plot.set_xlim(-1.05, 1.05)
        plot.set_xlabel("rank correlation")
    if has_shares:
        plot = columns[-1]
        plot.axvline(0.0, color=MUTED, linewidth=0.8)
        parts = [
            ("alone", INK, "s", [(e.first_order, e.first_low, e.first_high) for e in effects]),
            ("with others", MUTED, "D", [(e.total, e.total_low, e.total_high) for e in effects]),
        ]
        parts = [part for part in parts if any(triple[0] is not None for triple in part[3])]
        handles = []
        for i, (name, colour, marker, triples) in enumerate(parts):
            place = rows + (0.13 - 0.26 * i if len(parts) == 2 else 0.0)
            each = series_of(name, colour, marker, triples)
            handles.append((_marks(plot, each, place, is_line=False, is_flat=True), name))
        plot.set_xlim(min(-0.05, plot.get_xlim()[0]), max(1.05, plot.get_xlim()[1]))
        plot.xaxis.set_major_formatter(lambda v, _: f"{v:g}".replace("-", "−"))
        plot.set_xlabel("share of the variance")
        legend_above(figure, handles)
    for plot in columns:
        rule_x(plot)
    columns[0].set_yticks(rows, [shortened(e.variable, 26) for e in effects])
    columns[0].set_ylim(-0.6, len(effects) - 0.4)
    return figure


def axis_label(lane: Lane) -> str:
    """Name of a variable with its unit."""
    unit = getattr(lane.variable, "unit", "")
    return shortened(lane.variable.name, 44) + (f" [{shortened(unit, 12)}]" if unit else "")


def series_of(
    name: str, colour: str, marker: str, triples: Sequence[tuple[float | None, float | None, float | None]]
) -> Series:
    """A series from one (mean, low, high) for each place; None where there is nothing."""
    rows = np.array([[np.nan if v is None else v for v in triple] for triple in triples], dtype=float)
    return Series(name, colour, marker, rows[:, 0], rows[:, 1], rows[:, 2])


def _marks(plot: Axes, each: Series, place: np.ndarray, *, is_line: bool, is_flat: bool = False) -> Any:
    """Markers with bars at some places; lying where `is_flat`."""
    bars = np.vstack([each.mean - each.low, each.high - each.mean])
    bars = np.where(np.isfinite(bars), np.maximum(bars, 0.0), 0.0)
    x, y = (each.mean, place) if is_flat else (place, each.mean)
    return plot.errorbar(
        x, y, xerr=bars if is_flat else None, yerr=None if is_flat else bars, color=each.colour, marker=each.marker,
        elinewidth=1.0, linestyle="-" if is_line else "none", linewidth=0.9, markeredgecolor=PAPER, markeredgewidth=0.5,
    )  # fmt: skip


def _value_axis(axis: Any, label: str, is_share: bool, is_difference: bool = False) -> None:
    axis.set_label_text(label)
    if is_share and is_difference:
        axis.set_major_formatter(lambda v, _: signed(f"{round(100.0 * v, 6):g}".replace("-", "−")))
    elif is_share:
        axis.set_major_formatter(lambda v, _: percent(v, 0))


def _map_axes(plot: Axes, field: Field) -> None:
    plot.set_xlabel(axis_label(field.across))
    plot.set_ylabel(axis_label(field.up))
    for spine in plot.spines.values():
        spine.set_visible(False)
    for lane, is_across in ((field.across, True), (field.up, False)):
        if lane.texts:
            names = [shortened(text, 14) for text in lane.texts]
            is_crowded = is_across and sum(map(len, names)) + 2 * len(names) > 46
            turned: dict[str, Any] = (
                {"rotation": 40, "ha": "right", "rotation_mode": "anchor"} if is_crowded else {}
            )
            (plot.set_xticks if is_across else plot.set_yticks)(range(lane.n_places), names, **turned)
        elif lane.is_log:
            _make_log(plot, "x" if is_across else "y")
        else:
            plot.locator_params(axis="x" if is_across else "y", nbins=6)


def _make_log(plot: Axes, which: str) -> None:
    """A logarithmic axis whose numbers are written out."""
    from matplotlib.ticker import LogLocator, NullFormatter

    plot.set(**{f"{which}scale": "log"})
    axis = plot.xaxis if which == "x" else plot.yaxis
    low, high = axis.get_view_interval()
    subs = (1.0,) if high > 30.0 * low else (1.0, 2.0, 5.0)
    axis.set_major_locator(LogLocator(subs=subs, numticks=8))
    axis.set_major_formatter(lambda v, _: f"{v:g}")
    axis.set_minor_formatter(NullFormatter())


def _write_cells(plot: Axes, field: Field, mesh: Any) -> None:
    """The value in each cell, all with as many decimals as the largest needs to show three digits; shares in whole percent."""
    largest = float(np.nanmax(np.abs(field.value)))
    digits = 0 if field.is_share or largest == 0.0 else max(0, 2 - math.floor(math.log10(largest)))
    scale = 100.0 if field.is_share else 1.0
    for (row, column), value in np.ndenumerate(field.value):
        if np.isfinite(value):
            red, green, blue, _ = mesh.to_rgba(value)
            is_dark = 0.299 * red + 0.587 * green + 0.114 * blue < 0.55
            text = f"{round(scale * value, digits) + 0.0:{'+' if field.ends else ''},.{digits}f}".replace(
                "-", "−"
            )
            plot.text(
                column,
                row,
                text,
                ha="center",
                va="center",
                fontsize=7.5,
                color="#ffffff" if is_dark else "#111111",
            )
