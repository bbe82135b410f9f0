"""What batches, their analysis and their reports show if no quantity is asked for."""

from __future__ import annotations

import numpy as np
import pytest
from made_batches import made_batch
from reported_batches import texts_of

from tussle.batch.analysis import analyse
from tussle.batch.results import Results
from tussle.batch.statistics import mean_of
from tussle.batch.variables import Choice, Range

POINTS = [{"uav": n, "tactic": tactic} for n in (4, 10, 30) for tactic in ("lanes", "random")]
VARIABLES = [Range("uav", 4, 30, is_int=True), Choice("tactic", ("lanes", "random"))]
UAV = np.array([point["uav"] for point in POINTS], dtype=float)


SHARE = np.clip(UAV / 30.0 + np.random.default_rng(1).normal(0.0, 0.05, (8, 6)), 0.0, 1.0)


def stored_patrol(scores=None, dead=0, metrics=None, end=(100.0,) * 6):
    """A study in which the number of UAVs and their tactic vary, and some of the UAVs die."""
    alive = {
        run: [(1, 0.0, int(UAV[run % 6])), (1, end[run % 6], int(UAV[run % 6]) - dead * (run % 3))]
        for run in range(48)
    }
    metrics = {"Guard.share": {None: SHARE}} if metrics is None else metrics
    return made_batch(scores or {}, variables=VARIABLES, points=POINTS, metrics=metrics, alive=alive)


def patrol(*given, **options):
    return Results(stored_patrol(*given, **options))


def test_the_number_that_varies_is_no_result():
    found = patrol()
    assert found.defaults.all == ["Guard.share"]
    said = analyse(found)
    assert said.quantities == ["Guard.share"] == [mean.name for mean in said.points[0].means]


def test_what_a_metric_repeats_of_the_varied_values_is_no_result():
    knots = {None: np.tile(UAV / 0.514444, (8, 1))}
    assert patrol(metrics={"A.knots": knots, "Guard.share": {None: SHARE}}).defaults.all == ["Guard.share"]
    assert patrol(metrics={"A.knots": knots}, end=tuple(UAV)).defaults.leading == ["A.knots"], "nothing else"


def test_the_time_at_the_end_is_no_result_where_it_is_what_varies():
    assert "t" not in patrol(end=tuple(10.0 * UAV)).defaults.all
    assert "t" in patrol(end=(50.0, 60.0, 50.0, 60.0, 70.0, 50.0)).defaults.all


def test_losses_stand_for_what_is_left_where_not_all_games_start_with_as_many():
    assert patrol(dead=1).defaults.all == ["Guard.share", "lost[1]"]
    same = {"Guard.share": {None: np.ones((8, 6))}}
    assert patrol(dead=1, metrics=same).defaults.leading == ["lost[1]"]
    assert patrol(metrics=same).defaults.all == ["Guard.share"], "nobody died"


def test_scores_come_first_and_a_metric_of_the_study_behind_them():
    scores = {1: 10.0 * SHARE, 2: 3.0 * SHARE**2}
    assert patrol(scores).defaults.leading == ["score[1]", "score[2]", "Guard.share"]
    assert patrol({1: 0.0 * SHARE, 2: 0.0 * SHARE}).defaults.leading == ["Guard.share"], "nobody scores"


def test_parts_and_copies_of_scores_are_shown_once():
    score = np.round(10.0 * SHARE)
    parts = {"M.score": {1: score}, "M.hits": {1: score}, "N.hits": {1: score}, "N.other": {1: score**2}}
    assert patrol({1: score, 2: 0.0 * score}, metrics=parts).defaults.leading == ["score[1]", "N.other[1]"]


def test_counts_of_networks_are_shown_only_alone():
    network = {name: {None: SHARE * 100.0 + i} for i, name in enumerate(("Radio.sent", "Radio.delivered"))}
    assert patrol(metrics=network).defaults.leading == ["Radio.delivered", "Radio.sent"]
    assert patrol(metrics=network | {"Guard.share": {None: SHARE}}).defaults.leading == ["Guard.share"]


def test_a_quantity_that_is_asked_for_in_two_spellings_is_one():
    found = patrol(metrics={"Guard.hits": {1: SHARE}})
    assert analyse(found, ["Guard.hits", " Guard.hits[1] "]).quantities == ["Guard.hits[1]"]


@pytest.mark.parametrize("independent", [False, True])
@pytest.mark.parametrize("n_seeds", [3, 8, 40])
def test_intervals_of_shares_are_within_zero_and_one(n_seeds, independent):
    share = np.minimum(1.0, 0.9 + np.random.default_rng(2).exponential(0.1, (n_seeds, 6)))
    share[0] = 0.7
    results = Results(
        made_batch(
            {}, variables=VARIABLES, points=POINTS, metrics={"G.s": {None: share}}, independent=independent
        )
    )
    every = [*results.means(["G.s"]), *results.means_by_point("G.s"), *results.means(["G.s"], point=1)]
    every += results.means(["G.s / 2 + t / 200"])
    for mean in every:
        assert 0.0 <= mean.low < mean.value < mean.high <= 1.0
    found = results.compare("G.s", "uav=4, tactic=lanes", "uav=30, tactic=lanes")
    assert -1.0 <= found.low <= found.high <= 1.0


def test_a_share_that_is_always_one_has_an_interval():
    mean = Results(made_batch({}, metrics={"G.all": {None: np.ones((10, 1))}})).means(["G.all"])[0]
    assert (mean.low, mean.high) == pytest.approx((0.7225, 1.0), abs=1e-3)


def test_intervals_of_shares_contain_the_truth():
    rng = np.random.default_rng(3)
    n_inside = 0
    for _ in range(400):
        share = (
            rng.binomial(10, rng.beta(19.0, 1.0, (12, 1))) / 10.0
        )  # as if ten intruders of a game had the same luck
        mean = mean_of("G.s", share.ravel(), is_share=True)
        n_inside += mean.low <= 0.95 <= mean.high
    assert n_inside / 400 > 0.92


def test_reports_name_the_metric_of_the_study_first():
    said = texts_of(stored_patrol())
    assert said.startswith("On average, Guard.share was ")
    assert "uav left" not in said
