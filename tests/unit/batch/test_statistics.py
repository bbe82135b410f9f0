"""Shares, means and differences with their intervals."""

from __future__ import annotations

import math
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from tussle.batch import statistics
from tussle.batch.statistics import (
    block_values,
    effective_size,
    mean_interval,
    mean_of,
    means_of,
    paired_difference,
    running_result,
    share_of,
    sign_test,
    stratified_interval,
    wilson,
)
from tussle.cli.batch import batch
from tussle.errors import MissingExtraError


def test_without_scipy_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "scipy", None)
    with pytest.raises(MissingExtraError, match=r"scipy.*tussle\[batch\]"):
        sign_test(3, 10)
    with pytest.raises(MissingExtraError):  # before anything is looked at
        batch(None)


# -- shares ---------------------------------------------------------------------------------------------------------------


@given(n=st.integers(1, 3000), of=st.data())
def test_shares_of_whole_runs_have_the_interval_of_scipy(n, of):
    k = of.draw(st.integers(0, n))
    known = binomtest(k, n).proportion_ci(0.95, method="wilson")
    assert wilson(k, n) == pytest.approx((known.low, known.high), abs=1e-12)


@given(share=st.floats(0.0, 1.0), n=st.floats(0.5, 1e4), more=st.floats(1e-6, 1e-4))
def test_an_interval_of_a_share_contains_it_and_moves_with_it(share, n, more):
    """Runs that stand for others are no whole number: rounded, 34 % of 25 runs had the interval of 36 %."""
    low, high = wilson(share * n, n)
    assert 0.0 <= low <= share + 1e-15
    assert share - 1e-15 <= high <= 1.0
    next_low, next_high = wilson(min(share + more, 1.0) * n, n)
    assert low <= next_low + 1e-12
    assert high <= next_high + 1e-12
    assert next_low - low < 0.02
    assert next_high - high < 0.02


def test_nothing_is_known_of_no_runs():
    assert all(math.isnan(end) for end in wilson(0, 0))
    share = share_of("keepers", 2, np.array([np.nan]))
    assert (share.n, share.of) == (0, 0)
    assert all(math.isnan(number) for number in (share.value, share.low, share.high))


def test_independent_runs_are_worth_themselves_and_equal_ones_one():
    rng = np.random.default_rng(2)
    seeds = np.repeat(np.arange(200), 10)
    same = np.repeat(rng.random(200) < 0.4, 10).astype(
        float
    )  # whoever wins with a seed wins at all ten points
    assert effective_size(same, None) == 2000.0
    assert effective_size(same, seeds) == pytest.approx(200.0, rel=0.02)
    apart = (rng.random(2000) < 0.4).astype(float)
    assert 1500.0 < effective_size(apart, seeds) <= 2000.0
    assert effective_size(np.ones(2000), seeds) == 200.0


def test_the_running_result_is_one_line():
    wins = {"prey": 0, "keepers": 598, "switchers": 359}
    assert running_result(wins, 1000) == "keepers 59.8 % ±3.0, switchers 35.9 % ±3.0, ties 4.3 %"
    assert running_result({"keepers": 3}, 3).startswith("keepers 100.0 % ±")
    assert running_result({"keepers": 0}, 5) == "ties 100.0 %"
    assert running_result({}, 5) == running_result({"keepers": 0}, 0) == ""


# -- means ----------------------------------------------------------------------------------------------------------------


def test_a_mean_has_the_bca_interval_of_scipy():
    from scipy.stats import bootstrap

    values = np.random.default_rng(3).exponential(size=60)
    expected = bootstrap(
        (values,),
        np.mean,
        n_resamples=statistics.N_RESAMPLES,
        rng=np.random.default_rng(statistics.SEED),
        method="BCa",
    ).confidence_interval
    assert mean_interval(values) == pytest.approx((expected.low, expected.high), rel=1e-12)
    low, high = mean_interval(values)
    assert high - values.mean() > 1.1 * (values.mean() - low)  # skewed to the right, as the values are


