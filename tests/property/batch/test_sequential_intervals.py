"""Intervals that may be looked at at any time, and answers that are read off them, are wrong no more often than they say."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tussle.batch.plan import BatchPlan
from tussle.batch.sequential import FIRST_SEEDS, Question, SequentialStop
from tussle.batch.sequential_intervals import bounded_interval, normal_interval, sequential_interval
from tussle.batch.statistics import mean_interval, wilson
from tussle.batch.target import Layout, Target, answers_of
from tussle.batch.tasks import Finished
from tussle.batch.variables import Choice, Range

ALPHA = 0.05
LOOKS = [int(5 * 1.25**i) for i in range(22)]
"""Numbers of games at which somebody looks: 5 to 542."""


def ever_wrong(draw, mean, interval, n_batches, seed=1):
    """Part of the batches in which the interval does not hold the mean at some look."""
    rng = np.random.default_rng(seed)
    wrong = 0
    for _ in range(n_batches):
        values = draw(rng, LOOKS[-1])
        for n in LOOKS:
            low, high = interval(values[:n])
            if not low <= mean <= high:
                wrong += 1
                break
    return wrong / n_batches


SHARES = {
    "bernoulli 0.5": (lambda rng, n: (rng.random(n) < 0.5).astype(float), 0.5),
    "bernoulli 0.95": (lambda rng, n: (rng.random(n) < 0.95).astype(float), 0.95),
    "beta": (lambda rng, n: rng.beta(8.0, 2.0, n), 0.8),
    "rarely nothing": (lambda rng, n: np.where(rng.random(n) < 0.03, 0.0, 1.0), 0.97),
}


@pytest.mark.parametrize("name", SHARES)
def test_the_interval_of_a_share_holds_it_at_all_looks(name):
    draw, mean = SHARES[name]
    assert ever_wrong(draw, mean, lambda v: bounded_interval(v, ALPHA), 100) <= ALPHA


def test_the_interval_of_a_normal_mean_holds_it_at_all_looks():
    assert (
        ever_wrong(lambda rng, n: rng.normal(3.0, 2.0, n), 3.0, lambda v: normal_interval(v, ALPHA), 1000)
        <= ALPHA
    )


def test_intervals_for_one_look_do_not():
    assert ever_wrong(*SHARES["bernoulli 0.5"], lambda v: wilson(v.sum(), len(v)), 100) > 2.0 * ALPHA
    assert ever_wrong(lambda rng, n: rng.normal(size=n), 0.0, mean_interval, 20) > 2.0 * ALPHA


def test_the_interval_of_zeros_and_ones_is_that_of_robbins():
    # A mean m is inside as long as B(k + 1/2, n - k + 1/2) / B(1/2, 1/2) < m^k (1 - m)^(n - k) / alpha.
    k, n = 37, 50
    for end in bounded_interval(np.array([1.0] * k + [0.0] * (n - k)), ALPHA):
        log_beta = math.lgamma(k + 0.5) + math.lgamma(n - k + 0.5) - math.lgamma(n + 1.0) - math.log(math.pi)
        assert log_beta == pytest.approx(
            k * math.log(end) + (n - k) * math.log1p(-end) - math.log(ALPHA), abs=1e-4
        )


def test_equal_values_have_a_width():
    assert bounded_interval(np.ones(50), ALPHA)[0] < 0.95
    low, high = sequential_interval(np.full(50, 3.0), ALPHA, (0.0, 10.0))
    assert low < 3.0 < high
    assert sequential_interval(np.full(50, 3.0), ALPHA, (3.0, 3.0)) == (3.0, 3.0)
    assert sequential_interval(np.full(5, 3.0), ALPHA, (0.0, 10.0)) == (-math.inf, math.inf)
    assert sequential_interval(np.empty(0), ALPHA, (-math.inf, math.inf)) == (-math.inf, math.inf)


def game(number, values):
    share = float(values.ravel()[number])
    return Finished(number, "time", 1.0, 1, None, "", "", 0.0, "", [(None, "Guard.share", share)], [])


def played(stop, plan, values):
    """Play the rounds of a stop with given values by seed and point, and return the number of games."""
    done = set()
    for needed in stop.rounds():
        for number in needed:
            if number not in done:
                stop.add(game(number, values))
        done.update(needed)
    return np.array(sorted(done))


@pytest.mark.parametrize("kind", ["bernoulli", "normal"])
def test_an_answer_is_wrong_no_more_often_than_it_says(kind):
    means = np.array([0.4, 0.6, 0.7, 0.95, 1.0])
    points = [{"n": n} for n in (4, 8, 12, 16, 20)]
    plan = BatchPlan(points, 300)
    target, rng, wrong, decided, games = (
        Target.parse("Guard.share >= 0.8"),
        np.random.default_rng(7),
        0,
        0,
        [],
    )
    n_batches = 40
    for _ in range(n_batches):
        if kind == "bernoulli":
            values = (rng.random((300, 5)) < means).astype(float)
        else:
            values = rng.normal(means, 0.1, (300, 5))
        variables = [Range("n", 4, 20, is_int=True)]
        stop = SequentialStop(Question(target), plan, variables)
        numbers = played(stop, plan, values)
        known = np.full((300, 5), np.nan)
        known.ravel()[numbers] = values.ravel()[numbers]
        (answer,) = answers_of(target, "", Layout.of(variables, points), points, known).answers
        first, smallest = answer.at_least, answer.smallest
        wrong += not (first is not None and first.low <= 16 and (smallest is None or smallest.low >= 16))
        decided += answer.is_decided
        assert stop.is_met == answer.is_decided
        games.append(len(numbers))
        assert np.isfinite(known[:, 0]).sum() < 100 > FIRST_SEEDS  # far from the target, little is played
    assert wrong <= ALPHA * n_batches
    assert decided > 0.5 * n_batches
    assert np.mean(games) < 0.7 * 300 * 5


def test_rounds_do_not_depend_on_the_order_of_the_games():
    points = [{"tactic": t, "n": n} for t in ("lanes", "random") for n in (1, 2, 3)]
    variables = [Choice("tactic", ("lanes", "random")), Choice("n", (1, 2, 3))]
    plan = BatchPlan(points, 200)
    values = (np.random.default_rng(3).random((200, 6)) < [0.2, 0.6, 0.9, 0.1, 0.5, 0.55]).astype(float)
    question = Question(Target.parse("Guard.share >= 0.5"))
    numbers = played(SequentialStop(question, plan, variables), plan, values)
    backwards = SequentialStop(question, plan, variables)
    for number in reversed(numbers.tolist()):  # as if all were finished before, by a process that was killed
        backwards.add(game(number, values))
    assert list(backwards.rounds())[-1] == numbers.tolist()
