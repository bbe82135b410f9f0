"""A quantity over the steps of a game, as its changes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

MAX_CHANGES = 20_000
"""Changes that are kept of one quantity; of more, every other one of the past goes."""

OF_TEAMS = ("left", "born", "score")
"""Quantities of each team that are always shown."""


class CurveName(NamedTuple):
    """What a curve shows.

    Attributes:
        name: "left", "born" or "score" of a team; a result, such as "SimpleCapture.captures"; a column of an entity, such as "x".
        team: The team; None of what belongs to no team.
        id: The entity; 0 of what belongs to none.
    """

    name: str
    team: int | None = None
    id: int = 0


class StepSeries:
    """A quantity that keeps its value until the next change. Values may be appended while another thread reads.

    Attributes:
        steps: Steps from which on the values hold, ascending.
        values: The values; NaN where the quantity is not known, or is no finite number.
        first: First step that was read.
        last: Last step that was read.
        is_thinned: There were more than `MAX_CHANGES`, so changes of the past are missing.
    """

    def __init__(self) -> None:
        self.steps: list[int] = []
        self.values: list[float] = []
        self.first = self.last = -1
        self.is_thinned = False

    def add(self, step: int, value: float, *, is_after_gap: bool = False) -> StepSeries:
        """Add the value of a step after the last one.

        Args:
            step: The step.
            value: Its value.
            is_after_gap: Steps between the last one and this one were left out; there the quantity is not known.

        Returns:
            The series that goes on: this one, or a shorter one in its place.
        """
        value = value if math.isfinite(value) else math.nan
        series = self.thinned() if len(self.steps) >= MAX_CHANGES else self
        if series.first < 0:
            series.first = step
        if is_after_gap and step > series.last + 1 and series.steps:
            series._append(series.last + 1, math.nan)
        series._append(step, value)
        series.last = step
        return series

    def _append(self, step: int, value: float) -> None:
        if self.values and (value == self.values[-1] or (math.isnan(value) and math.isnan(self.values[-1]))):
            return
        self.steps.append(step)  # before its value: a reader counts the values
        self.values.append(value)

    def _kept(self, n: slice, last: int) -> StepSeries:
        kept = StepSeries()
        kept.steps, kept.values = self.steps[n], self.values[n]
        kept.first, kept.last, kept.is_thinned = self.first, last, self.is_thinned
        return kept

    def thinned(self) -> StepSeries:
        """Return a series with every other change."""
        kept = self._kept(slice(None, None, 2), self.last)
        kept.is_thinned = True
        return kept

    def until(self, step: int) -> StepSeries:
        """Return the series up to a step."""
        n = int(np.searchsorted(self.steps, step, side="right"))
        return self._kept(slice(0, n), min(self.last, step))

    def at(self, step: int) -> float:
        """Return the value at a step; NaN before the first."""
        n = int(np.searchsorted(self.steps, step, side="right"))
        return self.values[n - 1] if n else math.nan


@dataclass(frozen=True)
class Changes:
    """Changes of a quantity for the page.

    Attributes:
        quantity: The quantity.
        start: Number of the first of these changes; later ones that the page has are wrong.
        t: Times from which on the values hold [s].
        values: The values.
    """

    quantity: CurveName
    start: int
    t: Sequence[float]
    values: Sequence[float]

    def document(self) -> dict[str, Any]:
        """Return them as JSON has them: what is no finite number is null."""
        q = self.quantity
        values = [value if math.isfinite(value) else None for value in self.values]
        return {
            "name": q.name,
            "team": q.team,
            "id": q.id,
            "from": self.start,
            "t": list(self.t),
            "v": values,
        }
