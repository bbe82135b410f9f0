"""What varies in a batch: ranges and choices, as text such as "prey_speed=20:30 kt" and "tactic=keep,switch", and as values of a point."""

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

from tussle.errors import ParameterError, UnitError, nearest_name
from tussle.mission.codecs import written
from tussle.numeric import exp, log
from tussle.units import LONGEST_TEXT, QUANTITY, unit_of

Value = int | float | str | bool
Point = dict[str, Value]

COLUMNS = ("run", "point", "seed")
"""Columns that every table of a batch has; a variable called so would be taken for one."""

MODIFIERS = ("int", "log")
WHOLE = re.compile(r"[-+]?\d{1,9}", re.ASCII)
WHOLE_VALUE = re.compile(r"[-+]?\d{1,18}", re.ASCII)
LARGEST_WHOLE = 10**15
"""Up to here, and not much further, a half more than a whole number is a float."""

MOST_LEVELS = 1_000_000

SHOWN_DIGITS = 12
"""Significant digits of a range's width in its values: enough to tell any two apart, few enough to be read and typed again.

It is not what makes the values the same everywhere: sums, products and `tussle.numeric` do that.
"""


@dataclass(frozen=True)
class Range:
    """Numbers between two bounds, which belong to it.

    Attributes:
        name: A placeholder of the mission, or a path such as "prey.Boids.max_speed".
        low: Smallest value [unit].
        high: Largest value [unit].
        is_int: Whole numbers only.
        is_log: Values lie evenly by their logarithm.
        levels: It takes only so many values, evenly from low to high; None for all between.
        unit: Unit that is written behind the number.
        is_text: Its bounds come from a text such as "20:30", so a number without unit is read as in a mission file; else it is SI.

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
                raise ParameterError(
                    f"{self.name}: {word} is a number, not {bound!r}; a unit has a place of its own"
                )
            # Plain floats, whatever came: they are written into files.
            object.__setattr__(self, word, float(bound))
        self._check_bounds()
        if self.is_int:
            self._check_whole()
        self._check_levels()
        _unit(self.name, self.unit)

    def _check_bounds(self) -> None:
        low, high = shown(self.low), shown(self.high)
        if not (math.isfinite(self.low) and math.isfinite(self.high)):
            raise ParameterError(
                f"{self.name}: the bounds of a range are finite numbers, not {low} and {high}"
            )
        if self.low == self.high:
            value = f"{low} {self.unit}".strip()
            raise ParameterError(
                f"{self.name}: both bounds are {value}, so nothing varies; give it one value with --set '{self.name}={value}'"
            )
        if self.low > self.high:
            raise ParameterError(
                f"{self.name}: the low bound {low} is above the high bound {high}; write the low one first"
            )
        if self.is_log and self.low <= 0.0:
            raise ParameterError(f"{self.name}: a range by the logarithm needs a low bound > 0, not {low}")

    def _check_whole(self) -> None:
        for bound in (self.low, self.high):
            if not bound.is_integer():
                raise ParameterError(
                    f"{self.name}: the bounds of a range of whole numbers are whole, {shown(bound)} is not"
                )
            if abs(bound) > LARGEST_WHOLE:
                raise ParameterError(
                    f"{self.name}: {shown(bound)} is too large; whole numbers are allowed up to 10^15"
                )

    def _check_levels(self) -> None:
        levels: Any = self.levels
        if levels is None:
            return
        if isinstance(levels, bool) or not isinstance(levels, numbers.Integral):
            raise ParameterError(f"{self.name}: levels are a whole number, not {levels!r}")
        n = int(levels)
        object.__setattr__(self, "levels", n)
        if not 2 <= n <= MOST_LEVELS:
            raise ParameterError(
                f"{self.name}: {n} levels are not allowed; a range takes 2 to {MOST_LEVELS:,}"
            )
        if self.is_int and len(set(self.spread(n))) < n:
            raise ParameterError(
                f"{self.name}: there are no {n} different whole numbers spread from {shown(self.low)} to "
                f"{shown(self.high)}{' by the logarithm' if self.is_log else ''}; ask for fewer levels"
            )

    @property
    def n_values(self) -> int | None:
        """How many values it takes; None where they are not countable."""
        if self.levels is not None:
            return self.levels
        return int(self.high) - int(self.low) + 1 if self.is_int else None

    def value_at(self, share: float) -> int | float:
        """The value below which a share of the range lies; equal shares of [0, 1] belong to each level or whole number.

        By the logarithm, whole numbers have the share of what is rounded to them.
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
        """The value as it is put into a mission file; a text stays as it is."""
        if isinstance(value, str):
            return value
        number = written(int(value) if self.is_int else float(value))
        return f"{number} {self.unit}" if self.unit else number

    def setting(self, value: Value, is_argument: bool = False) -> Value:
        """The value as a mission takes it: a text where it is one, else a number in SI units. Arguments of functions stay numbers."""
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
        """Digits of a value: more of them where the range is narrow beside its values, as from 35.721025 to 35.721026."""
        width = min(self.high - self.low, sys.float_info.max)
        leading = _exponent(max(abs(self.low), abs(self.high))) - _exponent(width)
        return min(SHOWN_DIGITS + max(leading, 0), 17)


