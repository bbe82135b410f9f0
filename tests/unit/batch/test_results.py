"""The results of a batch: tables, arrays, and statistics over all runs or one point."""

from __future__ import annotations

import math
import time

import bowl
import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest
from made_batches import START, made_batch, with_table, write_batch

from tussle.batch import Batch, InProcess, load_batch
from tussle.batch.results import Results
from tussle.batch.schemas import RESULTS
from tussle.batch.statistics import mean_interval, mean_of, wilson
from tussle.batch.variables import Choice, Range
from tussle.errors import ParameterError

GRID = [Choice("tactic", ("keep", "switch")), Range("speed", 20.0, 30.0, levels=2, unit="kt")]
POINTS = [{"tactic": tactic, "speed": speed} for tactic in ("keep", "switch") for speed in (20.0, 30.0)]


def scores(n_seeds, n_points=1, seed=1):
    """Scores of two teams, ties among them."""
    rng = np.random.default_rng(seed)
    return {2: rng.poisson(5.0, (n_seeds, n_points)), 3: rng.poisson(4.0, (n_seeds, n_points))}


@pytest.fixture
def grid():
    """Thirty seeds at four points; three runs failed."""
    return Results(
        made_batch(
            scores(30, 4),
            variables=GRID,
            points=POINTS,
            sample="grid",
            failed={5: "boom", 6: "bang", 41: "boom"},
        )
    )


# -- tables ---------------------------------------------------------------------------------------------------------------


def test_there_is_one_row_per_run_with_all_that_is_known_of_it():
    given = scores(4)
    hits = {2: [[1.5], [2.5], [3.5], [4.5]], None: [[7.0], [8.0], [9.0], [10.0]]}
    results = Results(made_batch(given, metrics={"Cap.hits": hits, "my metric.x": {3: np.ones((4, 1))}}))
    runs = results.runs.to_pydict()
    assert runs["run"] == [0, 1, 2, 3]
    assert runs["seed"] == [1, 2, 3, 4]
    assert runs["score[2]"] == given[2].ravel().tolist()
    assert runs["Cap.hits[2]"] == [1.5, 2.5, 3.5, 4.5]
    assert runs["Cap.hits"] == [7.0, 8.0, 9.0, 10.0]
    assert runs['"my metric.x"[3]'] == [1.0] * 4
    assert runs["state_hash"] == [f"{run:016x}" for run in range(4)]
    assert runs["lost[1]"] == [START[1] - 17.0] * 4
    assert results.quantities[:4] == ["wins[2]", "wins[3]", "ties", "score[2]"]
    assert set(results.quantities) <= set(runs)
    assert (results.n_runs, results.n_failed, results.n_planned) == (4, 0, 4)
    assert results.teams == {1: "prey", 2: "keepers", 3: "switchers"}


def test_the_order_of_the_rows_does_not_matter(grid):
    stored = made_batch(
        scores(30, 4), variables=GRID, points=POINTS, failed={5: "boom", 6: "bang", 41: "boom"}
    )
    mixed = np.random.default_rng(1).permutation(stored.table.num_rows)
    again = Results(with_table(stored, stored.table.take(pa.array(mixed))))
    pd.testing.assert_frame_equal(again.frame("pandas"), grid.frame("pandas"))


def test_failed_runs_have_no_numbers_but_a_row(grid):
    assert grid.n_failed == 3
    for name in grid.quantities:
        assert np.flatnonzero(np.isnan(grid.quantity(name))).tolist() == [5, 6, 41]
    failed = grid.failed().to_pydict()
    assert failed["run"] == [5, 6, 41]
    assert failed["error"] == ["boom", "bang", "boom"]
    assert failed["tactic"] == [POINTS[run % 4]["tactic"] for run in (5, 6, 41)]


def test_a_batch_that_goes_on_has_the_runs_that_are_finished():
    results = Results(made_batch(scores(10, 2), points=[{}, {}], missing=[0, 7, 19]))
    assert (results.n_runs, results.n_planned) == (17, 20)
    assert [run for run in range(20) if run not in results.runs["run"].to_pylist()] == [0, 7, 19]
    assert np.isnan(results.by_seed("score[2]")).sum() == 3
    assert sum(share.n for share in results.shares()) == results.shares()[0].of == 17


