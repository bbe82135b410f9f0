"""Distributions of parameters, of which each episode draws its own value."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from tussle.batch.variables import Choice, Range, Variable, parse_values, parse_variable
from tussle.errors import ParameterError

UNNAMED = "distribution"


def uniform(low: float, high: float, *, unit: str = "", log: bool = False, whole: bool = False) -> Range:
    """A uniform distribution, for `reset` and `Task.vary`.

    Args:
        low: Smallest value [unit].
        high: Largest value [unit].
        unit: Unit of both; by default SI units.
        log: Values are spread evenly by their logarithm.
        whole: Whole numbers only, low and high included.

    Raises:
        ParameterError: The bounds are not allowed.
        UnitError: The unit is unknown.
    """
    return Range(UNNAMED, low, high, whole, log, None, unit)


def choice(values: Iterable[Any]) -> Choice:
    """A distribution of some values, each of which is as likely as the others, for `reset` and `Task.vary`.

    Raises:
        ParameterError: A value is not allowed, or there is none.
    """
    return Choice(UNNAMED, tuple(values))


def named(distribution: Variable, path: str) -> Variable:
    """A distribution as that of the parameter with a path."""
    return replace(distribution, name=path)


def variables_of(vary: Any, where: str) -> list[Variable]:
    """The variables of a task, from texts such as "prey.Boids.max_speed=10:20", or from distributions by path.

    Raises:
        ParameterError: One is malformed.
    """
    if not isinstance(vary, Mapping):
        return [parse_variable(text) for text in vary]
    found: list[Variable] = []
    for path, given in vary.items():
        if not isinstance(given, (str, Range, Choice)):
            raise ParameterError(
                f"{where}: vary of {path!r} is {given!r:.80}; it takes uniform(10, 20), choice(['a', 'b']), or a text such as '10:20'"
            )
        found.append(parse_values(path, given) if isinstance(given, str) else named(given, path))
    return found


def extremes(variable: Variable) -> list[Any]:
    """Values that are allowed if all of a variable are: the bounds of a range, all choices."""
    many = (variable.low, variable.high) if isinstance(variable, Range) else variable.values
    return [variable.setting(value) for value in many]


__all__ = ["choice", "extremes", "named", "uniform", "variables_of"]