@dataclass(frozen=True)
class Choice:
    """One of some values.

    Attributes:
        name: A placeholder of the mission, or a path such as "prey.motion_model".
        values: Texts, numbers or truth values, all different.
        is_text: They come from a text such as "20,30", so a number is read as in a mission file; else it is SI.

    Raises:
        ParameterError: A value is of another type or stands twice, there is none, or the name is not allowed.
    """

    name: str
    values: tuple[Any, ...]
    is_text: bool = False

    def __post_init__(self) -> None:
        _check_name(self.name)
        values: Any = self.values
        if isinstance(values, str) or not isinstance(values, Sequence | np.ndarray):
            raise ParameterError(f"{self.name}: choices are a list, not {values!r}")
        # Plain Python values, whatever came: they are written into files.
        plain = tuple(v.item() if isinstance(v, np.generic) else v for v in values)
        object.__setattr__(self, "values", plain)
        if not plain:
            raise ParameterError(f"{self.name}: there is nothing to choose from; give at least one value")
        seen: set[tuple[bool, str | float]] = set()
        for value in plain:
            check_value(self.name, value)
            key = key_of(value)
            if key in seen:
                raise ParameterError(f"{self.name}: the choice {value!r} stands there twice")
            seen.add(key)

    @property
    def n_values(self) -> int:
        """How many values there are."""
        return len(self.values)

    def value_at(self, share: float) -> Value:
        """The value to which a share belongs; each has an equal part of [0, 1]."""
        return self.values[min(int(share * len(self.values)), len(self.values) - 1)]  # type: ignore[no-any-return]

    def text(self, value: Value) -> str:
        """The value as it is put into a mission file."""
        return written(value)

    def setting(self, value: Value, is_argument: bool = False) -> Value:
        """As of a range."""
        return written(value) if self.is_text and not is_argument else value


Variable = Range | Choice


def shown(number: float) -> str:
    """A number for a message, without digits that say nothing."""
    return f"{number:.12g}"


def _check_name(name: Any) -> None:
    if not isinstance(name, str) or not name.strip():
        raise ParameterError(
            f"a variable has a name, not {name!r}: a placeholder of the mission, or a path such as prey.Boids.max_speed"
        )
    if name in COLUMNS:
        raise ParameterError(
            f"{name!r} cannot vary: the tables of a batch have a column of this name ({', '.join(COLUMNS)})"
        )


def check_value(name: str, value: Any) -> None:
    """Refuse what a point cannot hold.

    Raises:
        ParameterError: It is neither a text, a truth value nor a finite number.
    """
    if not isinstance(value, str | bool | int | float):
        raise ParameterError(
            f"{name}: {value!r} cannot be chosen; a choice is a text, a number, or true or false"
        )
    if isinstance(value, float) and not math.isfinite(value):
        raise ParameterError(f"{name}: {value} cannot be chosen; a number is finite")
    if isinstance(value, int) and abs(value) >= 2**63:
        raise ParameterError(f"{name}: {value!r:.30} is too large; whole numbers are allowed up to 2^63 - 1")


def key_of(value: Value) -> tuple[bool, str | float]:
    """What equal choices have in common: 1 and 1.0 are one number, true and "true" one text in a mission."""
    is_number = not isinstance(value, str | bool)
    return is_number, value if is_number else written(value)


def _mixed(low: float, high: float, share: float, *, is_log: bool) -> float:
    """What lies at a share of the way. Not low + share * (high - low), whose difference may be too large for a number."""
    if is_log:
        return float(exp(log(low) * (1.0 - share) + log(high) * share))
    return low * (1.0 - share) + high * share


