"""What the entities of one plugin share: columns, searches, draws, messages."""

from __future__ import annotations

from typing import Any

from tussle.api.easy.search import Search
from tussle.api.easy.values import Cells, Columns
from tussle.api.group import GroupView
from tussle.errors import ParameterError


class Draws:
    """Random numbers of a view's rows, each drawn for all of them, by law and label.

    Args:
        view: Whose rows they are.
        n: Number of rows.
    """

    def __init__(self, view: Any, n: int) -> None:
        self._view, self._n = view, n
        self._of: dict[str, tuple[str, list[list[float]], list[int]]] = {}

    def clear(self, prefix: str = "") -> None:
        """Forget what was drawn: another call begins, whose labels are told from others' by a prefix."""
        self._of.clear()
        self._prefix = prefix

    def next(self, row: int, law: str, label: str) -> float:
        """The next number of a row under a label: what `g.uniform(label, k)` and `g.normal(label, k)` give, one after the other.

        Raises:
            ParameterError: The label has served for numbers of another law in this step.
        """
        label = label or law
        drawn, lines, used = self._of.setdefault(label, (law, [], [0] * self._n))
        if drawn != law:
            raise ParameterError(
                f"the label {label!r} has been drawn as {drawn} in this step, with the same random bits; use another label for {law}"
            )
        j = used[row]
        used[row] = j + 1
        if j >= len(lines):
            lines[:] = self._view.draw_lines(law, self._prefix + label, max(1, 2 * j)).tolist()
        return lines[j][row]


class DrawIn:
    """Draws shapes in one world; see `tussle.api.draw`."""

    __slots__ = ("_draw", "_world")

    def __init__(self, draw: Any, world: int) -> None:
        self._draw, self._world = draw, world

    def __getattr__(self, kind: str) -> Any:
        shape = getattr(self._draw, kind)
        return lambda **attributes: shape(**{"world": self._world, **attributes})


class Look:
    """What the entities of one plugin share, until rows change.

    Attributes:
        plugin: The bound plugin.
        author: What its author knows as `self`.
        g: The view.
        own: The plugin's columns; `cells`, those of one number.
        mine: Body columns of the rows, as they believe them to be.
        truth: Body columns of everybody.
    """

    def __init__(self, plugin: Any, g: GroupView) -> None:
        self.plugin, self.author, self.g = plugin, plugin._for_one(), g
        self.own: dict[str, Any] = plugin.__dict__
        self.cells = Cells(self.own)
        self.bodies = g.bodies
        self.mine, self.truth = Columns(g), Columns(g.bodies)
        self.search, self.draws = Search(g), Draws(g, g.n)
        self.heard: dict[str, Any] = {}
        _, _, id_row, id_start = g._bodies.layout()
        self.id_row: Any = memoryview(id_row)  # type: ignore[arg-type]
        self.id_start: list[int] = id_start.tolist()
        self.everyone = [plugin.me_type(self, row, world) for row, world in enumerate(g.world.tolist())]

    def begin(self, hook: str = "") -> None:
        """A call begins."""
        self.mine.clear()
        self.truth.clear()
        self.heard.clear()
        self.search.clear()
        self.draws.clear(hook)

    def row_of(self, world: int, entity: int) -> int:
        """Body row of an id; -1 for 0 and for who is gone."""
        place = self.id_start[world] + entity
        return self.id_row[place] if entity > 0 and place < self.id_start[world + 1] else -1
