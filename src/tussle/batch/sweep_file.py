"""Reads sweep files (TOML), and the ranges files (XML) of SCRIMMAGE's batch scripts."""

from __future__ import annotations

import tomllib
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tussle.batch.points import variables_of
from tussle.batch.ranges_file import SCALES, read_ranges
from tussle.batch.sampling import METHODS
from tussle.batch.schemas import SEED
from tussle.batch.variables import Choice, Point, Range, Variable, parse_values
from tussle.documents import Maybe, Real, Rule, Whole, problem, read_text
from tussle.errors import ParameterError, clipped, listed, nearest_name
from tussle.mission.limits import Limits
from tussle.mission.problems import MAX_LINES

KEYS: dict[str, Rule] = {
    "runs": Maybe(Whole(1)),
    "first_seed": Maybe(SEED),
    "sample": Maybe(METHODS),
    "samples": Maybe(Whole(1)),
    "sample_seed": Maybe(Whole()),
}
"""Keys with one value, which are fields of `Sweep` too."""
RANGE: dict[str, Rule] = {
    "low": Real(),
    "high": Real(),
    "type": Maybe(("real", "int")),
    "scale": Maybe(SCALES),
    "levels": Maybe(Whole(2)),
    "unit": Maybe(str),
}


@dataclass(frozen=True)
class Sweep:
    """The contents of a sweep file; None for what it does not have.

    Attributes:
        variables: What varies; for explicit points, the choices among their values.
        runs: Games of each point.
        first_seed: Their first seed.
        sample: Method of sampling.
        samples: Points to draw.
        sample_seed: Seed of the drawing.
        points: Explicit points.
    """

    variables: tuple[Variable, ...] = ()
    runs: int | None = None
    first_seed: int | None = None
    sample: str | None = None
    samples: int | None = None
    sample_seed: int | None = None
    points: tuple[Point, ...] | None = None


def read_sweep(path: str | Path) -> Sweep:
    """Read a sweep file or a ranges file; its name tells which, else its first character.

    Raises:
        ParameterError: It cannot be read, is malformed, or has values that are not allowed: one line for each problem.
    """
    file = Path(path)
    text = read_text(file, ParameterError, Limits().text).removeprefix("\ufeff")
    suffix = file.suffix.lower()
    found: dict[str, Any] = {}
    if suffix == ".xml" or (suffix != ".toml" and text.lstrip().startswith("<")):
        variables, problems = read_ranges(text, str(path))
        found["variables"] = tuple(variables)
    else:
        problems = []
        try:
            found = _read_toml(tomllib.loads(text), problems)
        except tomllib.TOMLDecodeError as error:
            problems = [f"this is not TOML: {error}"]
        except RecursionError:
            problems = ["lists or tables are nested too deep"]
        problems = [f"{path}: {line}" for line in problems]
    if problems:
        more = ["... and more"] if len(problems) > MAX_LINES else []
        raise ParameterError("\n".join([*problems[:MAX_LINES], *more]))
    return Sweep(**found)


def _read_toml(table: Mapping[str, Any], problems: list[str]) -> dict[str, Any]:
    """Fields of `Sweep`; problems are appended."""
    problems += _unknown(table, (*KEYS, "vary", "points"))[:MAX_LINES]
    problems += filter(None, (problem(table.get(key), rule, key) for key, rule in KEYS.items()))
    found = {key: table.get(key) for key in KEYS}
    if "vary" in table:
        found["variables"] = tuple(_variables(table["vary"], problems))
    return found | _points(table, problems) if "points" in table else found


def _unknown(table: Mapping[str, Any], keys: Collection[str]) -> list[str]:
    return [
        f"{clipped(key)!r} is unknown{nearest_name(key, keys)}; {listed(keys)}"
        for key in table
        if key not in keys
    ]


# -- [vary] ---------------------------------------------------------------------------------------------------------------


def _variables(table: Any, problems: list[str]) -> Iterator[Variable]:
    if not isinstance(table, dict) or not table:
        problems.append('[vary] is a table with lines such as prey_speed = "20:30 kt"')
        return
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
    return any(key in RANGE and not isinstance(value, dict) for key, value in table.items())


def _variable(name: str, value: Any) -> Variable:
    if isinstance(value, dict):
        return _range(name, value)
    if isinstance(value, list):
        return Choice(name, tuple(value))
    return parse_values(name, value) if isinstance(value, str) else Choice(name, (value,))


def _range(name: str, table: Mapping[str, Any]) -> Range:
    for wrong in (*_unknown(table, RANGE), problem(table, RANGE)):
        if wrong:
            raise ParameterError(f"{name}: {wrong}")
    is_int, is_log = table.get("type") == "int", table.get("scale") == "log"
    return Range(
        name, table["low"], table["high"], is_int, is_log, table.get("levels"), table.get("unit", "")
    )


# -- [[points]] -----------------------------------------------------------------------------------------------------------


def _points(table: Mapping[str, Any], problems: list[str]) -> dict[str, Any]:
    rows = table["points"]
    if not isinstance(rows, list) or not all(isinstance(row, dict) and row for row in rows):
        problems.append("[[points]] are tables with a line for each name")
        return {}
    problems += [
        f"{key} is not allowed beside [[points]]; points that are given are not sampled"
        for key in ("vary", "sample", "samples", "sample_seed")
        if key in table
    ]
    points = tuple(dict(_flat(row, is_range_allowed=False)) for row in rows)
    try:
        return {"points": points, "variables": tuple(variables_of(points))}
    except ParameterError as error:
        problems.append(f"[[points]] {error}")
        return {}
