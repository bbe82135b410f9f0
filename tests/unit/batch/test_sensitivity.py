"""What each variable does: against functions whose indices are known."""

from __future__ import annotations

import math
import sys

import numpy as np
import pytest
from made_batches import made_batch

from tussle.batch.results import Results
from tussle.batch.sampling import sample
from tussle.batch.sensitivity import as_factorial, spearman
from tussle.batch.variables import Choice, Range
from tussle.errors import MissingExtraError

ISHIGAMI = [Range(name, -math.pi, math.pi) for name in ("a", "b", "c")]
FIRST, TOTAL = [0.3139, 0.4424, 0.0], [0.5576, 0.4424, 0.2437]  # Ishigami and Homma (1990), with 7 and 0.1


def ishigami(points):
    a, b, c = (np.array([p[name] for p in points]) for name in ("a", "b", "c"))
    return np.sin(a) + 7.0 * np.sin(b) ** 2 + 0.1 * c**4 * np.sin(a)


def results_of(scores, **options):
    return Results(made_batch({2: np.atleast_2d(scores)}, **options))


# -- Saltelli's sample ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def saltelli_points():
    return sample(ISHIGAMI, "saltelli", 512, seed=1)


def test_saltellis_indices_are_those_of_the_ishigami_function(saltelli_points):
    scores = ishigami(saltelli_points)
    found = results_of(scores, variables=ISHIGAMI, points=saltelli_points, sample="saltelli").sensitivity(
        "score[2]"
    )
    assert [e.variable for e in found] == ["a", "b", "c"]
    for e, first, total in zip(found, FIRST, TOTAL, strict=True):
        assert e.method == "sobol"
        assert e.first_order == pytest.approx(first, abs=0.05)
        assert e.total == pytest.approx(total, abs=0.05)
        assert e.first_low <= e.first_order <= e.first_high
        assert e.first_low <= first <= e.first_high
        assert e.total_low <= total <= e.total_high


def test_rows_that_lack_a_run_are_left_out_and_told(saltelli_points):
    batch = {
        "variables": ISHIGAMI,
        "points": saltelli_points,
        "sample": "saltelli",
        "failed": {7: "boom", 8: "boom", 99: "boom"},
    }
    found = results_of(ishigami(saltelli_points), **batch).sensitivity("score[2]")
    assert "510 base rows" in found[0].note
    assert "2 rows lack a run and are left out" in found[0].note
    assert found[1].first_order == pytest.approx(0.4424, abs=0.06)


# -- any sample -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("method", "n"), [("lhs", 100), ("sobol", 128)])
def test_parts_come_of_points_sampled_otherwise(method, n):
    points = sample(ISHIGAMI, method, n, seed=2)
    found = results_of(ishigami(points), variables=ISHIGAMI, points=points, sample=method).sensitivity(
        "score[2]"
    )
    assert [e.variable for e in found] == ["a", "b", "c", "unexplained"]
    for e, first, total in zip(found, FIRST, TOTAL, strict=False):
        assert e.method == "fit"
        assert e.first_order == pytest.approx(first, abs=0.08)
        assert e.total == pytest.approx(total, abs=0.1)
        assert e.first_low < e.first_order < e.first_high


def test_rounding_of_the_points_does_not_change_the_parts():
    """Processors round differently. The fit is the best one on all of them, and not where rounding lets the search end."""
    points, found = sample(ISHIGAMI, "lhs", 100, seed=2), []
    for chance in map(np.random.default_rng, range(4)):
        moved = [{k: v * (1.0 + 1e-12 * chance.normal()) for k, v in p.items()} for p in points]
        results = results_of(ishigami(moved), variables=ISHIGAMI, points=moved, sample="lhs")
        found.append([e.first_order for e in results.sensitivity("score[2]")])
    assert np.ptp(found, axis=0).max() < 2e-3


@pytest.mark.parametrize("n", [24, 100])
def test_a_choice_among_ranges_has_its_part_with_few_points_too(n):
    variables = [Range("x", 0.0, 1.0), Choice("tactic", ("keep", "switch", "rest"))]
    points = sample(variables, "lhs", n, seed=3)
    add = {"keep": -1.0, "switch": 1.0, "rest": 0.0}
    means = np.array([p["x"] * math.sqrt(12.0) + add[p["tactic"]] for p in points])  # variances 1 and 2/3
    scores = means + np.random.default_rng(1).normal(0.0, 1.0, (10, n))  # and 1
    found = results_of(scores, variables=variables, points=points, sample="lhs").sensitivity("score[2]")
    assert [e.method for e in found] == ["fit", "fit", "fit"]
    assert [e.variable for e in found] == ["x", "tactic", "seed"]
    assert [e.first_order for e in found] == pytest.approx([3 / 8, 2 / 8, 3 / 8], abs=0.08)
    assert found[1].total >= found[1].first_order
    assert math.isnan(found[1].rank_correlation)
    assert "tactic has no order" in found[1].note


def test_few_points_have_no_parts_and_the_note_says_so():
    points = sample(ISHIGAMI, "lhs", 6, seed=1)
    found = results_of(ishigami(points), variables=ISHIGAMI, points=points, sample="lhs").sensitivity(
        "score[2]"
    )
    assert all(e.first_order is None and e.method == "" for e in found)
    assert "they take 7 points" in found[0].note


# -- factorial ------------------------------------------------------------------------------------------------------------

