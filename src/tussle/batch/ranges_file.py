"""Reads the ranges file of SCRIMMAGE's batch scripts: one XML tag per placeholder, `<max_speed low="15" high="25" type="float"/>`."""

from __future__ import annotations

from tussle.batch.variables import Choice, Range, Variable, parse_bounds, read_value, shown
from tussle.errors import MissionError, ParameterError, clipped, listed, nearest_name
from tussle.mission.limits import Limits
from tussle.mission.node import Budget, Node, parse

ATTRIBUTES = ("low", "high", "type", "count", "vec", "scale")
TYPES = ("float", "int")
SCALES = ("linear", "log")


def read_ranges(text: str, file: str) -> tuple[list[Variable], list[str]]:
    """The variables, and the problems, one line each with its place.

    `count` is the number of levels. `vec` is a list of values to choose from; low and high, which those scripts demand beside it, are
    ignored. Unlike those scripts, `scale="log"` is followed, and whole numbers include the high bound. A range whose bounds are equal
    is a choice of one value.

    Raises:
        ParameterError: It is no XML, or a mission.
    """
    try:
        root, _ = parse(text, file, Budget(Limits()))
    except MissionError as error:
        raise ParameterError(str(error)) from None
    if root.tag == "runscript":
        raise ParameterError(
            f"{root.place}: this is a mission; a ranges file has one tag for each placeholder"
        )
    variables: list[Variable] = []
    problems: list[str] = []
    seen: set[str] = set()
    for node in root.children:
        # A name space is no part of the placeholder's name.
        name = node.tag.rpartition("}")[2]
        try:
            if name in seen:
                raise ParameterError(f"{name}: it is there twice")
            seen.add(name)
            variables.append(_variable(name, node))
        except ParameterError as error:
            problems.append(f"{node.place}: {error}")
    if not root.children:
        problems.append(
            f'{root.place}: nothing varies; write tags such as <prey_speed low="20" high="30" type="float"/>'
        )
    return variables, problems


def _variable(name: str, node: Node) -> Variable:
    found = {key: value.strip() for key, value in node.attributes.items()}
    for key in found:
        if key not in ATTRIBUTES:
            raise ParameterError(
                f"{name}: the attribute {key!r} is unknown{nearest_name(key, ATTRIBUTES)}; {listed(ATTRIBUTES)}"
            )
    for key, allowed in (("type", TYPES), ("scale", SCALES)):
        if key in found and found[key] not in allowed:
            raise ParameterError(
                f"{name}: {key}={found[key]!r} is not allowed{nearest_name(found[key], allowed)}; {listed(allowed)}"
            )
    is_int = found.get("type") == "int"
    if "vec" in found:
        return Choice(
            name, tuple(_number(name, item, is_int=is_int) for item in found["vec"].split(",")), is_text=True
        )
    missing = [key for key in ("low", "high", "type") if key not in found]
    if missing:
        raise ParameterError(f"{name}: it has no {' and no '.join(missing)}; a range has low, high and type")
    low, high, unit = parse_bounds(name, found["low"], found["high"])
    count = read_value(found["count"]) if "count" in found else None
    if isinstance(count, str | float):
        raise ParameterError(f"{name}: count={found['count']!r} is not allowed; it takes a whole number")
    if low == high or count == 1:
        value = f"{shown(low)} {unit}" if unit else _number(name, shown(low), is_int=is_int)
        return Choice(name, (value,), is_text=True)
    return Range(name, low, high, is_int, found.get("scale") == "log", count, unit, is_text=True)


def _number(name: str, text: str, *, is_int: bool) -> int | float:
    value = read_value(text.strip())
    if isinstance(value, str):
        raise ParameterError(
            f"{name}: {clipped(value)!r} is not a number; vec takes numbers, as in vec='1, 2, 5'"
        )
    if is_int and not float(value).is_integer():
        raise ParameterError(f"{name}: {value!r} is not a whole number, as type='int' demands")
    return int(value) if is_int else float(value)
