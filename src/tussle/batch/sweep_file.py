"""Reads what varies from a file: a sweep file (TOML), or a ranges file (XML) of SCRIMMAGE's batch scripts."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tussle.batch.points import variables_of
from tussle.batch.ranges_file import SCALES, read_ranges
from tussle.batch.sampling import METHODS
from tussle.batch.variables import Choice, Point, Range, Variable, parse_values
from tussle.documents import read_text
from tussle.errors import ParameterError, listed, nearest_name
from tussle.mission.limits import Limits
from tussle.mission.problems import MOST_LINES

WHOLE = {
    "runs": ("n_seeds", 1),
    "first_seed": ("first_seed", 0),
    "samples": ("n_samples", 1),
    "sample_seed": ("sample_seed", 0),
}
"""Keys that take a whole number: attribute of `Sweep` and smallest value."""

KEYS = ("runs", "first_seed", "sample", "samples", "sample_seed", "vary", "points")
RANGE_KEYS = ("low", "high", "type", "scale", "levels", "unit")
TYPES = ("real", "int")


@dataclass(frozen=True)
class Sweep:
    """What a file says about a batch; None where it says nothing.

    Attributes:
        variables: What varies; for explicit points, the values that they have.
        sample: Method of sampling.
        n_samples: Points to draw.
        sample_seed: Seed of the drawing.
        n_seeds: Seeds for each point.
        first_seed: The first of them.
        points: Explicit points.
    """

    variables: tuple[Variable, ...] = ()
    sample: str | None = None
    n_samples: int | None = None
    sample_seed: int | None = None
    n_seeds: int | None = None
    first_seed: int | None = None
    points: tuple[Point, ...] | None = None


def read_sweep(path: str | Path) -> Sweep:
    """Read a sweep file, or a ranges file: which of them it is, its name tells, else its first character.

    Raises:
        ParameterError: It cannot be read, is malformed, or says what is not allowed; all that is wrong is told, one line each.
    """
    file = Path(path)
    text = read_text(file, ParameterError, Limits().text).removeprefix("\ufeff")
    is_xml = file.suffix.lower() == ".xml" or (
        file.suffix.lower() != ".toml" and text.lstrip().startswith("<")
    )
    if is_xml:
        variables, problems = read_ranges(text, str(path))
        said: dict[str, Any] = {"variables": tuple(variables)}
    else:
        try:
            said, told = _read_toml(text, str(path))
        except RecursionError:
            raise ParameterError(f"{path}: lists or tables stand in one another too deep") from None
        problems = [f"{path}: {problem}" for problem in told]
    if problems:
        more = ["... and more"] if len(problems) > MOST_LINES else []
        raise ParameterError("\n".join([*problems[:MOST_LINES], *more]))
    return Sweep(**said)


def _read_toml(text: str, file: str) -> tuple[dict[str, Any], list[str]]:
    """Arguments of `Sweep`, and what is wrong."""
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ParameterError(f"{file}: this is not TOML: {error}") from None
    unknown = [key for key in table if key not in KEYS][:MOST_LINES]
    problems = [f"{key[:80]!r} is unknown{nearest_name(key[:80], KEYS)}; {listed(KEYS)}" for key in unknown]
    said: dict[str, Any] = {}
    for key, (attribute, least) in WHOLE.items():
        value = table.get(key)
        if value is None:
            continue
        if type(value) is not int or value < least:
            problems.append(f"{key} = {value!r} is not allowed; it takes a whole number >= {least}")
        said[attribute] = value
    if "sample" in table:
        said["sample"] = method = table["sample"]
        if method not in METHODS:
            name = str(method)[:80]
            problems.append(
                f"sample = {method!r} is not allowed{nearest_name(name, METHODS)}; {listed(METHODS)}"
            )
    if "vary" in table:
        said["variables"] = tuple(_variables(table["vary"], problems))
    if "points" in table:
        said |= _points(table, problems)
    return said, problems


# -- [vary] ---------------------------------------------------------------------------------------------------------------


def _variables(table: Any, problems: list[str]) -> Iterator[Variable]:
    if not isinstance(table, dict):
        problems.append('vary is a table: [vary] and below it lines such as prey_speed = "20:30 kt"')
        return
    if not table:
        problems.append('[vary] is empty; write lines such as prey_speed = "20:30 kt" below it')
    seen: set[str] = set()
    for name, value in _flat(table, is_range_allowed=True):
        try:
            if name in seen:
                raise ParameterError(f"{name}: it varies twice")
            seen.add(name)
            yield _variable(name, value)
        except ParameterError as error:
            problems.append(f"[vary] {error}")


def _flat(table: Mapping[str, Any], *, is_range_allowed: bool, above: str = "") -> Iterator[tuple[str, Any]]:
    """Names and values: TOML takes the points of a name without quotes, as in prey.Boids.gain, for tables in tables."""
    for key, value in table.items():
        name = f"{above}{key}"
        is_range = is_range_allowed and isinstance(value, dict) and _is_range(value)
        if isinstance(value, dict) and value and not is_range:
            yield from _flat(value, is_range_allowed=is_range_allowed, above=f"{name}.")
        else:
            yield name, value


def _is_range(table: Mapping[str, Any]) -> bool:
    return any(key in RANGE_KEYS and not isinstance(value, dict) for key, value in table.items())


def _variable(name: str, value: Any) -> Variable:
    if isinstance(value, dict):
        return _range(name, value)
    if isinstance(value, list):
        return Choice(name, tuple(value))
    return parse_values(name, value) if isinstance(value, str) else Choice(name, (value,))


def _range(name: str, table: Mapping[str, Any]) -> Range:
    for key in table:
        if key not in RANGE_KEYS:
            raise ParameterError(
                f"{name}: {key!r} is unknown{nearest_name(key, RANGE_KEYS)}; {listed(RANGE_KEYS)}"
            )
    missing = [key for key in ("low", "high") if key not in table]
    if missing:
        raise ParameterError(
            f"{name}: it has no {' and no '.join(missing)}; write {{ low = 20, high = 30 }}, '20:30' or a list"
        )
    for key, allowed in (("type", TYPES), ("scale", SCALES)):
        word = table.get(key, allowed[0])
        if word not in allowed:
            raise ParameterError(
                f"{name}: {key} = {word!r} is not allowed{nearest_name(str(word), allowed)}; {listed(allowed)}"
            )
    unit = table.get("unit", "")
    if not isinstance(unit, str):
        raise ParameterError(f"{name}: unit = {unit!r} is not allowed; it takes a text such as 'kt'")
    return Range(
        name,
        table["low"],
        table["high"],
        is_int=table.get("type") == "int",
        is_log=table.get("scale") == "log",
        levels=table.get("levels"),
        unit=unit,
    )


# -- [[points]] -----------------------------------------------------------------------------------------------------------


def _points(table: Mapping[str, Any], problems: list[str]) -> dict[str, Any]:
    rows = table["points"]
    if not isinstance(rows, list) or not all(isinstance(row, dict) and row for row in rows):
        problems.append("points are tables: [[points]] and below it one line for each name, for each point")
        return {}
    problems += [
        f"{key} and [[points]] stand side by side; points that are given are not sampled"
        for key in ("vary", "sample", "samples", "sample_seed")
        if key in table
    ]
    points = tuple(dict(_flat(row, is_range_allowed=False)) for row in rows)
    try:
        return {"points": points, "variables": tuple(variables_of(points))}
    except ParameterError as error:
        problems.append(f"[[points]] {error}")
        return {}
