"""Points by their values, and pairs of them."""

from __future__ import annotations

import pytest

from tussle.batch.selection import paired_points, select_points
from tussle.batch.variables import Choice, Range
from tussle.errors import ParameterError

VARIABLES = [
    Choice("tactic", ("keep", "switch", "a, b")),
    Range("prey.speed", 20.0, 30.0, unit="kt"),
    Choice("n", (5, 10)),
]
POINTS = [
    {"tactic": tactic, "prey.speed": speed, "n": n}
    for tactic in ("keep", "switch", "a, b")
    for speed in (20.0, 23.456789)
    for n in (5, 10)
]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("3", [3]),
        ("tactic=keep", [0, 1, 2, 3]),
        (" tactic = switch , n=10 ", [5, 7]),
        ("prey.speed=20, tactic=keep", [0, 1]),
        ("prey.speed=20 kt,n=5.0", [0, 4, 8]),
        ("prey.speed=23.4568", [2, 3, 6, 7, 10, 11]),  # as it is shown
        ("tactic=a, b", [8, 9, 10, 11]),
        ("n=5,tactic=a, b", [8, 10]),
    ],
)
def test_a_text_selects_points(text, found):
    assert select_points(VARIABLES, POINTS, text) == found


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("12", "there is no point 12; there are points 0 to 11"),
        ("tactic", "it takes NAME=VALUE"),
        ("tactic=", "it takes NAME=VALUE"),
        ("tactik=keep", "'tactik' was not varied (did you mean 'tactic'?); there are: tactic, prey.speed, n"),
        ("tactic=kep", "no point has tactic=kep (did you mean 'keep'?); there are: keep, switch, a, b"),
        ("n=7", "no point has n=7; there are: 5, 10"),
        ("n=many", "no point has n=many"),
    ],
)
def test_what_selects_nothing_is_told(text, words):
    with pytest.raises(ParameterError) as error:
        select_points(VARIABLES, POINTS, text)
    assert words in str(error.value)


def test_pairs_agree_in_all_that_is_not_named():
    assert paired_points(VARIABLES, POINTS, "tactic=keep", "tactic=switch") == ([0, 1, 2, 3], [4, 5, 6, 7])
    assert paired_points(VARIABLES, POINTS, "n=10", "n=5") == ([1, 3, 5, 7, 9, 11], [0, 2, 4, 6, 8, 10])
    assert paired_points(VARIABLES, POINTS, "n=10,tactic=keep", "tactic=switch,n=5") == ([1, 3], [4, 6])
    assert paired_points(VARIABLES, POINTS, 2, 7) == ([2], [7])
    assert paired_points(VARIABLES, POINTS, "2", "tactic=switch, prey.speed=20, n=5") == ([2], [4])


def test_points_that_are_there_twice_are_paired_in_their_order():
    variables = [Choice("tactic", ("keep", "switch")), Range("n", 1.0, 9.0, is_int=True)]
    points = [{"tactic": t, "n": n} for n in (3, 3, 4) for t in ("keep", "switch")] + [
        {"tactic": "keep", "n": 3}
    ]
    assert paired_points(variables, points, "tactic=keep", "tactic=switch") == ([0, 2, 4], [1, 3, 5])


@pytest.mark.parametrize(
    ("a", "b", "words"),
    [
        (1, 1, "compared with itself"),
        (0, 12, "there is no point 12"),
        (0, -1, "there is no point -1"),
        ("tactic=keep", "n=5", "they name the same ones"),
        ("tactic=keep", 4, "they name the same ones"),
    ],
)
def test_what_cannot_be_paired_is_told(a, b, words):
    with pytest.raises(ParameterError, match=words):
        paired_points(VARIABLES, POINTS, a, b)


def test_points_that_agree_in_nothing_are_no_pairs():
    variables = [Choice("a", (1, 2)), Range("x", 0.0, 9.0)]
    points = [{"a": 1 + i % 2, "x": float(i)} for i in range(6)]
    for some in (points, points[:2]):
        with pytest.raises(
            ParameterError, match="no point with a=1 has one with a=2 that agrees with it in x"
        ):
            paired_points(variables, some, "a=1", "a=2")


@pytest.mark.parametrize(
    ("values", "text", "found"),
    [
        ((1_000_000, 1_000_001, 1_000_002), "1000001", [1]),
        ((2**53, 2**53 + 1), str(2**53 + 1), [1]),
        ((0.1, 0.1000001, 0.1000002), "0.1000001", [1]),
        ((0.1000001, 0.1000002, 0.3), "0.1", [0, 1]),  # as they are shown
        ((-3, 3), "-3", [0]),
        ((0, 1e-9), "0", [0]),
    ],
)
def test_a_value_is_the_one_that_is_named_and_none_that_is_near(values, text, found):
    points = [{"k": value} for value in values]
    assert select_points([Choice("k", values)], points, f"k={text}") == found
