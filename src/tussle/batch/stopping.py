"""When a batch with a rule such as `--until 0.02` stops, independent of the order in which its runs are finished."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from tussle.batch.plan import BatchPlan
from tussle.batch.quantities import Quantity, column_name
from tussle.batch.statistics import LEVEL, wilson
from tussle.batch.tasks import Finished
from tussle.errors import ParameterError

MIN_RUNS = 20
"""With fewer runs a standard deviation is too uncertain to stop by."""

TAKES = (
    "it takes WIDTH for the wins of all teams, QUANTITY:WIDTH, or 'width(QUANTITY) < WIDTH', such as 0.02, score[2]:0.5 or "
    "'width(wins[2]) < 0.02'"
)
SIGN = re.compile(r":|±|\+/?-")
"""Stands before the width; ± and its spellings are those of earlier versions."""
Columns = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Until:
    """Half the width that the 95 % interval of a result is to have at each point.

    Attributes:
        quantity: The result; None for the wins of every team.
        half_width: Of the interval.
    """

    quantity: Quantity | None
    half_width: float

    @staticmethod
    def parse(text: str) -> Until:
        """Read "0.02" or "score[2]:0.5".

        Raises:
            ParameterError: It is written otherwise, or asks for an impossible width.
        """
        signs = list(SIGN.finditer(text))
        name, number = (text[: signs[-1].start()], text[signs[-1].end() :]) if signs else ("", text)
        name, number = name.strip(), number.strip()
        try:
            half_width = float(number)
        except ValueError:
            hint = "; a share of 2 % is written 0.02" if number.endswith("%") else ""
            raise ParameterError(f"until {text!r}: {number!r} is no number{hint}; {TAKES}") from None
        if not 0.0 < half_width < math.inf:
            raise ParameterError(f"until {text!r}: the width {number} is not allowed; it takes a number > 0")
        quantity = Quantity.parse(name) if name else None
        if half_width >= 0.5 and (quantity is None or quantity.is_share):
            raise ParameterError(
                f"until {text!r}: shares lie between 0 and 1, so the width {number} says nothing; 2 % is written 0.02"
            )
        return Until(quantity, half_width)

    def is_met(self, columns_by_point: Iterable[Columns]) -> bool:
        """Return True if the interval is narrow enough at every point.

        Args:
            columns_by_point: For each point, name -> value for each of its runs, (n,); NaN where a run failed.

        Raises:
            ParameterError: The runs have no such result.
        """
        return all(self.width(columns) <= self.half_width for columns in columns_by_point)

    def width(self, columns: Columns) -> float:
        """Half the width of the interval at one point, of several results the widest; infinite for less than 20 runs.

        Args:
            columns: Name -> value for each run, (n,); NaN where it failed.

        Raises:
            ParameterError: The runs have no such result.
        """
        if not any(np.isfinite(values).any() for values in columns.values()):
            return math.inf
        if self.quantity is not None:
            return _half(self.quantity.evaluate(columns), self.quantity.is_share)
        wins = [values for name, values in columns.items() if name.startswith("wins[")]
        if not wins:
            raise ParameterError(
                f"until {self}: these games have no scores, so nobody wins; name a quantity, as in t:0.5"
            )
        return max(_half(values, is_share=True) for values in wins)

    def check(self, columns: Columns) -> None:
        """See that runs have the result.

        Raises:
            ParameterError: They have not.
        """
        self.width(columns)

    def __str__(self) -> str:
        return f"{self.quantity}:{self.half_width!r}" if self.quantity else repr(self.half_width)


def _half(values: np.ndarray, is_share: bool) -> float:
    """Half of Wilson's interval of a share, or of the normal interval of a mean."""
    known = values[np.isfinite(values)]
    n = len(known)
    if n < MIN_RUNS:
        return math.inf
    if is_share:
        low, high = wilson(float(known.sum()), n)
        return (high - low) / 2.0
    return NormalDist().inv_cdf(0.5 + LEVEL / 2.0) * float(known.std(ddof=1)) / math.sqrt(n)


ROUND = 10
"""Seeds between two checks of the rule."""


