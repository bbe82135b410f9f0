"""The data of a report: which teams compete, which quantities are shown, what varies, and the means behind the plots."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tussle.batch.report.drawing import marker_of
from tussle.batch.report.formatting import file_name
from tussle.batch.results import Results
from tussle.batch.sampling import method_for
from tussle.batch.selection import written
from tussle.batch.statistics import mean_of, share_of, wilson
from tussle.batch.variables import Choice, Range, Variable
from tussle.errors import MissingExtraError
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
MOST_VARIABLES = 6
"""Largest number of variables with plots; if there are more, those with the strongest effects are shown."""
MOST_LEVELS = 12
"""A range with at most this many values is shown value by value."""
MOST_BINS = 12
POINTS_PER_BIN = 8
WIDE_RATIO = 50.0
"""Numbers whose largest ratio is at least this are shown on a logarithmic axis."""
FEWEST_SEEDS = 10
"""With fewer seeds, the variance between seeds is not estimated, and the interval holds for these seeds only."""


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


# -- variables as axes ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Axis:
    """A variable as an axis: its values if they are few, else bins.

    Args:
        variable: The variable.
        index: The place of each point, (n_points,).
        position: Positions of the places, (n_places,): values of the variable, or 0, 1, 2, ... if these are not numbers.
        texts: The values as texts; empty for bins.
        edges: Ends of the bins, (n_places + 1,); empty where the places are values.
        is_number: Positions are values of the variable.
    """

    variable: Variable
    index: np.ndarray
    position: np.ndarray
    texts: tuple[str, ...]
    edges: np.ndarray
    is_number: bool

    @property
    def n_places(self) -> int:
        return len(self.position)

    @property
    def unit(self) -> str:
        return getattr(self.variable, "unit", "")

    @property
    def is_log(self) -> bool:
        """True if the axis is logarithmic."""
        if isinstance(self.variable, Range):
            return self.variable.is_log
        low, high = float(self.position.min()), float(self.position.max())
        return self.is_number and low > 0.0 and high >= WIDE_RATIO * low

    def place_text(self, place: int) -> str:
        """Return the text of a place: "20 kt", "from 20 to 22.5 kt", "keep"."""
        unit = f" {self.unit}" if self.unit else ""
        if self.texts:
            return f"{self.texts[place]}{unit}"
        low, high = (f"{edge:.3g}" for edge in self.edges[place : place + 2])
        return f"from {low} to {high}{unit}"


def axis_of(
    variable: Variable, points: Sequence[dict[str, Any]], n_bins: int = MOST_BINS, *, is_even: bool = False
) -> Axis:
    """A variable as an axis.

    Args:
        variable: The variable.
        points: The values at each point.
        n_bins: Largest number of bins.
        is_even: Bins have equal widths, or equal ratios on a logarithmic axis; else they contain equally many points.
    """
    given = [point[variable.name] for point in points]
    if not all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in given):
        names = [written(value) for value in given]
        order = [written(value) for value in variable.values] if isinstance(variable, Choice) else []
        texts = sorted(
            dict.fromkeys(names), key=lambda text: order.index(text) if text in order else len(order)
        )
        index = np.array([texts.index(name) for name in names], dtype=np.int64)
        return Axis(variable, index, np.arange(float(len(texts))), tuple(texts), np.empty(0), False)
    values = np.array(given, dtype=float)
    levels, index = np.unique(values, return_inverse=True)
    if len(levels) <= MOST_LEVELS:
        return Axis(variable, index, levels, tuple(f"{v:.6g}" for v in levels), np.empty(0), True)
    if is_even:
        space = np.geomspace if isinstance(variable, Range) and variable.is_log else np.linspace
        edges = space(values.min(), values.max(), n_bins + 1)
    else:
        n_bins = int(np.clip(len(values) // POINTS_PER_BIN, 2, n_bins))
        edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, n_bins + 1)))
    index = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    return Axis(variable, index, _mean_by(values, index, len(edges) - 1), (), edges, True)


def _mean_by(values: np.ndarray, group: np.ndarray, n_groups: int) -> np.ndarray:
    """Mean of the known values of each group, (n_groups,); NaN for none."""
    is_known = np.isfinite(values)
    n = np.bincount(group[is_known], minlength=n_groups)
    total = np.bincount(group[is_known], weights=values[is_known], minlength=n_groups)
    return np.asarray(total / np.where(n > 0, n, np.nan))


# -- means with intervals ---------------------------------------------------------------------------------------------------


def clustered_mean(
    values: np.ndarray, seed: np.ndarray, draw: np.ndarray | None, *, is_share: bool
) -> tuple[float, float, float]:
    """Return the mean of runs that are not independent, and its 95 % interval; NaN if unknown.

    Runs with the same seed are correlated, and so are runs of points from the same draw. The variance is clustered by both
    (Cameron, Gelbach and Miller 2011), or by one if the other has too few clusters; the interval is Student's with one degree of
    freedom less than the number of clusters. For a share it is Wilson's, with Kish's effective number of independent runs.

    Args:
        values: Value of each run, (n,); NaN is left out.
        seed: Its seed, (n,).
        draw: Its draw of points, (n,); None if the points were not drawn.
        is_share: The values are 0 and 1.
    """
    is_known = np.isfinite(values)
    values = values[is_known]
    clusters = [np.unique(by[is_known], return_inverse=True)[1] for by in (draw, seed) if by is not None]
    if len(clusters) == 2 and (
        clusters[1].max(initial=-1) + 1 < FEWEST_SEEDS or clusters[0].max(initial=-1) < 1
    ):
        clusters = clusters[:1]
    n_clusters = min((int(c.max(initial=-1)) + 1 for c in clusters), default=0)
    if not len(values):
        return math.nan, math.nan, math.nan
    mean = float(values.mean())
    if n_clusters < 2:
        return mean, math.nan, math.nan
    if np.ptp(values) == 0.0:
        return (mean, *wilson(mean * n_clusters, n_clusters)) if is_share else (mean, mean, mean)
    half, error = max(
        _half_width(values, c)
        for c in ([np.stack(clusters, axis=1)] if len(clusters) == 2 else []) + clusters
    )
    if not is_share:
        return mean, mean - half, mean + half
    n = (
        min(max(mean * (1.0 - mean) / error**2, float(n_clusters)), float(len(values)))
        if error
        else float(len(values))
    )
    return (mean, *wilson(mean * n, n))


def _half_width(values: np.ndarray, clusters: np.ndarray) -> tuple[float, float]:
    """Half of Student's interval of a mean with clustered errors, and its standard error; 0 where the variance is negative."""
    from statsmodels.regression.linear_model import OLS

    with np.errstate(invalid="ignore"):
        fit = OLS(values, np.ones(len(values))).fit(
            cov_type="cluster", cov_kwds={"groups": clusters}, use_t=True
        )
        low, high = fit.conf_int()[0]
        return max(float(high - low) / 2.0, 0.0) if high >= low else 0.0, float(np.nan_to_num(fit.bse[0]))