GRID = [Range("x", 0.0, 1.0, levels=2), Choice("tactic", ("keep", "switch"))]


def grid_scores(n_seeds, noise, interaction=0.0):
    """(n_seeds, 4): 2 x + the tactic + x times it, on -1 and 1: variances 4, 1 and interaction squared; and noise."""
    points = sample(GRID, "grid")
    x = np.array([2.0 * p["x"] - 1.0 for p in points])
    tactic = np.array([1.0 if p["tactic"] == "keep" else -1.0 for p in points])
    rng = np.random.default_rng(5)
    rows = 2.0 * x + tactic + interaction * x * tactic + noise * rng.normal(size=(n_seeds, 4))
    return {"scores": rows, "variables": GRID, "points": points, "sample": "grid"}


def test_a_grid_is_taken_apart_into_factors_interaction_and_seed():
    found = results_of(**grid_scores(400, noise=2.0, interaction=1.0)).sensitivity("score[2]")
    assert [e.variable for e in found] == ["x", "tactic", "interaction", "seed"]
    shares = [e.first_order for e in found]
    assert shares == pytest.approx([0.4, 0.1, 0.1, 0.4], abs=0.05)
    assert sum(shares) == pytest.approx(1.0)
    assert [e.total for e in found] == [
        pytest.approx(0.5, abs=0.05),
        pytest.approx(0.2, abs=0.05),
        None,
        None,
    ]
    for e, share in zip(found, [0.4, 0.1, 0.1, 0.4], strict=True):
        assert e.method == "anova"
        assert e.first_low < share < e.first_high
    assert "4 combinations × 400 seeds" in found[0].note


def test_a_single_seed_leaves_interaction_and_noise_together():
    found = results_of(**grid_scores(1, noise=0.0, interaction=1.0)).sensitivity("score[2]")
    assert [e.variable for e in found] == ["x", "tactic", "interaction and seed"]
    assert [e.first_order for e in found] == pytest.approx([4 / 6, 1 / 6, 1 / 6])
    assert found[0].total is None
    assert found[0].first_low is None
    assert "intervals take 20 seeds" in found[0].note


def test_points_are_a_factorial_in_any_order_or_none():
    rng = np.random.default_rng(6)
    columns = [("a", "a", "b", "b", "a", "b"), (1, 2, 3, 1, 3, 2)]
    values = as_factorial(columns, np.array([[1.0, 2.0, 6.0, 4.0, 3.0, 5.0]]))
    np.testing.assert_array_equal(values[0, 0], [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(values[0, 1], [4.0, 5.0, 6.0])
    twice = [("a", "a", "b", "b"), (1, 1, 2, 2)]
    assert as_factorial(twice, rng.normal(size=(3, 4))) is None
    assert as_factorial([tuple(range(200))], rng.normal(size=(3, 200))) is None


# -- rank correlation -----------------------------------------------------------------------------------------------------


def test_the_rank_correlation_is_that_of_the_points_means():
    from scipy.stats import spearmanr

    points = sample(ISHIGAMI, "lhs", 40, seed=7)
    scores = ishigami(points) + np.random.default_rng(8).normal(size=(5, 40))
    found = results_of(scores, variables=ISHIGAMI, points=points, sample="lhs").sensitivity("score[2]")
    expected = spearmanr([p["a"] for p in points], scores.mean(axis=0)).statistic
    assert found[0].rank_correlation == pytest.approx(expected)
    assert found[0].rank_low < expected < found[0].rank_high
    assert "over the points' means" in found[0].note


def test_its_interval_holds_as_often_as_it_says():
    rng = np.random.default_rng(9)
    true = 6.0 / math.pi * math.asin(0.6 / 2.0)  # Spearman's of two normal variables that correlate by 0.6
    held = 0
    for _ in range(400):
        x, e = rng.normal(size=(2, 50))
        _, low, high = spearman(x, 0.6 * x + 0.8 * e)
        held += low <= true <= high
    assert 0.92 < held / 400 < 0.98


def test_ranks_of_what_does_not_vary_or_always_rises():
    x = np.arange(9.0)
    assert all(math.isnan(number) for number in spearman(x, np.ones(9)))
    assert spearman(x, x**3) == (1.0, 1.0, 1.0)
    assert spearman(x, -x) == (-1.0, -1.0, -1.0)
    assert math.isnan(spearman(x[:3], x[:3] ** 2)[1])


# -- without SALib --------------------------------------------------------------------------------------------------------


@pytest.fixture
def no_salib(monkeypatch):
    for name in [name for name in sys.modules if name.split(".")[0] == "SALib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(sys, "path", [])
    monkeypatch.setattr(sys, "path_importer_cache", {})


@pytest.mark.usefixtures("no_salib")
def test_only_what_needs_salib_misses_it(saltelli_points):
    results = results_of(
        ishigami(saltelli_points), variables=ISHIGAMI, points=saltelli_points, sample="saltelli"
    )
    with pytest.raises(MissingExtraError, match=r"need SALib, .* pip install 'tussle\[batch\]'"):
        results.sensitivity("score[2]")
    assert results.rank_correlations("score[2]")[0].rank_correlation > 0.3
    points = sample(ISHIGAMI, "lhs", 20, seed=2)
    found = results_of(ishigami(points), variables=ISHIGAMI, points=points, sample="lhs").sensitivity(
        "score[2]"
    )
    assert found[0].first_order is not None