def test_a_batch_without_a_finished_run_says_nothing_and_fails_nowhere():
    results = Results(
        made_batch(scores(3, 4), variables=GRID, points=POINTS, sample="grid", missing=range(12))
    )
    assert (results.n_runs, results.n_planned, len(results.points)) == (0, 12, 4)
    assert results.shares() == []
    assert math.isnan(results.means(["t"])[0].value)
    assert math.isnan(results.survival(1).mean[0])
    assert results.by_seed("t").shape == (0, 4)
    assert math.isnan(results.compare("t", 0, 1).difference)
    assert all(math.isnan(e.rank_correlation) for e in results.sensitivity("t"))
    assert results.failed().num_rows == results.slowest().num_rows == 0


def test_a_batch_directory_is_loaded(tmp_path, grid):
    stored = made_batch(
        scores(30, 4), variables=GRID, points=POINTS, sample="grid", failed={5: "boom", 6: "bang", 41: "boom"}
    )
    loaded = load_batch(write_batch(stored, tmp_path / "batch"))
    pd.testing.assert_frame_equal(loaded.frame("pandas"), grid.frame("pandas"))
    assert loaded.variables == grid.variables == GRID
    assert loaded.points == POINTS
    assert (
        repr(loaded)
        == f"<Results {str(tmp_path / 'batch')!r}: 120 of 120 runs, 4 points of tactic, speed, 3 failed>"
    )


def test_values_of_a_choice_stay_what_they_were():
    mixed = [Choice("n", (5, "many", True, 0.5)), Choice("end", (1, 2)), Choice("ties", (7,))]
    points = [{"n": n, "end": 1 + i % 2, "ties": 7} for i, n in enumerate((5, "many", True, 0.5))]
    results = Results(made_batch(scores(1, 4), variables=mixed, points=points))
    assert results.points == points
    assert [type(p["n"]) for p in results.points] == [int, str, bool, float]
    assert results.runs["varied end"].to_pylist() == [1, 2, 1, 2]  # a run has an end of its own
    assert results.runs["end"].to_pylist() == ["time"] * 4
    assert results.runs["varied ties"].to_pylist() == [7] * 4
    assert results.runs["ties"].to_pylist() == results.quantity("ties").tolist()
    assert results.label(1) == "n=many, end=2, ties=7"


def test_labels_and_titles_are_for_people(grid):
    assert [grid.label(point) for point in (0, 3)] == [
        "tactic=keep, speed=20 kt",
        "tactic=switch, speed=30 kt",
    ]
    assert grid.title("score[2]-score[9]") == "score of keepers - score of [9]"
    assert grid.title("wins[-1]") == "wins of [-1]"
    assert Results(made_batch(scores(1))).label(0) == ""


def test_the_slowest_runs_are_those_that_took_longest(grid):
    slowest = grid.slowest(3)
    assert slowest["cpu_s"].to_pylist() == [7.0, 7.0, 7.0]
    assert slowest["run"].to_pylist() == [6, 13, 20]


def test_runs_are_handed_out_as_frames(grid):
    assert isinstance(grid.frame(), pd.DataFrame)
    assert grid.frame("polars")["score[2]"].to_list()[:3] == grid.quantity("score[2]")[:3].tolist()
    assert isinstance(grid.frame("polars"), pl.DataFrame)
    with pytest.raises(ParameterError, match="did you mean 'pandas'"):
        grid.frame("panda")


# -- numbers --------------------------------------------------------------------------------------------------------------


def test_shares_count_the_games_that_did_not_fail(grid):
    given = scores(30, 4)
    known = np.ones(120, bool)
    known[[5, 6, 41]] = False
    more = (given[2] > given[3]).ravel()[known].sum()
    found = {share.name: share for share in grid.shares()}
    assert list(found) == ["keepers", "switchers", "ties"]
    assert (found["keepers"].n, found["keepers"].of, found["keepers"].team) == (more, 117, 2)
    assert found["ties"].n == (given[2] == given[3]).ravel()[known].sum()
    at_point = {share.name: share for share in grid.shares(1)}
    assert at_point["keepers"].of == 28
    assert at_point["keepers"].n == np.nansum(grid.by_seed("wins[2]")[:, 1])
    assert (at_point["keepers"].low, at_point["keepers"].high) == wilson(at_point["keepers"].n, 28)


