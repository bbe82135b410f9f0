"""The variables of a batch: ranges and choices, written as "prey_speed=20:30 kt" and "tactic=keep,switch"."""

from __future__ import annotations

import math
import numbers
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tussle.arguments import explained
from tussle.declare.units import MAX_TEXT, QUANTITY, unit_of
from tussle.errors import ParameterError, UnitError, clipped, nearest_name
from tussle.mission.codecs import written
from tussle.numeric import exp, log

Value = int | float | str | bool
Point = dict[str, Value]

COLUMNS = ("run", "point", "seed")
"""Columns that every table of a batch has, and that no variable can be named after."""

MODIFIERS = ("int", "log")
WHOLE = re.compile(r"[-+]?\d{1,9}", re.ASCII)
WHOLE_VALUE = re.compile(r"[-+]?\d{1,19}", re.ASCII)
MAX_WHOLE = 10**15
"""Largest bound of a whole number: up to here, floats represent a whole number plus one half."""

MAX_LEVELS = 1_000_000

SHOWN_DIGITS = 12
"""Significant digits of a range's width in its values: enough to tell any two apart, few enough to be typed."""


@explained
@dataclass(frozen=True)
class Range:
    """Numbers between two bounds, both included.

    Attributes:
        name: A placeholder of the mission, or a path such as "prey.Boids.max_speed".
        low: Smallest value [unit].
        high: Largest value [unit].
        is_int: Whole numbers only.
        is_log: Values are spread evenly by their logarithm.
        levels: Number of values, spread evenly from low to high; None for all values between.
        unit: Unit that is written behind the number.
        is_text: The bounds come from a text such as "20:30", so a number without unit is read as in a mission file; else it is SI.

    Raises:
        ParameterError: The bounds, the levels or the name are not allowed.
        UnitError: The unit is unknown.
    """

    name: str
    low: float
    high: float
    is_int: bool = False
    is_log: bool = False
    levels: int | None = None
    unit: str = ""
    is_text: bool = False

    def __post_init__(self) -> None:
        _check_name(self.name)
        for word in ("low", "high"):
            bound = getattr(self, word)
            if isinstance(bound, bool) or not isinstance(bound, numbers.Real):
                raise ParameterError(f"{self.name}: {word} is a number, not {bound!r}; `unit` takes a unit")
            object.__setattr__(self, word, float(bound))  # as files take it, also if it was NumPy's
        if wrong := self._wrong_bounds() or self._wrong_levels():
            raise ParameterError(f"{self.name}: {wrong}")
        _unit(self.name, self.unit)

    def _wrong_bounds(self) -> str:
        low, high = shown(self.low), shown(self.high)
        if not (math.isfinite(self.low) and math.isfinite(self.high)):
            return f"the bounds of a range are finite numbers, not {low} and {high}"
        if self.low == self.high:
            value = f"{low} {self.unit}".strip()
            return (
                f"both bounds are {value}, so nothing varies; give one value with --set '{self.name}={value}'"
            )
        if self.low > self.high:
            return f"the low bound {low} is above the high bound {high}; write the low one first"
        if self.is_log and self.low <= 0.0:
            return f"a range by the logarithm needs a low bound > 0, not {low}"
        for bound in (self.low, self.high) if self.is_int else ():
            if not bound.is_integer():
                return f"the bounds of a range of whole numbers are whole, {shown(bound)} is not"
            if abs(bound) > MAX_WHOLE:
                return f"{shown(bound)} is too large; whole numbers are allowed up to 10^15"
        return ""

    def _wrong_levels(self) -> str:
        levels: Any = self.levels
        if levels is None:
            return ""
        if isinstance(levels, bool) or not isinstance(levels, numbers.Integral):
            return f"levels are a whole number, not {levels!r}"
        n = int(levels)
        object.__setattr__(self, "levels", n)
        if not 2 <= n <= MAX_LEVELS:
            return f"{n} levels are not allowed; a range takes 2 to {MAX_LEVELS:,}"
        if self.is_int and len(set(self.spread(n))) < n:
            return f"there are no {n} different whole numbers spread over the range; ask for fewer levels"
        return ""

    @property
    def n_values(self) -> int | None:
        """Number of values; None where they are not countable."""
        if self.levels is not None:
            return self.levels
        return int(self.high) - int(self.low) + 1 if self.is_int else None

    def value_at(self, share: float) -> int | float:
        """The value below which a share of the range lies; equal shares of [0, 1] belong to each level or whole number.

        By the logarithm, a whole number has the share of the numbers that are rounded to it.
        """
        if self.levels is not None:
            return self._level(min(int(share * self.levels), self.levels - 1), self.levels)
        if not self.is_int:
            return self._between(share)
        if self.is_log:
            near = _mixed(self.low - 0.5, self.high + 0.5, share, is_log=True)
            whole = math.floor(near + 0.5)
        else:
            whole = int(self.low) + math.floor(share * (self.high - self.low + 1.0))
        return min(max(whole, int(self.low)), int(self.high))

    def spread(self, n: int) -> tuple[int | float, ...]:
        """Values, n >= 2 of them, evenly from low to high, both included; whole ones are rounded, so that some may be equal."""
        return tuple(self._level(i, n) for i in range(n))

    def text(self, value: Value) -> str:
        """The value as a mission file has it; a text stays as it is."""
        if isinstance(value, str):
            return value
        number = written(int(value) if self.is_int else float(value))
        return f"{number} {self.unit}" if self.unit else number

    def setting(self, value: Value, is_argument: bool = False) -> Value:
        """The value as `read_mission` takes it: a text where it was one, else a number in SI units. Arguments of functions stay numbers."""
        if isinstance(value, str) or self.unit or (self.is_text and not is_argument):
            return self.text(value)
        return int(value) if self.is_int else float(value)

    def _level(self, i: int, n: int) -> int | float:
        if i in (0, n - 1):
            value = self.high if i else self.low
        else:
            value = self._between(i / (n - 1))
        return math.floor(value + 0.5) if self.is_int else value

    def _between(self, share: float) -> float:
        value = _mixed(self.low, self.high, share, is_log=self.is_log)
        return min(max(float(f"{value:.{self._digits}g}"), self.low), self.high)

    @cached_property
    def _digits(self) -> int:
        """Digits of a value: more of them where the range is narrow compared with its values, as from 35.721025 to 35.721026."""
        width = min(self.high - self.low, sys.float_info.max)
        leading = _exponent(max(abs(self.low), abs(self.high))) - _exponent(width)
        return min(SHOWN_DIGITS + max(leading, 0), 17)


