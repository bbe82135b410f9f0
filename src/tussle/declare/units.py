"""Units: converts input such as "40 kt" to SI (20.577... m/s); inside tussle all numbers are SI and radians.

This is the only module that knows the names of units. The package pint would bring a registry, quantity arrays and some
hundred milliseconds of import; a mission file needs only the table below.

A unit is written as factors with integer powers: "m/s^2", "kg m^2", "N m", "1/s". A slash divides by the single factor that
follows it. Angle is a separate dimension: "rad" is neither "" nor "1", so a heading cannot be connected to a ratio.
"""

from __future__ import annotations

import math
import re
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

from tussle.errors import DeclarationError, ParameterError, UnitError, clipped, listed, nearest_name

Dimension = tuple[int, int, int, int, int, int]
"""Powers of metre, kilogram, second, ampere, kelvin, radian."""

NONE: Dimension = (0, 0, 0, 0, 0, 0)
LENGTH: Dimension = (1, 0, 0, 0, 0, 0)
MASS: Dimension = (0, 1, 0, 0, 0, 0)
TIME: Dimension = (0, 0, 1, 0, 0, 0)
CURRENT: Dimension = (0, 0, 0, 1, 0, 0)
TEMPERATURE: Dimension = (0, 0, 0, 0, 1, 0)
ANGLE: Dimension = (0, 0, 0, 0, 0, 1)
FREQUENCY: Dimension = (0, 0, -1, 0, 0, 0)
SPEED: Dimension = (1, 0, -1, 0, 0, 0)
ANGULAR_SPEED: Dimension = (0, 0, -1, 0, 0, 1)
FORCE: Dimension = (1, 1, -2, 0, 0, 0)
PRESSURE: Dimension = (-1, 1, -2, 0, 0, 0)
ENERGY: Dimension = (2, 1, -2, 0, 0, 0)
POWER: Dimension = (2, 1, -3, 0, 0, 0)
VOLTAGE: Dimension = (2, 1, -3, -1, 0, 0)


class Unit(NamedTuple):
    """A unit: its size in the coherent SI unit, and its dimension.

    Rational factors are fractions, so that a conversion rounds once. Factors with pi are floats, so that "30 deg" equals
    `math.radians(30)` bit for bit.
    """

    factor: Fraction | float
    dimension: Dimension


# Metre, kilogram, second, ampere, kelvin and the units derived from them: BIPM, The International System of Units, 9th
# edition (2019); minute, hour and degree: its table 8. Foot and pound: the international yard and pound agreement of 1959.
# Nautical mile: First International Extraordinary Hydrographic Conference, 1929. Pound-force: with the standard
# acceleration of the third CGPM (1901). All of them exact, as in NIST Special Publication 811 (2008), appendix B.
FOOT = Fraction("0.3048")
POUND = Fraction("0.45359237")
NAUTICAL_MILE = Fraction(1852)
MILE = 5280 * FOOT
POUND_FORCE = POUND * Fraction("9.80665")

UNITS: dict[str, Unit] = {
    "": Unit(Fraction(1), NONE),
    "1": Unit(Fraction(1), NONE),
    "%": Unit(Fraction(1, 100), NONE),
    "m": Unit(Fraction(1), LENGTH),
    "km": Unit(Fraction(1000), LENGTH),
    "cm": Unit(Fraction(1, 100), LENGTH),
    "mm": Unit(Fraction(1, 1000), LENGTH),
    "ft": Unit(FOOT, LENGTH),
    "mi": Unit(MILE, LENGTH),
    "nmi": Unit(NAUTICAL_MILE, LENGTH),
    "s": Unit(Fraction(1), TIME),
    "ms": Unit(Fraction(1, 1000), TIME),
    "min": Unit(Fraction(60), TIME),
    "h": Unit(Fraction(3600), TIME),
    "Hz": Unit(Fraction(1), FREQUENCY),
    "kt": Unit(NAUTICAL_MILE / 3600, SPEED),
    "mph": Unit(MILE / 3600, SPEED),
    "rad": Unit(Fraction(1), ANGLE),
    "deg": Unit(math.pi / 180.0, ANGLE),
    "rev": Unit(2.0 * math.pi, ANGLE),
    "rpm": Unit(2.0 * math.pi / 60.0, ANGULAR_SPEED),
    "kg": Unit(Fraction(1), MASS),
    "g": Unit(Fraction(1, 1000), MASS),
    "lb": Unit(POUND, MASS),
    "slug": Unit(POUND_FORCE / FOOT, MASS),
    "N": Unit(Fraction(1), FORCE),
    "kN": Unit(Fraction(1000), FORCE),
    "lbf": Unit(POUND_FORCE, FORCE),
    "Pa": Unit(Fraction(1), PRESSURE),
    "J": Unit(Fraction(1), ENERGY),
    "W": Unit(Fraction(1), POWER),
    "V": Unit(Fraction(1), VOLTAGE),
    "A": Unit(Fraction(1), CURRENT),
    "K": Unit(Fraction(1), TEMPERATURE),
}