def _exponent(number: float) -> int:
    """Power of ten of the first digit; by the text, since log10 of a power of ten is not the same on every machine."""
    return int(f"{number:e}".rpartition("e")[2])


# -- as text --------------------------------------------------------------------------------------------------------------


def parse_variable(text: str) -> Variable:
    """What `--vary` says: "prey_speed=20:30 kt", "prey.count=50:100:int", "gain=1e-3:10:log:5", "tactic=keep,switch".

    Raises:
        ParameterError: It is written otherwise, or asks for what is not allowed.
    """
    name, equals, values = (part.strip() for part in text.partition("="))
    if not equals:
        raise ParameterError(
            f"{_cut(text)!r} does not say what varies; write a range such as prey_speed=20:30 or choices such as tactic=keep,switch"
        )
    return parse_values(name, values)


def parse_values(name: str, text: str) -> Variable:
    """The variable of a name whose values are written as on the command line: a text with ":" is a range, one with "," choices.

    Raises:
        ParameterError: It is written otherwise, or asks for what is not allowed.
    """
    _check_name(name)
    if ":" in text and "," not in text:
        return _parse_range(name, [part.strip() for part in text.split(":")])
    items = [item.strip() for item in text.split(",")]
    if "" in items:
        raise ParameterError(
            f"{name}: {'a value is missing' if len(items) > 1 else 'there is no value'} in {_cut(text)!r}; "
            "write a range as 20:30 or choices as keep,switch"
        )
    for item in items:
        if ":" in item and all(QUANTITY.fullmatch(part.strip()) for part in _cut(item).split(":")):
            raise ParameterError(
                f"{name}: the range {_cut(item)!r} cannot stand among choices; write a range alone, as 20:30, or values, as 20,25,30"
            )
    return Choice(name, tuple(read_value(item) for item in items), is_text=True)


def read_value(text: str) -> Value:
    """A text from outside as a number where it is one, else as it is."""
    if WHOLE_VALUE.fullmatch(text):
        return int(text)
    match = QUANTITY.fullmatch(text) if len(text) <= LONGEST_TEXT else None
    is_number = match is not None and not match["unit"] and not match["number"].endswith("inf")
    return float(text) if is_number else text


def parse_bounds(name: str, low: str, high: str) -> tuple[float, float, str]:
    """Two numbers and the unit behind both, or behind the second one for both.

    Raises:
        ParameterError: One is not a number, or their units differ.
    """
    (low_number, low_unit), (high_number, high_unit) = _quantity(name, low), _quantity(name, high)
    if low_unit not in ("", high_unit):
        unit = f"in {high_unit}" if high_unit else "without a unit"
        raise ParameterError(
            f"{name}: one bound is in {low_unit} and the other {unit}; write both in one unit, as in 20:30 {low_unit}"
        )
    return low_number, high_number, high_unit


def _quantity(name: str, text: str) -> tuple[float, str]:
    match = QUANTITY.fullmatch(text) if len(text) <= LONGEST_TEXT else None
    if match is not None:
        return float(match["number"]), _unit(name, match["unit"].strip())
    if text.lower() == "nan":
        return math.nan, ""  # Range says what is wrong with it
    raise ParameterError(
        f"{name}: {_cut(text)!r} is not a number; write a range as low:high, such as 20:30, 20:30 kt or 1e-3:10:log"
    )


def _unit(name: str, text: str) -> str:
    try:
        unit_of(text)
    except UnitError as error:
        raise UnitError(f"{name}: {error}") from None
    return text


def _parse_range(name: str, parts: list[str]) -> Range:
    low, high, unit = parse_bounds(name, parts[0], parts[1])
    said: dict[str, int] = {}
    for part in parts[2:]:
        word = "levels" if WHOLE.fullmatch(part) else part
        if word not in (*MODIFIERS, "levels"):
            raise ParameterError(
                f"{name}: {_cut(part)!r} behind a range means nothing{nearest_name(_cut(part), MODIFIERS)}; "
                "allowed are int, log and a whole number of levels"
            )
        if word in said:
            raise ParameterError(
                f"{name}: {'levels are' if word == 'levels' else f'{word} is'} said twice behind the range"
            )
        said[word] = int(part) if word == "levels" else 1
    return Range(name, low, high, "int" in said, "log" in said, said.get("levels"), unit, is_text=True)


def _cut(text: str) -> str:
    return text if len(text) <= 80 else text[:80] + "..."
