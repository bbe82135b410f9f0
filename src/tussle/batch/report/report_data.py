"""The data of a report: which teams compete, which quantities are shown, what varies, and the fits behind the plots."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tussle.batch.report.drawing import marker_of
from tussle.batch.report.formatting import file_name
from tussle.batch.response import FittedVariable, Response, axes_of
from tussle.batch.results import Results
from tussle.batch.sampling import method_for
from tussle.batch.sensitivity import Effect
from tussle.batch.statistics import mean_of
from tussle.errors import ParameterError
from tussle.palette import MUTED

_TITLES = {
    "wins": "games won by {}",
    "score": "score of {}",
    "alive": "{} left at the end",
    "lost": "{} lost",
}
_OF_TEAM = re.compile(r"(wins|score|alive|lost)\[(-?\d+)\]")

DRAWN_POINTS = ("lhs", "sobol", "saltelli", "product")
"""Sampling methods that draw points at random from ranges."""
MAX_VARIABLES = 6
"""Largest number of variables with plots; if there are more, those with the strongest effects are shown."""
MAX_LINES = 6
"""A choice with at most so many values has a line for each."""


@dataclass(frozen=True)
class Measure:
    """A quantity that is plotted.

    Args:
        expression: As `Results.quantity` takes it.
        name: Name of the team, or of the quantity if it has no team.
        team: Its team; None if it belongs to no single team.
        label: Label of its axis.
        is_share: The quantity is 0 or 1 in each run.
        colour: That of the team.
    """

    expression: str
    name: str
    team: int | None
    label: str
    is_share: bool = False
    colour: str = MUTED

    @property
    def marker(self) -> str:
        return "o" if self.team is None else marker_of(self.team)


class ReportData:
    """The data of a report.

    Args:
        results: Its results.
        more: Quantities to be shown beside those that the report chooses.

    Raises:
        ParameterError: There is no such quantity.
    """

    def __init__(self, results: Results, more: Sequence[str] = ()) -> None:
        self.results = results
        self.points = results.points
        asked = dict.fromkeys(map(results.canonical, more))
        self.more = tuple(Measure(e, self.title(e), None, self.title(e)) for e in asked)
        self.point: np.ndarray = np.asarray(results.runs["point"].to_numpy(), dtype=np.int64)
        self._effects: dict[str, list[Effect]] = {}

    # -- names --------------------------------------------------------------------------------------------------------------

    def name_of(self, team: int) -> str:
        """The name of a team."""
        return self.results.teams.get(team) or f"team {team}"

    def _measure(self, name: str, team: int, label: str, is_share: bool = False) -> Measure:
        """A quantity of a team."""
        return Measure(
            f"{name}[{team}]", self.name_of(team), team, label, is_share, self.results.colours[team]
        )

    def title(self, expression: str) -> str:
        """The name of a quantity."""
        found = _OF_TEAM.fullmatch(expression)
        if found is not None:
            return _TITLES[found[1]].format(self.name_of(int(found[2])))
        return "length of the game [s]" if expression == "t" else self.results.title(expression)

    def point_name(self, point: int) -> str:
        """Return the values of a point, without the name of the variable if there is only one."""
        label = self.results.label(point)
        return label.split("=", 1)[1] if len(self.results.variables) == 1 else label

    # -- runs and points ----------------------------------------------------------------------------------------------------

    @property
    def n_good(self) -> int:
        """Runs that did not fail."""
        return self.results.n_runs - self.results.n_failed

    @property
    def has_points(self) -> bool:
        """True if the batch has more than one point."""
        return len(self.points) > 1

    @cached_property
    def method(self) -> str:
        """Description of the sampling of the points."""
        return method_for(self.results.variables, str(self.results.info.get("sample") or ""))

    @property
    def is_drawn(self) -> bool:
        """Points were drawn from ranges."""
        return self.method in DRAWN_POINTS

    def known(self, expression: str) -> np.ndarray:
        """Return the known values of a quantity, (n,); empty if no plugin reports it."""
        is_name = re.fullmatch(r"[\w.]+(\[-?\d+\])?", expression)
        if is_name and expression not in self.results.quantities:
            return np.empty(0)
        values = self.results.quantity(expression)
        return np.asarray(values[np.isfinite(values)])

    def mean_by_point(self, measure: Measure) -> np.ndarray:
        """Mean of a quantity at each point, (n_points,); NaN without games."""
        return np.array([mean.value for mean in self.results.means_by_point(measure.expression)])

    def response(self, measure: Measure) -> Response | None:
        """The fit of a quantity over what varies; None for too few points."""
        try:
            return self.results.response(measure.expression)
        except ParameterError:
            return None

    def effects(self, measure: Measure) -> list[Effect]:
        """What each variable does to a quantity."""
        name = measure.expression
        if name not in self._effects:
            self._effects[name] = self.results.sensitivity(name)
        return self._effects[name]

    def means_at(
        self, axis: FittedVariable, measure: Measure, given: Mapping[str, Any] | None = None
    ) -> np.ndarray:
        """Mean of a quantity at each value of an axis, lower and upper end of its interval, (n_values, 3).

        By the fit, so that the other variables are as at all points; for too few points, of the games at the value.
        """
        response, name = self.response(measure), axis.variable.name
        if response is not None:
            found = response.along(name, axis.values, given)
            return np.stack([found.value, found.low, found.high], axis=1)
        rows, values = [], self.results.quantity(measure.expression)
        for value in axis.values:
            points = self.points_with({**(given or {}), name: value})
            chosen = np.isin(self.point, points)
            seed = None if self.results.info["independent"] else self.results.seed_blocks(points)[chosen]
            is_share = self.results.is_share(measure.expression)
            strata = self.point[chosen] if len(points) > 1 else None
            mean = mean_of("", values[chosen], seed, strata, is_share=is_share)
            rows.append((mean.value, mean.low, mean.high))
        return np.array(rows)

    def points_with(self, values: Mapping[str, Any]) -> list[int]:
        """The points that have some values."""
        return [
            i for i, point in enumerate(self.points) if all(point[name] == v for name, v in values.items())
        ]

    # -- what is shown ------------------------------------------------------------------------------------------------------

    @cached_property
    def rivals(self) -> tuple[int, ...]:
        """Teams that score or win in some game, ordered by wins."""
        found = {}
        for team in self.results.teams:
            scores, wins = (self.known(f"{name}[{team}]") for name in ("score", "wins"))
            if np.any(scores != 0.0) or np.any(wins > 0.0):
                found[team] = float(wins.sum())
        return tuple(sorted(found, key=lambda team: (-found[team], team)))

    @cached_property
    def wins(self) -> tuple[Measure, ...]:
        """Wins of the teams that score or win; empty for games without scores."""
        teams = [t for t in self.rivals if t in self.results.scored] if len(self.results.scored) > 1 else []
        teams = [t for t in teams if not self._is_asked(f"wins[{t}]")]
        return tuple(self._measure("wins", t, "share of the games won", True) for t in teams)

    @cached_property
    def scores(self) -> tuple[Measure, ...]:
        """Quantities of teams among those that are shown if none are asked for: scores, or what is left or lost."""
        kinds = {"score": "score", "alive": "left at the end", "lost": "lost"}
        found = []
        for name in self.results.defaults.leading:
            match = _OF_TEAM.fullmatch(name)
            if match is not None and not self._is_asked(name):
                team = int(match[2])
                found.append(self._measure(match[1], team, kinds[match[1]]))
        return tuple(found)

    @cached_property
    def measured(self) -> tuple[Measure, ...]:
        """Quantities that the user asks for, and what metrics and interactions measure."""
        names = [n for n in self.results.defaults.leading if not _OF_TEAM.fullmatch(n) and n != "t"]
        return (
            *self.more,
            *(Measure(n, self.title(n), None, self.title(n)) for n in names if not self._is_asked(n)),
        )

    def _is_asked(self, name: str) -> bool:
        return any(measure.expression == name for measure in self.more)

    @property
    def measures(self) -> tuple[Measure, ...]:
        """All quantities of the report."""
        return (*self.wins, *self.scores, *self.measured)

    @property
    def groups(self) -> list[tuple[str, tuple[Measure, ...]]]:
        """Measures that share a plot, with the beginning of its file name."""
        found = [
            ("wins", self.wins),
            (self.scores[0].label.partition(" ")[0] if self.scores else "", self.scores),
        ]
        found += [(file_name(m.expression), (m,)) for m in self.measured]
        return [(stem, measures) for stem, measures in found if measures]

    @cached_property
    def axes(self) -> list[FittedVariable]:
        """Variables with more than one value over the points."""
        return axes_of(self.results.variables, self.points)

    def by_strength(self, *measures: Measure) -> list[FittedVariable]:
        """The variables, those first that explain most of any of some quantities, by default of all."""

        def strength(axis: FittedVariable) -> float:
            every = (e for m in measures or self.measures for e in self.effects(m))
            return max(
                (strength_of(e) or 0.0 for e in every if e.variable == axis.variable.name), default=0.0
            )

        return sorted(self.axes, key=lambda axis: -strength(axis))

    @cached_property
    def shown_axes(self) -> list[FittedVariable]:
        """The variables with plots, in the order in which they were given."""
        if len(self.axes) <= MAX_VARIABLES:
            return self.axes
        ranked = self.by_strength()[:MAX_VARIABLES]
        return [axis for axis in self.axes if axis in ranked]

    @cached_property
    def lines(self) -> FittedVariable | None:
        """The choice whose values have a line each in the plots: the strongest of few values."""
        choices = [axis for axis in self.axes if not axis.is_number and len(axis.values) <= MAX_LINES]
        if len(choices) < 2:
            return choices[0] if choices else None
        return next(axis for axis in self.by_strength() if axis in choices)


def strength_of(effect: Effect) -> float | None:
    """The strength of an effect, 0 to 1: its total part, else its own, else the rank correlation; None if none is known."""
    values = (effect.total, effect.first_order, effect.rank_correlation)
    return next((abs(v) for v in values if v is not None and np.isfinite(v)), None)