SPELLED_OUT = {
    "metre": "m",
    "meter": "m",
    "feet": "ft",
    "foot": "ft",
    "mile": "mi",
    "second": "s",
    "sec": "s",
    "minute": "min",
    "hour": "h",
    "hr": "h",
    "hertz": "Hz",
    "knot": "kt",
    "kph": "km/h",
    "kmh": "km/h",
    "radian": "rad",
    "degree": "deg",
    "newton": "N",
    "pound": "lb",
    "percent": "%",
}
"""Spellings that are refused, since each unit has one name; the error message suggests that name."""

COMPOUND_EXAMPLES = (
    "m/s",
    "km/h",
    "m/s^2",
    "rad/s",
    "deg/s",
    "rad/s^2",
    "deg/s^2",
    "1/s",
    "kg m^2",
    "N m",
    "N s",
    "N/m",
    "m^2",
)

FACTOR = re.compile(
    r"(?P<solidus>/?)\s*(?P<name>1(?=\s*/)|%|[A-Za-z]+)(?:\^(?P<power>-?[1-9]))?\s*(?:\*\s*(?=[A-Za-z%]))?"
)
# The bound on the exponent keeps a hostile "1e999999999" from becoming a fraction of a gigabyte; the lookahead keeps the rest of
# such a text, or of "1.2.3", from being parsed as a unit.
QUANTITY = re.compile(
    r"(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?|[-+]?inf)(?![A-Za-z0-9.]*\d)\s*(?P<unit>.*)",
    re.ASCII,
)
MAX_TEXT = 200


@lru_cache(maxsize=512)
def unit_of(text: str) -> Unit:
    """Parse a unit such as "kg m^2" or "m/s".

    Raises:
        UnitError: The text is not a unit, or contains an unknown name.
    """
    factor: Fraction | float = Fraction(1)
    dimension = list(NONE)
    place, rest = 0, text.strip()
    if rest in UNITS:
        return UNITS[rest]
    while place < len(rest):
        match = FACTOR.match(rest, place)
        if match is None:
            raise UnitError(
                f"{text!r} is not a unit; write factors with integer powers, as in 'm/s^2', 'kg m^2' or '1/s'"
            )
        unit = _named(match["name"])
        power = int(match["power"] or 1) * (-1 if match["solidus"] else 1)
        factor = factor * unit.factor**power
        dimension = [have + power * new for have, new in zip(dimension, unit.dimension, strict=True)]
        place = match.end()
    a, b, c, d, e, f = dimension
    return Unit(factor, (a, b, c, d, e, f))


def _named(name: str) -> Unit:
    unit = UNITS.get(name)
    if unit is not None:
        return unit
    word = name.lower()
    meant = SPELLED_OUT.get(word) or SPELLED_OUT.get(word.removesuffix("s"))
    guess = f" (did you mean {meant!r}?)" if meant else nearest_name(name, UNITS)
    raise UnitError(f"{name!r} is not a unit{guess}; {listed(n for n in UNITS if n not in ('', '1'))}")