def test_few_values_have_students_interval_and_many_the_normal_one():
    rng = np.random.default_rng(4)
    few = rng.normal(5.0, 2.0, size=5)
    half = 2.7764451 * few.std(ddof=1) / math.sqrt(5)  # t of 4 degrees of freedom, from a table
    assert mean_interval(few) == pytest.approx((few.mean() - half, few.mean() + half), rel=1e-7)
    many = rng.exponential(size=100_000)
    half = 1.959964 * many.std(ddof=1) / math.sqrt(100_000)
    assert mean_interval(many) == pytest.approx((many.mean() - half, many.mean() + half), rel=1e-6)


def test_one_value_has_no_interval_and_none_no_mean():
    one = mean_of("t", np.array([np.nan, 3.0, np.inf]))
    assert (one.n, one.value) == (1, 3.0)
    assert all(math.isnan(number) for number in (one.low, one.high, one.sd))
    none = mean_of("t", np.array([np.nan]))
    assert none.n == 0
    assert all(
        math.isnan(number) for number in (none.value, none.low, none.high, none.sd, *none.quantiles.values())
    )


def test_all_points_at_once_give_what_each_gives_by_itself():
    rng = np.random.default_rng(5)
    rows = [rng.exponential(size=n) for n in (30, 7, 30, 1, 0, 30, 2500)]
    rows[2][:3] = np.nan
    for together, row in zip(means_of("t", rows), rows, strict=True):
        alone = mean_of("t", row)
        for name in ("n", "value", "low", "high", "sd"):
            assert getattr(together, name) == pytest.approx(getattr(alone, name), rel=1e-12, nan_ok=True)


def test_intervals_of_means_hold_as_often_as_they_say():
    rng = np.random.default_rng(6)
    rows = rng.exponential(size=(400, 60))
    low, high = statistics.mean_intervals(rows)
    share = ((low <= 1.0) & (high >= 1.0)).mean()
    assert 0.90 < share < 0.98  # 0.94 for so skewed a distribution; 400 draws leave ±0.024


# -- blocks ---------------------------------------------------------------------------------------------------------------


@given(st.lists(st.tuples(st.floats(-1e3, 1e3), st.integers(0, 6)), min_size=1, max_size=50))
def test_values_of_blocks_have_the_mean_of_all(pairs):
    values, blocks = np.array([v for v, _ in pairs]), np.array([b for _, b in pairs])
    found = block_values(values, blocks)
    assert len(found) == len(set(blocks.tolist()))
    assert found.mean() == pytest.approx(values.mean(), abs=1e-9)


def test_shared_seeds_widen_the_interval_over_points_as_they_should():
    """Forty seeds at six points; what a seed adds at all points is as large as what differs by itself."""
    rng = np.random.default_rng(7)
    n_seeds, n_points, blocks = 40, 6, np.repeat(np.arange(40), 6)
    held, held_without = 0, 0
    for _ in range(150):
        runs = (rng.normal(size=(n_seeds, 1)) + rng.normal(size=(n_seeds, n_points))).ravel()
        mean, naive = mean_of("score", runs, blocks), mean_of("score", runs)
        held += mean.low <= 0.0 <= mean.high
        held_without += naive.low <= 0.0 <= naive.high
    assert held > 0.88 * 150
    assert held_without < 0.85 * 150


def test_the_interval_over_points_has_none_of_their_differences():
    values, points = np.repeat([5.0, 10.0, 20.0], 4), np.repeat([0, 1, 2], 4)
    seeds = np.tile(np.arange(4), 3)
    for mean in (mean_of("robots", values, seeds, points), mean_of("robots", values, None, points)):
        assert (mean.value, mean.low, mean.high) == pytest.approx((35 / 3,) * 3)
        assert mean.high - mean.low == 0.0


def test_one_run_of_each_point_has_no_interval():
    mean = mean_of("robots", np.array([5.0, 10.0, 20.0]), None, np.arange(3))
    assert np.isnan([mean.low, mean.high]).all()
    mean = mean_of("robots", np.array([5.0, 10.0, 20.0]), np.zeros(3), np.arange(3))
    assert np.isnan([mean.low, mean.high]).all()


def test_a_stratified_interval_is_students_where_there_is_one_point():
    values = np.random.default_rng(1).normal(size=9)
    assert stratified_interval(values, np.zeros(9)) == pytest.approx(mean_interval(values))


