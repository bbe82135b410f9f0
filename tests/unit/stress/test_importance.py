"""Importance sampling: estimates are those of closed forms, weights are bounded, and what cannot be trusted is said."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy import stats

from tussle import Simulation
from tussle.errors import MissionError, ParameterError
from tussle.mission import read_mission
from tussle.stress import Distribution, Stress
from tussle.stress.distributions import with_distributions
from tussle.stress.importance import SHARES, Proposal, estimate


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


def test_weights_are_bounded_and_have_the_mean_one():
    """Whatever was fitted: the mean weight of points of the proposal is the mass of the nominal distribution."""
    random = np.random.default_rng(1)
    proposal = Proposal(3)
    proposal.fit(random.normal(4.0, 0.2, (50, 3)), random.uniform(0.0, 1.0, 50))
    weights = proposal.weights(proposal.draw(random.normal(size=(200_000, 3))))
    assert weights.max() <= 1.0 / SHARES[0] + 1e-9
    assert weights.mean() == pytest.approx(1.0, abs=0.03)
    proposal.fit(np.zeros((1, 3)), np.ones(1))  # a single point
    assert np.isfinite(proposal.weights(np.full((1, 3), 1e3))).all()


def test_chance_in_games_with_the_same_values():
    """Games that fail with a probability that rises with a value: the mean over both kinds of luck."""
    exact = 0.5 * stats.norm.sf(4.0)
    random = np.random.default_rng(2)

    def robustness(u, _):
        left = 4.0 - u[:, 0]
        return np.where(random.uniform(size=len(u)) < 0.5, left, np.maximum(left, 0.0) + 0.5)

    found = [estimate(robustness, 1, 1000, 400, seed) for seed in range(20)]
    assert sum(each.low <= exact <= each.high for each in found) >= 17


def test_what_cannot_be_trusted_is_said():
    """Failures in a corner of many dimensions, with few games."""
    noted = estimate(lambda u, _: 9.0 - np.sort(u, axis=1)[:, -6:].sum(axis=1), 40, 60, 100, 1)
    assert any("cannot be trusted" in note or "no game" in note for note in noted.notes)
    assert not estimate(lambda u, _: 3.0 - u[:, 0], 1, 1000, 400, 1).notes


@pytest.mark.parametrize(
    ("robustness", "message"),
    [
        (lambda u: np.full(len(u), -1.0), "all of 400 games fail with values of the given distributions"),
        (
            lambda u: np.full(len(u), np.inf),
            "no failure was found: the nearest tenth of 2,800 games stays at",
        ),
        (lambda u: 1.0 + abs(u[:, 0]), "other values of the distributions lead no nearer"),
    ],
)
def test_specifications_that_fail_in_all_games_or_in_none(robustness, message):
    with pytest.raises(ParameterError, match=message):
        estimate(lambda u, _: robustness(u), 1, 1000, 400, 1)


PAIR = """<runscript name="Pair"><run end="1" dt="0.5"/>
<entity><name>left</name><count>1</count><x>${left_x=0 m}</x><motion_model>Still</motion_model></entity>
<entity><name>right</name><count>1</count><x>${right_x=20}</x><motion_model>Still</motion_model></entity>
</runscript>"""
SPEC = "always (distance(left, right) > 1 m)"
VARY = ("left_x=normal(0, 2 m)", "right_x = normal(12, 2)")


@pytest.fixture
def pair(tmp_path):
    """A mission file of two robots."""
    file = tmp_path / "pair.xml"
    file.write_text(PAIR)
    return file


def test_two_start_positions_of_a_mission_file(pair, tmp_path):
    """The least distance of two normal positions; a study that was killed ends as it would have."""
    sd = 2.0 * np.sqrt(2.0)
    exact = stats.norm.cdf(-11.0 / sd) - stats.norm.cdf(-13.0 / sd)
    path = tmp_path / "out"
    found = Stress(pair, SPEC, vary=VARY).importance(300, 100, directory=path, processes=1)
    assert found.low < exact < found.high
    assert found.n_plain > 50 * found.n_games
    assert len({p.game.seed for p in found.failures}) == found.n_failed
    text, lines = (path / "result.json").read_text(), (path / "games.jsonl").read_text()
    assert json.loads(text)["probability"] == found.value
    (path / "games.jsonl").write_text(lines[: len(lines) // 2])
    again = Stress(pair, SPEC, vary=VARY).importance(300, 100, directory=path, processes=1, stack=7)
    assert (again.value, (path / "result.json").read_text()) == (found.value, text)
    assert (path / "games.jsonl").read_text().count("\n") == lines.count("\n") == found.n_games
    loaded = read_mission(path / "failures/0.xml")
    (ended,) = Simulation(loaded.mission, loaded.seed).run()
    assert ended.state_hash == found.failures[0].state_hash


@pytest.mark.parametrize(
    ("vary", "message"),
    [
        ((), "nothing varies; vary values with distributions"),
        (("left_x=0:3",), "left_x varies without a distribution; write left_x=normal"),
        (("left_x=gaus(0, 1)",), "there is no distribution 'gaus'"),
        (("left_x=normal(0, 0)",), "is not allowed; it takes .mean, sd."),
        (("left_x=normal(0, kg)",), "left_x: 'kg' is not a number"),
        (("left_x=lognormal(-1, 1)",), "with a positive width, and a positive median"),
        (("left_x=uniform(3, 1)",), "is not allowed; it takes .low, high."),
        (("left_x=normal(0, 1)", "left_x=normal(0, 2)"), "left_x varies twice"),
        (("middle=normal(0, 1)",), "middle"),
        (("run.dt=normal(0, 1)",), "the mission cannot be played"),
    ],
)
def test_distributions_that_are_none(pair, vary, message):
    with pytest.raises((ParameterError, MissionError), match=message):
        Stress(pair, SPEC, vary=vary).importance(100, 100, processes=1)


def test_each_method_says_what_it_takes(pair):
    study = Stress(pair, SPEC, vary=VARY)
    with pytest.raises(ParameterError, match="a search takes ranges"):
        study.search(10)
    for method in (study.probability, study.sample):
        with pytest.raises(ParameterError, match="or `importance` for distributions"):
            method()


def test_values_of_distributions():
    def values(text):
        (one,), _ = with_distributions([f"v={text}"])
        return [one.value_at(u) for u in (-1.0, 0.0, 1.0)], one.setting(one.value_at(0.0))

    assert values("normal(10, 2 kt)") == ([8.0, 10.0, 12.0], "10.0 kt")
    assert values("normal(1e1,2)")[0] == [8.0, 10.0, 12.0]
    low, middle, high = values("lognormal(4 m, 0.5)")[0]
    assert (middle, high / middle, middle / low) == (
        4.0,
        pytest.approx(np.exp(0.5)),
        pytest.approx(np.exp(0.5)),
    )
    assert values("uniform(2, 4)")[0] == pytest.approx([2 + 2 * stats.norm.cdf(u) for u in (-1, 0, 1)])
    assert with_distributions({"a": "normal(1, 2)", "b": (1, 2)})[1] == {"b": (1, 2)}
    assert with_distributions({"a": Distribution("", "normal", 1.0, 2.0)})[0][0].setting(1.5) == 1.5
