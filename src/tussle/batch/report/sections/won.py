"""Who won how often, and by how much."""

from __future__ import annotations

import numpy as np

from tussle.batch.report import plots
from tussle.batch.report.drawing import colour_of
from tussle.batch.report.parts import Plate, Section
from tussle.batch.report.sections.scores import outside
from tussle.batch.report.subject import Subject
from tussle.batch.report.words import count, estimate, percent
from tussle.batch.statistics import BLOCKS_FROM

MOST_BARS = 20
"""Points with a bar each."""


def won(subject: Subject) -> Section:
    """Who won how often."""
    results = subject.results
    if not subject.wins:
        return Section("won", "Who won")
    plates = [
        Plate(
            "wins",
            "Games won",
            f"Bars: share of the {count(subject.n_good, 'game')}. Thin line: its 95 % interval, Wilson's{_blocks(subject)}."
            " A game is a tie where the highest score is shared.",
            lambda: plots.share_bars(_bars(subject)),
        )
    ]
    if len(subject.wins) >= 2:
        plates.append(_margin(subject))
    if 1 < len(results.points) <= MOST_BARS:
        plates.append(_by_point(subject))
    return Section("won", "Who won", plates=tuple(plates))


def _blocks(subject: Subject) -> str:
    """What is said of intervals that are taken over several points."""
    if not subject.has_points:
        return ""
    is_shared = not subject.results.info.get("independent") and len(np.unique(subject.seed)) >= BLOCKS_FROM
    return f", over all points; {'games of one seed count as one block' if is_shared else 'each game counts by itself'}"


def _bars(subject: Subject) -> list[plots.Bar]:
    shares = [s for s in subject.results.shares() if s.team is None or s.team in subject.rivals]
    shares.sort(key=lambda s: (s.team is None, -s.n, s.team or 0))
    return [
        plots.Bar(
            s.name, plots.END_COLOURS["time"] if s.team is None else colour_of(s.team), s.value, s.low, s.high,
            f"{percent(s.value)}  ({count(s.n)})",
        )
        for s in shares
    ]  # fmt: skip


def _margin(subject: Subject) -> Plate:
    """By how much the one who won more often was ahead of the next."""
    ahead, behind = subject.rivals[:2]
    values = subject.values(f"score[{ahead}]-score[{behind}]")
    values = values[np.isfinite(values)]
    first, second = ((subject.name_of(t), colour_of(t)) for t in (behind, ahead))
    return Plate(
        "margin",
        f"Score of {second[0]} minus score of {first[0]}",
        f"Each game once. Line: the mean, {estimate(values.mean())}. Grey: about equal, ties among them."
        f" The two numbers belong to the same game, so this says more"
        f" than the two distributions beside each other.{outside(values)}",
        lambda: plots.margins(values, first, second, "difference of the scores"),
    )


def _by_point(subject: Subject) -> Plate:
    results = subject.results
    lines = [results.shares(point) for point in range(len(results.points))]
    order = [m.team for m in sorted(subject.wins, key=lambda m: m.team or 0)]
    parts = []
    for team in [*order[:1], None, *order[1:]]:
        shares = np.nan_to_num([next(s.value for s in line if s.team == team) for line in lines])
        if shares.any():
            parts.append(
                ("ties", plots.END_COLOURS["time"], shares)
                if team is None
                else (subject.name_of(team), colour_of(team), shares)
            )
    return Plate(
        "wins-by-point",
        f"Games won by {results.variables[0].name}"
        if len(results.variables) == 1
        else "Games won at each point",
        "Each bar is one set of values and all of its games; its parts are who won them.",
        lambda: plots.stacked_shares([subject.point_name(i) for i in range(len(results.points))], parts),
    )
