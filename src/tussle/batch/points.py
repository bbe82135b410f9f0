"""Points of a batch, each one set of values: as settings of a mission, and the variables of points that are given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from tussle.batch.variables import Choice, Value, Variable, check_value, key_of
from tussle.errors import ParameterError, nearest_name


def settings_of(
    point: Mapping[str, Value], variables: Sequence[Variable], is_argument: bool = False
) -> dict[str, Value]:
    """The values of a point as a mission takes them; with `is_argument`, as a function that makes a mission takes them.

    Raises:
        ParameterError: The point has no value of a variable, or a value of none.
    """
    names = {variable.name for variable in variables}
    for name in point:
        if name not in names:
            raise ParameterError(f"the point has {name!r}, which does not vary{nearest_name(name, names)}")
    if missing := [name for name in names if name not in point]:
        raise ParameterError(f"the point has no value of {', '.join(sorted(missing))}")
    return {variable.name: variable.setting(point[variable.name], is_argument) for variable in variables}


def variables_of(points: Sequence[Mapping[str, Value]]) -> list[Variable]:
    """The variables of points that are given: for each name the choice among its values.

    Raises:
        ParameterError: There are no points, they have different names, or a value is not allowed.
    """
    if not points:
        raise ParameterError("there are no points; give at least one")
    for i, point in enumerate(points):
        if different := point.keys() ^ points[0].keys():
            raise ParameterError(
                f"points 0 and {i} differ in {min(different)!r}; each point has a value of each variable"
            )
        for name, value in point.items():
            check_value(name, value)
    return [Choice(name, _different([point[name] for point in points])) for name in points[0]]


def _different(values: Sequence[Value]) -> tuple[Value, ...]:
    """Each value once, the first of equal ones."""
    first: dict[tuple[bool, str | float], Value] = {}
    for value in values:
        first.setdefault(key_of(value), value)
    return tuple(first.values())