def test_games_without_scores_have_no_winners():
    results = Results(made_batch({}, metrics={"Cap.hits": {None: np.ones((3, 1))}}))
    assert results.shares() == []
    assert not {"ties", "wins[1]"} & set(results.quantities)
    assert results.defaults.all == ["Cap.hits", "alive[1]"]


def test_means_are_those_of_the_runs(grid):
    values = grid.quantity("score[2]")
    mean = grid.means(["score[2]"], point=2)[0]
    of_point = values[2::4][np.isfinite(values[2::4])]
    assert (mean.n, mean.value) == (len(of_point), pytest.approx(of_point.mean()))
    assert (mean.low, mean.high) == mean_interval(of_point)
    assert [mean.name for mean in grid.means()] == [
        "score[2]",
        "score[3]",
        "alive[1]",
    ]


def test_all_points_at_once_are_what_each_is_by_itself(grid):
    for point in range(4):
        assert grid.shares_by_point()[point] == grid.shares(point)
        alone, together = grid.means(["score[2]"], point)[0], grid.means_by_point("score[2]")[point]
        assert (together.low, together.high) == pytest.approx((alone.low, alone.high), rel=1e-12)
    n, n_failed = grid.n_runs_by_point()
    assert n.tolist() == [30, 28, 29, 30]
    assert n_failed.tolist() == [0, 2, 1, 0]


def test_over_points_the_runs_of_a_seed_count_as_one_block():
    luck = np.random.default_rng(2).normal(size=(30, 1))
    batch = {"variables": GRID, "points": POINTS}
    shared = {2: luck + np.zeros((30, 4)), 3: np.zeros((30, 4))}
    mean = Results(made_batch(shared, **batch)).means(["score[2]"])[0]
    assert (mean.low, mean.high) == pytest.approx(mean_interval(luck.ravel()))
    share = Results(made_batch(shared, **batch)).shares()[0]
    assert (share.low, share.high) == pytest.approx(wilson(share.n / 4, 30), abs=0.01)
    apart = Results(made_batch(shared, independent=True, **batch))
    assert apart.means(["score[2]"])[0].high < mean.high - 0.1
    assert (apart.shares()[0].low, apart.shares()[0].high) == wilson(share.n, 120)


def test_a_quantity_can_be_asked_of_some_runs(grid):
    values = grid.quantity("score[2] - score[3]")
    np.testing.assert_array_equal(grid.quantity("score[2] - score[3]", [7, 0]), values[[7, 0]])
    with pytest.raises(ParameterError, match="run 120 is not among the 120 finished runs"):
        grid.quantity("t", [3, 120])


@pytest.mark.parametrize(
    "ask",
    [lambda r: r.shares(4), lambda r: r.means(point=-1), lambda r: r.label(9), lambda r: r.survival(1, 4)],
)
def test_a_point_that_is_not_there_is_told(grid, ask):
    with pytest.raises(ParameterError, match=r"there is no point -?\d; there are points 0 to 3"):
        ask(grid)


# -- comparisons ----------------------------------------------------------------------------------------------------------


def test_points_are_compared_seed_by_seed(grid):
    found = grid.compare("score[2]", 0, 1)
    matrix = grid.by_seed("score[2]")
    more = (matrix[:, 1] - matrix[:, 0])[np.isfinite(matrix[:, :2]).all(axis=1)]
    assert (found.a, found.b) == ("tactic=keep, speed=20 kt", "tactic=keep, speed=30 kt")
    assert (found.n, found.n_greater, found.n_less) == (28, (more > 0).sum(), (more < 0).sum())
    assert found.difference == pytest.approx(more.mean())


def test_values_are_compared_over_all_points_that_agree_in_the_rest():
    luck = np.random.default_rng(3).normal(scale=5.0, size=(30, 1))
    effect = np.array([0.0, 10.0, 1.0, 11.0])  # one for the tactic, ten for the speed
    results = Results(made_batch({2: luck + effect, 3: np.zeros((30, 4))}, variables=GRID, points=POINTS))
    tactic, speed = (
        results.compare("score[2]", *names)
        for names in (("tactic=keep", "tactic=switch"), ("speed=20", "speed=30"))
    )
    assert (tactic.n, tactic.n_greater, tactic.difference) == (60, 60, pytest.approx(1.0))
    assert (tactic.low, tactic.high) == pytest.approx((1.0, 1.0))  # the luck of a seed is in both
    assert speed.difference == pytest.approx(10.0)
    assert (tactic.a, tactic.b) == ("tactic=keep", "tactic=switch")