@lru_cache(maxsize=4096)
def parse(text: str, unit: str, text_unit: str = "") -> float:
    """Parse a quantity to SI units. Results are cached: a mission that is read many times has few different texts.

    Args:
        text: Such as "12", "40 kt", "-1.5e3 m".
        unit: Unit of the wanted dimension, and default unit of a bare number.
        text_unit: Unit of a bare number where the format has another one, such as "deg"; "" is `unit`.

    Returns:
        The value in the coherent SI unit (m, kg, s, A, K, rad and their products), rounded once.

    Raises:
        UnitError: The unit is unknown or has another dimension.
        ParameterError: The text is not a number, or is too large for a float.
    """
    wanted = unit_of(unit)
    number, written = _split(text)
    name = written or text_unit or unit
    given = unit_of(name)
    if given.dimension != wanted.dimension:
        raise UnitError(_mismatch(text if written else f"{text} {name}", name, unit))
    if isinstance(number, float):  # infinite
        return number
    try:
        return float(number * given.factor)
    except OverflowError:
        raise ParameterError(f"{text!r} is too large for a float") from None


def _split(text: str) -> tuple[Fraction | float, str]:
    """Split a text into number and unit; the unit is "" if there is none."""
    match = QUANTITY.fullmatch(text.strip()) if len(text) <= MAX_TEXT else None
    if match is None:
        raise ParameterError(
            f"{clipped(text)!r} is not a number; write one, with or without a unit, as in '12' or '40 kt'"
        )
    number = match["number"]
    return (float(number) if number.endswith("inf") else Fraction(number)), match["unit"].strip()


def _mismatch(value: str, given: str, wanted: str) -> str:
    allowed = spellings(wanted)
    if unit_of(wanted).dimension == NONE:
        return f"{value!r} has a unit; expected is a number without unit (or with '%')"
    examples = " or ".join(repr(f"12 {name}") for name in allowed[:3])
    return f"{value!r} is in {given or 'no unit'}, not convertible to {wanted}; write {examples} ({listed(allowed)})"


def spellings(unit: str) -> list[str]:
    """Names of units of the same dimension, `unit` first; for messages and pages."""
    dimension = unit_of(unit).dimension
    names = [unit, *UNITS, *COMPOUND_EXAMPLES]
    return list(dict.fromkeys(n for n in names if n not in ("", "1") and unit_of(n).dimension == dimension))


def compatible(unit_a: str, unit_b: str) -> bool:
    """Return True if a channel may connect two units: same dimension and same size, since channels do not convert.

    Raises:
        UnitError: A text is not a unit.
    """
    a, b = unit_of(unit_a), unit_of(unit_b)
    return a.dimension == b.dimension and float(a.factor) == float(b.factor)


def split_units(text: str, n: int) -> tuple[str, ...]:
    """Units of n components, from a declaration.

    Args:
        text: One unit for all, or n units separated by spaces: "m m rad m/s". In a list, join the factors of one unit by "*"
            ("kg*m^2") and write "1" for a component without unit.
        n: Number of components, at least 1.

    Returns:
        n units; "" for a component without unit.

    Raises:
        DeclarationError: The number of units is neither one nor n, or a unit is unknown.
    """
    parts = text.split() if n > 1 else [text.strip()]
    if len(parts) <= 1:
        parts = (parts or [""]) * n
    if len(parts) != n:
        raise DeclarationError(
            f"unit {text!r} has {len(parts)} units for {n} components; write one unit for all or one for each, with '*' "
            f"inside a unit ('kg*m^2') and '1' for a component without unit"
        )
    for part in parts:
        try:
            unit_of(part)
        except UnitError as error:
            raise DeclarationError(f"unit {text!r}: {error}") from None
    return tuple("" if part == "1" else part for part in parts)


def is_si(unit: str) -> bool:
    """Return True if a unit is coherent SI, as used inside tussle: "m/s" and "" are, "kt", "deg" and "%" are not.

    Raises:
        UnitError: The text is not a unit.
    """
    return float(unit_of(unit).factor) == 1.0
