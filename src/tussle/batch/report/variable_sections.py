"""The sections of a report about what varies: effects, maps, strengths, differences and points."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tussle.batch.report import plots
from tussle.batch.report.drawing import MARKERS, shortened
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
from tussle.batch.report.report_data import MAX_VARIABLES, Measure, ReportData, strength_of
from tussle.batch.report.sections import Plot, ReportTable, Section, numbers
from tussle.batch.response import FittedVariable
from tussle.batch.selection import written
from tussle.batch.sensitivity import Effect
from tussle.batch.statistics import PairedComparison
from tussle.batch.variables import Range
from tussle.errors import ParameterError
from tussle.palette import TEAM_COLOURS

MAX_BARS = 40
"""Largest number of points whose intervals are drawn as bars."""
MAX_PLACES = 20
"""Largest number of choices in a plot, and of points in a table."""
MAX_PANELS = 3
"""Maps have a panel for each value of a choice with at most so many values."""
N_ALONG, N_GRID = 41, 21
"""Places of a fit along a variable, and along each side of a map."""
MAX_NUMBERS = 6
"""Largest number of values of a numeric choice that are compared in pairs."""
DASHES = ("-", "--", "-.", ":", (0, (5, 1)), (0, (1, 1)))


def effects(data: ReportData) -> Section:
    """Return the response of each quantity to each variable."""
    axes = data.shown_axes
    found = [_effects_of(data, axes, stem, measures) for stem, measures in data.groups] if axes else []
    hidden = len(data.axes) - len(axes)
    lead = (
        [f"The {MAX_VARIABLES} of {len(data.axes)} variables with the strongest effects are shown."]
        if hidden
        else []
    )
    by_variable = list(itertools.chain.from_iterable(itertools.zip_longest(*found)))
    return Section(
        "effects", "What the varied values do", lead if by_variable else [], [p for p in by_variable if p]
    )


def _effects_of(
    data: ReportData, axes: Sequence[FittedVariable], stem: str, measures: Sequence[Measure]
) -> list[Plot]:
    """Return plots of some measures along each variable; each measure by itself where a choice has a line for each value."""
    found = []
    for axis in axes:
        is_split = data.lines is not None and data.lines != axis and len(measures) > 1
        for some in [[m] for m in measures] if is_split else [list(measures)]:
            name = f"{stem}-{some[0].team}" if is_split else stem
            what = some[0].label
            if len(some) == 1 and some[0].team is not None:
                what = data.title(some[0].expression)
            draw = _curves if axis.is_number else _rows
            found.append(
                Plot(
                    f"{name}-by-{file_name(axis.variable.name)}",
                    f"{capital(what)}, by {axis.variable.name}",
                    _effect_caption(data, axis, some),
                    lambda draw=draw, axis=axis, some=some: draw(data, axis, some),  # type: ignore[misc]
                )
            )
    return found


def _levels(
    data: ReportData, axis: FittedVariable, measures: Sequence[Measure]
) -> list[tuple[Measure, Mapping[str, Any], str, str, Any, str]]:
    """Measure, values that are held, name, colour, dashes and marker of each line along an axis."""
    lines = data.lines
    if lines is None or lines == axis:
        return [(m, {}, m.name, m.colour, "-", m.marker) for m in measures]
    return [
        (m, {lines.variable.name: value}, f"{written(value)}", colour, dashes, marker)
        for m in measures
        for value, colour, dashes, marker in zip(lines.values, TEAM_COLOURS, DASHES, MARKERS, strict=False)
    ]


def _curves(data: ReportData, axis: FittedVariable, measures: Sequence[Measure]) -> Any:
    """Draw the fits along a number, and the means of the points."""
    name, curves, dots = axis.variable.name, [], []
    at = axis.spread(N_ALONG)
    for measure, given, label, colour, dashes, marker in _levels(data, axis, measures):
        means = data.results.means_by_point(measure.expression)
        chosen = data.points_with(given)
        x = np.array([float(data.points[i][name]) for i in chosen])
        rows = np.array([(means[i].value, means[i].low, means[i].high) for i in chosen])
        if not _has_bars(data, axis):
            rows[:, 1:] = np.nan
        dots.append(replace(plots.series_of(label, colour, marker, rows), x=x))
        response = data.response(measure)
        if response is not None:
            fit = response.along(name, at, given)
            x = np.array(at, dtype=float)
            curves.append(plots.Series(label, colour, dashes, fit.value, fit.low, fit.high, x))
    return plots.response_curves(axis, curves, dots, measures[0].label, is_share=measures[0].is_share)


def _has_bars(data: ReportData, axis: FittedVariable) -> bool:
    """Nothing varies behind the points of an axis but what has lines."""
    behind = [other for other in data.axes if other not in (axis, data.lines)]
    return not behind and len(data.points) <= MAX_BARS


def _rows(data: ReportData, axis: FittedVariable, measures: Sequence[Measure]) -> Any:
    """Draw the means at each value of a choice."""
    shown = replace(axis, values=axis.values[:MAX_PLACES])
    series = [
        plots.series_of(label, colour, marker, data.means_at(shown, measure, given))
        for measure, given, label, colour, _, marker in _levels(data, axis, measures)
    ]
    names = [written(value) for value in shown.values]
    return plots.in_rows(names, series, measures[0].label, is_share=measures[0].is_share)


def _effect_caption(data: ReportData, axis: FittedVariable, measures: Sequence[Measure]) -> str:
    lines = data.lines if data.lines != axis else None
    behind = [other for other in data.axes if other not in (axis, lines)]
    others = (
        " and ".join(other.variable.name for other in behind) if len(behind) < 3 else "the other variables"
    )
    held = f", {others} as at all points" if behind else ""
    is_fitted = all(data.response(m) is not None for m in measures)
    each = f" for each {lines.variable.name}" if lines is not None else ""
    if not axis.is_number:
        first = (
            f"the first {MAX_PLACES} of {len(axis.values)} values"
            if len(axis.values) > MAX_PLACES
            else "each value"
        )
        how = f"by the fit{held}" if is_fitted else "of its games"
        return f"Mark: mean at {first}{each}, {how}. Bar: 95 % interval of the mean over the seeds."
    bar = ", with its 95 % interval over the seeds" if _has_bars(data, axis) else ""
    differ = f"; {others} differ{'s' if len(behind) == 1 else ''} between the dots" if behind else ""
    dots = f"Dot: mean of the games of a point{bar}{differ}."
    if not is_fitted:
        return f"{dots} There are too few points for a fit."
    return f"{dots} Line: smooth fit (Gaussian process){each}{held}. Band: 95 % interval of the fit at each place."


# -- two variables ----------------------------------------------------------------------------------------------------------


def maps(data: ReportData) -> Section:
    """Quantities over the two strongest variables that are numbers."""
    section = Section("maps", "Two variables at once")
    if sum(axis.is_number for axis in data.axes) < 2:
        return section
    pair = [axis for axis in data.by_strength() if axis.is_number][:2]
    across, up = sorted(pair, key=data.axes.index)
    found = [_maps_of(data, across, up, stem, measures) for stem, measures in data.groups]
    return replace(section, plots=list(itertools.chain.from_iterable(found)))


def _maps_of(
    data: ReportData, across: FittedVariable, up: FittedVariable, stem: str, measures: Sequence[Measure]
) -> list[Plot]:
    """One map of the difference of two rivals, or one map of each quantity."""
    title = f"by {across.variable.name} and {up.variable.name}"
    if len(measures) == 2 and measures[0].team is not None:
        low, high = sorted(measures, key=lambda m: m.team or 0)
        what = f"{'share of the games won' if low.is_share else low.label}, {high.name} minus {low.name}"
        unit = ", in percentage points" if low.is_share else ""
        label = f"◂ {shortened(low.name, 14)}  ·  {shortened(high.name, 14)} ▸"
        more = Measure(f"{high.expression}-{low.expression}", "", None, label, low.is_share)
        kinds: list[tuple[str, str, str, Measure, tuple[str, ...]]] = [
            (
                f"{stem}-map",
                f"{capital(what)}, {title}",
                f" Colour: {what}{unit}; it is that of the team with more.",
                more,
                (low.colour, high.colour),
            )
        ]
    else:
        kinds = [
            (
                f"{stem}-map-{m.team}" if m.team is not None else f"{stem}-map",
                f"{capital(m.label)}: {m.name}, {title}" if m.team is not None else f"{m.label} {title}",
                "", m, (),
            )
            for m in measures
        ]  # fmt: skip
    caption = _map_caption(data, across, up)
    return [
        Plot(
            name, text, caption + colour,
            lambda m=m, ends=ends: plots.response_maps(  # type: ignore[misc]
                across, up, _surfaces(data, m, across, up), m.label, ends, is_share=m.is_share
            ),
        )
        for name, text, colour, m, ends in kinds
        if data.response(m) is not None
    ]  # fmt: skip


def _panels(data: ReportData) -> FittedVariable | None:
    return data.lines if data.lines is not None and len(data.lines.values) <= MAX_PANELS else None


def _surfaces(
    data: ReportData, measure: Measure, across: FittedVariable, up: FittedVariable
) -> list[plots.Surface]:
    response, panels, means = data.response(measure), _panels(data), data.mean_by_point(measure)
    assert response is not None
    xs, ys, found = across.spread(N_GRID), up.spread(N_GRID), []
    for value in panels.values if panels is not None else [None]:
        given = {} if panels is None else {panels.variable.name: value}
        chosen = [i for i in data.points_with(given) if np.isfinite(means[i])]
        dots = [[float(data.points[i][axis.variable.name]) for i in chosen] for axis in (across, up)]
        plane = response.plane(across.variable.name, up.variable.name, xs, ys, given)
        name = "" if panels is None else f"{panels.variable.name} = {written(value)}"
        found.append(
            plots.Surface(
                name, np.array(xs, float), np.array(ys, float), plane, np.array([*dots, means[chosen]])
            )
        )
    return found


def _map_caption(data: ReportData, across: FittedVariable, up: FittedVariable) -> str:
    panels = _panels(data)
    behind = [axis.variable.name for axis in data.axes if axis not in (across, up, panels)]
    numbers_ = sum(axis.is_number for axis in data.axes)
    chosen = f" The two strongest of {numbers_} variables that are numbers." if numbers_ > 2 else ""
    held = (
        f", {' and '.join(behind) if len(behind) < 3 else 'the other variables'} as at all points"
        if behind
        else ""
    )
    return (
        f"Dot: mean of the games of a point. Lines and ground: smooth fit (Gaussian process){held}.{chosen}"
    )


# -- sensitivity ------------------------------------------------------------------------------------------------------------


def strengths(data: ReportData) -> Section:
    """The section on the influence of each variable on the quantities."""
    found, remarks = [], dict[str, None]()
    for measure in data.measures if data.axes else ():
        known = [e for e in _effects(data, measure) if strength_of(e) is not None]
        shown = sorted(known, key=lambda e: -(strength_of(e) or 0.0))[:MAX_PLACES]
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
    found = data.effects(measure)
    if len(data.axes) > 1:
        return found
    return [
        replace(e, total=None, total_low=None, total_high=None) for e in found
    ]  # "with others" says nothing of one variable


# -- differences ------------------------------------------------------------------------------------------------------------


def differences(data: ReportData) -> Section:
    """Return the differences between the values of each choice: paired by seed, or by the fit where no points can be paired."""
    rows, lead = list[list[str]](), []
    for axis in data.axes:
        if isinstance(axis.variable, Range) or len(axis.values) > (
            MAX_NUMBERS if axis.is_number else MAX_PLACES
        ):
            continue
        name = axis.variable.name
        fitted = [row for m in data.measures for row in _fitted_differences(data, axis, m)]
        if data.is_drawn and data.method != "product" and fitted:  # hardly any points would pair
            lead.append(
                f"The values of {name} are not compared in pairs, since points that differ in it differ in other variables, too; their "
                "differences are those of the fit."
            )
            rows += fitted
            continue
        try:
            compared = [(ms, [_compared(data, axis, m) for m in ms]) for _, ms in data.groups]
        except ParameterError as error:
            lead.append(f"The values of {name} are not compared: {sentence(str(error))}")
            continue
        for measures, lines in compared:
            for pairs in zip(*lines, strict=True):
                rows += [_difference_cells(data, m, c) for m, c in zip(measures, pairs, strict=True)]
    columns = numbers(
        "pairs", "mean before", "after", "difference", "95 % interval", "more / less / equal", "p"
    )
    paired, once = (
        "Pairs are games with the same seed and otherwise the same values.",
        ", in which a seed counts once",
    )
    if data.results.info.get("independent"):
        paired, once = (
            "Pairs are games with otherwise the same values, in the order of their seeds; each has a seed of its own.",
            "",
        )
    caption = (
        f"{paired} more / less / equal: number of pairs. p: exact sign test{once}, each by itself; of twenty such numbers one is below 0.05"
        " by chance."
    )
    table = ReportTable("", [("quantity", "text"), ("change", "text"), *columns], rows, caption)
    return Section("differences", "Differences of choices", lead, tables=[table] if rows else [])


def _fitted_differences(data: ReportData, axis: FittedVariable, measure: Measure) -> list[list[str]]:
    """Each further value less the first one, the other variables as at all points, by the fit."""
    response, name, first = data.response(measure), axis.variable.name, axis.values[0]
    if response is None or axis.is_number:
        return []
    value = response.along(name, axis.values).value
    scale, unit = (100.0, "\u00a0pp") if measure.is_share else (1.0, "")
    shown, found = percent if measure.is_share else estimate, []
    for i, other in enumerate(axis.values[1:], 1):
        difference, low, high = response.difference(name, first, other)
        found.append(
            [
                data.title(measure.expression), f"{name}={written(first)} → {name}={written(other)}", "–", shown(value[0]), shown(value[i]),
                signed(estimate(scale * difference)) + unit, interval(low, high, scale, unit), "–", "–",
            ]
        )  # fmt: skip
    return found


def _compared(data: ReportData, axis: FittedVariable, measure: Measure) -> list[PairedComparison]:
    """Compare each further value with the first one.

    Raises:
        ParameterError: A value cannot be named, or the points cannot be paired.
    """
    sides: list[int | str] = []
    for value in axis.values:
        points = data.points_with({axis.variable.name: value})
        sides.append(points[0] if len(points) == 1 else f"{axis.variable.name}={value}")
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
    order, caption, half = np.arange(len(data.points)), "", MAX_PLACES // 2
    if len(order) > MAX_PLACES:
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
