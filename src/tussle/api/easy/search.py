"""Who is near whom, asked by one row after another and answered for all rows at once."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api.group import GroupView
from tussle.errors import ParameterError
from tussle.neighbors import queries

Found = list[tuple[int, int]]
"""Id and body row of each."""


class Search:
    """The queries of the rows of a view.

    The first rows that ask are answered one by one. A question that many ask is answered for all rows, in one call of the kernel;
    what it finds is the same.

    Attributes:
        known: (k, team) of `nearest`, and (radius, team, "near") of `near` -> what each row finds, as far as all have been answered.
    """

    def __init__(self, g: GroupView) -> None:
        self._g = g
        self._asked: dict[Any, int] = {}
        self.known: dict[Any, list[Found]] = {}

    def clear(self) -> None:
        """Forget the answers: somebody has moved."""
        self._asked.clear()
        self.known.clear()

    def nearest(self, row: int, k: int, team: Any) -> Found:
        """(id, body row) of the k nearest others of a row, nearest first, the smaller id first at equal distance."""
        return self._ask(("nearest", k, _checked(team)), (k, team), row)

    def near(self, row: int, radius: float, team: Any) -> Found:
        """(id, body row) of the others nearer than radius [m] to a row; ordered as by `nearest`."""
        return self._ask(("near", float(radius), _checked(team)), (radius, team, "near"), row)

    def _ask(self, question: tuple[str, Any, Any], key: Any, row: int) -> Found:
        n = self._asked[key] = self._asked.get(key, 0) + 1
        if n <= 1 + self._g.n // 256:  # few rows ask this, or it is another radius each time
            return self._answers(*question, row, row + 1)[0]
        known = self.known[key] = self._answers(*question, 0, self._g.n)
        return known[row]

    def _answers(self, kind: str, limit: Any, team: Any, first: int, last: int) -> list[Found]:
        """What the rows [first, last) find."""
        g, bodies, index = self._g, self._g.bodies, self._g.any_index()
        x, y, z = np.ascontiguousarray(g.pos[:, first:last])
        first, last = g.first + first, g.first + last
        if kind == "nearest":
            other, _ = queries.nearest(index, first, last, x, y, z, limit, bodies.team, team)
            is_there = other.T >= 0
            count, rows = is_there.sum(axis=1), other.T[is_there]
        else:
            radius = np.full(last - first, limit)
            found = queries.pairs(index, first, last, x, y, z, radius, bodies.team, team)
            order = np.lexsort((bodies.id[found.other], found.distance, found.row))
            count, rows = found.count, found.other[order]
        pairs, ends = (
            list(zip(bodies.id[rows].tolist(), rows.tolist(), strict=True)),
            np.cumsum(count).tolist(),
        )
        return [pairs[i:j] for i, j in zip([0, *ends], ends, strict=False)]


def _checked(team: Any) -> Any:
    if team is None or type(team) is int or team in ("own", "other"):
        return team
    if isinstance(team, np.integer):
        return int(team)
    raise ParameterError(f"team = {team!r} is not allowed; it is 'own', 'other', a team number or None")