@pytest.mark.parametrize("n_seeds", [3, 5, 12])
@pytest.mark.parametrize("shared", [0.0, 1.0])
def test_intervals_over_points_hold_the_mean_over_these_points_as_often_as_they_say(n_seeds, shared):
    """Four points that differ by far more than their runs; seeds that add the same at all points, and apart."""
    rng, n = np.random.default_rng(5), 400
    effect = np.array([0.0, 30.0, 70.0, 200.0])
    points, seeds = np.tile(np.arange(4), n_seeds), np.repeat(np.arange(n_seeds), 4)
    held = widths = 0.0
    for _ in range(n):
        luck = shared * rng.normal(size=(n_seeds, 1)) + rng.normal(size=(n_seeds, 4)) * [1.0, 2.0, 1.0, 0.5]
        mean = mean_of("x", (effect + luck).ravel(), seeds if shared else None, points)
        held += mean.low <= effect.mean() <= mean.high
        widths += (mean.high - mean.low) / n
    assert abs(held / n - 0.95) < 4.0 * (0.95 * 0.05 / n) ** 0.5  # four standard errors
    assert widths < 12.0  # the points are 200 apart


def test_blocks_that_lack_a_point_do_not_differ_for_that():
    values, points = np.array([1.0, 100.0, 1.0, 100.0, 1.0]), np.array([0, 1, 0, 1, 0])
    mean = mean_of("x", values, np.array([0, 0, 1, 1, 2]), points)
    assert mean.low == mean.high == pytest.approx(50.5)


@pytest.mark.parametrize("are_blocks", [True, False])
def test_a_point_that_was_played_more_often_counts_no_more(are_blocks):
    """Batches with a target play on where the answer is open; there the mean over all runs is not that over the points."""
    rng, held = np.random.default_rng(8), 0
    points, seeds = (
        np.repeat([0, 1, 2], [40, 10, 10]),
        np.concatenate([np.arange(40), np.arange(10), np.arange(10)]),
    )
    effect = np.array([0.0, 3.0, 9.0])
    for _ in range(300):
        values = effect[points] + rng.normal(size=60)
        mean = mean_of("x", values, seeds if are_blocks else None, points)
        assert mean.value == pytest.approx(np.mean([values[points == k].mean() for k in range(3)]))
        held += mean.low <= 4.0 <= mean.high
    assert abs(held / 300 - 0.95) < 4.0 * (0.95 * 0.05 / 300) ** 0.5


def test_shares_over_points_stay_within_0_and_1_and_hold_as_often_as_they_say():
    rng, n, n_seeds = np.random.default_rng(6), 400, 8
    odds = np.array([0.02, 0.5, 0.98])
    points, seeds = np.tile(np.arange(3), n_seeds), np.repeat(np.arange(n_seeds), 3)
    held = 0
    for _ in range(n):
        share = share_of("a", 1, (rng.random((n_seeds, 3)) < odds).astype(float).ravel(), seeds, points)
        assert 0.0 <= share.low <= share.value <= share.high <= 1.0
        held += share.low <= odds.mean() <= share.high
    assert held / n > 0.95 - 4.0 * (0.95 * 0.05 / n) ** 0.5


# -- differences ----------------------------------------------------------------------------------------------------------


def test_pairs_are_compared_within_themselves():
    rng = np.random.default_rng(8)
    seed = rng.normal(scale=10.0, size=100)
    a, b = seed + rng.normal(size=100), seed + 1.0 + rng.normal(size=100)
    a[3], b[5] = np.nan, np.nan
    found = paired_difference("score", ("keep", "switch"), a, b)
    is_known = np.isfinite(a) & np.isfinite(b)
    assert (found.a, found.b, found.n) == ("keep", "switch", 98)
    assert found.difference == pytest.approx(found.mean_b - found.mean_a)
    assert (found.low, found.high) == mean_interval((b - a)[is_known])
    assert 0.5 < found.low < 1.0 < found.high < 1.5  # a spread of 10 between seeds, and yet
    assert (found.n_greater, found.n_less) == (int((b > a).sum()), int((b < a).sum()))
    assert found.p == sign_test(found.n_greater, found.n_less) < 1e-4


@pytest.mark.parametrize("value", [0.0, 0.25, 1.0])
def test_a_share_of_copies_of_one_game_has_no_interval(value):
    found = mean_of("share", np.full(4, value), np.zeros(4, int), are_copies=True, is_share=True)
    assert (found.value, found.n) == (value, 4)
    assert np.isnan([found.low, found.high]).all()
