"""When a batch with a rule such as `--until 0.02` stops, independent of the order in which its runs are finished."""

from __future__ import annotations

import numpy as np

from tussle.batch.plan import BatchPlan
from tussle.batch.quantities import column_name
from tussle.batch.tasks import Finished
from tussle.batch.until import Until

ROUND = 10
"""Seeds between two checks of the rule."""


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
        self._columns: dict[str, np.ndarray] = {}  # by seed and point, (room for seeds, n_points)
        self._is_there = np.zeros((0, plan.n_points), bool)
        self._n_whole = 0  # seeds from the first on of which all points are there

    def add(self, finished: Finished) -> bool:
        """Take a finished run into account; true when the rule is met."""
        if self.n_seeds is not None:
            return True
        seed, point = divmod(finished.number, self.plan.n_points)
        self._make_room(seed + 1)
        for name, value in quantities_of(finished).items():
            if name not in self._columns:
                self._columns[name] = np.full(self._is_there.shape, np.nan)
            self._columns[name][seed, point] = value
        self._is_there[seed, point] = True
        while self._n_whole < len(self._is_there) and self._is_there[self._n_whole].all():
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
            {name: values[:n_seeds, point] for name, values in self._columns.items()} for point in points
        )

    def _make_room(self, n_seeds: int) -> None:
        n_now = len(self._is_there)
        if n_seeds <= n_now:
            return
        n_more = max(n_seeds, 2 * n_now) - n_now
        self._is_there = np.pad(self._is_there, ((0, n_more), (0, 0)))
        for name, values in self._columns.items():
            self._columns[name] = np.pad(values, ((0, n_more), (0, 0)), constant_values=np.nan)


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
