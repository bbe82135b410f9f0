"""Data shared by all entities of one easy-mode plugin: columns, neighbour queries, random numbers and messages."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api.easy.values import Cells, Columns
from tussle.api.group import GroupView
from tussle.errors import ParameterError
from tussle.numeric.neighbors import queries


class RandomNumbers:
    """Random numbers for the rows of a view, drawn for all rows at once.

    Args:
        view: View that draws the numbers.
        n: Number of rows.
    """

    def __init__(self, view: Any, n: int) -> None:
        self._view, self._n = view, n
        self._of: dict[str, tuple[str, list[list[float]], list[int]]] = {}

    def clear(self, prefix: str = "") -> None:
        """Start a new call. `prefix` separates the labels of hooks from each other."""
        self._of.clear()
        self._prefix = prefix

    def next(self, row: int, law: str, label: str) -> float:
        """The next number of a row and label: the values of `g.uniform(label, k)` or `g.normal(label, k)` in order.

        Raises:
            ParameterError: The label was used with another law in this step.
        """
        label = label or law
        drawn, lines, used = self._of.setdefault(label, (law, [], [0] * self._n))
        if drawn != law:
            raise ParameterError(
                f"label {label!r} is in use for {drawn} numbers in this step, with the same random bits; use another label for {law}"
            )
        j = used[row]
        used[row] = j + 1
        if j >= len(lines):
            lines[:] = self._view.draw_lines(law, self._prefix + label, max(1, 2 * j)).tolist()
        return lines[j][row]


class WorldDraw:
    """Draw shapes in one world; see `tussle.api.draw`."""

    __slots__ = ("_draw", "_world")

    def __init__(self, draw: Any, world: int) -> None:
        self._draw, self._world = draw, world

    def __getattr__(self, kind: str) -> Any:
        shape = getattr(self._draw, kind)
        return lambda **attributes: shape(**{"world": self._world, **attributes})


class Shared:
    """Data shared by all entities of one plugin; valid until rows change.

    Attributes:
        plugin: The bound plugin.
        author: The object passed as `self` to the author's methods.
        g: The view.
        own: Columns of the plugin.
        cells: Columns of one number, as memory views.
        belief: Body columns of the rows, as the entities believe them to be.
        truth: True body columns of all entities.
        entities: The `Me` of each row.
    """

    def __init__(self, plugin: Any, g: GroupView) -> None:
        self.plugin, self.author, self.g = plugin, plugin._author_self(), g
        self.own: dict[str, Any] = plugin.__dict__
        self.cells = Cells(self.own)
        self.bodies = g.bodies
        self.belief, self.truth = Columns(g), Columns(g.bodies)
        self.search, self.draws = Search(g), RandomNumbers(g, g.n)
        self.heard: dict[str, Any] = {}
        _, _, id_row, id_start = g._bodies.layout()
        self.id_row: Any = memoryview(id_row)  # type: ignore[arg-type]
        self.id_start: list[int] = id_start.tolist()
        self.entities = [plugin.me_type(self, row, world) for row, world in enumerate(g.world.tolist())]

    def begin(self, hook: str = "") -> None:
        """Start a call: discard cached values."""
        self.belief.clear()
        self.truth.clear()
        self.heard.clear()
        self.search.clear()
        self.draws.clear(hook)

    def row_of(self, world: int, entity: int) -> int:
        """Body row of an id; -1 for id 0 and for removed entities."""
        place = self.id_start[world] + entity
        return self.id_row[place] if entity > 0 and place < self.id_start[world + 1] else -1


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
