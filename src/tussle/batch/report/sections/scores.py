"""How scores are distributed, and the means of all that was counted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tussle.batch.report import plots
from tussle.batch.report.parts import Column, Plate, Section, Table
from tussle.batch.report.subject import Measure, Subject, varies
from tussle.batch.report.words import capital, count, estimate, file_name, number

MOST_MEANS = 60


def scores(subject: Subject) -> Section:
    """How much each team scored, and the means of all that was counted."""
    plates = []
    for measures in (subject.scores, *((measure,) for measure in subject.more)):
        varied = [m for m in measures if varies(subject.known(m.expression))]
        if varied:
            plates.append(_distribution(subject, varied))
    title = "How much was scored" if subject.rivals else "What was counted"
    means = _means(subject)
    return Section("scores", title, plates=tuple(plates), tables=(means,) if means.rows else ())


def _distribution(subject: Subject, measures: Sequence[Measure]) -> Plate:
    """How one quantity of several teams, or one of its own, is distributed."""
    label, has_teams = measures[0].label, measures[0].team is not None
    names = [m.name if has_teams else "" for m in measures]
    values = [subject.known(m.expression) for m in measures]
    spreads = [plots.Spread(n, m.colour, v) for n, m, v in zip(names, measures, values, strict=True)]
    return Plate(
        "scores" if has_teams else f"distribution-{file_name(measures[0].expression)}",
        "Distribution of the scores" if has_teams and subject.rivals else capital(label),
        "Height: number of games; all rows have the same scale. Dot: mean. Line below: the middle half of the games."
        + outside(np.concatenate(values)),
        lambda: plots.distributions(spreads, label),
    )


def outside(values: np.ndarray) -> str:
    """What is said of games whose values the plot does not reach."""
    n = len(values) - len(plots.inside(values))
    far = f"from {number(values.min())} to {number(values.max())}"
    return f" The values go {far}; {count(n)} of {count(len(values))} lie beyond the plot." if n else ""


def _means(subject: Subject) -> Table:
    results = subject.results
    names = [q for q in results.quantities if not q.startswith(("wins[", "ties", "start[", "steps"))]
    names = [q for q in names if varies(subject.known(q)) and not _is_score_again(subject, q)]
    left_out = len(names) - MOST_MEANS
    means = results.means([*(m.expression for m in subject.more), *names[:MOST_MEANS]])
    rows = tuple(
        (
            subject.title(m.name), estimate(m.value), f"{estimate(m.low)} to {estimate(m.high)}", estimate(m.sd),
            number(m.quantiles[0.05]), number(m.quantiles[0.5]), number(m.quantiles[0.95]), count(m.n),
        )
        for m in means
    )  # fmt: skip
    columns = ("mean", "95 % interval of the mean", "sd", "5 %", "median", "95 %", "games")
    caption = (
        "The interval is where the mean would lie; the columns 5 %, median and 95 % are where the games lie. "
        "What was the same in all games is not shown."
    )
    if left_out > 0:
        caption += f" {left_out} more quantities are in the tables of the batch."
    return Table("All that was counted", (Column("quantity", "text"), *map(Column, columns)), rows, caption)


def _is_score_again(subject: Subject, name: str) -> bool:
    """It is what a metric reported as its score, where that is the team's score."""
    plugin, dot, score = name.rpartition(".")
    return (
        bool(plugin and dot)
        and score.startswith("score[")
        and np.array_equal(subject.known(name), subject.known(score))
    )
