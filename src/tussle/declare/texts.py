"""Parsing of values from text, the same for mission files, settings, sweeps and Python."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any

from tussle.declare import units
from tussle.errors import MAX_SHOWN, ParameterError, clipped

TRUE, FALSE = ("true", "1", "yes", "on"), ("false", "0", "no", "off")
MAX_ITEMS = 100_000
"""Maximum count of numbers in one value."""
ROW = re.compile(r"\s*\[([^\[\]]*)\]")
FRAMES = ("XYZ", "GPS")

Part = tuple[str, str, str]
"""A component of a value: its name, its SI unit, and the unit of a bare number."""


def shown(text: str, longest: int = MAX_SHOWN) -> str:
    """Quote external text for a message, on one line and shortened."""
    return repr(clipped(" ".join(text.split()), longest))


def truth(text: str) -> bool:
    """Parse a boolean: true, 1, yes, on or false, 0, no, off; case is ignored.

    Raises:
        ParameterError: The text is none of these.
    """
    word = text.strip().lower()
    if word in TRUE:
        return True
    if word in FALSE:
        return False
    raise ParameterError(f"{shown(text)} is not allowed; it takes true or false")


def row(text: str, parts: Sequence[Part]) -> tuple[float, ...]:
    """Parse one number per component to SI units: "1, 0.2, 1, 45", "0.0 5.0", "[ 0 5 ]" or, for a matrix, "[ 1 0 ] [ 0 1 ]".

    With commas, each may have a unit.

    Raises:
        ParameterError: The count is wrong, or an item is not a number.
    """
    bare = (", " if "," in text else " ").join(rows(text)) if text.lstrip().startswith("[") else text.strip()
    items = [item.strip() for item in bare.split(",")] if "," in bare else bare.split()
    if items and not items[-1] and "," in bare:
        items.pop()
    if len(items) != len(parts):
        names = ", ".join(name for name, _, _ in parts)
        raise ParameterError(f"{shown(text)} has {len(items)} numbers; it takes {len(parts)} ({names})")
    return tuple(units.parse(item, *part[1:]) for item, part in zip(items, parts, strict=True))


def rows(text: str) -> list[str]:
    """The texts inside each pair of brackets: "[ 0 1 2 ] [ 3 4 5 ]".

    Raises:
        ParameterError: There is text outside the brackets, or a bracket is not closed.
    """
    found, place = [], 0
    while match := ROW.match(text, place):
        found.append(match[1].strip())
        place = match.end()
    if text[place:].strip(" \t\n,"):
        raise ParameterError(f"{shown(text[place:])} is not a row; rows are written [ ... ] [ ... ]")
    return found


def items(
    text: str, parts: Sequence[Part], has_fields: bool, from_geodetic: Callable[..., Any] | None
) -> list[Any]:
    """Parse the items of a list to SI units: numbers, or rows of numbers.

    Args:
        text: The text.
        parts: The components of an item.
        has_fields: Whether an item is a row.
        from_geodetic: Converts latitude, longitude [rad], altitude [m], (3,), to a world position [m]; used for rows that begin
            with GPS.

    Raises:
        ParameterError: The text is not a list of such items.
    """
    if not has_fields:
        bare = " ".join(rows(text)) if "[" in text else text
        return [units.parse(word, *parts[0][1:]) for word in bare.replace(",", " ").split()]
    return [_placed(each, parts, from_geodetic) for each in rows(text)]


def _placed(text: str, parts: Sequence[Part], from_geodetic: Callable[..., Any] | None) -> tuple[float, ...]:
    """Parse one row; a leading XYZ or GPS gives the frame of its fields x, y, z."""
    frame, _, rest = text.partition(" ")
    names = [name for name, _, _ in parts]
    if frame not in FRAMES or "frame" in names:
        return row(text, parts)
    places = [i for i, name in enumerate(names) if name in ("x", "y", "z")]
    if frame == "XYZ" or len(places) != 3:
        return row(rest, parts)
    if from_geodetic is None:
        raise ParameterError(
            f"{shown(text)} needs the origin of a mission file; give positions here as x, y, z in m"
        )
    geodetic = list(parts)
    for i, (unit, bare) in zip(places, (("rad", "deg"), ("rad", "deg"), ("m", "m")), strict=True):
        geodetic[i] = (names[i], unit, bare)
    values = list(row(rest, geodetic))
    for i, value in zip(places, from_geodetic([values[i] for i in places]), strict=True):
        values[i] = float(value)
    return tuple(values)
