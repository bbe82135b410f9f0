"""Each quantity along each variable."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from tussle.batch.report.binning import FEWEST_SEEDS, Lane, Means, grouped_means, lane_of
from tussle.batch.report.parts import Plate, Section
from tussle.batch.report.plots_of_variables import Series, along, in_rows
from tussle.batch.report.subject import MOST_VARIABLES, Measure, Subject
from tussle.batch.report.words import capital, count, file_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_DOTS = 400
"""Points that are shown one by one behind the means."""
MOST_PLACES = 20
"""Choices that are shown side by side."""


def effects(subject: Subject) -> Section:
    """Each quantity along each variable."""
    lanes = [lane_of(variable, subject.points) for variable in subject.shown_variables]
    if not lanes or not subject.groups:
        return Section("effects", "What the varied values do")
    plates = []
    for stem, measures in subject.groups:
        lines = [_Line(lane, _series(subject, lane, measures)) for lane in lanes]
        limits = _limits(lines, measures[0].is_share) if len(lines) > 1 else None
        plates.append([_effect(subject, line, stem, measures, limits) for line in lines])
    lead = []
    hidden = len(subject.variables) - len(subject.shown_variables)
    if hidden:
        lead.append(
            f"Shown are the {MOST_VARIABLES} of {len(subject.variables)} variables with the strongest effects."
        )
    by_variable = itertools.chain.from_iterable(zip(*plates, strict=True))
    return Section("effects", "What the varied values do", lead=tuple(lead), plates=tuple(by_variable))


@dataclass(frozen=True)
class _Line:
    lane: Lane
    series: list[Series]


def _limits(lines: Sequence[_Line], is_share: bool) -> tuple[float, float]:
    """Ends of an axis on which all lines have their place, so that effects of one variable and another can be compared."""
    every = [
        values[: MOST_PLACES if not line.lane.is_number else None]
        for line in lines for each in line.series for values in (each.mean, each.low, each.high, each.dots[1])
    ]  # fmt: skip
    low, high = np.nanmin(np.concatenate(every)), np.nanmax(np.concatenate(every))
    room = 0.04 * (high - low) or 0.5
    if is_share:
        return max(low - room, -0.02), min(high + room, 1.02)
    return low - room, high + room


def _effect(
    subject: Subject, line: _Line, stem: str, measures: Sequence[Measure], limits: tuple[float, float] | None
) -> Plate:
    label, is_share, lane = measures[0].label, measures[0].is_share, line.lane
    others = len(subject.variables) - 1
    caption = _places_in_words(lane, len(subject.points)) + _interval_in_words(subject)
    if others:
        what = "other variable varies" if others == 1 else f"{others} other variables vary"
        caption += f" The {what} behind each mean. All plots of this quantity have the same scale."

    def draw() -> Figure:
        if lane.is_number:
            return along(lane, line.series, label, is_share=is_share, limits=limits)
        kept = slice(0, MOST_PLACES)
        cut = [replace(s, mean=s.mean[kept], low=s.low[kept], high=s.high[kept]) for s in line.series]
        return in_rows(lane.texts[kept], cut, label, is_share=is_share, limits=limits)

    name = f"{stem}-by-{file_name(lane.variable.name)}"
    return Plate(name, f"{capital(label)} by {lane.variable.name}", caption, draw)


def _places_in_words(lane: Lane, n_points: int) -> str:
    if lane.texts and lane.n_places > MOST_PLACES and not lane.is_number:
        return f"Mean at the first {MOST_PLACES} of {lane.n_places} values. "
    if lane.texts:
        return "Mean at each value. "
    return f"Means of {count(n_points)} points in {lane.n_places} bins of equal number. "


def _interval_in_words(subject: Subject) -> str:
    if subject.is_drawn and len(np.unique(subject.seed)) >= FEWEST_SEEDS:
        return "Bars: 95 % interval of the mean, over points and seeds."
    if subject.is_drawn:
        return "Bars: 95 % interval of the mean over points, with these seeds."
    return "Bars: 95 % interval of the mean over seeds."


def means_at(subject: Subject, lane: Lane, measure: Measure) -> Means:
    """Mean of a quantity at each place of an axis."""
    return grouped_means(
        subject.values(measure.expression), lane.index[subject.point], lane.n_places, subject.draw, subject.seed,
        is_share=measure.is_share, is_sampled=subject.is_drawn,
    )  # fmt: skip


def _series(subject: Subject, lane: Lane, measures: Sequence[Measure]) -> list[Series]:
    """Means of each quantity along an axis, and single points behind them where there are bins and not too many points."""
    found = []
    for measure in measures:
        means = means_at(subject, lane, measure)
        dots = (np.empty(0), np.empty(0))
        if not lane.texts and not measure.is_share and len(subject.points) <= MOST_DOTS:
            at = np.array([float(point[lane.variable.name]) for point in subject.points])
            dots = (at, subject.mean_by_point(measure))
        found.append(
            Series(measure.name, measure.colour, measure.marker, means.mean, means.low, means.high, dots)
        )
    return found
