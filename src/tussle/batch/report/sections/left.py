"""Who was left as time went on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tussle.batch.report import plots
from tussle.batch.report.drawing import PAPER, colour_of, mixed
from tussle.batch.report.parts import Plate, Section
from tussle.batch.report.subject import Subject

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_CURVES = 6
"""Points whose curves can be told apart in one plot."""


def left(subject: Subject) -> Section:
    """Who was left as time went on."""
    results = subject.results
    teams = [t for t in results.teams if _has_losses(subject, t)]
    if not teams or not subject.n_good:
        return Section("left", "Who was left")
    plates = [
        Plate(
            "left",
            "Left over time",
            "Mean number of each team that is left. Band: 95 % interval of the mean at each time. Games that ended early count on as"
            " they ended.",
            lambda: plots.curves_over_time(
                [_curve(subject, t, None, subject.name_of(t), colour_of(t), "-") for t in teams],
                "number left",
            ),
        )
    ]
    if 1 < len(results.points) <= MOST_CURVES:
        plates += [_curves_by_point(subject, team) for team in teams]
    return Section("left", "Who was left", plates=tuple(plates))


def _has_losses(subject: Subject, team: int) -> bool:
    return f"lost[{team}]" in subject.results.quantities and bool(
        np.any(subject.known(f"lost[{team}]") > 0.0)
    )


def _curve(
    subject: Subject, team: int, point: int | None, name: str, colour: str, dashes: str
) -> plots.Curve:
    s = subject.results.survival(team, point)
    return plots.Curve(name, colour, dashes, s.t, s.mean, s.low, s.high)


def _curves_by_point(subject: Subject, team: int) -> Plate:
    results = subject.results
    n = len(results.points)
    base = colour_of(team)

    def draw() -> Figure:
        ramp = [mixed(base, PAPER, 0.45 * (1.0 - i / (n - 1))) for i in range(n)]
        dashes = ["-", "--", "-.", ":", (0, (5, 1)), (0, (1, 1))]
        curves = [
            _curve(subject, team, i, subject.point_name(i), ramp[i], dashes[i % len(dashes)])  # type: ignore[arg-type]
            for i in range(n)
        ]
        return plots.curves_over_time(curves, f"{subject.name_of(team)} left")

    return Plate(
        f"left-{team}-by-point",
        f"{subject.name_of(team)} left, by {results.variables[0].name if len(results.variables) == 1 else 'point'}",
        "Mean number left at each point, with its 95 % interval.",
        draw,
    )