@explained
@dataclass(frozen=True)
class Choice:
    """One of several values.

    Attributes:
        name: A placeholder of the mission, or a path such as "prey.motion_model".
        values: Texts, numbers or truth values, all different.
        is_text: They come from a text such as "20,30", so a number is read as in a mission file; else it is SI.

    Raises:
        ParameterError: A value has another type or is there twice, there is none, or the name is not allowed.
    """

    name: str
    values: tuple[Any, ...]
    is_text: bool = False

    def __post_init__(self) -> None:
        _check_name(self.name)
        values: Any = self.values
        if isinstance(values, str) or not isinstance(values, Sequence | np.ndarray):
            raise ParameterError(f"{self.name}: choices are a list, not {values!r}")
        plain = tuple(v.item() if isinstance(v, np.generic) else v for v in values)
        object.__setattr__(self, "values", plain)
        if not plain:
            raise ParameterError(f"{self.name}: there is nothing to choose from; give at least one value")
        seen: set[tuple[bool, str | float]] = set()
        for value in plain:
            check_value(self.name, value)
            if key_of(value) in seen:
                raise ParameterError(f"{self.name}: the choice {value!r} is there twice")
            seen.add(key_of(value))

    @property
    def n_values(self) -> int:
        """Number of values."""
        return len(self.values)

    def value_at(self, share: float) -> Value:
        """The value to which a share belongs; each has an equal part of [0, 1]."""
        return self.values[min(int(share * len(self.values)), len(self.values) - 1)]  # type: ignore[no-any-return]

    def text(self, value: Value) -> str:
        """The value as a mission file has it."""
        return written(value)

    def setting(self, value: Value, is_argument: bool = False) -> Value:
        """The value as `read_mission` takes it, see `Range.setting`."""
        return written(value) if self.is_text and not is_argument else value


Variable = Range | Choice


def shown(number: float) -> str:
    """A number for a message, to twelve digits."""
    return f"{number:.12g}"


def _check_name(name: Any) -> None:
    if not isinstance(name, str) or not name.strip():
        raise ParameterError(
            f"a variable has a name, not {name!r}: a placeholder of the mission, or a path such as prey.Boids.max_speed"
        )
    if name in COLUMNS:
        raise ParameterError(
            f"{name!r} cannot vary, as the tables of a batch have columns {', '.join(COLUMNS)}"
        )


def check_value(name: str, value: Any) -> None:
    """Check a value of a point.

    Raises:
        ParameterError: It is neither a text, a truth value nor a finite number.
    """
    if not isinstance(value, str | bool | int | float):
        wrong = "a choice is a text, a number, or true or false"
    elif isinstance(value, float) and not math.isfinite(value):
        wrong = "a number is finite"
    elif isinstance(value, int) and not -(2**63) <= value < 2**63:
        wrong = "whole numbers are allowed up to 2^63 - 1"
    else:
        return
    raise ParameterError(f"{name}: {value!r:.80} cannot be chosen; {wrong}")


def key_of(value: Value) -> tuple[bool, str | float]:
    """A key that equal values share: 1 and 1.0 are one number, true and "true" one text in a mission."""
    is_number = not isinstance(value, str | bool)
    return is_number, value if is_number else written(value)


