"""Probabilities by splitting are those of closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from walks import PROCESSES, brownian, chain, gap

from tussle.numeric.kernel import collecting_later
from tussle.stress.splitting import interval, split


@pytest.mark.parametrize("process", PROCESSES)
@pytest.mark.parametrize("p", [1e-2, 1e-4])
def test_the_mean_of_estimates_is_the_exact_probability(process, p):
    play, exact = process(p)
    found = [r.probability for r in split(play, 40, 10, 40, 1)]
    error = np.std(found, ddof=1) / math.sqrt(len(found))
    assert abs(np.mean(found) - exact) < 4.0 * error
    assert error < 0.4 * exact


@pytest.mark.slow
@pytest.mark.parametrize("process", PROCESSES)
@pytest.mark.parametrize("p", [1e-2, 1e-4])
def test_intervals_cover_the_exact_probability(process, p):
    """90 to 99 of 100 studies."""
    play, exact = process(p)
    n = {chain: 200, gap: 50}.get(process, 100)
    with collecting_later():  # millions of objects stay, and none is garbage
        repetitions = split(play, n, n // 4, 2000, 1)
    covered = 0
    for k in range(100):
        _, low, high = interval([r.probability for r in repetitions[20 * k : 20 * k + 20]])
        covered += low <= exact <= high
    print(f"{process.__name__} {exact:.2g}: {covered} of 100 intervals cover")
    assert 90 <= covered <= 100


def test_a_repetition_counts_its_games_and_their_ancestors():
    play, _ = brownian(1e-3)
    asked = []

    def counting(games):
        asked.extend(games)
        return play(games)

    found = split(counting, 30, 6, 3, 5)
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
    many = split(play, 20, 5, 4, 1)
    assert [r.probability for r in split(play, 20, 5, 2, 1)] == [r.probability for r in many[:2]]


def test_where_no_game_comes_nearer_the_repetition_dies_out():
    play, _ = chain(1e-2)

    def blind(games):
        return [p.__class__(p.game, p.verdict.__class__(1.0, [0], [1.0]), 1.0, 0.0, "") for p in play(games)]

    (found,) = split(blind, 10, 2, 1, 1)
    assert (found.is_extinct, found.levels, found.shares, found.failures) == (True, [1.0], [1.0], [])


def test_interval_of_few_estimates():
    assert interval([0.0, 0.0]) == (0.0, 0.0, 1.0)
    assert interval([0.25]) == (0.25, 0.0, 1.0)
    mean, low, high = interval([1e-6, 2e-6, 3e-6])
    assert mean == pytest.approx(2e-6)
    assert low < 1e-6 < 3e-6 < high < 1.0
    assert interval([0.9, 0.1])[2] == 1.0
