"""Units: "40 kt" becomes 20.577... m/s here, at the edge; inside, everything is SI and radians.

This is the only place that knows the names of units. The package pint would bring a registry, quantity arrays and some
hundred milliseconds of import; what a mission file needs is the one table below.

A unit is written as factors with whole powers: "m/s^2", "kg m^2", "N m", "1/s". A solidus divides by the one factor that
follows it. An angle is a dimension of its own: "rad" is neither "" nor "1", so a heading cannot be wired to a ratio.
"""

from __future__ import annotations

import math
import re
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

from tussle.errors import DeclarationError, ParameterError, UnitError, listed, nearest_name

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
    """A unit: how many of the coherent SI unit it is, and of what.

    Rational factors are fractions, so that a conversion rounds once. Those with pi in them are floats, so that "30 deg"
    has the bits of `math.radians(30)`.
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
"""Not understood, on purpose: one name a unit. They make the error message name the right one."""

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
# The bound on the exponent keeps a hostile "1e999999999" from becoming an exact fraction of a gigabyte; the look ahead keeps
# the rest of such a text, or of "1.2.3", from being taken for a unit.
QUANTITY = re.compile(
    r"(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?|[-+]?inf)(?![A-Za-z0-9.]*\d)\s*(?P<unit>.*)",
    re.ASCII,
)
LONGEST_TEXT = 200


@lru_cache(maxsize=512)
def unit_of(text: str) -> Unit:
    """The unit that a text such as "kg m^2" or "m/s" names.

    Raises:
        UnitError: It is not written as a unit, or holds a name that the table does not have.
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
                f"{text!r} is not a unit; write factors with whole powers, as in 'm/s^2', 'kg m^2' or '1/s'"
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
    """A quantity in SI units; a mission that is read a thousand times has few texts that differ, so they are kept.

    Args:
        text: Such as "12", "40 kt", "-1.5e3 m".
        unit: Unit that is wanted, and the unit of a number without one.
        text_unit: Unit of a number without one where that is historically another, such as "deg"; "" is `unit`.

    Returns:
        The value in the coherent SI unit (m, kg, s, A, K, rad and their products), rounded once.

    Raises:
        UnitError: Its unit is unknown or measures something else.
        ParameterError: It is not a number, or is too large for one.
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
        raise ParameterError(f"{text!r} is too large for a number") from None


def _split(text: str) -> tuple[Fraction | float, str]:
    """Number and unit of a text; the unit is "" where there is none."""
    match = QUANTITY.fullmatch(text.strip()) if len(text) <= LONGEST_TEXT else None
    if match is None:
        shown = text if len(text) <= LONGEST_TEXT else text[:40] + "..."
        raise ParameterError(
            f"{shown!r} is not a number; write one, with or without a unit, as in '12' or '40 kt'"
        )
    number = match["number"]
    return (float(number) if number.endswith("inf") else Fraction(number)), match["unit"].strip()


def _mismatch(value: str, given: str, wanted: str) -> str:
    allowed = spellings(wanted)
    if unit_of(wanted).dimension == NONE:
        return f"{value!r} has a unit; this is a plain number (or '%'), without unit"
    examples = " or ".join(repr(f"12 {name}") for name in allowed[:3])
    return f"{value!r} is in {given or 'no unit'}, which cannot become {wanted}; write {examples} ({listed(allowed)})"


def spellings(unit: str) -> list[str]:
    """Names of the same kind of quantity, those of `unit` itself first: for messages and pages."""
    dimension = unit_of(unit).dimension
    names = [unit, *UNITS, *COMPOUND_EXAMPLES]
    return list(dict.fromkeys(n for n in names if n not in ("", "1") and unit_of(n).dimension == dimension))


def compatible(unit_a: str, unit_b: str) -> bool:
    """Whether numbers in one unit may be wired to an input in the other: same kind and same size, since a wire converts nothing.

    Raises:
        UnitError: One of them is not a unit.
    """
    a, b = unit_of(unit_a), unit_of(unit_b)
    return a.dimension == b.dimension and float(a.factor) == float(b.factor)


def split_units(text: str, n: int) -> tuple[str, ...]:
    """Unit of each of n components, from a declaration.

    Args:
        text: One unit for all, or n of them separated by blanks: "m m rad m/s". In a list, join the factors of one unit
            by "*" ("kg*m^2") and write "1" for a component without unit.
        n: Number of components, at least 1.

    Returns:
        n units; a component without unit has "".

    Raises:
        DeclarationError: There are neither one nor n units, or one is unknown.
    """
    parts = text.split() if n > 1 else [text.strip()]
    if len(parts) <= 1:
        parts = (parts or [""]) * n
    if len(parts) != n:
        raise DeclarationError(
            f"unit {text!r} names {len(parts)} units for {n} components; write one unit for all or one for each, with '*' "
            f"inside a unit ('kg*m^2') and '1' for a component without unit"
        )
    for part in parts:
        try:
            unit_of(part)
        except UnitError as error:
            raise DeclarationError(f"unit {text!r}: {error}") from None
    return tuple("" if part == "1" else part for part in parts)


def is_si(unit: str) -> bool:
    """Whether numbers in this unit are numbers inside tussle: "m/s" and "" are, "kt", "deg" and "%" are not.

    Raises:
        UnitError: It is not a unit.
    """
    return float(unit_of(unit).factor) == 1.0