class ReportData:
    """The data of a report.

    Args:
        results: Its results.
        more: Quantities to be shown beside those that the report chooses.

    Raises:
        ParameterError: There is no such quantity.
        MissingExtraError: Statsmodels is not installed.
    """

    def __init__(self, results: Results, more: Sequence[str] = ()) -> None:
        try:
            import statsmodels.regression.linear_model  # noqa: F401
        except ImportError as error:
            raise MissingExtraError(
                f"the report needs statsmodels, which cannot be imported ({error}); pip install 'tussle[batch]' brings it"
            ) from None
        self.results = results
        self.points = results.points
        self.more = tuple(Measure(e, self.title(e), None, self.title(e)) for e in more)
        self.point: np.ndarray = np.asarray(results.runs["point"].to_numpy(), dtype=np.int64)
        self.seed: np.ndarray = np.asarray(results.runs["seed"].to_numpy())
        for measure in self.more:
            results.quantity(measure.expression)

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
        """There is more than one point."""
        return len(self.points) > 1

    @cached_property
    def method(self) -> str:
        """Description of the sampling of the points."""
        return method_for(self.results.variables, str(self.results.info.get("sample") or ""))

    @property
    def is_drawn(self) -> bool:
        """Points were drawn from ranges."""
        return self.method in DRAWN_POINTS

    @cached_property
    def draw(self) -> np.ndarray | None:
        """Number of the draw of each run's point, (n_runs,): points of one draw share values. None if the points were not drawn."""
        if not self.is_drawn:
            return None
        n_choices = math.prod(len(v.values) for v in self.results.variables if isinstance(v, Choice))
        per_draw = {"saltelli": len(self.results.variables) + 2, "product": n_choices}.get(self.method, 1)
        return np.asarray(self.point // per_draw)

    def known(self, expression: str) -> np.ndarray:
        """Return the known values of a quantity, (n,); empty if no plugin reports it."""
        is_name = re.fullmatch(r"[\w.]+(\[-?\d+\])?", expression)
        if is_name and expression not in self.results.quantities:
            return np.empty(0)
        values = self.results.quantity(expression)
        return np.asarray(values[np.isfinite(values)])

    def mean_by_point(self, measure: Measure) -> np.ndarray:
        """Mean of a quantity at each point, (n_points,); NaN without games."""
        return _mean_by(self.results.quantity(measure.expression), self.point, len(self.points))

    def cells(self, measure: Measure, across: Axis, up: Axis) -> np.ndarray:
        """Mean of a quantity in each cell of two axes, (up.n_places, across.n_places); NaN without games."""
        cell = (up.index * across.n_places + across.index)[self.point]
        means = _mean_by(self.results.quantity(measure.expression), cell, up.n_places * across.n_places)
        return means.reshape(up.n_places, across.n_places)

    def means_at(self, axis: Axis, measure: Measure) -> np.ndarray:
        """Mean of a quantity at each place of an axis, lower and upper end of its interval, (n_places, 3)."""
        values, draw = self.results.quantity(measure.expression), self.draw
        found = []
        for place in range(axis.n_places):
            points = np.flatnonzero(axis.index == place).tolist()
            rows, seed = np.isin(self.point, points), self.results.seed_blocks(points)
            if draw is None:
                found.append(self._mean_over(values[rows], seed[rows], self.point[rows], measure.is_share))
            else:
                found.append(clustered_mean(values[rows], seed[rows], draw[rows], is_share=measure.is_share))
        return np.array(found)

    def _mean_over(
        self, values: np.ndarray, seed: np.ndarray, point: np.ndarray, is_share: bool
    ) -> tuple[float, float, float]:
        """Mean of runs of given points, which are as they are, and its interval over their seeds."""
        is_apart = bool(self.results.info["independent"])
        if is_share:
            share = share_of("", None, values, None if is_apart else seed, None if is_apart else point)
            return share.value, share.low, share.high
        mean = mean_of("", values, None if is_apart else seed, point)
        return mean.value, mean.low, mean.high

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
        return tuple(self._measure("wins", t, "share of the games won", True) for t in teams)

    @cached_property
    def scores(self) -> tuple[Measure, ...]:
        """Scores of the teams; in games without scores, the entities left at the end of teams that lost some."""
        if self.rivals:
            return tuple(self._measure("score", t, "score") for t in sorted(self.rivals))
        teams = [t for t in self.results.diminished if varies(self.known(f"alive[{t}]"))]
        return tuple(self._measure("alive", t, "left at the end") for t in teams)

    @cached_property
    def measured(self) -> tuple[Measure, ...]:
        """Quantities that the user asks for, and in games without scores what metrics and interactions measure."""
        asked = [m.expression for m in self.more]
        names = (
            []
            if self.rivals
            else [n for n in self.results.measured if varies(self.known(n)) and n not in asked]
        )
        return (*self.more, *(Measure(n, self.title(n), None, self.title(n)) for n in names))

    @property
    def measures(self) -> tuple[Measure, ...]:
        """All quantities of the report."""
        return (*self.wins, *self.scores, *self.measured)

    @property
    def groups(self) -> list[tuple[str, tuple[Measure, ...]]]:
        """Measures that share a plot, with the beginning of its file name."""
        found = [("wins", self.wins), ("score" if self.rivals else "left", self.scores)]
        found += [(file_name(m.expression), (m,)) for m in self.measured]
        return [(stem, measures) for stem, measures in found if measures]

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """Variables with more than one value over the points."""
        return tuple(v for v in self.results.variables if len({repr(p[v.name]) for p in self.points}) > 1)

    def by_strength(self, *measures: Measure) -> list[Variable]:
        """The variables, those first that explain most of the variance of the runs of any of some quantities, by default of all."""

        def strength(variable: Variable) -> float:
            axis = axis_of(variable, self.points)
            group = axis.index[self.point]
            return max(
                (_explained(self.results.quantity(m.expression), group) for m in measures or self.measures),
                default=0.0,
            )

        return sorted(self.variables, key=lambda v: -strength(v))

    @cached_property
    def shown_variables(self) -> tuple[Variable, ...]:
        """The variables with plots, in the order in which they were given."""
        if len(self.variables) <= MOST_VARIABLES:
            return self.variables
        ranked = self.by_strength()[:MOST_VARIABLES]
        return tuple(v for v in self.variables if v in ranked)


def varies(values: np.ndarray) -> bool:
    """Return whether the values differ."""
    return bool(len(values)) and bool(np.ptp(values) > 0.0)


def _explained(values: np.ndarray, group: np.ndarray) -> float:
    """Share of the variance of runs that is between groups (the correlation ratio)."""
    is_known = np.isfinite(values)
    values, group = values[is_known], group[is_known]
    if not varies(values):
        return 0.0
    means = _mean_by(values, group, int(group.max()) + 1)[group]
    return float(np.var(means) / np.var(values))
