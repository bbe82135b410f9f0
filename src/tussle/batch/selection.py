"""Selects points by their values, and pairs points that agree in all other values."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from tussle.batch.variables import Choice, Range, Variable
from tussle.documents import is_count
from tussle.errors import ParameterError, listed, nearest_name
from tussle.mission.codecs import written as text_of

Points = Sequence[Mapping[str, Any]]
MAX_LISTED = 12


def select_points(variables: Sequence[Variable], points: Points, text: str) -> list[int]:
    """The points with the values that a text names: "tactic=keep", "tactic=keep, prey_speed=20", or "3" for a point by its number.

    Raises:
        ParameterError: There is no such variable, or no such point.
    """
    if is_number(text):
        return [known_point(points, int(text))]
    wanted = _values(variables, text)
    named = [(v.name, _named(dict.fromkeys(point[v.name] for point in points), shown)) for v, shown in wanted]
    found = [i for i, point in enumerate(points) if all(point[name] in values for name, values in named)]
    if found:
        return found
    for (variable, shown), (_, values) in zip(wanted, named, strict=True):
        if not values:
            there = list(dict.fromkeys(written(point[variable.name]) for point in points))
            more = f" and {len(there) - MAX_LISTED} more" if len(there) > MAX_LISTED else ""
            raise ParameterError(
                f"{text!r}: no point has {variable.name}={shown}{nearest_name(shown, there)}; "
                f"{listed(there[:MAX_LISTED])}{more}"
            )
    raise ParameterError(f"{text!r}: each of these values is there, but no point has all of them")


def known_point(points: Points, number: int) -> int:
    """The number of a point that exists.

    Raises:
        ParameterError: There is none.
    """
    if isinstance(number, bool) or not 0 <= number < len(points):
        raise ParameterError(f"there is no point {number}; there are points 0 to {len(points) - 1}")
    return int(number)


def paired_points(
    variables: Sequence[Variable], points: Points, a: int | str, b: int | str
) -> tuple[list[int], list[int]]:
    """Points of a, and in the same order the points of b that agree with them in all variables that the texts do not name.

    Raises:
        ParameterError: There is no such point, or no two points can be paired.
    """
    if a == b:
        raise ParameterError(f"{a!r} is compared with itself")
    chosen = [_points_of(variables, points, side) for side in (a, b)]
    if len(chosen[0]) == len(chosen[1]) == 1 and (is_number(a) or is_number(b)):
        return chosen[0], chosen[1]
    named = [_names_in(variables, side) for side in (a, b)]
    if named[0] != named[1]:
        raise ParameterError(
            f"{a!r} and {b!r} select several points by different variables; to be paired they name the same ones"
        )
    others = [v.name for v in variables if v.name not in named[0]]
    places: dict[tuple[Any, ...], list[int]] = {}
    for i in chosen[1]:
        places.setdefault(tuple(points[i][name] for name in others), []).append(i)
    firsts, seconds = [], []
    for i in chosen[0]:
        partners = places.get(tuple(points[i][name] for name in others))
        if partners:  # points that are there twice are paired in their order
            firsts.append(i)
            seconds.append(partners.pop(0))
    if not firsts:
        raise ParameterError(f"no point with {a} has one with {b} that agrees with it in {', '.join(others)}")
    return firsts, seconds


def is_number(side: int | str) -> bool:
    """Return True if a point is given by its number."""
    return not isinstance(side, str) or is_count(side.strip())


def written(value: Any) -> str:
    """A value as a text; real numbers have six digits."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _points_of(variables: Sequence[Variable], points: Points, side: int | str) -> list[int]:
    return select_points(variables, points, side) if isinstance(side, str) else [known_point(points, side)]


def _names_in(variables: Sequence[Variable], side: int | str) -> set[str]:
    return {v.name for v in variables if is_number(side)} or {
        v.name for v, _ in _values(variables, str(side))
    }


def _values(variables: Sequence[Variable], text: str) -> list[tuple[Variable, str]]:
    """Variable and wanted value of each "name=value" in a text."""
    by_name = {v.name: v for v in variables}
    found = []
    next_name = "|".join(re.escape(name) for name in by_name)
    for part in re.split(rf",(?=\s*(?:{next_name})\s*=)", text):  # values may have commas too
        name, sign, value = (piece.strip() for piece in part.partition("="))
        if not sign or not value:
            raise ParameterError(
                f"{text!r} selects no points; it takes NAME=VALUE, several with commas, or a point's number"
            )
        if name not in by_name:
            raise ParameterError(
                f"{text!r}: {name!r} was not varied{nearest_name(name, by_name)}; {listed(by_name)}"
            )
        variable = by_name[name]
        if isinstance(variable, Range) and variable.unit:
            value = value.removesuffix(variable.unit).strip()
        found.append((variable, value))
    return found


def _named(values: Iterable[Any], shown: str) -> list[Any]:
    """The values that a text names: the one whose text it is, else the number that it is, else those that agree to six digits."""
    values = list(values)
    numbers = [v for v in values if isinstance(v, (int, float)) and not isinstance(v, bool)]
    try:
        number = float(shown)
    except ValueError:
        number = math.nan
    tolerances = (0.0, 5e-6)
    alike = ([v for v in numbers if math.isclose(v, number, rel_tol=tolerance)] for tolerance in tolerances)
    return next(filter(None, ([v for v in values if str(v) == shown], *alike)), [])


def original(value: Any, variable: Variable) -> Any:
    """A value as it was given: a column of texts holds numbers and truth values as texts where others are texts."""
    if isinstance(value, str) and isinstance(variable, Choice):
        return next((given for given in variable.values if text_of(given) == value), value)
    return value


def with_unit(value: Any, variable: Variable) -> str:
    """A value as shown, with the unit of its variable."""
    unit = variable.unit if isinstance(variable, Range) else ""
    return f"{written(value)} {unit}" if unit else written(value)