def test_means_of_both_sides_differ_by_the_difference_also_where_runs_are_missing():
    luck = np.random.default_rng(3).normal(size=(30, 1))
    effect = np.array([0.0, 10.0, 1.0, 11.0])
    failed = {4 * seed + 1: "boom" for seed in range(20)}
    values = {2: luck + effect, 3: np.zeros((30, 4))}
    results = Results(made_batch(values, variables=GRID, points=POINTS, failed=failed))
    found = results.compare("score[2]", "tactic=keep", "tactic=switch")
    assert found.n == 40
    assert found.difference == pytest.approx(found.mean_b - found.mean_a)


def test_pairs_of_a_seed_count_as_one_block():
    luck = np.random.default_rng(4).normal(size=(30, 1))  # for the second tactic, at both speeds
    results = Results(
        made_batch({2: luck * [0, 0, 1, 1], 3: np.zeros((30, 4))}, variables=GRID, points=POINTS)
    )
    found = results.compare("score[2]", "tactic=keep", "tactic=switch")
    assert found.n == 60
    assert (found.low, found.high) == pytest.approx(mean_interval(luck.ravel()))


def test_selecting_points_by_text(grid):
    assert grid.select("speed=30 kt") == [1, 3]


# -- size -----------------------------------------------------------------------------------------------------------------


