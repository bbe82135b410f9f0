"""Batches that reports are made of, and what a report of them would say."""

from __future__ import annotations

import numpy as np
from made_batches import made_batch

from tussle.batch.report import sections_of
from tussle.batch.report.answers import answers
from tussle.batch.report.report_data import ReportData
from tussle.batch.report.sections import answer, notes
from tussle.batch.results import Results
from tussle.batch.sampling import sample
from tussle.batch.variables import Choice, Range


def scores_of_the_paper() -> dict[int, np.ndarray]:
    """A thousand games, of which team 2 wins 593, team 3 wins 361, and 46 are ties."""
    rng = np.random.default_rng(2)
    low = rng.integers(0, 20, 1000)
    more = rng.integers(1, 12, 1000)
    is_second = np.arange(1000) < 593
    is_third = (np.arange(1000) >= 593) & (np.arange(1000) < 954)
    shuffled = rng.permutation(1000)
    second, third = (low + np.where(is_ahead, more, 0) for is_ahead in (is_second, is_third))
    return {1: np.zeros((1000, 1)), 2: second[shuffled][:, None], 3: third[shuffled][:, None]}


def noise(points: int, seeds: int, mean: float, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).poisson(mean, (seeds, points))


def choices(failed=None, **options):
    """Forty seeds; the second tactic gives team 2 three points more with each."""
    tactic = Choice("tactic", ("keep", "switch"))
    luck = noise(1, 40, 9.0)
    scores = {2: luck + np.array([0, 3]), 3: noise(1, 40, 9.0, 1) + np.array([0, 0])}
    return made_batch(scores, variables=[tactic], points=sample([tactic]), failed=failed, **options)


def ranges():
    """Two ranges: team 2 scores less the faster the prey, team 3 more with its gain."""
    variables = [Range("prey_speed", 20.0, 30.0, unit="kt"), Range("gain", 0.01, 10.0, is_log=True)]
    points = sample(variables, "lhs", 80, 1)
    speed, gain = (np.array([p[name] for p in points]) for name in ("prey_speed", "gain"))
    rng = np.random.default_rng(3)
    scores = {
        2: rng.poisson(20.0 - (speed - 20.0), (12, 80)),
        3: rng.poisson(8.0 + 3.0 * np.log10(gain / 0.01), (12, 80)),
    }
    return made_batch(scores, variables=variables, points=points, sample="lhs")


def texts_of(stored, more=()) -> str:
    """All texts of the page, without its pictures being drawn."""
    data, parts = ReportData(Results(stored), more), []
    for section in sections_of(data):
        parts += [section.title, *section.lead]
        parts += [f"{plot.title} {plot.caption}" for plot in section.plots]
        parts += [f"{name} {value}" for name, value in section.facts]
        for table in section.tables:
            parts += [table.title, *(" ".join(row) for row in table.rows), table.caption]
    asked = [f"{each.question} {each.text}" for each in answers(data)]
    return "\n".join([answer(data), *asked, *notes(data), *parts]).replace("\u00a0", " ")


def names_of(stored, more=()) -> set[str]:
    """Names of the sections and of the plots, which are not drawn."""
    sections = sections_of(ReportData(Results(stored), more))
    return {s.name for s in sections} | {plot.name for s in sections for plot in s.plots}
