"""Quantities of a run: named numbers, and arithmetic with them."""

from __future__ import annotations

import ast
import json
import keyword
import math
import re
import warnings
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from tussle.errors import ParameterError, clipped, listed, nearest_name

MAX_TEXT = 200
MAX_LISTED = 12
SHARES = ("wins", "ties")
OPERATORS = (ast.Add, ast.Sub, ast.Mult, ast.Div)
TAKES = "it takes names as score[2], ties or CPA.cpa[1], numbers, + - * / and parentheses"


def column_name(metric: str, team: int | None) -> str:
    """The name of a metric of a team, or of the world: "score[2]", "CPA.cpa[1]", '"my metric.hits"[2]', "ties"."""
    is_plain = metric.isascii() and all(
        part.isidentifier() and not keyword.iskeyword(part) for part in metric.split(".")
    )
    name = metric if is_plain else json.dumps(metric, ensure_ascii=False)
    return name if team is None else f"{name}[{team}]"


def metric_of(name: str) -> str:
    """The metric of the name of a column: "score" of "score[2]", "my metric.hits" of '"my metric.hits"[2]'."""
    metric = re.sub(r"\[-?\d+\]$", "", name)
    return str(json.loads(metric)) if metric.startswith('"') else metric


@dataclass(frozen=True)
class Quantity:
    """A number of each run, given by an expression.

    Attributes:
        text: The expression.
    """

    text: str
    _tree: ast.expr = field(repr=False, compare=False)

    @staticmethod
    def parse(text: str) -> Quantity:
        """Read an expression such as "score[2]-score[3]" or "lost[1] / start[1]".

        Raises:
            ParameterError: The text is no such expression.
        """
        if len(text) > MAX_TEXT:
            raise ParameterError(
                f"quantity {clipped(text)!r} has {len(text)} characters; at most {MAX_TEXT} are allowed"
            )
        try:
            with warnings.catch_warnings():  # the parser has opinions about "1if"; it is refused below
                warnings.simplefilter("ignore")
                tree = ast.parse(text.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            why = getattr(error, "msg", None) or str(error) or "it is nested too deeply"
            raise ParameterError(f"quantity {text!r} cannot be read: {why}; {TAKES}") from None
        if not sum(1 for _ in _names(tree, text)):
            raise ParameterError(f"quantity {text!r} names nothing that a run has; {TAKES}")
        return Quantity(text.strip(), tree)

    @property
    def is_share(self) -> bool:
        """The quantity is 0 or 1 in each run: wins of a team, or ties."""
        is_name = not isinstance(self._tree, (ast.BinOp, ast.UnaryOp))
        return is_name and next(_names(self._tree, self.text))[0] in SHARES

    @property
    def may_be_negative(self) -> bool:
        """Whether an expression of shares may be below 0: it subtracts from anything but 1, or turns a sign."""
        return any(
            isinstance(node.op, ast.USub)
            or (isinstance(node.op, ast.Sub) and getattr(node.left, "value", None) != 1)
            for node in _operations(self._tree)
        )

    def names(self, columns: Collection[str]) -> list[str]:
        """The columns that the expression names, each once, in order.

        Args:
            columns: Names of all that there are.

        Raises:
            ParameterError: There is no such column, or a team must be named.
        """
        found = (_column(metric, team, self.text, columns) for metric, team in _names(self._tree, self.text))
        return list(dict.fromkeys(found))

    def canonical(self, columns: Collection[str]) -> str:
        """The text; of a single name, the name of its column, so that one quantity has one text.

        Raises:
            ParameterError: There is no such column, or a team must be named.
        """
        names = self.names(columns)
        return self.text if isinstance(self._tree, (ast.BinOp, ast.UnaryOp)) else names[0]

    def evaluate(self, columns: Mapping[str, np.ndarray]) -> np.ndarray:
        """Value for each run, (n,); NaN where a part is not known and where it divides by zero.

        Args:
            columns: Name -> value for each run, (n,).

        Raises:
            ParameterError: There is no such column, or a team must be named.
        """
        with np.errstate(all="ignore"):  # infinite distances, and what becomes of them
            return np.array(self._value(self._tree, columns), dtype=np.float64)

    def _value(self, node: ast.expr, columns: Mapping[str, np.ndarray]) -> np.ndarray | float:
        if isinstance(node, ast.BinOp):
            a, b = self._value(node.left, columns), self._value(node.right, columns)
            if isinstance(node.op, ast.Add):
                return a + b
            if isinstance(node.op, ast.Sub):
                return a - b
            if isinstance(node.op, ast.Mult):
                return a * b
            divisor = np.asarray(b, dtype=np.float64)
            return a / np.where(divisor == 0.0, np.nan, divisor)
        if isinstance(node, ast.UnaryOp):
            value = self._value(node.operand, columns)
            return -value if isinstance(node.op, ast.USub) else value
        if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
            return float(node.value)
        metric, team = _metric(node, self.text)
        return columns[_column(metric, team, self.text, columns)]

    def __str__(self) -> str:
        return self.text


def _operations(node: ast.expr) -> Iterator[ast.BinOp | ast.UnaryOp]:
    """The operations of an expression."""
    if isinstance(node, ast.BinOp):
        yield node
        yield from _operations(node.left)
        yield from _operations(node.right)
    elif isinstance(node, ast.UnaryOp):
        yield node
        yield from _operations(node.operand)


def _names(node: ast.expr, text: str) -> Iterator[tuple[str, int | None]]:
    """Metric and team of each name in an expression; raises for what is not arithmetic."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, OPERATORS):
        yield from _names(node.left, text)
        yield from _names(node.right, text)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.UAdd, ast.USub)):
        yield from _names(node.operand, text)
    elif isinstance(node, ast.Constant) and not isinstance(node.value, str):
        value = node.value
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
            raise _refused(node, text)
    else:
        yield _metric(node, text)


def _metric(node: ast.expr, text: str) -> tuple[str, int | None]:
    if not isinstance(node, ast.Subscript):
        return _dotted(node, text), None
    team, sign = node.slice, 1
    if isinstance(team, ast.UnaryOp) and isinstance(team.op, ast.USub):
        team, sign = team.operand, -1
    if not isinstance(team, ast.Constant) or type(team.value) is not int:
        raise ParameterError(
            f"quantity {text!r}: {ast.unparse(node)!r} names no team; in brackets stands the team's number"
        )
    return _dotted(node.value, text), sign * team.value


def _dotted(node: ast.expr, text: str) -> str:
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute):
        return f"{_dotted(node.value, text)}.{node.attr}"
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    raise _refused(node, text)


def _refused(node: ast.expr, text: str) -> ParameterError:
    return ParameterError(f"quantity {text!r}: {ast.unparse(node)!r} is not allowed; {TAKES}")


def _column(metric: str, team: int | None, text: str, columns: Collection[str]) -> str:
    """The column of a metric; without a team the only one of the metric."""
    name = column_name(metric, team)
    if name in columns:
        return name
    stem = column_name(metric, None)
    of_teams = [c for c in columns if c.startswith(f"{stem}[")]
    if team is None and len(of_teams) == 1:
        return of_teams[0]
    if team is None and of_teams:
        raise ParameterError(f"quantity {text!r}: {name!r} needs a team; {listed(of_teams)}")
    known = of_teams or list(columns)
    more = f" and {len(known) - MAX_LISTED} more" if len(known) > MAX_LISTED else ""
    raise ParameterError(
        f"quantity {text!r}: there is no {name!r}{nearest_name(name, columns)}; {listed(known[:MAX_LISTED])}{more}"
    )
