"""Probabilities by splitting are those of closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from walks import ENTITIES, NORMAL, PROCESSES, begun, brownian, chain, playing

from tussle.numeric.kernel import collecting_later
from tussle.stress import Played, Verdict
from tussle.stress.formulas import guided
from tussle.stress.splitting import Redraws, interval, split


@pytest.mark.parametrize("process", PROCESSES)
@pytest.mark.parametrize("p", [1e-2, 1e-4])
def test_the_mean_of_estimates_is_the_exact_probability(process, p):
    play, exact = process(p)
    found = [r.probability for r in split(play, 40, 10, range(40), 1)]
    error = np.std(found, ddof=1) / math.sqrt(len(found))
    assert abs(np.mean(found) - exact) < 4.0 * error
    assert error < 0.4 * exact


@pytest.mark.parametrize("levels", [(1.5, 1.0, 0.5), (2.0, 1.6, 1.2, 0.8, 0.6, 0.4, 0.2)])
def test_moves_to_other_starts_change_no_probability(levels):
    """At any levels, also where they are too few to help."""
    play, exact = begun(1e-2)
    found = [r.probability for r in split(play, 40, 10, range(60), 1, Redraws(levels, ENTITIES, 2))]
    error = np.std(found, ddof=1) / math.sqrt(len(found))
    assert abs(np.mean(found) - exact) < 4.0 * error
    assert error < 0.25 * exact


def covering(exact, play, n, n_replaced, *redraws):
    """How many of 100 studies of 20 repetitions have an interval that covers the exact probability."""
    covered = 0
    with collecting_later():  # many objects are made, and none is garbage
        for first in range(0, 2000, 20):
            repetitions = split(play, n, n_replaced, range(first, first + 20), 1, *redraws)
            _, low, high = interval([r.probability for r in repetitions])
            covered += low <= exact <= high
    print(f"{exact:.2g}: {covered} of 100 intervals cover")
    return covered


@pytest.mark.slow
def test_intervals_cover_a_probability_that_the_start_decides():
    """90 to 99 of 100 studies."""
    play, exact = begun(0.03)
    (before,) = split(play, 30, 7, [9000], 1)
    assert 90 <= covering(exact, play, 30, 7, Redraws.of(before, ENTITIES, 1)) <= 100


def guided_brownian(p, lead):
    """Brownian motion that fails at b, with a guide that is broken at lead * b on every second step, or never on the way."""
    from scipy.stats import norm

    b, steps = norm.isf(p / 2), 100

    def path(draw, n):
        x = np.maximum.accumulate(np.cumsum(draw(NORMAL), axis=1) / math.sqrt(steps), axis=1)
        x = np.concatenate([np.zeros((n, 1)), x], axis=1)
        seen = np.maximum.accumulate(np.where(np.arange(steps + 1) % 2, x, 0.0), axis=1)
        return guided(b - x, lead * b - seen)

    return playing(path, steps)


@pytest.mark.parametrize("lead", [0.5, 0.9, 3.0])
def test_a_guide_changes_no_probability(lead):
    """Be it broken long before a failure, just before, or after it."""
    p, shift = 1e-3, 0.5826 / math.sqrt(100)  # of a walk in steps (Broadie et al. 1997)
    from scipy.stats import norm

    exact = 2.0 * norm.sf(norm.isf(p / 2) + shift)
    found = [r.probability for r in split(guided_brownian(p, lead), 40, 10, range(40), 1)]
    error = np.std(found, ddof=1) / math.sqrt(len(found))
    assert abs(np.mean(found) - exact) < 4.0 * error + 0.02 * exact
    assert error < 0.4 * exact


def test_a_guided_score_never_rises_and_is_negative_for_a_failure_alone():
    known = np.array([np.inf, np.inf, 5.0, 5.0, 2.0, 0.0, -1.0])
    guide = np.array([np.inf, 3.0, 3.0, 0.0, -0.5, -2.0, -2.0])
    score = guided(known, guide)
    assert (np.diff(score[1:]) <= 0.0).all()
    np.testing.assert_allclose(score, [np.inf, 4.0, 4.0, 1.0, 2 / 3, 0.0, -1.0])
    np.testing.assert_array_equal(guided(known, -np.ones(7))[[0, 6]], [1.0, -1.0])


def test_a_repetition_whose_branches_are_all_alike_ends():
    """A score that creeps on without end is no way to a failure."""
    rounds = []

    def play(games):
        rounds.append(len(games))
        scores = [1.0 - 1e-3 * (len(rounds) + i / len(games)) for i in range(len(games))]
        return [Played(g, Verdict(s, [0], [s]), 1.0, 0.0, "") for g, s in zip(games, scores, strict=True)]

    (found,) = split(play, 20, 5, [0], 1)
    assert found.is_extinct
    assert 20 < len(rounds) < 200


@pytest.mark.slow
@pytest.mark.parametrize("process", PROCESSES)
@pytest.mark.parametrize("p", [1e-2, 1e-4])
def test_intervals_cover_the_exact_probability(process, p):
    """90 to 99 of 100 studies."""
    play, exact = process(p)
    n = 100 if process is chain else 50
    assert 90 <= covering(exact, play, n, n // 4) <= 100


def test_a_repetition_counts_its_games_and_their_ancestors():
    play, _ = brownian(1e-3)
    asked = []

    def counting(games):
        asked.extend(games)
        return play(games)

    found = split(counting, 30, 6, range(3), 5)
    assert sum(r.n_games for r in found) == len(asked) == len(set(asked))
    for r in found:
        assert r.levels == sorted(r.levels, reverse=True)
        assert all(share >= 6 / 30 for share in r.shares)
        assert 1 <= r.n_ancestors <= 30
        assert r.probability == pytest.approx(np.prod([1 - s for s in r.shares]) * len(r.failures) / 30)
        seeds = range(5 + 30 * r.number, 5 + 30 * r.number + 30)
        for failed in r.failures:
            assert failed.game.seed in seeds
            assert play([failed.game])[0].verdict == failed.verdict


def test_repetitions_do_not_depend_on_how_many_there_are():
    play, _ = chain(1e-2)
    many = split(play, 20, 5, range(4), 1)
    assert [r.probability for r in split(play, 20, 5, [1, 0], 1)] == [r.probability for r in many[1::-1]]


def test_where_no_game_comes_nearer_the_repetition_dies_out():
    play, _ = chain(1e-2)

    def blind(games):
        return [p.__class__(p.game, p.verdict.__class__(1.0, [0], [1.0]), 1.0, 0.0, "") for p in play(games)]

    (found,) = split(blind, 10, 2, [0], 1)
    assert (found.is_extinct, found.levels, found.shares, found.failures) == (True, [1.0], [1.0], [])


def test_interval_of_few_estimates():
    assert interval([0.0, 0.0]) == (0.0, 0.0, 1.0)
    assert interval([0.25]) == (0.25, 0.0, 1.0)
    mean, low, high = interval([1e-6, 2e-6, 3e-6])
    assert mean == pytest.approx(2e-6)
    assert low < 1e-6 < 3e-6 < high < 1.0
    assert interval([0.9, 0.1])[2] == 1.0
