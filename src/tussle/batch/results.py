"""The results of a batch, as tables, arrays and statistics."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from tussle.arguments import explained
from tussle.batch import run_table
from tussle.batch.default_quantities import (
    COUNTED,
    DefaultQuantities,
    InformativeQuantities,
    default_quantities,
    is_within_one,
)
from tussle.batch.quantities import Quantity, column_name, metric_of
from tussle.batch.response import Response, fitted
from tussle.batch.run_table import N_TIMES, Survival, survival_of
from tussle.batch.selection import is_number, known_point, original, paired_points, select_points, with_unit
from tussle.batch.sensitivity import Effect, effects, rank_effects
from tussle.batch.statistics import (
    Mean,
    PairedComparison,
    Share,
    mean_of,
    means_of,
    numbered,
    paired_difference,
    share_of,
)
from tussle.batch.store import RUNS
from tussle.batch.target import Answers, Layout, Target, answers_of, crossing_of
from tussle.batch.variables import Variable
from tussle.batch.varied import variable_of
from tussle.declare.displays import counted, line, listing, page, table
from tussle.documents import several
from tussle.errors import ParameterError, listed
from tussle.palette import colour_of, on_paper
from tussle.record.run import check_frames, frame_of, load_run

if TYPE_CHECKING:
    from tussle.batch.store import StoredBatch


@explained
class Results:
    """Results of the runs of a batch; of an unfinished batch, those of its finished runs.

    Failed runs are in no share, mean or comparison; `n_failed` says how many there are. Where several points are taken together,
    means and intervals are those over these points, each as much as another; how they differ is no part of the width. The runs of
    a seed then count as one block, since they share their random numbers; of one seed there is no interval.

    Args:
        stored: The batch as it was read.

    Attributes:
        path: The batch directory; None for a batch in memory.
        info: What `batch.json` says.
        notes: What is missing, and notes about the mission file, one line each.
        design: One row per planned run: run, point, seed and the variables.
        runs: One row per finished run: keys, variables, how it ended, and each quantity.
        n_distinct: Distinct games among the runs that did not fail: where nothing in those of a point depends on the seed, they are
            copies of one game.
    """

    def __init__(self, stored: StoredBatch) -> None:
        self.path: Path | None = stored.path
        self.info: dict[str, Any] = stored.info
        self.notes: list[str] = [*stored.notes, *(stored.info.get("mission", {}).get("notes") or ())]
        self.design: pa.Table = stored.design
        self._stored = stored
        facts = stored.runs
        self._run: np.ndarray = facts["run"].to_numpy()
        self._point: np.ndarray = facts["point"].to_numpy()
        self._seed_index: np.ndarray = self._run // max(1, len(self.points))
        self._is_failed = run_table.is_failed(facts)
        self._columns = run_table.quantities(stored.metrics, facts, list(self.teams))
        self._game = run_table.distinct_games(facts, self._is_failed, self._columns.values())
        self.n_distinct: int = len(np.unique(self._game[~self._is_failed]))
        if n_copies := self.n_runs - self.n_failed - self.n_distinct:
            self.notes.append(
                f"{n_copies:,} of {self.n_runs:,} runs are copies of another run of their point: nothing in them depends on the seed; "
                f"intervals count distinct games ({self.n_distinct:,})"
            )
        self._fits: dict[tuple[str, bool], Response] = {}
        names = [v.name for v in self.variables]
        keyed = run_table.with_values(facts, self.design, names, self._columns)
        new = {n: pa.array(v) for n, v in self._columns.items() if n not in run_table.FACTS}
        self.runs: pa.Table = pa.table(keyed | new)

    @property
    def table(self) -> pa.Table:
        """One row per run, team and metric; of a very large batch, it is read when it is asked for."""
        return self._stored.table

    @property
    def alive(self) -> pa.Table:
        """Entities of each run and team whenever their number changes."""
        return self._stored.alive

    # -- what there is ----------------------------------------------------------------------------------------------------

    @cached_property
    def variables(self) -> list[Variable]:
        """The variables of the batch."""
        return [variable_of(entry) for entry in self.info["variables"]]

    @cached_property
    def teams(self) -> dict[int, str]:
        """Number of each team -> its name."""
        named = {int(team): str(name) for team, name in self.info["teams"].items()}
        return dict(sorted(({team: f"team {team}" for team in self._stored.teams} | named).items()))

    @cached_property
    def colours(self) -> dict[int, str]:
        """Number of each team -> its colour in plots, "#rrggbb"."""
        known = {int(team): colour for team, colour in (self.info.get("colours") or {}).items()}
        return {team: on_paper(known.get(team) or colour_of(team)) for team in self.teams}

    @cached_property
    def points(self) -> list[dict[str, Any]]:
        """The values of the variables at each point."""
        _, first = np.unique(self.design["point"].to_numpy(), return_index=True)
        if not self.variables:
            return [{} for _ in first]
        rows = self.design.take(pa.array(first))
        columns = [[original(value, v) for value in rows[v.name].to_pylist()] for v in self.variables]
        return [
            dict(zip((v.name for v in self.variables), values, strict=True))
            for values in zip(*columns, strict=True)
        ]

    @property
    def n_runs(self) -> int:
        """Finished runs, failed ones included."""
        return len(self._run)

    @property
    def n_failed(self) -> int:
        """Finished runs that failed."""
        return int(self._is_failed.sum())

    @property
    def n_planned(self) -> int:
        """Runs that were to be played; where points have different numbers of seeds, those that are finished."""
        if self.info["is_complete"] and self.info.get("is_partial"):
            return self.n_runs
        return int(self.info["n_runs"])

    @property
    def quantities(self) -> list[str]:
        """Names of all numbers that a run has."""
        return list(self._columns)

    @property
    def scored(self) -> dict[int, str]:
        """Number -> name of the teams that have a score."""
        return {
            team: name for team, name in self.teams.items() if column_name("score", team) in self._columns
        }

    def label(self, point: int) -> str:
        """The values of a point: "prey_speed=23.4 kt, tactic=keep"; "" where nothing varies."""
        values = self.points[known_point(self.points, point)]
        return ", ".join(f"{v.name}={with_unit(values[v.name], v)}" for v in self.variables)

    def title(self, expression: str) -> str:
        """A quantity with the teams by name: "score of keepers"."""
        spaced = re.sub(r"(?<!\[)\s*([-+*/])\s*", r" \1 ", expression).strip()
        return re.sub(r"\[(-?\d+)\]", lambda m: f" of {self.teams.get(int(m[1]), m[0])}", spaced)

    # -- numbers ----------------------------------------------------------------------------------------------------------

    def quantity(self, expression: str, runs: Iterable[int] | None = None) -> np.ndarray:
        """A number of each run, (n,); NaN where it failed.

        Args:
            expression: A name such as "score[2]", or arithmetic with names. A recorded column of plugins, such as "Boids.goal.x[1]", is its
                mean over the states of a team, and NaN for runs that are not recorded.
            runs: Numbers of the runs; None for all that are finished, in order.

        Raises:
            ParameterError: There is no such name, or a run is not finished.
        """
        parsed = Quantity.parse(expression)
        values = parsed.evaluate(self._columns_for(parsed))
        if runs is None:
            return values
        wanted = np.asarray(list(runs), dtype=np.int64)
        place = np.minimum(np.searchsorted(self._run, wanted), max(0, len(self._run) - 1))
        is_there = self._run[place] == wanted if len(self._run) else np.zeros(len(wanted), bool)
        if not is_there.all():
            raise ParameterError(f"run {wanted[~is_there][0]} is not among the {self.n_runs} finished runs")
        return values[place]

    def _columns_for(self, quantity: Quantity) -> dict[str, np.ndarray]:
        """The numbers of the runs, with the columns of plugins if the quantity names something else."""
        try:
            quantity.names(self._columns)
        except ParameterError:
            return self._columns | self._recorded
        return self._columns

    @cached_property
    def _recorded(self) -> dict[str, np.ndarray]:
        """Mean of each recorded column of plugins over the states of a team, (n,); NaN for runs that are not recorded."""
        found: dict[str, np.ndarray] = {}
        n_recorded, folder = 0, self.path or Path()
        for row, number in enumerate(self._run.tolist() if self.path else ()):
            place = folder / RUNS / f"{number:06d}"
            run = load_run(place, is_mapped=True) if place.exists() else None
            if run is None or not run.is_complete or not run.columns:
                continue
            n_recorded += 1
            parts = [part for column in run.columns.values() for part in column.parts]
            by_team = run.trajectory_table.group_by("team", use_threads=False)
            means = by_team.aggregate([(part, "mean") for part in parts]).to_pylist()
            for each in means:
                for part in parts:
                    if each[f"{part}_mean"] is not None:
                        name = column_name(part, each["team"])
                        found.setdefault(name, np.full(self.n_runs, np.nan))[row] = each[f"{part}_mean"]
        if found:
            self.notes.append(
                f"columns of plugins are known of {counted(n_recorded, 'run')}, with which they were recorded"
            )
        return found

    def shares(self, point: int | None = None) -> list[Share]:
        """Games that each team won, and ties, with Wilson's interval; nothing for games without scores.

        Args:
            point: The runs of this point; None for all runs.
        """
        rows = self._rows(point)
        blocks, strata = self._blocks(rows, point)
        shares = [
            share_of(name, team, self._columns[column][rows], blocks, None if blocks is None else strata)
            for name, team, column in self._outcomes()
        ]
        if self._is_blocked(point) and len(np.unique(self._seed_index[rows])) < 2:
            shares = [replace(share, low=math.nan, high=math.nan) for share in shares]
        return shares

    def means(self, expressions: Sequence[str] | None = None, point: int | None = None) -> list[Mean]:
        """Means of quantities with their intervals.

        Args:
            expressions: What; by default those of `defaults`.
            point: Over the runs of this point; None for all runs.

        Raises:
            ParameterError: There is no such name or point.
        """
        rows = self._rows(point)
        blocks, strata = self._blocks(rows, point)
        chosen = self.defaults.all if expressions is None else several(expressions)
        are_copies = not self._is_blocked(point)
        return [
            mean_of(
                text, self.quantity(text)[rows], blocks, strata, are_copies=are_copies, is_share=self.is_share(text)
            )
            for text in chosen
        ]  # fmt: skip

    def means_by_point(self, expression: str) -> list[Mean]:
        """The mean of a quantity at each point, without gathering its runs anew for each."""
        values, is_share = self._by_point(self.quantity(expression)), self.is_share(expression)
        if self._has_copies:
            games = self._by_point(self._game)
            return [
                mean_of(expression, *of_point, is_share=is_share)
                for of_point in zip(values, games, strict=True)
            ]
        return means_of(expression, values, is_share=is_share)

    def shares_by_point(self) -> list[list[Share]]:
        """Games that each team won at each point."""
        names = self._outcomes()
        columns = [self._by_point(self._columns[column]) for _, _, column in names]
        games = self._by_point(self._game) if self._has_copies else [None] * len(self.points)
        return [
            [
                share_of(name, team, rows[i], games[i])
                for (name, team, _), rows in zip(names, columns, strict=True)
            ]
            for i in range(len(self.points))
        ]

    def n_runs_by_point(self) -> tuple[np.ndarray, np.ndarray]:
        """Finished runs that did not fail, and runs that failed, at each point, (n_points,)."""
        n_points = len(self.points)
        failed = np.bincount(self._point[self._is_failed], minlength=n_points)
        return np.bincount(self._point, minlength=n_points) - failed, failed

    def _by_point(self, values: np.ndarray) -> list[np.ndarray]:
        """Values of the runs of each point."""
        order = np.argsort(self._point, kind="stable")
        cuts = np.searchsorted(self._point[order], np.arange(1, len(self.points)))
        return np.split(values[order], cuts)

    def _outcomes(self) -> list[tuple[str, int | None, str]]:
        """Name, team and column of each way in which a game can end; empty where no team has a rival, so that nobody can win."""
        if len(self.scored) < 2:
            return []
        found: list[tuple[str, int | None, str]] = [
            (name, team, column_name("wins", team)) for team, name in self.scored.items()
        ]
        return [*found, ("ties", None, "ties")] if found else []

    @cached_property
    def defaults(self) -> DefaultQuantities:
        """The quantities that are shown if none are asked for."""
        return default_quantities(self._columns, list(self.teams), self._varied)

    def telling(self, expressions: Sequence[str]) -> list[str]:
        """Return the informative ones of some quantities: they vary, and repeat neither a varied value nor an earlier one.

        Raises:
            ParameterError: There is no such quantity.
        """
        found = {text: self.quantity(text) for text in several(expressions)}
        return InformativeQuantities(found, self._varied)(tuple(found))

    @property
    def _varied(self) -> list[list[Any]]:
        """Values of each variable, run by run."""
        return [[self.points[i][v.name] for i in self._point.tolist()] for v in self.variables]

    def canonical(self, expression: str) -> str:
        """One text for each quantity: "score[2]" for " score[2]", "Cap.hits[1]" for "Cap.hits" where only team 1 has it.

        Raises:
            ParameterError: There is no such quantity.
        """
        parsed = Quantity.parse(expression)
        return parsed.canonical(self._columns_for(parsed))

    def is_share(self, expression: str) -> bool:
        """Return whether a quantity is a share: its interval is within 0 and 1.

        So are wins and ties, and everything else whose values lie between 0 and 1 in all runs, but for what every game counts, and
        for differences, which might be negative.

        Raises:
            ParameterError: There is no such quantity.
        """
        quantity = Quantity.parse(expression)
        columns = self._columns_for(quantity)
        is_count = quantity.names(columns) == [expression] and metric_of(expression) in COUNTED
        if quantity.is_share or is_count or quantity.may_be_negative:
            return quantity.is_share
        return is_within_one(quantity.evaluate(columns))

    @property
    def diminished(self) -> list[int]:
        """The teams that lost entities in some run."""
        lost = {team: self._columns.get(column_name("lost", team)) for team in self.teams}
        return [team for team, values in lost.items() if values is not None and np.any(values > 0.0)]

    def compare(self, expression: str, a: int | str, b: int | str) -> PairedComparison:
        """Differences b - a of pairs of runs with the same seed; with independent seeds, in order of the runs.

        Args:
            expression: The quantity.
            a: A point, or values such as "tactic=keep" that select points.
            b: The same; points of a and b are paired that agree in all variables which the texts do not name.

        Raises:
            ParameterError: There is no such quantity or point, or no two points that can be paired.
        """
        firsts, seconds = paired_points(self.variables, self.points, a, b)
        matrix, games, blocks = self.by_seed(expression), self._games_by_seed, None
        strata = np.tile(np.arange(len(firsts)), len(matrix)) if len(firsts) > 1 else None
        is_by_seed = len(firsts) > 1 and not self.info["independent"]
        if is_by_seed:
            blocks = np.repeat(numbered(games), len(firsts))
        elif self._has_copies:
            blocks = numbered(np.stack([games[:, firsts].ravel(), games[:, seconds].ravel()], axis=1))
        names = (str(a), str(b))
        if is_number(a) or is_number(b):
            names = (self.label(firsts[0]), self.label(seconds[0]))
        values = matrix[:, firsts].ravel(), matrix[:, seconds].ravel()
        found = paired_difference(expression, names, *values, blocks, strata, are_copies=not is_by_seed)
        if self.is_share(expression):
            return replace(found, low=max(found.low, -1.0), high=min(found.high, 1.0))
        return found

    def by_seed(self, expression: str) -> np.ndarray:
        """A quantity by seed and point, (n_seeds, n_points); NaN where it failed or is not finished."""
        n_seeds = int(self._seed_index.max()) + 1 if len(self._run) else 0
        matrix = np.full((n_seeds, len(self.points)), np.nan)
        matrix[self._seed_index, self._point] = self.quantity(expression)
        return matrix

    def seed_blocks(self, points: Sequence[int]) -> np.ndarray:
        """A number for the seed of each run, (n_runs,), the same for seeds whose games are copies of each other at some points.

        Args:
            points: These.
        """
        return np.asarray(numbered(self._games_by_seed[:, list(points)])[self._seed_index])

    @property
    def _has_copies(self) -> bool:
        return self.n_distinct < self.n_runs - self.n_failed

    @cached_property
    def _games_by_seed(self) -> np.ndarray:
        """Number of the distinct game of each seed and point, (n_seeds, n_points); -1 where it is not finished."""
        games = np.full((int(self._seed_index.max(initial=-1)) + 1, len(self.points)), -1)
        games[self._seed_index, self._point] = self._game
        return games

    def answers(self, target: str | Target | None = None, over: str | None = None) -> Answers | None:
        """The smallest value of a variable at which the mean of a quantity reaches a target, for each choice.

        Args:
            target: Such as "Guard.share >= 0.95"; None for that of the command that played the batch, if it had one.
            over: Name of the variable; None for that of the command, else for the first range, else the first choice of numbers.

        Raises:
            ParameterError: There is no such quantity or variable, or the target is written otherwise.
        """
        if target is None and (target := self.info.get("target")) is None:
            return None
        asked = Target.parse(target) if isinstance(target, str) else target
        layout = Layout.of(self.variables, self.points, over or self.info.get("over"))
        expression = str(asked.quantity)
        found = answers_of(asked, self.title(expression), layout, self.points, self.by_seed(expression))
        if found.over is None:
            return found
        try:
            fit = self.response(expression)
        except ParameterError:  # too few points for a curve
            return found
        name = found.over.name
        with_fit = (replace(a, crossing=crossing_of(fit, asked, name, a.values)) for a in found.answers)
        return replace(found, answers=tuple(with_fit))

    def select(self, text: str) -> list[int]:
        """The points at which variables have the values that a text such as "tactic=keep, prey_speed=20" names.

        Raises:
            ParameterError: There is no such variable, or no such point.
        """
        return select_points(self.variables, self.points, text)

    def sensitivity(self, expression: str) -> list[Effect]:
        """Influence of each variable on a quantity.

        Raises:
            ParameterError: There is no such quantity.
            MissingExtraError: The points were sampled for indices that take a package which is not there.
        """
        values = self.by_seed(expression)
        fit = partial(self._fit, expression, is_share=False)
        return effects(self.variables, self.points, values, self._step, fit)

    def response(self, expression: str) -> Response:
        """A smooth fit of a quantity over all that varies, with its band.

        Raises:
            ParameterError: There is no such quantity, nothing varies, or too few points have runs.
        """
        return self._fit(expression, is_share=self.is_share(expression))

    def _fit(self, expression: str, *, is_share: bool) -> Response:
        key = (expression, is_share)
        if key not in self._fits:
            self._fits[key] = fitted(
                self.variables, self.points, self.by_seed(expression),
                is_share=is_share, has_own_seeds=bool(self.info["independent"]), what=expression,
            )  # fmt: skip
        return self._fits[key]

    def rank_correlations(self, expression: str) -> list[Effect]:
        """Same as `sensitivity` without parts of the variance; it needs no optional package."""
        return rank_effects(self.variables, self.points, self.by_seed(expression), self._step)

    @property
    def _step(self) -> int:
        """Points from one base row to the next of a sample for Saltelli's indices; 0 for other samples."""
        step = len(self.variables) + 2
        return step if self.info.get("sample") == "saltelli" and len(self.points) % step == 0 else 0

    def survival(self, team: int, point: int | None = None) -> Survival:
        """Mean number of a team left over time; a run that ended early stays as it ended.

        Args:
            team: Its number.
            point: Over the runs of this point; None for all runs, without an interval if there are several points.

        Raises:
            ParameterError: There is no such team or point.
        """
        if team not in self.teams:
            raise ParameterError(
                f"there is no team {team!r}; {listed(f'{n} ({t})' for n, t in self.teams.items())}"
            )
        chosen = self._run[self._rows(point) & ~self._is_failed]
        run, t, of_team, alive = (self.alive[name].to_numpy() for name in ("run", "t", "team", "alive"))
        is_chosen = np.isin(run, chosen)
        last = float(t[is_chosen].max()) if is_chosen.any() else float(self.info["start"])
        times = np.linspace(float(self.info["start"]), last, N_TIMES)
        rows = np.flatnonzero(is_chosen & (of_team == team))
        rows = rows[np.lexsort((t[rows], run[rows]))]
        label = "" if point is None else self.label(point)
        found = survival_of(label, team, run[rows], t[rows], alive[rows].astype(np.int64), len(chosen), times)
        if point is None and len(self.points) > 1:
            nothing = np.full(len(times), np.nan)
            return replace(found, low=nothing, high=nothing)
        return found

    # -- tables -----------------------------------------------------------------------------------------------------------

    def failed(self) -> pa.Table:
        """The runs that failed: keys, variables, error."""
        names = [n for n in self.runs.column_names if n not in self._columns]
        return self.runs.select(names).filter(pa.array(self._is_failed))

    def slowest(self, n: int = 10) -> pa.Table:
        """The runs that took most CPU time: keys, variables, how they ended."""
        names = [n for n in self.runs.column_names if n not in self._columns or n in run_table.FACTS]
        order = np.argsort(-run_table.floats(self.runs["cpu_s"]), kind="stable")[:n]
        return self.runs.select(names).take(pa.array(order))

    def frame(self, package: str = "") -> Any:
        """The runs as a frame.

        Args:
            package: "pandas" or "polars"; by default the first of them that is installed.

        Raises:
            ParameterError: `package` names something else.
            MissingExtraError: It is not installed.
        """
        check_frames(package)
        return frame_of(self.runs, package)

    # -- rows -------------------------------------------------------------------------------------------------------------

    def _rows(self, point: int | None) -> np.ndarray:
        """Return True for each run of a point, (n_runs,)."""
        return np.ones(self.n_runs, bool) if point is None else self._point == known_point(self.points, point)

    def _is_blocked(self, point: int | None) -> bool:
        """Runs of several points share their seeds."""
        return point is None and len(self.points) > 1 and not self.info["independent"]

    def _blocks(self, rows: np.ndarray, point: int | None) -> tuple[np.ndarray | None, np.ndarray | None]:
        """Block and stratum of each of these runs.

        The block is their seed, over all points, or else their distinct game; None where runs are independent. The stratum is their
        point; None for the runs of one point.
        """
        strata = self._point[rows] if point is None and len(self.points) > 1 else None
        if self._is_blocked(point):
            return np.asarray(self.seed_blocks(range(len(self.points)))[rows]), strata
        return self._game[rows] if self._has_copies else None, strata

    def __repr__(self) -> str:
        return line("Results", "in memory" if self.path is None else repr(str(self.path)), *self._facts())

    def _facts(self) -> tuple[str, ...]:
        runs = f"{self.n_runs:,} of {self.n_planned:,} runs"
        points = (
            f"{counted(len(self.points), 'point')} of {listing([v.name for v in self.variables])}"
            if self.variables
            else ""
        )
        return runs, points, f"{self.n_failed:,} failed" if self.n_failed else ""

    def _repr_html_(self) -> str:
        finite = ((name, values[np.isfinite(values)]) for name, values in self._columns.items())
        rows = ((self.title(name), *map(float, (v.mean(), v.min(), v.max()))) for name, v in finite if len(v))
        title = "Results in memory" if self.path is None else f"Results {self.path}"
        return page(title, self._facts(), table(("quantity", "mean", "minimum", "maximum"), rows))
