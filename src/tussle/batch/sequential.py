"""Plays only the games that a question needs: the points whose answer is open get more seeds, the others do not."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from tussle.batch.plan import BatchPlan
from tussle.batch.quantities import Quantity
from tussle.batch.sequential_intervals import seen_in, sequential_interval
from tussle.batch.statistics import LEVEL
from tussle.batch.stopping import PlayedQuantities, Until
from tussle.batch.target import Answers, Layout, Target, answers_of
from tussle.batch.tasks import Finished
from tussle.batch.variables import Variable
from tussle.errors import ParameterError

FIRST_SEEDS = 20
"""Seeds that every point gets."""
GROWTH = 1.5
"""Seeds of a point whose answer is open, in the next round as a multiple."""
WIDTH = re.compile(r"\s*width\s*\((?P<quantity>.*)\)\s*<=?\s*(?P<width>[^<]*)", re.DOTALL)


@dataclass(frozen=True)
class Width:
    """The width that the interval of a mean is to have at each point.

    Attributes:
        quantity: The quantity.
        width: Upper less lower end of its interval.
    """

    quantity: Quantity
    width: float

    @staticmethod
    def parse(text: str) -> Width | None:
        """Read "width(Guard.share) < 0.02"; None for a text of another form.

        Raises:
            ParameterError: The width is no number, or is not allowed.
        """
        match = WIDTH.fullmatch(text)
        if match is None:
            return None
        try:
            width = float(match["width"])
        except ValueError:
            width = math.nan
        if not 0.0 < width < math.inf:
            raise ParameterError(
                f"until {text!r}: the width {match['width'].strip()!r} is not allowed; it takes a number > 0"
            )
        return Width(Quantity.parse(match["quantity"]), width)

    def __str__(self) -> str:
        return f"width({self.quantity}) < {self.width!r}"


@dataclass(frozen=True)
class Question:
    """What a batch is to find out: whether a target is reached, or a mean to within a width, or the first that comes.

    Attributes:
        target: The target; None for none.
        width: The width; None for none.
        over: Name of the variable whose smallest value the target needs; None for the one that `variable_over` chooses.
    """

    target: Target | None
    width: Width | None = None
    over: str | None = None

    def check(self, columns: Mapping[str, np.ndarray]) -> None:
        """See that runs have the quantities.

        Args:
            columns: Name -> value for each run, (n,).

        Raises:
            ParameterError: They have not.
        """
        for asked in (self.target, self.width):
            if asked is not None:
                asked.quantity.names(columns)

    def __str__(self) -> str:
        over = "" if self.over is None else f" over {self.over}"
        return "; ".join(
            str(asked) + (over if asked is self.target else "")
            for asked in (self.target, self.width)
            if asked
        )


Rule = Until | Question


def rule_of(
    until: str | Until | None, target: str | Target | None = None, over: str | None = None
) -> Rule | None:
    """The rule that texts of the command line state.

    Args:
        until: Such as "0.02", "score[2]:0.5", or "width(Guard.share) < 0.02".
        target: Such as "Guard.share >= 0.95".
        over: Name of a variable, for a target.

    Raises:
        ParameterError: One is written otherwise, or the two do not go together.
    """
    width = Width.parse(until) if isinstance(until, str) else None
    if target is None:
        if over is not None:
            raise ParameterError(f"over {over!r} names the variable of a target; there is none")
        return (
            Question(None, width)
            if width is not None
            else Until.parse(until)
            if isinstance(until, str)
            else until
        )
    if until is not None and width is None:
        raise ParameterError(
            f"until {str(until)!r} is not allowed with a target; write it as 'width(QUANTITY) < WIDTH'"
        )
    return Question(Target.parse(target) if isinstance(target, str) else target, width, over)


class SequentialStop:
    """Decides after each round which points get further seeds.

    The rounds depend on the games of earlier rounds only, neither on their order nor on where they were played, so that a batch that
    was killed goes on as it would have.

    Args:
        rule: The question.
        plan: The runs that may be played.
        variables: What varies.
        n_least: Seeds that the batch keeps in any case.

    Attributes:
        n_seeds: Largest number of seeds of a point; None until the last round has been played.
        is_met: The question is answered.
    """

    def __init__(self, rule: Question, plan: BatchPlan, variables: list[Variable], n_least: int = 0) -> None:
        self.rule, self.plan, self.n_least = rule, plan, n_least
        self.n_seeds: int | None = None
        self.is_met = False
        self._layout = Layout.of(variables, plan.points, rule.over)
        self._games = PlayedQuantities(plan)

    def add(self, finished: Finished) -> None:
        """Take a finished run into account."""
        self._games.add(finished)

    def rounds(self) -> Iterator[list[int]]:
        """Numbers of all runs that the rounds so far need, by seed; the next round is asked for when they are played."""
        n_points, most = self.plan.n_points, self.plan.n_seeds
        n = np.full(n_points, min(FIRST_SEEDS, most))
        while True:
            needed = np.arange(int(n.max()))[:, None] < n
            yield np.flatnonzero(needed).tolist()
            grows = self._is_open(n, most) & (n < most)
            if not grows.any():
                break
            n = np.where(
                grows, np.minimum(np.maximum(np.ceil(GROWTH * n), n + FIRST_SEEDS), most).astype(n.dtype), n
            )
        self.is_met = not self._is_open(n, math.inf).any()
        self.n_seeds = max(int(n.max()), self.n_least)

    def _is_open(self, n: np.ndarray, most: float) -> np.ndarray:
        """Points with less than `most` games that need further seeds, (n_points,), by the first n games of each."""
        is_open = np.ones(len(n), bool)
        if self.rule.target is not None:
            is_open[:] = False
            is_open[self._answers(self.rule.target, n).wanted(most)] = True
        if self.rule.width is not None:
            games = self._games.matrix(self.rule.width.quantity, n)
            seen = seen_in(games, self.rule.width.quantity.may_be_negative)
            for point in np.flatnonzero(is_open).tolist():
                own = games[:, point]
                low, high = sequential_interval(own[np.isfinite(own)], 1.0 - LEVEL, seen)
                is_open[point] = not high - low < self.rule.width.width
        return is_open

    def _answers(self, target: Target, n: np.ndarray) -> Answers:
        matrix = self._games.matrix(target.quantity, n)
        return answers_of(target, str(target.quantity), self._layout, self.plan.points, matrix)
