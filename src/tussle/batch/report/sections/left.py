"""Who was left as time went on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from tussle.batch.report import plots
from tussle.batch.report.drawing import PAPER, colour_of, mixed
from tussle.batch.report.parts import Plate, Section
from tussle.batch.report.subject import Subject

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SMALL = 5
"""Teams that have so many times fewer entities than the largest get a plot of their own."""
MOST_NAMED = 4
MOST_CURVES = 6
"""Points whose curves can be told apart in one plot."""


def left(subject: Subject) -> Section:
    """Who was left as time went on."""
    results = subject.results
    teams = [t for t in results.teams if _has_losses(subject, t)]
    if not teams or not subject.n_good:
        return Section("left", "Who was left")
    plates = [_over_time(subject, alike) for alike in _of_like_size(subject, teams)]
    if 1 < len(results.points) <= MOST_CURVES:
        plates += [_curves_by_point(subject, team) for team in teams]
    return Section("left", "Who was left", plates=tuple(plates))


def _over_time(subject: Subject, teams: Sequence[int]) -> Plate:
    names = ", ".join(map(subject.name_of, teams)) if len(teams) <= MOST_NAMED else f"{len(teams)} teams"
    return Plate(
        f"left-{'-'.join(map(str, teams))}",
        f"{names} left over time",
        "Mean number of each team that is left. Band: 95 % interval of the mean at each time. Games that ended early count on as they"
        " ended.",
        lambda: plots.curves_over_time(
            [_curve(subject, t, None, subject.name_of(t), colour_of(t), "-") for t in teams],
            f"{names} left" if len(teams) == 1 else "number left",
        ),
    )


def _of_like_size(subject: Subject, teams: Sequence[int]) -> list[list[int]]:
    """Teams that fit on one axis: the large ones, and apart from them those that would lie at its foot."""
    size = {team: float(subject.known(f"start[{team}]").max(initial=0.0)) for team in teams}
    large = [team for team in teams if size[team] * SMALL >= max(size.values())]
    small = [team for team in teams if team not in large]
    return [group for group in (large, small) if group]


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
