"""All that is said about a batch at once."""

from __future__ import annotations

import json
import math

import numpy as np
from made_batches import made_batch

from tussle.batch.analysis import analyse
from tussle.batch.results import Results
from tussle.batch.sampling import sample
from tussle.batch.sensitivity import Effect
from tussle.batch.variables import Choice, Range
from tussle.errors import MissingExtraError

TACTIC = Choice("tactic", ("keep", "switch", "rest"))
SPEED = Range("speed", 20.0, 30.0, levels=2)


def batch(variables, method="", n_seeds=25, n=None, **options):
    points = sample(variables, method, n, seed=1) if variables else [{}]
    rng = np.random.default_rng(1)
    scores = {1: np.zeros((n_seeds, len(points))), 2: rng.poisson(9.0, (n_seeds, len(points)))}
    return Results(made_batch(scores, variables=variables, points=points, sample=method, **options))


def test_a_batch_without_variables_has_shares_and_means_only():
    results = batch([])
    found = analyse(results)
    assert (found.n_runs, found.n_points, found.n_seeds, found.first_seed) == (25, 1, 25, 1)
    assert found.shares == results.shares()
    assert found.means == results.means()
    assert found.titles["score[2]"] == "score of keepers"
    assert [found.points, found.comparisons, found.sensitivity, found.failures, found.notes] == [
        [],
        [],
        {},
        [],
        [],
    ]


def test_without_scores_points_are_looked_at_by_what_is_left():
    alive = {run: [(1, 0.0, 50), (1, 5.0, run)] for run in range(20)}
    hits = {"A.hits": {None: np.ones((10, 2))}}
    points = [{"speed": 20.0}, {"speed": 30.0}]
    results = Results(made_batch({}, metrics=hits, alive=alive, variables=[SPEED], points=points))
    assert [mean.name for mean in analyse(results).points[0].means] == ["alive[1]"]


def test_what_is_asked_to_be_compared_is():
    found = analyse(
        batch([TACTIC, SPEED], "grid"), ["t", "score[2]"], [("speed=20", "speed=30"), ("0", "5")]
    ).comparisons
    assert [(c.quantity, c.a, c.b) for c in found] == [
        ("t", "speed=20", "speed=30"),
        ("score[2]", "speed=20", "speed=30"),
        ("t", "tactic=keep, speed=20", "tactic=rest, speed=30"),
        ("score[2]", "tactic=keep, speed=20", "tactic=rest, speed=30"),
    ]


def test_failed_runs_are_grouped_by_what_was_said():
    failed = {3: "boom", 4: "bang", 9: "boom", 44: "boom"}
    found = analyse(batch([SPEED], failed=failed)).failures
    assert [(f.error, f.n, f.run, f.seed, f.point) for f in found] == [
        ("boom", 3, 3, 2, "speed=30"),
        ("bang", 1, 4, 3, "speed=20"),
    ]


def test_a_missing_package_is_noted_once_and_the_ranks_are_there(monkeypatch):
    results = batch([Range("x", 0.0, 1.0), Range("y", 0.0, 1.0)], "saltelli", n_seeds=1, n=32)

    def missing(_):
        raise MissingExtraError("parts of the variance need SALib")

    monkeypatch.setattr(results, "sensitivity", missing)
    found = analyse(results, ["score[2]", "score[2]*2"])
    assert found.notes == ["parts of the variance need SALib"]
    assert [e.variable for e in found.sensitivity["score[2]"]] == ["x", "y"]
    assert all(
        isinstance(e, Effect) and not math.isnan(e.rank_correlation) for e in found.sensitivity["score[2]*2"]
    )


def test_it_is_json_without_numbers_that_json_does_not_have():
    found = analyse(batch([TACTIC, SPEED], "grid", failed=dict.fromkeys(range(0, 150, 6), "boom")))
    text = json.dumps(found.as_dict(), allow_nan=False)
    again = json.loads(text)
    assert again["points"][0]["means"][0]["value"] is None  # all runs of this point failed
    assert again["points"][1]["means"][0]["quantiles"]["0.5"] == found.points[1].means[0].quantiles[0.5]
    assert again["shares"][0]["name"] == "prey"
    assert again["variables"][1] == {
        "kind": "range", "is_text": False, "name": "speed",
        "low": 20.0, "high": 30.0, "is_int": False, "is_log": False, "levels": 2, "unit": "",
    }  # fmt: skip
