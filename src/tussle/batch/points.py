"""Points of a batch, each one set of values: from rows that someone wrote, and to the settings of a mission."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from tussle.batch.variables import Choice, Value, Variable, check_value, key_of
from tussle.errors import ParameterError, nearest_name


def settings_of(
    point: Mapping[str, Value], variables: Sequence[Variable], is_argument: bool = False
) -> dict[str, Value]:
    """The values of a point as a mission takes them, a file or one made in Python; or as the arguments of a function that makes one.

    Raises:
        ParameterError: The point has no value of a variable, or one that is none.
    """
    names = {variable.name for variable in variables}
    for name in point:
        if name not in names:
            raise ParameterError(f"the point has {name!r}, which does not vary{nearest_name(name, names)}")
    missing = [variable.name for variable in variables if variable.name not in point]
    if missing:
        raise ParameterError(f"the point has no value of {', '.join(missing)}")
    return {variable.name: variable.setting(point[variable.name], is_argument) for variable in variables}


def variables_of(points: Sequence[Mapping[str, Value]]) -> list[Variable]:
    """What varies in points that are given one by one: for each name the choice among the values that it has.

    Raises:
        ParameterError: There are none, not all have the same names, or a value is not allowed.
    """
    if not points:
        raise ParameterError("there are no points; give at least one")
    names = points[0].keys()
    for i, point in enumerate(points):
        for name in {**points[0], **point}:
            if name not in point or name not in names:
                raise ParameterError(
                    f"point {i if name not in point else 0} has no value of {name!r}, others have; each point has one of each"
                )
            check_value(name, point[name])
    return [Choice(name, _different(point[name] for point in points)) for name in names]


def _different(values: Iterable[Value]) -> tuple[Value, ...]:
    first: dict[tuple[bool, str | float], Value] = {}
    for value in values:
        first.setdefault(key_of(value), value)
    return tuple(first.values())
