"""What another choice changes, in games with the same seed."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from tussle.batch.report import plots_of_variables as plots
from tussle.batch.report.binning import Lane, lane_of
from tussle.batch.report.parts import Column, Plate, Section, Table
from tussle.batch.report.subject import Measure, Subject
from tussle.batch.report.words import capital, count, estimate, file_name, p_value, percent, sentence, signed
from tussle.batch.selection import written
from tussle.batch.statistics import Comparison
from tussle.batch.variables import Range
from tussle.errors import ParameterError

MOST_PLACES = 20
"""Choices in one plot."""
MOST_NUMBERS = 6
"""Numbers to choose from that are compared with each other; more of them are rather read along an axis."""


def differences(subject: Subject) -> Section:
    """What another choice changes, seed by seed."""
    plates, rows, lead = [], [], []
    for variable in subject.variables:
        lane = lane_of(variable, subject.points)
        if isinstance(variable, Range) or lane.n_places > (MOST_NUMBERS if lane.is_number else MOST_PLACES):
            continue
        try:
            found = [
                (stem, measures, [_compared(subject, lane, m) for m in measures])
                for stem, measures in subject.groups
            ]
        except ParameterError as error:
            lead.append(f"The values of {variable.name} are not compared: {sentence(str(error))}")
            continue
        for stem, measures, lines in found:
            plates.append(_difference(lane, stem, measures, lines))
            by_place = itertools.chain.from_iterable(zip(*lines, strict=True))
            rows += [_cells(subject, m, c) for m, c in zip(itertools.cycle(measures), by_place, strict=False)]
    if not plates:
        return Section("differences", "Paired differences", lead=tuple(lead))
    columns = ("pairs", "mean before", "after", "difference", "95 % interval", "more / less / equal", "p")
    pairs = "Games with the same seed and otherwise the same values are compared with each other."
    if subject.results.info.get("independent"):
        pairs = "Games with otherwise the same values are compared in the order of their seeds; each has a seed of its own."
    caption = (
        f"{pairs} more / less / equal: in how many pairs. p: of the exact sign test, each by itself; among twenty such numbers one is"
        " below 0.05 by chance."
    )
    heads = (Column("quantity", "text"), Column("change", "text"), *map(Column, columns))
    table = Table("In numbers", heads, tuple(rows), caption)
    return Section("differences", "Paired differences", tuple(lead), plates=tuple(plates), tables=(table,))


def _compared(subject: Subject, lane: Lane, measure: Measure) -> list[Comparison]:
    """Each further value with the first one.

    Raises:
        ParameterError: A value cannot be named, or the points cannot be paired.
    """
    name = lane.variable.name
    sides: list[int | str] = []
    for place in range(lane.n_places):
        points = np.flatnonzero(lane.index == place)
        value = written(subject.points[int(points[0])][name])
        sides.append(int(points[0]) if len(points) == 1 else f"{name}={value}")
    return [subject.results.compare(measure.expression, sides[0], side) for side in sides[1:]]


def _difference(
    lane: Lane, stem: str, measures: Sequence[Measure], lines: Sequence[Sequence[Comparison]]
) -> Plate:
    is_share, label = measures[0].is_share, measures[0].label
    series = [
        plots.series_of(m.name, m.colour, m.marker, [(c.difference, c.low, c.high) for c in line])
        for m, line in zip(measures, lines, strict=True)
    ]
    unit = "percentage points of the games won" if is_share else f"change of {label}"
    return Plate(
        f"{stem}-change-by-{file_name(lane.variable.name)}",
        f"{capital(label)}: change against {lane.variable.name}={lane.texts[0]}",
        f"Mean difference between games of a pair, with its 95 % interval. Right of 0: more than with {lane.texts[0]}.",
        lambda: plots.in_rows(lane.texts[1:], series, unit, is_share=is_share, is_difference=True),
    )


def _cells(subject: Subject, measure: Measure, c: Comparison) -> tuple[str, ...]:
    def shown(value: float) -> str:
        return percent(value) if measure.is_share else estimate(value)

    def points(value: float) -> str:
        return (
            estimate(100.0 * value) + "\u00a0pp"
            if measure.is_share and np.isfinite(value)
            else estimate(value)
        )

    return (
        subject.title(measure.expression), f"{c.a} → {c.b}", count(c.n), shown(c.mean_a), shown(c.mean_b),
        signed(points(c.difference)), f"{points(c.low)} to {points(c.high)}",
        f"{count(c.n_greater)} / {count(c.n_less)} / {count(c.n_equal)}",
        p_value(c.p),
    )  # fmt: skip
