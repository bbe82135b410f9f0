"""What mission files write besides the values of parameters: whole numbers, ratios, plugins on one line."""

from __future__ import annotations

import math
import numbers
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from tussle import units
from tussle.columns import MOST_INTEGER
from tussle.errors import MissionError, ParameterError
from tussle.texts import shown

RATIO = re.compile(r"\s*([-+.\deE]+)\s*/\s*([-+.\deE]+)\s*", re.ASCII)
BEHAVIOR = re.compile(r"\s*\[\s*([^\s\[\]='\"]+)")
PAIR = re.compile(r"\s*([^\s\[\]='\"]+)\s*=\s*(?:'([^']*)'|\"([^\"]*)\"|([^\s\[\]'\"]+))")
MOST_PLUGINS = 1000
"""In one parameter."""


class Told(NamedTuple):
    """A plugin written on one line: its name and attributes."""

    name: str
    attributes: dict[str, str]


def number(text: str, unit: str = "", text_unit: str = "") -> float:
    """A finite quantity; a bare number is in `text_unit`, else in `unit`.

    Raises:
        ParameterError: It is no number, has a wrong unit, or is not finite.
    """
    value = units.parse(text, unit, text_unit)
    if not math.isfinite(value):
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
        if len(found) > MOST_PLUGINS:
            raise MissionError(f"there are more than {MOST_PLUGINS:,} plugins in it")
    if text[place:].strip(" \t\n,"):
        raise MissionError(f"{shown(text[place:])} is not a plugin; it takes [ NAME key='value' ... ]")
    return found


def told_text(name: str, attributes: Mapping[str, str]) -> str:
    """One plugin as `behaviors` reads it.

    Raises:
        MissionError: A value has both kinds of quotes.
    """
    parts = []
    for key, value in attributes.items():
        quote = "'" if "'" not in value else '"'
        if quote in value:
            raise MissionError(
                f"{shown(value)} has both kinds of quotes and cannot stand in a plugin within a plugin"
            )
        parts.append(f" {key}={quote}{value}{quote}")
    return f"[ {name}{''.join(parts)} ]"


def written(value: Any, si: Sequence[str] = ("",), bare: Sequence[str] = ("",)) -> str:
    """A value as a file has it, with all digits, so that it is read as what it is: a text is as it stands there, a number is SI.

    Args:
        value: A text, a number, a truth value, or a sequence of numbers or of sequences of numbers.
        si: SI unit of each component.
        bare: Unit of each component's bare number; where it is another, the SI unit is written.

    Raises:
        ParameterError: It is something else.
    """
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, numbers.Real):
        number = str(int(value)) if isinstance(value, numbers.Integral) else repr(float(value))
        return number if si[0] == bare[0] else f"{number} {si[0] or '1'}"
    if not isinstance(value, (Sequence, np.ndarray)):
        raise ParameterError(
            f"{value!r} is not allowed; a file takes a number, a text, true or false, or a list of numbers"
        )
    if any(isinstance(item, (Sequence, np.ndarray)) and not isinstance(item, str) for item in value):
        return " ".join(f"[ {written(row, si, bare)} ]" for row in value)
    units_of = zip(si, bare, strict=True) if len(si) == len(value) else [(si[0], bare[0])] * len(value)
    return ", ".join(written(item, (a,), (b,)) for item, (a, b) in zip(value, units_of, strict=True))
