"""When enough has been played."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tussle.batch.statistics import wilson
from tussle.batch.stopping import MIN_RUNS, Until
from tussle.errors import ParameterError


def wins(k: int, n: int) -> np.ndarray:
    return np.array([1.0] * k + [0.0] * (n - k))


@pytest.mark.parametrize(
    ("text", "quantity", "half_width"),
    [
        ("0.02", None, 0.02),
        (" 2e-2 ", None, 0.02),
        ("score[2] : 0.5", "score[2]", 0.5),
        ("score[2] - score[3]:20", "score[2] - score[3]", 20.0),
        ("±0.02", None, 0.02),
        ("score[2]+-1+-3", "score[2]+-1", 3.0),
    ],
)
def test_a_rule_is_read_and_written_again(text, quantity, half_width):
    rule = Until.parse(text)
    assert (rule.quantity and str(rule.quantity), rule.half_width) == (quantity, half_width)
    assert Until.parse(str(rule)) == rule


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("score[2]-0.5", "no number"),
        ("", "no number"),
        ("score[2]:", "no number"),
        ("2%", "2 % is written 0.02"),
        ("0", "> 0"),
        ("-1", "> 0"),
        ("nan", "> 0"),
        ("inf", "> 0"),
        ("2", "between 0 and 1"),
        ("wins[2]:0.5", "between 0 and 1"),
        ("score[:1", "cannot be read"),
    ],
)
def test_what_is_no_rule_is_refused(text, words):
    with pytest.raises(ParameterError, match=words):
        Until.parse(text)


def test_a_share_is_as_wide_as_wilsons_interval():
    low, high = wilson(60, 100)
    columns = {
        "wins[2]": wins(60, 100),
        "wins[3]": wins(1, 100),
        "ties": wins(50, 100),
        "t": np.arange(100.0),
    }
    assert (
        Until.parse("0.1").width(columns) == (high - low) / 2.0
    )  # the widest of the teams; ties are nobody's win
    assert Until.parse("wins[2]:0.1").width(columns) == (high - low) / 2.0
    assert Until.parse("wins[3]:0.1").width(columns) < 0.03
    assert Until.parse("0.096").is_met([columns])
    assert not Until.parse("0.094").is_met([columns])


def test_a_mean_is_as_wide_as_its_normal_interval():
    values = np.random.default_rng(1).normal(size=400)
    width = Until.parse("score[2]:1").width({"score[2]": values})
    assert width == pytest.approx(1.959964 * values.std(ddof=1) / 20.0, rel=1e-6)
    assert Until.parse("2*score[2]-1:1").width({"score[2]": values}) == pytest.approx(2.0 * width)


def test_a_few_runs_are_never_enough():
    rule = Until.parse("score[1]:1")
    equal = {"score[1]": np.full(MIN_RUNS - 1, 3.0), "wins[1]": np.full(MIN_RUNS - 1, 1.0)}
    assert rule.width(equal) == math.inf
    assert Until.parse("0.4").width(equal) == math.inf
    assert rule.is_met([{"score[1]": np.full(MIN_RUNS, 3.0)}])


def test_a_result_that_the_runs_do_not_have_is_told():
    with pytest.raises(ParameterError, match="nobody wins; name a quantity"):
        Until.parse("0.02").is_met([{"t": np.arange(30.0)}])
    with pytest.raises(ParameterError, match=r"there is no 'score\[9\]'"):
        Until.parse("score[9]:1").is_met([{"score[1]": np.arange(30.0)}])
