"""Values in mission files other than parameters: integers, ratios and inline plugins."""

from __future__ import annotations

import math
import numbers
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from tussle.declare import texts, units
from tussle.declare.columns import MAX_INTEGER
from tussle.declare.texts import shown
from tussle.errors import MissionError, ParameterError

RATIO = re.compile(r"\s*([-+.\deE]+)\s*/\s*([-+.\deE]+)\s*", re.ASCII)
BEHAVIOR = re.compile(r"\s*\[\s*([^\s\[\]='\"]+)")
PAIR = re.compile(r"\s*([^\s\[\]='\"]+)\s*=\s*(?:'([^']*)'|\"([^\"]*)\"|([^\s\[\]'\"]+))")
MAX_PLUGINS = 1000
"""Maximum number of plugins in one parameter."""


class InlinePlugin(NamedTuple):
    """A plugin written on one line: its name and attributes."""

    name: str
    attributes: dict[str, str]


def number(text: str, unit: str = "", text_unit: str = "") -> float:
    """Parse a finite quantity to SI units; a bare number is in `text_unit`, else in `unit`.

    Raises:
        ParameterError: It is not a number, or has a wrong unit.
        MissionError: It is not finite.
    """
    value = units.parse(text, unit, text_unit)
    if not math.isfinite(value):
        raise MissionError(f"{shown(text)} is not allowed; it takes a finite number")
    return value


def integer(text: str, least: int = -MAX_INTEGER, most: int = MAX_INTEGER) -> int:
    """Parse an integer.

    Raises:
        ParameterError: It is not a number, or has a unit.
        MissionError: It is not an integer, or is out of bounds.
    """
    value = number(text)
    if value != int(value) or not least <= value <= most:
        bounds = f" from {least:,} to {most:,}" if least > -MAX_INTEGER else f" up to {most:,}"
        raise MissionError(f"{shown(text)} is not allowed; it takes a whole number{bounds}")
    return int(value)


def fraction(text: str, unit: str) -> float:
    """Parse a number, or a ratio such as "1 / 2".

    Raises:
        ParameterError: It is neither, or has a wrong unit.
        MissionError: It is not finite, or divides by zero.
    """
    match = RATIO.fullmatch(text)
    if match is None:
        return number(text, unit)
    divisor = number(match[2])
    value = number(match[1]) / divisor if divisor else math.nan
    if not math.isfinite(value):
        raise MissionError(f"{shown(text)} is not allowed: it divides by zero")
    return value


def inline_plugin(text: str) -> InlinePlugin:
    """Parse one plugin: "Name key='value' key='value'".

    Raises:
        MissionError: The text has another form.
    """
    found = inline_plugins(f"[ {text} ]")
    if len(found) != 1:
        raise MissionError(f"{shown(text)} is not one plugin; it takes NAME key='value' ...")
    return found[0]


def inline_plugins(text: str) -> list[InlinePlugin]:
    """Parse the plugins in a parameter: "[ AvoidEntityMS gain='1.0' ] [ MoveToGoalMS goal='1,2,3' ]".

    Raises:
        MissionError: The text has another form.
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
                f"{shown(text[place:])} after {shown(match[1])} is not allowed; it takes key='value' ... ]"
            )
        place = end.end()
        found.append(InlinePlugin(match[1], attributes))
        if len(found) > MAX_PLUGINS:
            raise MissionError(f"there are more than {MAX_PLUGINS:,} plugins in one parameter")
    if text[place:].strip(" \t\n,"):
        raise MissionError(f"{shown(text[place:])} is not a plugin; it takes [ NAME key='value' ... ]")
    return found


def inline_plugins_by_blanks(text: str) -> list[InlinePlugin]:
    """Parse the plugins in a parameter as SCRIMMAGE does: blanks separate the attributes, and quotes are dropped wherever they are.

    Raises:
        ParameterError: There is text outside the brackets, or a bracket is not closed.
        MissionError: A plugin has no name, or something else than key=value after it.
    """
    found = []
    for row in texts.rows(text):
        words = row.split()
        pairs = [word.split("=") for word in words[1:]]
        if not words or not all(len(pair) == 2 and pair[0] for pair in pairs):
            raise MissionError(f"{shown(row)} is not allowed; it takes NAME key='value' ...")
        found.append(InlinePlugin(words[0], {key: re.sub("['\"]", "", value) for key, value in pairs}))
    return found


def word_rows(text: str, fields: Sequence[str]) -> list[dict[str, str]]:
    """Parse rows of words, one per field: "[ a b ] [ c d ]".

    Raises:
        ParameterError: There is text outside the brackets, or a bracket is not closed.
        MissionError: A row has another number of words.
    """
    found = [row.split() for row in texts.rows(text)]
    if not all(len(row) == len(fields) for row in found):
        raise MissionError(f"{shown(text)} is not allowed; it takes rows [ {' '.join(fields)} ]")
    return [dict(zip(fields, row, strict=True)) for row in found]


def inline_text(name: str, attributes: Mapping[str, str]) -> str:
    """Write one plugin in the form that `inline_plugins` reads.

    Raises:
        MissionError: A value has both kinds of quotes.
    """
    parts = []
    for key, value in attributes.items():
        quote = "'" if "'" not in value else '"'
        if quote in value:
            raise MissionError(
                f"{shown(value)} has both kinds of quotes and cannot be written in an inline plugin"
            )
        parts.append(f" {key}={quote}{value}{quote}")
    return f"[ {name}{''.join(parts)} ]"


def written(value: Any, si: Sequence[str] = ("",), bare: Sequence[str] = ("",)) -> str:
    """Write a value as in a mission file, with all digits, so that it is read back unchanged. A text is written as it is.

    Args:
        value: A text, an SI number, a boolean, or a sequence of numbers or of sequences of numbers.
        si: SI unit of each component.
        bare: Unit of a bare number in the file, for each component; where it differs, the SI unit is written.

    Raises:
        ParameterError: The value has another type.
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
            f"{value!r} is not allowed; a mission file takes a number, a text, true or false, or a list of numbers"
        )
    if any(isinstance(item, (Sequence, np.ndarray)) and not isinstance(item, str) for item in value):
        return " ".join(f"[ {written(row, si, bare)} ]" for row in value)
    units_of = zip(si, bare, strict=True) if len(si) == len(value) else [(si[0], bare[0])] * len(value)
    return ", ".join(written(item, (a,), (b,)) for item, (a, b) in zip(value, units_of, strict=True))
