"""One codec for each way in which the format writes something."""

from __future__ import annotations

import math

import pytest

from tussle.api import Param
from tussle.declare import texts
from tussle.errors import MissionError, ParameterError, TussleError
from tussle.mission import codecs


@pytest.mark.parametrize("text", ["true", " True ", "1", "yes"])
def test_truth(text):
    assert texts.truth(text)
    assert not texts.truth({"1": "0", "yes": "no"}.get(text.strip(), "FALSE"))
    with pytest.raises(ParameterError, match="it takes true or false"):
        texts.truth(text + "x")


@pytest.mark.parametrize(
    ("text", "value"), [(" 1 / 2 ", 0.5), ("1/4", 0.25), ("3", 3.0), ("2 Hz", 2.0), ("2 1/s", 2.0)]
)
def test_rates(text, value):
    assert codecs.fraction(text, "1/s") == value


@pytest.mark.parametrize("text", ["1/0", "a/2", "1/", "/2", "", "nan", "inf"])
def test_wrong_rates(text):
    with pytest.raises(TussleError):
        codecs.fraction(text, "1/s")


@pytest.mark.parametrize("text", ["1.5", "1e30", "-1", "x", "", "3 m", "1e999"])
def test_wrong_whole_numbers(text):
    with pytest.raises(TussleError):
        codecs.integer(text, 0)


def test_a_row_of_numbers():
    parts = [("kp", "", ""), ("band", "rad", "deg")]
    assert (
        texts.row("1, 45", parts)
        == texts.row(" 1 45 ", parts)
        == texts.row("[ 1 45 ]", parts)
        == (1.0, math.radians(45.0))
    )
    assert texts.row("1, 45 deg", parts) == texts.row("1, 45,", parts) == (1.0, math.radians(45.0))
    assert texts.row("1, 0.5 rad", parts) == (1.0, 0.5)
    with pytest.raises(ParameterError, match=r"'1 2 3' has 3 numbers; it takes 2 \(kp, band\)"):
        texts.row("1 2 3", parts)
    with pytest.raises(ParameterError, match="not convertible to rad"):
        texts.row("1, 3 m", parts)


def test_rows():
    assert texts.rows(" [ 1 2 ]\n\t[3 4] ") == ["1 2", "3 4"]
    assert texts.rows("") == []
    for wrong in ("[ 1 2", "1 2", "[1] x", "[[1]]"):
        with pytest.raises(ParameterError, match="is not a row"):
            texts.rows(wrong)


def test_behaviors():
    found = codecs.inline_plugins("""[ A gain='1.0' goal="1,2" ]\n [B n=3]  [ C ]""")
    assert found == [("A", {"gain": "1.0", "goal": "1,2"}), ("B", {"n": "3"}), ("C", {})]
    assert codecs.inline_plugins("[ Outer inner='[ Inner a=1 ]' ]") == [("Outer", {"inner": "[ Inner a=1 ]"})]
    for wrong in ("A gain='1'", "[ A gain='1'", "[ A gain= ]", "[ ]", "[ A a='1' a='2' ]", "[A] b"):
        with pytest.raises(MissionError):
            codecs.inline_plugins(wrong)


@pytest.mark.parametrize(
    ("column", "text", "value"),
    [
        (Param(1.0, unit="rad", text_unit="deg"), "90", math.pi / 2),
        (Param(1.0, unit="rad", text_unit="deg"), "1 rad", 1.0),
        (Param(1), "5", 5),
        (Param(False), "TRUE", True),
        (Param("a", choices=("a", "b")), " b ", "b"),
        (Param((1.0, 2.0), fields="mean sd", unit="m"), "0.0 5.0", (0.0, 5.0)),
        (Param((1, 2), fields="a b"), "3,4", (3, 4)),
        (Param((), ragged=True, unit="m"), "1, 2 3", (1.0, 2.0, 3.0)),
        (Param((), ragged=True, unit="m"), "[ 1 2 ]", (1.0, 2.0)),
        (Param((), ragged=True, fields="x y"), "[ 1 2 ] [ 3, 4 ]", ((1.0, 2.0), (3.0, 4.0))),
        (Param(math.inf, unit="m"), "inf", math.inf),
    ],
)
def test_parameters(column, text, value):
    assert column.convert(text) == value


@pytest.mark.parametrize(
    ("column", "text"),
    [
        (Param(1.0, ge=0.0), "-1"),
        (Param(1.0), "nan"),
        (Param(1.0), ""),
        (Param(1), "1.5"),
        (Param(1), "1e200"),
        (Param(1), "inf"),
        (Param(False), "maybe"),
        (Param("a", choices=("a", "b")), "c"),
        (Param((1.0, 2.0), fields="a b"), "1"),
        (Param((), ragged=True, fields="x y"), "1 2"),
        (Param((), ragged=True), "1 x"),
        (Param((), ragged=True), "1 " * 200_000),
    ],
)
def test_wrong_parameters(column, text):
    with pytest.raises(ParameterError):
        column.convert(text)
