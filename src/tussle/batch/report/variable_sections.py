"""The sections of a report about what varies: effects, maps, strengths, differences and points."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tussle.batch.report import plots
from tussle.batch.report.drawing import shortened
from tussle.batch.report.formatting import (
    capital,
    count,
    estimate,
    file_name,
    interval,
    p_value,
    percent,
    sentence,
    signed,
)
from tussle.batch.report.report_data import FEWEST_SEEDS, MOST_VARIABLES, Axis, Measure, ReportData, axis_of
from tussle.batch.report.sections import Plot, ReportTable, Section, numbers
from tussle.batch.selection import written
from tussle.batch.sensitivity import Effect
from tussle.batch.statistics import PairedComparison
from tussle.batch.variables import Range
from tussle.errors import ParameterError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_DOTS = 400
"""Largest number of points that are shown one by one behind the means."""
MOST_PLACES = 20
"""Largest number of choices in a plot, and of points in a table."""
MOST_CELLS = 16
"""Largest number of bins along one side of a map."""
POINTS_PER_CELL = 5
FEWEST_CELLS = 4
"""Fewest cells with games for which a map is drawn."""
MOST_NUMBERS = 6
"""Largest number of values of a numeric choice that are compared in pairs."""


def effects(data: ReportData) -> Section:
    """Return the means of each quantity along each variable."""
    title = "What the varied values do"
    axes = [axis_of(variable, data.points) for variable in data.shown_variables]
    found = [_effects_of(data, axes, stem, measures) for stem, measures in data.groups] if axes else []
    hidden = len(data.variables) - len(axes)
    lead = (
        [f"The {MOST_VARIABLES} of {len(data.variables)} variables with the strongest effects are shown."]
        if hidden
        else []
    )
    by_variable = list(itertools.chain.from_iterable(zip(*found, strict=True)))
    return Section("effects", title, lead if by_variable else [], by_variable)


def _effects_of(data: ReportData, axes: Sequence[Axis], stem: str, measures: Sequence[Measure]) -> list[Plot]:
    """Return plots of some measures along each variable, on one scale."""
    label, is_share = measures[0].label, measures[0].is_share
    lines = [[_series(data, axis, m) for m in measures] for axis in axes]
    limits = _limits(list(itertools.chain.from_iterable(lines)), is_share) if len(axes) > 1 else None
    return [
        Plot(
            f"{stem}-by-{file_name(axis.variable.name)}", f"{capital(label)} by {axis.variable.name}", _effect_caption(data, axis),
            lambda axis=axis, line=line: _draw_effect(axis, line, label, is_share, limits),  # type: ignore[misc]
        )
        for axis, line in zip(axes, lines, strict=True)
    ]  # fmt: skip


def _draw_effect(
    axis: Axis, line: Sequence[plots.Series], label: str, is_share: bool, limits: plots.Limits
) -> Figure:
    if axis.is_number:
        return plots.along(axis, line, label, is_share=is_share, limits=limits)
    return plots.in_rows(axis.texts[:MOST_PLACES], line, label, is_share=is_share, limits=limits)


def _series(data: ReportData, axis: Axis, measure: Measure) -> plots.Series:
    """Return the means of a quantity along an axis, with single points behind them if there are bins and not too many points."""
    rows = data.means_at(axis, measure)[: None if axis.is_number else MOST_PLACES]
    found = plots.series_of(measure.name, measure.colour, measure.marker, rows)
    if axis.texts or measure.is_share or len(data.points) > MOST_DOTS:
        return found
    at = np.array([float(point[axis.variable.name]) for point in data.points])
    return replace(found, dots=(at, data.mean_by_point(measure)))


def _limits(series: Sequence[plots.Series], is_share: bool) -> tuple[float, float]:
    every = np.concatenate([v for s in series for v in (s.mean, s.low, s.high, *(s.dots or ())[1:])])
    low, high = float(np.nanmin(every)), float(np.nanmax(every))
    room = 0.04 * (high - low) or 0.5
    return (max(low - room, -0.02), min(high + room, 1.02)) if is_share else (low - room, high + room)


def _effect_caption(data: ReportData, axis: Axis) -> str:
    if not axis.texts:
        places = f"Means of {count(len(data.points), 'point')} in {axis.n_places} bins of equal number."
    elif axis.n_places > MOST_PLACES and not axis.is_number:
        places = f"Mean at the first {MOST_PLACES} of {axis.n_places} values."
    else:
        places = "Mean at each value."
    over = "over seeds"
    if data.is_drawn:
        over = (
            "over points and seeds"
            if len(np.unique(data.seed)) >= FEWEST_SEEDS
            else "over points, with these seeds"
        )
    others = len(data.variables) - 1
    scale = (
        " The other variables vary behind each mean. Plots of one quantity have one scale." if others else ""
    )
    return f"{places} Bar: 95 % interval of the mean, {over}.{scale}"


# -- two variables ----------------------------------------------------------------------------------------------------------


def maps(data: ReportData) -> Section:
    """Quantities over the two strongest variables."""
    section = Section("maps", "Two variables at once")
    pair = sorted(data.by_strength()[:2], key=data.variables.index)
    if len(pair) < 2:
        return section
    n_bins = int(np.clip(np.sqrt(len(data.points) / POINTS_PER_CELL), 3, MOST_CELLS))
    across, up = (axis_of(v, data.points, n_bins, is_even=True) for v in pair)
    if not across.is_number and up.is_number:
        across, up = up, across
    cells = {(repr(p[pair[0].name]), repr(p[pair[1].name])) for p in data.points}
    if len(cells) < FEWEST_CELLS or any(not a.is_number and a.n_places > MOST_PLACES for a in (across, up)):
        return section
    cut = "" if across.texts and up.texts else f"; ranges are cut into {n_bins} equal parts"
    more = (
        f" The two strongest of {len(data.variables)} variables; the others vary behind each cell."
        if data.variables[2:]
        else ""
    )
    caption = f"Mean of the games in each cell{cut}. Grey: no games.{more}"
    found = [_maps_of(data, across, up, stem, measures, caption) for stem, measures in data.groups]
    return replace(section, plots=list(itertools.chain.from_iterable(found)))


def _maps_of(
    data: ReportData, across: Axis, up: Axis, stem: str, measures: Sequence[Measure], caption: str
) -> list[Plot]:
    """One map of the difference of two rivals, or one map of each quantity."""
    title = f"by {across.variable.name} and {up.variable.name}"
    if len(measures) == 2 and measures[0].team is not None:
        low, high = sorted(measures, key=lambda m: m.team or 0)
        what = f"{'share of the games won' if low.is_share else low.label}, {high.name} minus {low.name}"
        unit = ", in percentage points" if low.is_share else ""

        def draw_difference() -> Figure:
            value = data.cells(high, across, up) - data.cells(low, across, up)
            label = f"◂ {shortened(low.name, 14)}  ·  {shortened(high.name, 14)} ▸"
            return plots.heat_map(across, up, value, label, (low.colour, high.colour), is_share=low.is_share)

        text = f"{caption} Colour: {what}{unit}; it is that of the team with more."
        return [Plot(f"{stem}-map", f"{capital(what)}, {title}", text, draw_difference)]
    return [
        Plot(
            f"{stem}-map-{m.team}" if m.team is not None else f"{stem}-map",
            f"{capital(m.label)}: {m.name}, {title}" if m.team is not None else f"{m.label} {title}",
            caption,
            lambda m=m: plots.heat_map(across, up, data.cells(m, across, up), m.label, is_share=m.is_share),  # type: ignore[misc]
        )
        for m in measures
    ]


# -- sensitivity ------------------------------------------------------------------------------------------------------------


def strengths(data: ReportData) -> Section:
    """The section on the influence of each variable on the quantities."""
    found, remarks = [], dict[str, None]()
    for measure in data.measures if data.variables else ():
        known = [e for e in _effects(data, measure) if _strength(e) is not None]
        shown = sorted(known, key=lambda e: -(_strength(e) or 0.0))[:MOST_PLACES]
        if shown:
            title = f"What {data.title(measure.expression)} depends on"
            caption = "Mark: estimate, the strongest at the top. Bar: its 95 % interval."
            name = f"strengths-{file_name(measure.expression)}"
            found.append(Plot(name, title, caption, lambda shown=shown: plots.effect_strengths(shown)))  # type: ignore[misc]
            remarks |= dict.fromkeys(part for e in shown for part in e.note.split("; ") if part)
    lead = [
        "Rank correlation: 1 or −1 where the quantity always rises or falls with the variable, 0 where it does not follow it.",
        "Share of the variance: the part that a variable makes alone, or with others. Interaction: the part of variables together only.",
        sentence("; ".join(remarks)),
    ]
    return Section("strengths", "Which variables matter", lead if found else [], found)


def _effects(data: ReportData, measure: Measure) -> list[Effect]:
    found = data.results.sensitivity(measure.expression)
    if len(data.results.variables) > 1:
        return found
    return [
        replace(e, total=None, total_low=None, total_high=None) for e in found
    ]  # "with others" says nothing of one variable


def _strength(effect: Effect) -> float | None:
    values = (effect.total, effect.first_order, effect.rank_correlation)
    return next((abs(v) for v in values if v is not None and np.isfinite(v)), None)


# -- differences ------------------------------------------------------------------------------------------------------------


def differences(data: ReportData) -> Section:
    """Return the differences between the values of each choice, paired by seed."""
    rows, lead = list[list[str]](), []
    for variable in data.variables:
        axis = axis_of(variable, data.points)
        if isinstance(variable, Range) or axis.n_places > (MOST_NUMBERS if axis.is_number else MOST_PLACES):
            continue
        try:
            compared = [(ms, [_compared(data, axis, m) for m in ms]) for _, ms in data.groups]
        except ParameterError as error:
            lead.append(f"The values of {variable.name} are not compared: {sentence(str(error))}")
            continue
        for measures, lines in compared:
            for pairs in zip(*lines, strict=True):
                rows += [_difference_cells(data, m, c) for m, c in zip(measures, pairs, strict=True)]
    columns = numbers(
        "pairs", "mean before", "after", "difference", "95 % interval", "more / less / equal", "p"
    )
    paired = "Pairs are games with the same seed and otherwise the same values."
    if data.results.info.get("independent"):
        paired = "Pairs are games with otherwise the same values, in the order of their seeds; each has a seed of its own."
    caption = (
        f"{paired} more / less / equal: number of pairs. p: exact sign test, each by itself; of twenty such numbers one is below 0.05 by"
        " chance."
    )
    table = ReportTable("", [("quantity", "text"), ("change", "text"), *columns], rows, caption)
    return Section("differences", "Paired differences", lead, tables=[table] if rows else [])


def _compared(data: ReportData, axis: Axis, measure: Measure) -> list[PairedComparison]:
    """Compare each further value with the first one.

    Raises:
        ParameterError: A value cannot be named, or the points cannot be paired.
    """
    sides: list[int | str] = []
    for place in range(axis.n_places):
        points = np.flatnonzero(axis.index == place)
        name, value = axis.variable.name, written(data.points[int(points[0])][axis.variable.name])
        sides.append(int(points[0]) if len(points) == 1 else f"{name}={value}")
    return [data.results.compare(measure.expression, sides[0], side) for side in sides[1:]]


def _difference_cells(data: ReportData, measure: Measure, c: PairedComparison) -> list[str]:
    scale, unit = (100.0, "\u00a0pp") if measure.is_share else (1.0, "")
    shown = percent if measure.is_share else estimate
    return [
        data.title(measure.expression), f"{c.a} → {c.b}", count(c.n), shown(c.mean_a), shown(c.mean_b),
        signed(estimate(scale * c.difference)) + (unit if c.n else ""), interval(c.low, c.high, scale, unit),
        f"{count(c.n_greater)} / {count(c.n_less)} / {count(c.n_equal)}", p_value(c.p),
    ]  # fmt: skip


# -- points -----------------------------------------------------------------------------------------------------------------


def points(data: ReportData) -> Section:
    """Return a table of points; of many points, those with most and least of the first quantity."""
    if not data.has_points or not data.measures:
        return Section("points", "Point by point")
    columns = [data.mean_by_point(m) for m in data.measures]
    order, caption, half = np.arange(len(data.points)), "", MOST_PLACES // 2
    if len(order) > MOST_PLACES:
        known = np.flatnonzero(np.isfinite(columns[0]))
        ordered = known[np.argsort(-columns[0][known], kind="stable")]
        order = np.concatenate([ordered[:half], ordered[-half:]])
        caption = (
            f"The {half} points with most and the {half} with least {data.title(data.measures[0].expression)}, of"
            f" {count(len(data.points))}. Chance adds to the extremes of many points: played again, they lie nearer to the middle."
        )
    n, _ = data.results.n_runs_by_point()
    rows = [
        [str(i), data.results.label(int(i)), count(int(n[i]))]
        + [(percent if m.is_share else estimate)(c[i]) for m, c in zip(data.measures, columns, strict=True)]
        for i in order
    ]
    heads = [
        ("point", "number"),
        ("values", "text"),
        *numbers("games", *(data.title(m.expression) for m in data.measures)),
    ]
    return Section("points", "Point by point", tables=[ReportTable("", heads, rows, caption)])