class PlayedQuantities:
    """The quantities of finished runs, by seed and point.

    Args:
        plan: The runs.

    Attributes:
        columns: Name -> values, (room for seeds, n_points); NaN where a run failed or is not finished.
        is_there: Which runs are finished, (room for seeds, n_points).
    """

    def __init__(self, plan: BatchPlan) -> None:
        self.columns: dict[str, np.ndarray] = {}
        self.is_there = np.zeros((0, plan.n_points), bool)

    def add(self, finished: Finished) -> None:
        """Add a run."""
        seed, point = divmod(finished.number, self.is_there.shape[1])
        self._make_room(seed + 1)
        for name, value in quantities_of(finished).items():
            if name not in self.columns:
                self.columns[name] = np.full(self.is_there.shape, np.nan)
            self.columns[name][seed, point] = value
        self.is_there[seed, point] = True

    def matrix(self, quantity: Quantity, n: np.ndarray) -> np.ndarray:
        """A quantity by seed and point, (n_seeds, n_points), of the first n games of each point; NaN for all others.

        Args:
            quantity: The quantity; NaN everywhere where all games failed.
            n: Games of each point, (n_points,).

        Raises:
            ParameterError: The runs have no such quantity.
        """
        n_seeds = int(n.max())
        if not any(np.isfinite(values).any() for values in self.columns.values()):
            return np.full((n_seeds, len(n)), np.nan)
        values = quantity.evaluate({name: column[:n_seeds] for name, column in self.columns.items()})
        return np.where(np.arange(n_seeds)[:, None] < n, values, np.nan)

    def _make_room(self, n_seeds: int) -> None:
        n_now = len(self.is_there)
        if n_seeds <= n_now:
            return
        n_more = max(n_seeds, 2 * n_now) - n_now
        self.is_there = np.pad(self.is_there, ((0, n_more), (0, 0)))
        for name, values in self.columns.items():
            self.columns[name] = np.pad(values, ((0, n_more), (0, 0)), constant_values=np.nan)


class Stop:
    """Watches the runs of a batch until its rule is met.

    It looks only at whole rounds of seeds of all points, so that the result does not depend on the executor.

    Args:
        rule: The rule.
        plan: The runs.
        n_least: Seeds that are kept in any case, such as those of a batch that was complete before.

    Attributes:
        n_seeds: Seeds with which the rule is met; None until then.
    """

    def __init__(self, rule: Until, plan: BatchPlan, n_least: int = 0) -> None:
        self.rule, self.plan, self.n_least = rule, plan, n_least
        self.n_seeds: int | None = None
        self._games = PlayedQuantities(plan)
        self._n_whole = 0  # seeds from the first on of which all points are there

    def add(self, finished: Finished) -> bool:
        """Take a finished run into account; true when the rule is met."""
        if self.n_seeds is not None:
            return True
        self._games.add(finished)
        is_there = self._games.is_there
        while self._n_whole < len(is_there) and is_there[self._n_whole].all():
            self._n_whole += 1
            if self._is_time(self._n_whole) and self._is_met(self._n_whole):
                self.n_seeds = self._n_whole
                return True
        return False

    def _is_time(self, n_seeds: int) -> bool:
        return n_seeds == self.n_least or (n_seeds > self.n_least and n_seeds % ROUND == 0)

    def _is_met(self, n_seeds: int) -> bool:
        points = range(self.plan.n_points)
        return self.rule.is_met(
            {name: values[:n_seeds, point] for name, values in self._games.columns.items()}
            for point in points
        )


def quantities_of(finished: Finished) -> dict[str, float]:
    """Quantities of a run by name; NaN where it failed."""
    values = {column_name(name, team): value for team, name, value in finished.metrics}
    scores = [team for team, name, _ in finished.metrics if name == "score"]
    values |= {column_name("wins", team): float(team == finished.winner) for team in scores}
    if scores:
        values["ties"] = float(finished.winner is None)
    start = {team: value for team, name, value in finished.metrics if name == "start"}
    values |= {
        column_name("lost", team): start[team] - value
        for team, name, value in finished.metrics
        if name == "alive" and team in start
    }
    values |= {"t": finished.t, "steps": float(finished.steps)}
    return dict.fromkeys(values, np.nan) if finished.end == "error" else values