def test_large_batches_are_tabled_without_a_loop_over_runs():
    n_runs, n_metrics = 100_000, 10
    rng = np.random.default_rng(5)
    run = np.repeat(np.arange(n_runs, dtype=np.int64), n_metrics)
    columns = {
        "run": run, "point": np.zeros(len(run), np.int32), "seed": run.astype(np.uint64) + np.uint64(1),
        "team": pa.array(np.tile(np.arange(n_metrics, dtype=np.int32) % 3 + 1, n_runs)),
        "metric": pa.array([f"A.m{i}" for i in range(n_metrics)]).take(pa.array(np.tile(np.arange(n_metrics), n_runs))),
        "value": rng.random(len(run)), "end": pa.array(["time"] * 1).take(pa.array(np.zeros(len(run), int))),
        "t": np.ones(len(run)), "steps": np.ones(len(run), np.int32), "winner": pa.nulls(len(run), pa.int32()),
        "state_hash": pa.nulls(len(run), pa.string()), "error": pa.nulls(len(run), pa.string()),
        "group": np.zeros(len(run), np.int32), "chance": np.zeros(len(run), np.uint8),
        "cpu_s": np.ones(len(run)), "host": pa.nulls(len(run), pa.string()),
    }  # fmt: skip
    small = made_batch(scores(1))
    design = pa.table(
        {
            "run": np.arange(n_runs),
            "point": np.zeros(n_runs, np.int32),
            "seed": np.arange(n_runs, dtype=np.uint64),
        }
    )
    table = pa.table([pa.array(columns[c.name]).cast(c.type) for c in RESULTS], schema=RESULTS)
    began = time.process_time()
    table.slice(0, table.num_rows // 20).to_pylist()
    as_objects = 20.0 * (time.process_time() - began)
    began = time.process_time()
    results = Results(with_table(small, table, design))
    spent = time.process_time() - began
    assert results.n_runs == n_runs
    np.testing.assert_array_equal(results.quantity("A.m7"), columns["value"][7::n_metrics])
    assert spent < 0.5 * as_objects  # no Python object is made of each row


# -- copies ---------------------------------------------------------------------------------------------------------------


def test_seeds_that_give_one_final_state_are_copies_and_not_observations():
    same = dict.fromkeys(range(30), "a" * 16)
    copies = Results(made_batch({2: np.full((30, 1), 3.0), 3: np.zeros((30, 1))}, hashes=same))
    distinct = Results(made_batch({2: np.full((30, 1), 3.0), 3: np.zeros((30, 1))}))
    assert (copies.n_distinct, distinct.n_distinct) == (1, 30)
    assert distinct.notes == []
    (note,) = copies.notes
    assert "29 of 30 runs are copies" in note
    share, mean = copies.shares()[0], copies.means(["score[2]"])[0]
    assert (share.n, share.of, mean.n, mean.value) == (30, 30, 30, 3.0)
    assert (share.low, share.high) == wilson(1, 1)
    assert np.isnan(mean.low)
    assert distinct.shares()[0].low == wilson(30, 30)[0]


def test_runs_with_one_final_state_and_other_results_are_no_copies():
    """A radio loses other messages in each game, which changes nothing else."""
    lost = np.array([6.0, 10.0, np.nan, 6.0, 10.0, np.nan, 7.0, -0.0]).reshape(8, 1)
    same = dict.fromkeys(range(8), "a" * 16)
    zeros = np.zeros((8, 1))
    results = Results(made_batch({2: zeros, 3: zeros}, metrics={"Radio.lost": {None: lost}}, hashes=same))
    assert results.n_distinct == 8
    mean = results.means(["Radio.lost"])[0]
    assert (mean.n, mean.low < mean.value < mean.high) == (6, True)


def test_games_that_are_alike_by_chance_are_observations():
    """Most games without a rare event end in one state; those in which nobody is left do so in each step in which the last one dies."""
    happened = (np.arange(100) % 20 == 7).astype(float)[:, None]
    scores = {2: happened, 3: np.zeros((100, 1))}
    hashes = {run: f"{int(happened[run, 0]):016x}" for run in range(100)}
    alike, apart = Results(made_batch(scores, hashes=hashes)), Results(made_batch(scores))
    assert alike.n_distinct == 100
    assert alike.notes == []
    assert alike.shares() == apart.shares()
    assert (alike.shares()[0].low, alike.shares()[0].high) == wilson(5, 100)
    assert alike.means(["score[2]"]) == apart.means(["score[2]"])


def test_copies_at_one_point_take_nothing_from_another():
    variable = Choice("tactic", ("keep", "switch"))
    luck = np.random.default_rng(1).normal(size=(20, 1))
    scores = {2: np.hstack([np.ones((20, 1)), luck]), 3: np.zeros((20, 2))}
    hashes = dict.fromkeys(range(0, 40, 2), "0" * 16)  # of the first point
    options = {"variables": [variable], "points": [{"tactic": "keep"}, {"tactic": "switch"}]}
    copied, once = (
        Results(made_batch(scores, hashes=hashes, **options)),
        Results(made_batch(scores, **options)),
    )
    assert copied.n_distinct == 21
    same, other = copied.means_by_point("score[2]")
    assert np.isnan(same.low)
    assert [other.low, other.high] == pytest.approx([(m := once.means_by_point("score[2]")[1]).low, m.high])
    assert copied.compare("score[2]", "tactic=keep", "tactic=switch") == once.compare(
        "score[2]", "tactic=keep", "tactic=switch"
    )


@pytest.mark.parametrize("n_levels", [1, 2, 9])
@pytest.mark.parametrize("differs_at", [2, 9, 15])
def test_a_variable_without_effect_makes_no_comparison_surer(n_levels, differs_at):
    """The pairs of one seed at several points share their luck: they are one sign, and one value of the interval."""
    variables = [Choice("tactic", ("keep", "switch")), Choice("paint", tuple(range(n_levels)))]
    points = [{"tactic": t, "paint": p} for t in ("keep", "switch") for p in range(n_levels)]
    luck = np.random.default_rng(2).normal(size=(15, 1))
    more = luck + np.where(np.arange(15) < differs_at, 1.0, 0.0)[:, None]
    scores = {2: np.repeat(np.hstack([luck, more]), n_levels, axis=1), 3: np.zeros((15, 2 * n_levels))}
    found = Results(made_batch(scores, variables=variables, points=points)).compare(
        "score[2]", "tactic=keep", "tactic=switch"
    )
    assert (found.n_greater, found.n_equal) == (differs_at * n_levels, (15 - differs_at) * n_levels)
    assert found.p == 2.0 ** (1 - differs_at)
    alone = mean_of("", (more - luck).ravel())
    assert [found.low, found.high] == pytest.approx([alone.low, alone.high], abs=1e-12)


def test_a_game_without_chance_gives_one_distinct_game():
    results = Batch(bowl.mission(), runs=5).play(executor=InProcess())
    assert (results.n_runs, results.n_distinct) == (5, 1)


def test_failed_runs_are_no_copies():
    same = dict.fromkeys(range(6), "a" * 16)
    results = Results(
        made_batch({2: np.ones((6, 1)), 3: np.zeros((6, 1))}, hashes=same, failed={0: "x", 1: "x"})
    )
    assert results.n_distinct == 1
    assert "3 of 6 runs are copies" in results.notes[0]
