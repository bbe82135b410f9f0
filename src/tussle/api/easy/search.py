"""Neighbour queries of single rows, computed for all rows at once when many rows ask the same."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api.group import GroupView
from tussle.errors import ParameterError
from tussle.numeric.neighbors import queries

Found = list[tuple[int, int]]
"""(id, body row) of each entity found."""


class Search:
    """Neighbour queries of the rows of a view.

    The first rows that make a query are answered one by one. When more rows make the same query, it is computed for all rows in one
    kernel call, with the same result.

    Attributes:
        cached: Query -> result of each row, for queries computed for all rows. A query is (k, team) of `nearest` or
            (radius, team, "near") of `near`.
    """

    def __init__(self, g: GroupView) -> None:
        self._g = g
        self._asked: dict[Any, int] = {}
        self.cached: dict[Any, list[Found]] = {}

    def clear(self) -> None:
        """Discard the results: entities have moved."""
        self._asked.clear()
        self.cached.clear()

    def nearest(self, row: int, k: int, team: Any) -> Found:
        """The k nearest other entities of a row, nearest first; at equal distance, smaller id first."""
        return self._query(("nearest", k, _checked(team)), (k, team), row)

    def near(self, row: int, radius: float, team: Any) -> Found:
        """The other entities nearer than radius [m] to a row, ordered as in `nearest`."""
        return self._query(("near", float(radius), _checked(team)), (radius, team, "near"), row)

    def _query(self, query: tuple[str, Any, Any], key: Any, row: int) -> Found:
        n = self._asked[key] = self._asked.get(key, 0) + 1
        if n <= 1 + self._g.n // 256:  # few rows make this query, or the radius differs each time
            return self._compute(*query, row, row + 1)[0]
        found = self.cached[key] = self._compute(*query, 0, self._g.n)
        return found[row]

    def _compute(self, kind: str, limit: Any, team: Any, first: int, last: int) -> list[Found]:
        """Results of the rows [first, last)."""
        g, bodies, index = self._g, self._g.bodies, self._g.any_index()
        x, y, z = np.ascontiguousarray(g.pos[:, first:last])
        first, last = g.first + first, g.first + last
        if kind == "nearest":
            other, _ = queries.nearest(index, first, last, x, y, z, limit, bodies.team, team)
            is_there = other.T >= 0
            count, rows = is_there.sum(axis=1), other.T[is_there]
        else:
            radius = np.full(last - first, limit)
            points = g.range_points(index)
            found = queries.pairs(index, first, last, x, y, z, radius, bodies.team, team, points)
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
