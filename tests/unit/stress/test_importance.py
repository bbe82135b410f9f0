"""Importance sampling: estimates are those of closed forms, weights are bounded, and what cannot be trusted is said."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tussle.stress.importance import estimate


def threshold(p):
    """One normal number above a threshold."""
    b = stats.norm.isf(p)
    return 1, lambda u: b - u[:, 0], p


def mean_of_five(p):
    """A sum of five normal numbers above a threshold."""
    b = stats.norm.isf(p) * np.sqrt(5.0)
    return 5, lambda u: b - u.sum(axis=1), p


def two_sides(p):
    """A normal number outside of two thresholds: two ways to fail."""
    b = stats.norm.isf(p / 2)
    return 2, lambda u: b - np.abs(u[:, 0]), p


def meeting(p):
    """Two normal start positions in the plane nearer than 1 m: the squared distance is a noncentral chi-square number."""
    from scipy.optimize import brentq

    sd = np.sqrt(2.0)

    def near(gap):
        return stats.ncx2.cdf(1.0 / sd**2, 2, (gap / sd) ** 2)

    gap = brentq(lambda g: np.log(near(g) / p), 0.01, 20.0)
    return 4, lambda u: np.hypot(gap + u[:, 0] - u[:, 2], u[:, 1] - u[:, 3]) - 1.0, p


PROBLEMS = (threshold, mean_of_five, two_sides, meeting)


@pytest.mark.slow
@pytest.mark.parametrize("problem", PROBLEMS)
@pytest.mark.parametrize("p", [1e-2, 1e-4, 1e-6, 1e-8])
def test_intervals_cover_the_exact_probability(problem, p):
    """90 to 99 of 100 studies."""
    d, robustness, exact = problem(p)
    found = [estimate(lambda u, _: robustness(u), d, 1000, 400, seed) for seed in range(100)]
    covered = sum(each.low <= exact <= each.high for each in found)
    games, gain = (np.median([getattr(each, name) for each in found]) for name in ("n_games", "n_plain"))
    print(
        f"{problem.__name__} {exact:.0e}: {covered} of 100 intervals cover; {games:,.0f} games for {gain:.2g}"
    )
    assert 90 <= covered <= 100


@pytest.mark.parametrize("problem", PROBLEMS)
@pytest.mark.parametrize("p", [1e-2, 1e-6])
def test_the_mean_of_estimates_is_the_exact_probability(problem, p):
    d, robustness, exact = problem(p)
    found = [estimate(lambda u, _: robustness(u), d, 1000, 400, seed).value for seed in range(20)]
    error = np.std(found, ddof=1) / np.sqrt(len(found))
    assert abs(np.mean(found) - exact) < 4.0 * error
    assert error < 0.1 * exact
