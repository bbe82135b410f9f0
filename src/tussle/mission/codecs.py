"""Text of a mission file to values: one codec for each way in which the format writes something."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any, NamedTuple

from tussle import units
from tussle.columns import Param
from tussle.errors import MissionError, ParameterError, listed, nearest_name
from tussle.mission.problems import shown

TRUE, FALSE = ("true", "1", "yes", "on"), ("false", "0", "no", "off")
MOST_INTEGER = 2**53
"""Beyond it a double, through which whole numbers are read, skips some."""
MOST_ITEMS = 100_000
"""Numbers, or plugins times a hundred, in one parameter."""
RATIO = re.compile(r"\s*([-+.\deE]+)\s*/\s*([-+.\deE]+)\s*", re.ASCII)
BEHAVIOR = re.compile(r"\s*\[\s*([^\s\[\]='\"]+)")
PAIR = re.compile(r"\s*([^\s\[\]='\"]+)\s*=\s*(?:'([^']*)'|\"([^\"]*)\"|([^\s\[\]'\"]+))")
ROW = re.compile(r"\s*\[([^\[\]]*)\]")
FRAMES = ("XYZ", "GPS")


class Told(NamedTuple):
    """A plugin written on one line: its name and attributes."""

    name: str
    attributes: dict[str, str]


def truth(text: str) -> bool:
    """Whether a text says yes: true or 1, in any case; false or 0 is no.

    Raises:
        MissionError: It is something else.
    """
    word = text.strip().lower()
    if word in TRUE:
        return True
    if word in FALSE:
        return False
    raise MissionError(f"{shown(text)} is not allowed; it takes true or false")


def number(text: str, unit: str = "", text_unit: str = "", *, finite: bool = True) -> float:
    """A quantity; a bare number is in `text_unit`, else in `unit`.

    Raises:
        MissionError: It is no number, has a wrong unit, or is not finite.
    """
    try:
        value = units.parse(text, unit, text_unit)
    except ParameterError as error:
        raise MissionError(str(error)) from None
    if math.isnan(value) or (finite and math.isinf(value)):
        raise MissionError(f"{shown(text)} is not allowed; it takes a finite number")
    return value


def whole(text: str, least: int = -MOST_INTEGER, most: int = MOST_INTEGER) -> int:
    """A whole number.

    Raises:
        MissionError: It is none, or out of bounds.
    """
    value = number(text)
    if value != int(value) or not least <= value <= most:
        bounds = f" from {least:,} to {most:,}" if least > -MOST_INTEGER else f" up to {most:,}"
        raise MissionError(f"{shown(text)} is not allowed; it takes a whole number{bounds}")
    return int(value)


def fraction(text: str, unit: str) -> float:
    """A number, or two with a solidus: "1 / 2".

    Raises:
        MissionError: It is neither, or the second is zero.
    """
    match = RATIO.fullmatch(text)
    if match is None:
        return number(text, unit)
    divisor = number(match[2])
    value = number(match[1]) / divisor if divisor else math.nan
    if not math.isfinite(value):
        raise MissionError(f"{shown(text)} is not allowed: it divides by zero")
    return value


def words(text: str) -> list[str]:
    """Words between commas and blanks."""
    return [word for word in re.split(r"[,\s]+", text.strip()) if word]


def chosen(text: str, choices: tuple[str, ...]) -> str:
    """One of some words.

    Raises:
        MissionError: It is another.
    """
    if text.strip() in choices:
        return text.strip()
    raise MissionError(
        f"{shown(text)} is not allowed{nearest_name(text.strip()[:80], choices)}; {listed(choices)}"
    )


def numbers(text: str, parts: list[tuple[str, str, str]]) -> tuple[float, ...]:
    """One number for each part: "1, 0.2, 1, 45" or "0.0 5.0"; with commas, each may have its unit.

    Args:
        text: As written, with or without brackets.
        parts: (name, unit, unit of a bare number) of each.

    Raises:
        MissionError: There are more or fewer, or one of them is no number.
    """
    bare = text.strip()
    bare = bare[1:-1] if bare.startswith("[") and bare.endswith("]") else bare
    items = [item.strip() for item in bare.split(",")] if "," in bare else bare.split()
    if items and not items[-1] and "," in bare:
        items.pop()
    if len(items) != len(parts):
        names = ", ".join(name for name, _, _ in parts)
        raise MissionError(f"{shown(text)} has {len(items)} numbers; it takes {len(parts)} ({names})")
    return tuple(
        number(item, unit, text_unit, finite=False)
        for item, (_, unit, text_unit) in zip(items, parts, strict=True)
    )


def rows(text: str) -> list[str]:
    """What stands in each pair of brackets: "[ 0 1 2 ] [ 3 4 5 ]".

    Raises:
        MissionError: Something stands outside, or a bracket is left open.
    """
    found, place = [], 0
    while match := ROW.match(text, place):
        found.append(match[1].strip())
        place = match.end()
    if text[place:].strip(" \t\n,"):
        raise MissionError(f"{shown(text[place:])} is not a row; rows are written [ ... ] [ ... ]")
    return found


def told(text: str) -> Told:
    """One plugin: "Name key='value' key='value'".

    Raises:
        MissionError: It is not written so.
    """
    found = behaviors(f"[ {text} ]")
    if len(found) != 1:
        raise MissionError(f"{shown(text)} is not one plugin; it takes NAME key='value' ...")
    return found[0]


def behaviors(text: str) -> list[Told]:
    """Plugins in a parameter: "[ AvoidEntityMS gain='1.0' ] [ MoveToGoalMS goal='1,2,3' ]".

    Raises:
        MissionError: It is not written so.
    """
    found, place = [], 0
    while match := BEHAVIOR.match(text, place):
        place, attributes = match.end(), {}
        while pair := PAIR.match(text, place):
            if pair[1] in attributes:
                raise MissionError(f"{match[1]}: {shown(pair[1])} is given twice")
            attributes[pair[1]] = next(v for v in pair.groups()[1:] if v is not None)
            place = pair.end()
        end = re.compile(r"\s*\]").match(text, place)
        if end is None:
            raise MissionError(
                f"{shown(text[place:])} is not understood behind {shown(match[1])}; it takes key='value' ... ]"
            )
        place = end.end()
        found.append(Told(match[1], attributes))
        if len(found) > MOST_ITEMS // 100:
            raise MissionError(f"there are more than {MOST_ITEMS // 100:,} plugins in it")
    if text[place:].strip(" \t\n,"):
        raise MissionError(f"{shown(text[place:])} is not a plugin; it takes [ NAME key='value' ... ]")
    return found


def param(text: str, column: Param, from_geodetic: Callable[..., Any] | None = None) -> Any:
    """A plugin's parameter, in SI units, checked.

    Args:
        text: As written.
        column: The declaration, whose `text_units` are the units of bare numbers.
        from_geodetic: Latitude, longitude [rad], altitude [m], (3,), to world positions [m], for rows that begin with GPS.

    Raises:
        MissionError: It is not written as this parameter is.
        ParameterError: Its value is not allowed.
    """
    if not column.is_text and len(text.replace(",", " ").split()) > MOST_ITEMS:
        raise MissionError(f"{shown(text)} has more than {MOST_ITEMS:,} numbers")
    if column.ragged:
        return column.convert(_ragged(text, column, from_geodetic))
    if column.is_text:
        return column.convert(text.strip())
    if column.dtype is bool:
        return column.convert(truth(text))
    values = (
        numbers(text, _parts(column))
        if column.fields
        else (number(text, column.units[0], column.text_units[0], finite=False),)
    )
    for value in values:
        if column.dtype is int and not abs(value) <= MOST_INTEGER:
            raise MissionError(f"{shown(text)} is not allowed; it takes {column.allowed()}")
    return column.convert(values if column.fields else values[0])


def _parts(column: Param) -> list[tuple[str, str, str]]:
    return list(zip(column.fields, column.units, column.text_units, strict=True))


def _ragged(text: str, column: Param, from_geodetic: Callable[..., Any] | None) -> list[Any]:
    if not column.fields:
        bare = " ".join(rows(text)) if "[" in text else text
        return [number(word, column.units[0], column.text_units[0]) for word in words(bare)]
    return [_row(row, column, from_geodetic) for row in rows(text)]


def _row(row: str, column: Param, from_geodetic: Callable[..., Any] | None) -> tuple[float, ...]:
    """Numbers of one row; a first word XYZ or GPS says how its fields x, y, z are meant."""
    frame, _, rest = row.partition(" ")
    if frame not in FRAMES or "frame" in column.fields:
        return numbers(row, _parts(column))
    places = [i for i, name in enumerate(column.fields) if name in ("x", "y", "z")]
    if frame == "XYZ" or len(places) != 3 or from_geodetic is None:
        return numbers(rest, _parts(column))
    parts = _parts(column)
    for i, (unit, text_unit) in zip(places, (("rad", "deg"), ("rad", "deg"), ("m", "m")), strict=True):
        parts[i] = (parts[i][0], unit, text_unit)
    values = list(numbers(rest, parts))
    for i, value in zip(places, from_geodetic([values[i] for i in places]), strict=True):
        values[i] = float(value)
    return tuple(values)
