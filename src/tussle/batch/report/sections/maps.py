"""Quantities over the two variables that do most."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from tussle.batch.report import plots_of_variables as plots
from tussle.batch.report.binning import Lane, even_lane, lane_of
from tussle.batch.report.drawing import shortened
from tussle.batch.report.parts import Plate, Section
from tussle.batch.report.subject import Measure, Subject
from tussle.batch.report.words import capital
from tussle.batch.variables import Variable

MOST_PLACES = 20
"""Choices along one side."""
MOST_CELLS = 16
"""Bins along one side."""
POINTS_PER_CELL = 5
FEWEST_CELLS = 4
"""Cells with games, below which a map says less than a table."""


def maps(subject: Subject) -> Section:
    """Quantities over the two variables that do most."""
    pair = _two_for_a_map(subject)
    if pair is None:
        return Section("maps", "Two variables at once")
    lanes = [lane_of(v, subject.points) for v in pair]
    n_bins = int(np.clip(np.sqrt(len(subject.points) / POINTS_PER_CELL), 3, MOST_CELLS))
    across, up = (even_lane(lane, subject.points, n_bins) for lane in lanes)
    caption = "Mean of the games in each cell"
    if not (across.texts and up.texts):
        caption += f"; ranges are cut into {n_bins} equal parts"
    caption += ". Grey: no games."
    if len(subject.variables) > 2:
        caption += (
            f" The two strongest of {len(subject.variables)} variables; the others vary behind each cell."
        )
    plates = [_map(subject, across, up, stem, measures, caption) for stem, measures in subject.groups]
    return Section("maps", "Two variables at once", plates=tuple(itertools.chain.from_iterable(plates)))


def _two_for_a_map(subject: Subject) -> tuple[Variable, Variable] | None:
    """The two strongest variables; of them, what has names goes up, where there is room for them."""
    if len(subject.variables) < 2:
        return None
    first, second = sorted(subject.by_strength()[:2], key=subject.variables.index)
    cells = {(repr(p[first.name]), repr(p[second.name])) for p in subject.points}
    lanes = [lane_of(v, subject.points) for v in (first, second)]
    if len(cells) < FEWEST_CELLS or any(not lane.is_number and lane.n_places > MOST_PLACES for lane in lanes):
        return None
    return (second, first) if not lanes[0].is_number and lanes[1].is_number else (first, second)


def _map(
    subject: Subject, across: Lane, up: Lane, stem: str, measures: Sequence[Measure], caption: str
) -> list[Plate]:
    """One map of the difference of two rivals, or one map of each quantity."""
    title = f"by {across.variable.name} and {up.variable.name}"
    if len(measures) == 2 and measures[0].team is not None:
        low, high = sorted(measures, key=lambda m: m.team or 0)
        what = "share of the games won" if low.is_share else low.label
        ends = ((low.name, low.colour), (high.name, high.colour))
        names = [shortened(name, 14) for name, _ in ends]
        label = f"◂ {names[0]}  ·  {names[1]} ▸"
        words = f" Colour: {what}, {high.name} minus {low.name}; the colour is of the team that has more."
        if low.is_share:
            words += " In percentage points."
        return [
            Plate(
                f"{stem}-map",
                f"{capital(what)}, {high.name} minus {low.name}, {title}",
                caption + words,
                lambda: plots.heat_map(
                    plots.Field(
                        across,
                        up,
                        _cells(subject, high, across, up) - _cells(subject, low, across, up),
                        label,
                        ends,
                        low.is_share,
                    )
                ),
            )
        ]
    return [
        Plate(
            f"{stem}-map-{m.team}" if m.team is not None else f"{stem}-map",
            f"{capital(m.label)}: {m.name}, {title}" if m.team is not None else f"{m.label} {title}",
            caption,
            lambda m=m: plots.heat_map(  # type: ignore[misc]
                plots.Field(across, up, _cells(subject, m, across, up), m.label, (), m.is_share)
            ),
        )
        for m in measures
    ]


def _cells(subject: Subject, measure: Measure, across: Lane, up: Lane) -> np.ndarray:
    """Mean of a quantity in each cell, (up.n_places, across.n_places); NaN without games."""
    values = subject.values(measure.expression)
    is_known = np.isfinite(values)
    cell = (up.index * across.n_places + across.index)[subject.point[is_known]]
    n_cells = up.n_places * across.n_places
    n = np.bincount(cell, minlength=n_cells)
    total = np.bincount(cell, weights=values[is_known], minlength=n_cells)
    return (total / np.where(n > 0, n, np.nan)).reshape(up.n_places, across.n_places)