def _mixed(low: float, high: float, share: float, *, is_log: bool) -> float:
    """The value at a share of the way. Not low + share * (high - low), whose difference may overflow."""
    if is_log:
        return float(exp(log(low) * (1.0 - share) + log(high) * share))
    return low * (1.0 - share) + high * share


def _exponent(number: float) -> int:
    """Power of ten of the first digit; from the text, since log10 of a power of ten differs between machines."""
    return int(f"{number:e}".rpartition("e")[2])


# -- as text --------------------------------------------------------------------------------------------------------------


def parse_variable(text: str) -> Variable:
    """Parse a text of `--vary`: "prey_speed=20:30 kt", "prey.count=50:100:int", "gain=1e-3:10:log:5", "tactic=keep,switch".

    Raises:
        ParameterError: The text is malformed, or a value is not allowed.
    """
    name, equals, values = (part.strip() for part in text.partition("="))
    if not equals:
        raise ParameterError(
            f"{clipped(text)!r} is no variable; write a range such as prey_speed=20:30 or choices such as tactic=keep,switch"
        )
    return parse_values(name, values)


def parse_values(name: str, text: str) -> Variable:
    """Parse the values of a variable: a text with ":" is a range, one with "," choices.

    Raises:
        ParameterError: The text is malformed, or a value is not allowed.
    """
    _check_name(name)
    if ":" in text and "," not in text:
        return _parse_range(name, [part.strip() for part in text.split(":")])
    items = [item.strip() for item in text.split(",")]
    if "" in items:
        raise ParameterError(
            f"{name}: a value is missing in {clipped(text)!r}; write a range as 20:30 or choices as keep,switch"
        )
    for item in items:
        if ":" in item and all(QUANTITY.fullmatch(part.strip()) for part in clipped(item).split(":")):
            raise ParameterError(
                f"{name}: the range {clipped(item)!r} cannot be among choices; write a range alone, as 20:30, or values, as 20,25,30"
            )
    return Choice(name, tuple(read_value(item) for item in items), is_text=True)


def read_value(text: str) -> Value:
    """A text as a number where it is one."""
    if WHOLE_VALUE.fullmatch(text) and -(2**63) <= int(text) < 2**63:
        return int(text)
    match = QUANTITY.fullmatch(text) if len(text) <= MAX_TEXT else None
    is_number = match is not None and not match["unit"] and not match["number"].endswith("inf")
    return float(text) if is_number else text


def parse_bounds(name: str, low: str, high: str) -> tuple[float, float, str]:
    """Two numbers, and the unit behind both, or behind the second one for both.

    Raises:
        ParameterError: One is not a number, or their units differ.
    """
    (low_number, low_unit), (high_number, high_unit) = _quantity(name, low), _quantity(name, high)
    if low_unit not in ("", high_unit):
        raise ParameterError(
            f"{name}: one bound is in {low_unit} and the other {f'in {high_unit}' if high_unit else 'without a unit'}; "
            "write both in one unit, as in 20:30 kt"
        )
    return low_number, high_number, high_unit


def _quantity(name: str, text: str) -> tuple[float, str]:
    match = QUANTITY.fullmatch(text) if len(text) <= MAX_TEXT else None
    if match is not None:
        return float(match["number"]), _unit(name, match["unit"].strip())
    if text.lower() == "nan":
        return math.nan, ""  # which Range refuses
    raise ParameterError(
        f"{name}: {clipped(text)!r} is not a number; write a range as low:high, such as 20:30, 20:30 kt or 1e-3:10:log"
    )


def _unit(name: str, text: str) -> str:
    try:
        unit_of(text)
    except UnitError as error:
        raise UnitError(f"{name}: {error}") from None
    return text


def _parse_range(name: str, parts: list[str]) -> Range:
    *_, last = parts
    word, unit = [*last.split(None, 1), "", ""][:2]
    upper = QUANTITY.fullmatch(parts[1]) if len(last) + len(parts[1]) <= MAX_TEXT else None
    if (
        len(parts) > 2
        and unit
        and upper
        and not upper["unit"]
        and (WHOLE.fullmatch(word) or word in MODIFIERS)
    ):
        parts = [parts[0], f"{parts[1]} {unit}", *parts[2:-1], word]  # "10:30:3 km/h" is "10:30 km/h:3"
    low, high, unit = parse_bounds(name, parts[0], parts[1])
    found: dict[str, int] = {}
    for part in parts[2:]:
        word = "levels" if WHOLE.fullmatch(part) else part
        if word not in (*MODIFIERS, "levels"):
            raise ParameterError(
                f"{name}: {clipped(part)!r} behind a range is not allowed{nearest_name(part, MODIFIERS)}; "
                "allowed are int, log and a whole number of levels; a unit is behind the upper bound or at the end, as 10:30:3 km/h"
            )
        if word in found:
            raise ParameterError(f"{name}: {word} is there twice behind the range")
        found[word] = int(part) if word == "levels" else 1
    return Range(name, low, high, "int" in found, "log" in found, found.get("levels"), unit, is_text=True)
