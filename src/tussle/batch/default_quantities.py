"""The quantities of a batch that are shown if none are asked for: the same for `tussle batch`, `tussle analyze` and the report."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.batch.quantities import column_name, metric_of

COUNTED = ("wins", "ties", "score", "alive", "lost", "start", "t", "steps")
"""Quantities that every game has, in the order in which they are listed; what plugins report comes behind."""
MAX_MEASURED = 12
"""Largest number of measured quantities that are looked at without being asked for."""


@dataclass(frozen=True)
class DefaultQuantities:
    """Quantities that are shown if none are asked for.

    Attributes:
        leading: Those that are shown point by point, compared, and explained: scores and what plugins measure; without them the
            losses, and else the time at the end.
        others: Those that are shown besides in tables of means: numbers left, and the time at the end.
    """

    leading: list[str]
    others: list[str]

    @property
    def all(self) -> list[str]:
        """All, the leading ones first."""
        return [*self.leading, *self.others]


def default_quantities(
    columns: Mapping[str, np.ndarray], teams: Sequence[int], varied: Sequence[Sequence[Any]] = ()
) -> DefaultQuantities:
    """Choose the quantities that tell most.

    Quantities that do not vary are left out, and so are those that only repeat a varied value or another quantity; counts of
    networks are shown only if nothing else is measured. If nothing remains, those that do not vary are shown.

    Args:
        columns: Name -> value for each run, (n,); NaN where it is not known.
        teams: Numbers of the teams.
        varied: Values of each variable, run by run, (n,) each.
    """
    known = {name: values for name, values in columns.items() if np.isfinite(values).any()}
    scores = [name for team in teams if (name := column_name("score", team)) in known]
    measured = _measured(known)
    left = [_left(known, team) for team in teams if _has_lost(known, team)]
    tells = InformativeQuantities(known, varied)
    leading: list[str] = []
    for names in ([*tells(scores), *tells(measured)[:MAX_MEASURED]], tells(left), tells(["t"])):
        leading = leading or tells(names)
    leading = leading or (scores or measured)[:MAX_MEASURED] or ["t"]
    return DefaultQuantities(leading, [name for name in [*left, *tells(["t"])] if name not in leading])


def is_of_network(names: Collection[str]) -> Callable[[str], bool]:
    """A function that returns whether a quantity is a count of a network.

    Args:
        names: Names of all quantities.
    """
    plugins = {name.removesuffix(".delivered") for name in names if name.endswith(".delivered")}
    found = {plugin for plugin in plugins if f"{plugin}.sent" in names}
    return lambda name: name.rpartition(".")[0] in found


def varies(values: np.ndarray) -> bool:
    """Return whether the known values differ."""
    known = values[np.isfinite(values)]
    return bool(len(known)) and bool(np.ptp(known) > 0.0)


def is_within_one(values: np.ndarray) -> bool:
    """Return whether all known values lie between 0 and 1, as those of a share do."""
    known = values[np.isfinite(values)]
    return bool(len(known)) and bool(((known >= 0.0) & (known <= 1.0)).all())


def _measured(known: Mapping[str, np.ndarray]) -> list[str]:
    """What metrics and interactions measure, shares first; of plugins that give a score, and of networks, only if there is nothing else."""
    names = [name for name in known if metric_of(name) not in COUNTED]
    scoring = {metric_of(name).rpartition(".")[0] for name in names if metric_of(name).endswith(".score")}
    network = is_of_network(known)
    own = [n for n in names if not network(n) and metric_of(n).rpartition(".")[0] not in scoring]
    return sorted(own or names, key=lambda name: not is_within_one(known[name]))


def _has_lost(known: Mapping[str, np.ndarray], team: int) -> bool:
    return bool(np.any(known.get(column_name("lost", team), np.zeros(1)) > 0.0))


def _left(known: Mapping[str, np.ndarray], team: int) -> str:
    """What is left of a team; what it lost if it did not always start with as many, since what is left then follows from that."""
    return column_name("lost" if varies(known[column_name("start", team)]) else "alive", team)


class InformativeQuantities:
    """Selects informative quantities: they vary, and repeat neither a varied value nor an earlier quantity.

    Args:
        known: Name -> value for each run, (n,).
        varied: Values of each variable, run by run.
    """

    def __init__(self, known: Mapping[str, np.ndarray], varied: Sequence[Sequence[Any]]) -> None:
        self.known = known
        self.varied = [
            np.array(values, dtype=float)
            for values in varied
            if all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in values)
        ]

    def __call__(self, names: Sequence[str]) -> list[str]:
        """Return those of them that tell something, in order."""
        found: list[str] = []
        for name in names:
            values = self.known.get(name)
            if values is None or not varies(values) or any(_repeats(values, x) for x in self.varied):
                continue
            if not any(np.array_equal(values, self.known[other], equal_nan=True) for other in found):
                found.append(name)
        return found


def _repeats(values: np.ndarray, variable: np.ndarray) -> bool:
    """Return whether a quantity is a varied value, in this or another unit."""
    is_known = np.isfinite(values) & (variable != 0.0)
    if not is_known.any() or not varies(variable):
        return False
    ratio = values[is_known] / variable[is_known]
    return bool(np.ptp(ratio) <= 1e-9 * np.abs(ratio).max()) and not np.any(
        values[np.isfinite(values) & ~is_known]
    )
