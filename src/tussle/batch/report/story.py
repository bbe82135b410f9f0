"""The sentences at the top of the page: the answer, and how much was played for it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tussle.batch.report.binning import lane_of, place_in_words
from tussle.batch.report.sections.effects import means_at
from tussle.batch.report.subject import Subject
from tussle.batch.report.words import count, estimate, number, percent, seconds, sentence
from tussle.batch.statistics import Share

MOST_NAMED = 3
"""Winners that the first sentence names."""


def answer(subject: Subject) -> str:
    """What came out, in one or two sentences."""
    results = subject.results
    if not results.n_runs:
        return "No game is finished yet."
    if not subject.n_good:
        return f"{_all_of(results.n_runs)} failed."
    over = f" over {count(len(subject.points), 'point')}" if subject.has_points else ""
    games = count(subject.n_good, "game")
    if not subject.wins:
        return f"{_who_was_left(subject)} in {games}{over}."
    shares = [s for s in results.shares() if s.n > 0]
    ties = next((s.n for s in shares if s.team is None), 0)
    winners = sorted((s for s in shares if s.team is not None), key=lambda s: -s.n)
    if not winners:
        return f"{_all_of(subject.n_good)}{over} ended in a tie."
    first, rest = winners[0], winners[1:MOST_NAMED]
    parts = [
        f"{first.name} won {count(first.n)} of {games}{over} ({percent(first.value)}, 95 % interval {_interval(first)})"
    ]
    parts += [f"{s.name} {count(s.n)} ({percent(s.value)}, {_interval(s)})" for s in rest]
    others = sum(s.n for s in winners[MOST_NAMED:])
    if others:
        parts.append(f"other teams {count(others)}")
    if ties:
        parts.append(count(ties, "tie"))
    return " ".join([", ".join(parts) + ".", *_most_and_least(subject)])


def _most_and_least(subject: Subject) -> Iterator[str]:
    """Where the first of the winners won most and least, along the variable that does most; nothing where chance could have done it."""
    if not subject.variables:
        return
    leader = subject.wins[0]
    variable = subject.by_strength(leader)[0]
    lane = lane_of(variable, subject.points, most_bins=4)
    means = means_at(subject, lane, leader)
    if not np.isfinite(means.mean).any():
        return
    most, least = int(np.nanargmax(means.mean)), int(np.nanargmin(means.mean))
    if not means.low[most] > means.high[least]:
        return
    best, worst = (
        f"{variable.name} {place_in_words(lane, i)} ({percent(means.mean[i])})" for i in (most, least)
    )
    yield f"{leader.name} won most with {best} and least with {worst}."


def _all_of(n: int) -> str:
    return "The only game" if n == 1 else f"All {count(n, 'game')}"


def _interval(share: Share) -> str:
    return f"{100.0 * share.low:.1f} to {100.0 * share.high:.1f}"


def _who_was_left(subject: Subject) -> str:
    """Where nobody scores, how many of each team were left."""
    measures = subject.scores
    if not measures:
        teams = [t for t in subject.results.teams if f"alive[{t}]" in subject.results.quantities]
        return (
            f"All of {' and of '.join(map(subject.name_of, teams))} were left"
            if teams
            else "Nothing was counted"
        )
    found = []
    for measure in measures:
        (mean,) = subject.results.means([measure.expression])
        (start,) = subject.results.means([measure.expression.replace("alive", "start")])
        interval = f"95 % interval {estimate(mean.low)} to {estimate(mean.high)}"
        found.append(f"{estimate(mean.value)} of {number(start.value)} {measure.name} ({interval})")
    return f"{' and '.join(found)} were left on average"


def notes(subject: Subject) -> list[str]:
    """What a reader must know before the rest."""
    results = subject.results
    said = [sentence(note) for note in results.notes]
    if results.n_failed:
        said.append(
            f"{count(results.n_failed, 'game')} of {count(results.n_runs)} failed and {'is' if results.n_failed == 1 else 'are'}"
            " left out of all numbers; the section “Games to look at” tells why."
        )
    stopped = results.info.get("stopped_by")
    if stopped:
        said.append(
            f"Played until it was known well enough: {stopped}. An interval that made the batch stop is no test."
        )
    return said


def headline(subject: Subject) -> list[tuple[str, str]]:
    """The few numbers under the answer."""
    results = subject.results
    found = [("games", count(results.n_runs))]
    if subject.has_points:
        found.append(("points", count(len(subject.points))))
        found.append(("variables", count(len(subject.variables))))
    found.append(("teams", count(len(results.teams))))
    cpu = float(np.nansum(np.asarray(results.runs["cpu_s"].to_numpy(zero_copy_only=False), dtype=float)))
    found.append(("CPU time", seconds(cpu)))
    return found
