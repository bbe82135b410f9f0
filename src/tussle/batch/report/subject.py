"""What the report of a batch is about: which teams compete, which quantities tell how they fared, what varies."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tussle.batch.report.binning import lane_of
from tussle.batch.report.drawing import MUTED, colour_of, marker_of
from tussle.batch.report.words import file_name
from tussle.batch.results import Results
from tussle.batch.sampling import method_for
from tussle.batch.variables import Choice, Variable

_WORDS = {"wins": "games won by {}", "score": "score of {}", "alive": "{} left at the end", "lost": "{} lost"}
_OF_TEAM = re.compile(r"(wins|score|alive|lost)\[(-?\d+)\]")

DRAWN_POINTS = ("lhs", "sobol", "saltelli", "product")
"""Ways of sampling in which the points are drawn from ranges, so that other points could as well have been."""
MOST_VARIABLES = 6
"""Variables with plots of their own; of more, those with the strongest effects."""


@dataclass(frozen=True)
class Measure:
    """A quantity that is plotted.

    Args:
        expression: As `Results.quantity` takes it.
        name: Of the team, or of the quantity where it has none.
        team: Its team; None for a quantity of no one team.
        label: Of the axis that it is plotted on.
        is_share: It is 0 or 1 in each run.
    """

    expression: str
    name: str
    team: int | None
    label: str
    is_share: bool = False

    @property
    def colour(self) -> str:
        return MUTED if self.team is None else colour_of(self.team)

    @property
    def marker(self) -> str:
        return "o" if self.team is None else marker_of(self.team)


class Subject:
    """A batch, looked at for what is worth showing.

    Args:
        results: Its results.
        more: Quantities to be shown beside those that the report chooses.

    Raises:
        ParameterError: There is no such quantity.
    """

    def __init__(self, results: Results, more: Sequence[str] = ()) -> None:
        self.results = results
        self.more = tuple(Measure(e, self.title(e), None, self.title(e)) for e in more)
        for measure in self.more:
            self.values(measure.expression)

    def name_of(self, team: int) -> str:
        """A team in words."""
        return self.results.teams.get(team) or f"team {team}"

    def title(self, expression: str) -> str:
        """A quantity in words."""
        found = _OF_TEAM.fullmatch(expression)
        if found is not None:
            return _WORDS[found[1]].format(self.name_of(int(found[2])))
        return "length of the game [s]" if expression == "t" else self.results.title(expression)

    def values(self, expression: str) -> np.ndarray:
        """A quantity, one value per finished run, (n_runs,)."""
        if expression not in self._values:
            self._values[expression] = self.results.quantity(expression)
        return self._values[expression]

    @cached_property
    def _values(self) -> dict[str, np.ndarray]:
        return {}

    @cached_property
    def n_good(self) -> int:
        """Runs that did not fail."""
        return self.results.n_runs - self.results.n_failed

    @cached_property
    def point(self) -> np.ndarray:
        """Point of each run, (n_runs,)."""
        return np.asarray(self.results.runs["point"].to_numpy(), dtype=np.int64)

    @cached_property
    def seed(self) -> np.ndarray:
        """Seed of each run, (n_runs,)."""
        return np.asarray(self.results.runs["seed"].to_numpy())

    @cached_property
    def points(self) -> list[dict[str, Any]]:
        return self.results.points

    def point_name(self, point: int) -> str:
        """A point in few words: its values, and only the value where one variable varies."""
        label = self.results.label(point)
        return label.split("=", 1)[1] if len(self.results.variables) == 1 else label

    @property
    def has_points(self) -> bool:
        """There is more than one point."""
        return len(self.points) > 1

    @property
    def is_drawn(self) -> bool:
        """Points were drawn from ranges."""
        return self.method in DRAWN_POINTS

    @cached_property
    def method(self) -> str:
        """How the points were sampled."""
        return method_for(self.results.variables, str(self.results.info.get("sample") or ""))

    @property
    def draw(self) -> np.ndarray:
        """Which draw each run's point comes from, (n_runs,): points of one draw share values, and so do not count by themselves."""
        per_draw = {"saltelli": len(self.results.variables) + 2, "product": self._n_choices}.get(
            self.method, 1
        )
        return np.asarray(self.point // per_draw)

    @property
    def _n_choices(self) -> int:
        """Combinations of choices at each drawn point."""
        return math.prod(len(v.values) for v in self.results.variables if isinstance(v, Choice))

    @cached_property
    def rivals(self) -> tuple[int, ...]:
        """Teams that score or win in some game, those with more wins first."""
        found = {}
        for team in self.results.teams:
            scores, wins = (self.known(f"{name}[{team}]") for name in ("score", "wins"))
            if np.any(scores != 0.0) or np.any(wins > 0.0):
                found[team] = float(wins.sum())
        return tuple(sorted(found, key=lambda team: (-found[team], team)))

    def known(self, expression: str) -> np.ndarray:
        """The values of a quantity that there are; none for one that nobody reports."""
        if expression not in self.results.quantities and expression not in self._values:
            return np.empty(0)
        values = self.values(expression)
        return np.asarray(values[np.isfinite(values)])

    @cached_property
    def wins(self) -> tuple[Measure, ...]:
        """Who wins; empty where nobody can."""
        teams = [t for t in self.rivals if f"wins[{t}]" in self.results.quantities]
        return tuple(Measure(f"wins[{t}]", self.name_of(t), t, "share of the games won", True) for t in teams)

    @cached_property
    def scores(self) -> tuple[Measure, ...]:
        """How much each team scores; without scores, how many of each are left at the end."""
        if self.rivals:
            return tuple(Measure(f"score[{t}]", self.name_of(t), t, "score") for t in sorted(self.rivals))
        teams = [t for t in self.results.teams if varies(self.known(f"alive[{t}]"))]
        return tuple(Measure(f"alive[{t}]", self.name_of(t), t, "left at the end") for t in teams)

    @property
    def groups(self) -> list[tuple[str, tuple[Measure, ...]]]:
        """What is drawn in one plot, with what its files begin with."""
        found = [("wins", self.wins), ("score" if self.rivals else "left", self.scores)]
        found += [(file_name(m.expression), (m,)) for m in self.more]
        return [(stem, measures) for stem, measures in found if measures]

    def mean_by_point(self, measure: Measure) -> np.ndarray:
        """Mean of a quantity at each point, (n_points,); NaN without games."""
        values = self.values(measure.expression)
        is_known = np.isfinite(values)
        n = np.bincount(self.point[is_known], minlength=len(self.points))
        total = np.bincount(self.point[is_known], weights=values[is_known], minlength=len(self.points))
        return np.asarray(total / np.where(n > 0, n, np.nan))

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """What really varies over the points."""
        return tuple(v for v in self.results.variables if len({repr(p[v.name]) for p in self.points}) > 1)

    def strength(self, variable: Variable, *measures: Measure) -> float:
        """How much a variable matters: the largest share of the variance of any of some quantities, by default of all that are plotted.

        The share that lies between the means of the variable's places (the correlation ratio), from the runs themselves; it needs no
        order of the values and no design.
        """
        group = lane_of(variable, self.points).index[self.point]
        chosen = measures or (*self.wins, *self.scores, *self.more)
        return max((_explained(self.values(m.expression), group) for m in chosen), default=0.0)

    def by_strength(self, *measures: Measure) -> list[Variable]:
        """The variables, the strongest first."""
        found = {v.name: self.strength(v, *measures) for v in self.variables}
        return sorted(self.variables, key=lambda v: -found[v.name])

    @cached_property
    def shown_variables(self) -> tuple[Variable, ...]:
        """The variables that get plots, in the order in which they were given."""
        if len(self.variables) <= MOST_VARIABLES:
            return self.variables
        ranked = self.by_strength()[:MOST_VARIABLES]
        return tuple(v for v in self.variables if v in ranked)


def varies(values: np.ndarray) -> bool:
    """Not all of them are the same."""
    return bool(len(values)) and bool(np.ptp(values) > 0.0)


def _explained(values: np.ndarray, group: np.ndarray) -> float:
    """Share of the variance of runs that is between groups."""
    is_known = np.isfinite(values)
    values, group = values[is_known], group[is_known]
    if len(values) < 2 or np.ptp(values) == 0.0:
        return 0.0
    n = np.bincount(group)
    mean = np.bincount(group, weights=values) / np.maximum(n, 1)
    return float((n * (mean - values.mean()) ** 2).sum() / ((values - values.mean()) ** 2).sum())
