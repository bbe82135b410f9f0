"""A table of points, those with most and fewest wins where they are many."""

from __future__ import annotations

import numpy as np

from tussle.batch.report.parts import Column, Section, Table
from tussle.batch.report.subject import Subject
from tussle.batch.report.words import count, estimate, percent

MOST_ROWS = 20


def points(subject: Subject) -> Section:
    """A table of points, those with most and fewest wins where they are many."""
    results = subject.results
    if not subject.has_points:
        return Section("points", "Point by point")
    measures = (*subject.wins, *subject.scores, *subject.more)
    if not measures:
        return Section("points", "Point by point")
    columns = {m.expression: subject.mean_by_point(m) for m in measures}
    leading = measures[0]
    order = np.arange(len(subject.points))
    caption = ""
    if len(order) > MOST_ROWS:
        values = columns[leading.expression]
        order = order[np.isfinite(values)][np.argsort(-values[np.isfinite(values)], kind="stable")]
        half = MOST_ROWS // 2
        order = np.concatenate([order[:half], order[-half:]])
        title = subject.title(leading.expression)
        caption = (
            f"The {half} points with most and the {half} with least {title}, of {count(len(subject.points))}. The extremes of many"
            " points owe something to chance: played again, they lie nearer to the middle."
        )
    n = np.bincount(
        subject.point[np.isfinite(subject.values(leading.expression))], minlength=len(subject.points)
    )
    rows = tuple(
        (
            str(i), results.label(int(i)), count(int(n[i])),
            *(percent(columns[m.expression][i]) if m.is_share else estimate(columns[m.expression][i]) for m in measures),
        )
        for i in order
    )  # fmt: skip
    heads = (
        Column("point"),
        Column("values", "text"),
        Column("games"),
        *(Column(subject.title(m.expression)) for m in measures),
    )
    return Section("points", "Point by point", tables=(Table("", heads, rows, caption),))
