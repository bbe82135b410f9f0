"""Units: exact definitions, spellings, dimensions, and what the messages say."""

from __future__ import annotations

import math
import re
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tussle.declare import units
from tussle.errors import DeclarationError, ParameterError, UnitError

DEFINITIONS = [
    ("1 kt", "m/s", 1852 / 3600),
    ("1 mph", "m/s", 0.44704),
    ("1 km/h", "m/s", 1 / 3.6),
    ("1 mi", "m", 1609.344),
    ("1 nmi", "m", 1852.0),
    ("1 ft", "m", 0.3048),
    ("1 ft", "km", 0.3048),
    ("1 lb", "kg", 0.45359237),
    ("1 lbf", "N", 4.4482216152605),
    ("1 slug", "kg", 14.593902937206364),
    ("1 slug", "lbf s^2/ft", 14.593902937206364),
    ("60 rpm", "rad/s", 2 * math.pi),
    ("1 rev", "rad", 2 * math.pi),
    ("180 deg", "rad", math.pi),
    ("9 deg/s", "rad/s", math.radians(9)),
    ("2 min", "s", 120.0),
    ("1.5 h", "s", 5400.0),
    ("250 ms", "s", 0.25),
    ("50 Hz", "1/s", 50.0),
    ("2 kN", "kg m/s^2", 2000.0),
    ("3 N m", "J", 3.0),
    ("3 W s", "J", 3.0),
    ("3 V A", "W", 3.0),
    ("20 %", "", 0.2),
    ("300 K", "K", 300.0),
    ("5 g", "kg", 0.005),
    ("7 mm", "m", 0.007),
    ("7 cm", "m", 0.07),
    ("4 N/m^2", "Pa", 4.0),
]


@pytest.mark.parametrize(("text", "unit", "value"), DEFINITIONS)
def test_units_have_the_size_of_their_definition(text: str, unit: str, value: float) -> None:
    assert units.parse(text, unit) == value


def test_every_unit_of_the_table_is_defined_by_some_example() -> None:
    written = {name for text, unit, _ in DEFINITIONS for name in re.findall("[A-Za-z%]+", f"{text} {unit}")}
    assert set(units.UNITS) - {"", "1"} <= written


@pytest.mark.parametrize("text", ["40 kt", "40kt", "  40  kt ", "4e1 kt", "+40.0 kt", "40. kt"])
def test_spellings_of_one_quantity(text: str) -> None:
    assert units.parse(text, "m/s") == 40 * 1852 / 3600


def test_bare_number_is_in_the_wanted_unit_unless_a_text_unit_is_declared() -> None:
    assert units.parse("12", "m/s") == 12.0
    assert units.parse("12", "m/s", text_unit="kt") == units.parse("12 kt", "m/s")
    assert units.parse("90", "rad", text_unit="deg") == math.pi / 2
    assert units.parse("1 rad", "rad", text_unit="deg") == 1.0


@given(st.floats(min_value=-1e6, max_value=1e6))
def test_conversion_rounds_once(number: float) -> None:
    exact = Fraction(repr(number)) * Fraction(1852, 3600)
    assert units.parse(f"{number!r} kt", "m/s") == float(exact)


@given(st.floats(min_value=-720.0, max_value=720.0))
def test_degrees_have_the_bits_of_the_standard_library(number: float) -> None:
    assert units.parse(f"{number!r} deg", "rad") == math.radians(number)


def test_infinity_is_a_value_and_nan_is_not() -> None:
    assert units.parse("inf", "m") == math.inf
    assert units.parse("-inf km", "m") == -math.inf
    with pytest.raises(ParameterError, match="'nan' is not a number"):
        units.parse("nan", "m")


@pytest.mark.parametrize("text", ["", "abc", "1.2.3", "1e9999", "0x10", "--1", "٣", "kt 40", "9" * 1000])
def test_what_is_not_a_number(text: str) -> None:
    with pytest.raises(ParameterError, match="is not a number; write one"):
        units.parse(text, "m")


def test_too_large_a_number_is_refused_and_not_made_infinite() -> None:
    with pytest.raises(ParameterError, match="too large"):
        units.parse("1e999", "m")


def test_wrong_dimension_says_what_is_allowed() -> None:
    with pytest.raises(UnitError) as caught:
        units.parse("40 s", "m/s")
    message = str(caught.value)
    assert message.startswith("'40 s' is in s, not convertible to m/s; write '12 m/s' or '12 kt'")
    assert "km/h" in message


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("1 rad", ""),
        ("1 %", "rad"),
        ("1 rad/s", "1/s"),
        ("1 Hz", "rad/s"),
        ("1 rpm", "Hz"),
        ("1 kg", "N"),
        ("1 m", "m^2"),
    ],
)
def test_dimensions_that_are_not_the_same(text: str, unit: str) -> None:
    with pytest.raises(UnitError):
        units.parse(text, unit)


def test_plain_number_with_a_unit() -> None:
    with pytest.raises(UnitError, match="without unit"):
        units.parse("3 m", "")


@pytest.mark.parametrize(
    ("text", "guess"),
    [
        ("40 knots", "kt"),
        ("40 Kt", "kt"),
        ("3 metres", "m"),
        ("3 degrees", "deg"),
        ("3 RPM", "rpm"),
        ("9 kph", "km/h"),
    ],
)
def test_unknown_unit_names_the_nearest(text: str, guess: str) -> None:
    with pytest.raises(UnitError, match=f"did you mean '{guess}'"):
        units.parse(text, "m/s")


@pytest.mark.parametrize("unit", ["m/", "m//s", "m^0", "m^x", "m*", "/", "m1", "2 m", "m,s", "(m)"])
def test_what_is_not_written_as_a_unit(unit: str) -> None:
    with pytest.raises(UnitError):
        units.unit_of(unit)


def test_solidus_divides_by_the_next_factor_only() -> None:
    assert units.compatible("m/s s", "m")
    assert units.compatible("m/s/s", "m/s^2")
    assert units.compatible("m s^-1", "m/s")


def test_wires_convert_nothing() -> None:
    assert units.compatible("N m", "kg m^2/s^2")
    assert units.compatible("", "1")
    assert not units.compatible("rad", "")
    assert not units.compatible("deg", "rad")
    assert not units.compatible("%", "")
    assert not units.compatible("m", "m/s")


def test_units_of_components() -> None:
    assert units.split_units("m m rad m/s", 4) == ("m", "m", "rad", "m/s")
    assert units.split_units("m/s", 3) == ("m/s", "m/s", "m/s")
    assert units.split_units("", 2) == ("", "")
    assert units.split_units("kg m^2", 1) == ("kg m^2",)
    assert units.split_units("kg*m^2 1", 2) == ("kg*m^2", "")
    assert units.split_units("1", 1) == ("",)


@pytest.mark.parametrize(("text", "n"), [("m m", 3), ("kg m^2", 3), ("m m m", 2), ("mtr", 1), ("m knots", 2)])
def test_declared_units_that_do_not_fit(text: str, n: int) -> None:
    with pytest.raises(DeclarationError, match=f"unit '{text.replace('^', '.')}'"):
        units.split_units(text, n)


def test_inside_everything_is_si() -> None:
    assert all(units.is_si(u) for u in ("", "m/s", "kg m^2", "rad/s", "N m", "Hz"))
    assert not any(units.is_si(u) for u in ("kt", "deg", "%", "km", "g", "rpm"))
