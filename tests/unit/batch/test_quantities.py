"""Expressions over the numbers of a run."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import strategies as st
from made_batches import made_batch

from tussle.batch.quantities import MAX_TEXT, Quantity
from tussle.batch.results import Results
from tussle.batch.sequential_intervals import seen_in, sequential_interval
from tussle.errors import ParameterError

COLUMNS = {
    "score[2]": np.array([3.0, 1.0, np.nan]),
    "score[3]": np.array([2.0, 4.0, np.nan]),
    "wins[2]": np.array([1.0, 0.0, np.nan]),
    "wins[-1]": np.array([0.0, 1.0, np.nan]),
    "ties": np.array([0.0, 0.0, np.nan]),
    "t": np.array([10.0, 20.0, np.nan]),
    "lost[1]": np.array([4.0, 0.0, np.nan]),
    "CPA.cpa": np.array([0.5, np.inf, np.nan]),
    "Cap.hits[3]": np.array([7.0, 8.0, np.nan]),
    '"my metric.a-b"[2]': np.array([5.0, 6.0, np.nan]),
}


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("score[2]", [3.0, 1.0]),
        (" score[2] - score[3] ", [1.0, -3.0]),
        ("-(score[2]+1)*2/4 - +1", [-3.0, -2.0]),
        ("2 - 1 - score[2]", [-2.0, 0.0]),
        ("wins[-1]", [0.0, 1.0]),
        ("lost[1] / t", [0.4, 0.0]),
        ("t / lost[1]", [2.5, np.nan]),
        ("1e2 * ties", [0.0, 0.0]),
        ("CPA.cpa", [0.5, np.inf]),
        ("CPA.cpa - CPA.cpa", [0.0, np.nan]),
        ("Cap.hits", [7.0, 8.0]),  # of one team only
        ('"my metric.a-b"[2]', [5.0, 6.0]),
        ("'my metric.a-b' + t", [15.0, 26.0]),
    ],
)
def test_an_expression_has_the_value_that_it_says(text, values):
    np.testing.assert_array_equal(Quantity.parse(text).evaluate(COLUMNS), [*values, np.nan])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("scoer[2]", "'scoer[2]' (did you mean 'score[2]'?); there are: score[2], score[3]"),
        ("score[4]", "there is no 'score[4]'"),
        ("score", "'score' needs a team; there are: score[2], score[3]"),
        ("CPA.cap", "(did you mean 'CPA.cpa'?)"),
    ],
)
def test_a_name_that_no_run_has_is_told_with_the_nearest(text, words):
    with pytest.raises(ParameterError) as error:
        Quantity.parse(text).evaluate(COLUMNS)
    assert words in str(error.value)
    assert repr(text) in str(error.value)


@pytest.mark.parametrize(
    "text",
    [
        "", "   ", "score[2", "3 + 4", "score[2] ** 2", "score[2] % 2", "score[2] // 2", "score[2] > 1", "not ties", "~ties",
        "abs(t)", "__import__('os').getcwd()", "t if ties else t", "[t]", "(t, t)", "score[t]", "score[1.0]", "score[True]",
        "score['a']", "score[1:2]", "t; t", "t = 1", "lambda: t", "f'{t}'", "t + True", "t + 1j", "t + 1e999", "t + None", "t.real()",
        "t\x00", "t + ...", "1if t else 2", "(t := 1)", "9" * 150 + " ** 9 + t", "(" * 190 + "t", "b'x'[1]", "await t", "score[2][3]",
    ],
)  # fmt: skip
def test_what_is_no_arithmetic_is_refused(text):
    with pytest.raises(ParameterError, match="quantity"):
        Quantity.parse(text).evaluate(COLUMNS)


def test_long_and_deep_texts_are_refused_or_read():
    assert Quantity.parse("-" * (MAX_TEXT - 1) + "t").evaluate(COLUMNS)[0] == -10.0
    with pytest.raises(ParameterError, match=f"at most {MAX_TEXT}"):
        Quantity.parse("t" * (MAX_TEXT + 1))


def test_shares_are_told_from_other_numbers():
    assert [Quantity.parse(t).is_share for t in ("wins[2]", "wins", "ties", "score[2]", "wins[2]-wins[-1]", "-ties")] == [
        True, True, True, False, False, False,
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "may_be"),
    [
        ("wins[2]", False), ("wins[-1]", False), ("wins[2]/2+ties", False), ("1-wins[2]", False), ("1-wins[-1]*ties", False),
        ("wins[2]-wins[3]", True), ("-wins[2]", True), ("0.5-wins[2]", True), ("1-(wins[2]-ties)", True), ("wins[2]*-2", True),
    ],
)  # fmt: skip
def test_differences_are_no_shares_whatever_was_seen_of_them(text, may_be):
    """That no game had a negative difference does not bound it by 0: its interval is no share's."""
    assert Quantity.parse(text).may_be_negative == may_be
    level = made_batch(
        {2: np.full((40, 1), 3.0), 3: np.full((40, 1), 3.0)}, metrics={"G.s": {None: np.zeros((40, 1))}}
    )
    expression = text.replace("ties", "G.s").replace("[-1]", "[3]")
    assert Results(level).is_share(expression) == (not may_be)
    values = np.zeros((40, 1))
    low, high = sequential_interval(values[:, 0], 0.05, seen_in(values, may_be))
    assert (low < -0.1) == may_be
    assert low <= 0.0 < high


NUMBERS = st.integers(0, 99).map(str)
NAMES = st.sampled_from(["a", "b[1]", "c.d[2]"])
EXPRESSIONS = st.recursive(
    NUMBERS | NAMES,
    lambda inner: (
        st.builds("({} {} {})".format, inner, st.sampled_from("+-*"), inner) | st.builds("-{}".format, inner)
    ),
    max_leaves=12,
)
