"""How scores are distributed, and the means of all that was counted."""

from __future__ import annotations

import numpy as np

from tussle.batch.report import plots
from tussle.batch.report.parts import Column, Plate, Section, Table
from tussle.batch.report.subject import Measure, Subject, varies
from tussle.batch.report.words import count, estimate, number

MOST_MEANS = 60


def scores(subject: Subject) -> Section:
    """How much each team scored, and the means of all that was counted."""
    measures = [m for m in (*subject.scores, *subject.more) if varies(subject.known(m.expression))]
    plates = []
    by_label: dict[str, list[Measure]] = {}
    for measure in measures:
        by_label.setdefault(measure.label, []).append(measure)
    for i, (label, group) in enumerate(by_label.items()):
        name = "scores" if i == 0 and group[0].team is not None else f"distribution-{i}"
        plates.append(
            Plate(
                name,
                f"Distribution of the {label}" if group[0].team is not None else label,
                "Height: number of games; all rows have the same scale. Dot: mean. Line below: the middle half of the games."
                + outside(np.concatenate([subject.known(m.expression) for m in group])),
                lambda group=group, label=label: plots.distributions(  # type: ignore[misc]
                    [
                        plots.Spread(
                            m.name if m.team is not None else "", m.colour, subject.known(m.expression)
                        )
                        for m in group
                    ],
                    label,
                ),
            )
        )
    return Section(
        "scores",
        "How much was scored" if subject.rivals else "What was counted",
        plates=tuple(plates),
        tables=(_means(subject),),
    )


def outside(values: np.ndarray) -> str:
    """What is said of games whose values the plot does not reach."""
    n = len(values) - len(plots.inside(values))
    far = f"from {number(values.min())} to {number(values.max())}"
    return f" The values go {far}; {count(n)} of {count(len(values))} lie beyond the plot." if n else ""


def _means(subject: Subject) -> Table:
    results = subject.results
    names = [q for q in results.quantities if not q.startswith(("wins[", "ties", "start[", "steps"))]
    names = [q for q in names if varies(subject.known(q))]
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
