"""Which runs a batch has, and how they are numbered."""

from __future__ import annotations

import pyarrow as pa
import pytest

from tussle.batch import Batch
from tussle.batch.plan import MAX_RUNS, BatchPlan
from tussle.errors import ParameterError
from tussle.mission import read_mission

THREE = [{"speed": 1.0}, {"speed": 2.0}, {"speed": 3.0}]


def test_runs_go_through_the_points_seed_by_seed():
    plan = BatchPlan(THREE, 2, first_seed=10)
    assert plan.table().select(["run", "point", "seed"]).to_pylist() == [
        {"run": 0, "point": 0, "seed": 10},
        {"run": 1, "point": 1, "seed": 10},
        {"run": 2, "point": 2, "seed": 10},
        {"run": 3, "point": 0, "seed": 11},
        {"run": 4, "point": 1, "seed": 11},
        {"run": 5, "point": 2, "seed": 11},
    ]
    assert [(plan.point(r), plan.seed(r)) for r in range(6)] == [
        (row["point"], row["seed"]) for row in plan.table().to_pylist()
    ]


def test_more_seeds_only_append():
    few, many = BatchPlan(THREE, 2).table(), BatchPlan(THREE, 5).table()
    assert many.slice(0, few.num_rows).equals(few)


def test_independent_runs_have_seeds_of_their_own():
    plan = BatchPlan(THREE, 2, first_seed=10, independent=True)
    assert plan.table()["seed"].to_pylist() == [10, 11, 12, 13, 14, 15] == [plan.seed(r) for r in range(6)]


@pytest.mark.parametrize(
    ("values", "dtype"),
    [
        ([1, 2], pa.int64()),
        ([1, 2.5], pa.float64()),
        (["a", "b"], pa.string()),
        ([1, "b"], pa.string()),
        ([True, False], pa.string()),
    ],
)
def test_a_variable_is_a_column_of_numbers_where_all_of_its_values_are(values, dtype):
    column = BatchPlan([{"x": v} for v in values], 1).table()["x"]
    assert column.type == dtype
    assert column.to_pylist() == [str(v).lower() if dtype == pa.string() else v for v in values]


def test_the_last_seeds_of_all_are_there():
    plan = BatchPlan([{}], 3, first_seed=2**64 - 3)
    seeds = [2**64 - 3, 2**64 - 2, 2**64 - 1]
    assert plan.table()["seed"].to_pylist() == [plan.seed(r) for r in range(3)] == seeds


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"n_seeds": 0}, "runs = 0"),
        ({"n_seeds": True}, "runs = True"),
        ({"n_seeds": 1, "first_seed": -1}, "first_seed = -1"),
        ({"n_seeds": 1, "first_seed": 2**64}, "from 0 to 18446744073709551615"),
        ({"n_seeds": 2, "first_seed": 2**64 - 1}, "begin with a smaller one"),
        ({"n_seeds": 2, "first_seed": 2**64 - 3, "independent": True}, "begin with a smaller one"),
        ({"n_seeds": MAX_RUNS}, "3 points with 10,000,000 seeds each are 30,000,000 runs"),
    ],
)
def test_a_plan_that_is_not_allowed_is_refused(options, words):
    with pytest.raises(ParameterError, match=words):
        BatchPlan(THREE, **options)


def test_a_title_with_slashes_names_one_directory():
    mission = read_mission("predator_prey", {"prey": "2", "run.end": "1"}).mission
    directory = Batch(mission.replace(name="a/b ../c"), runs=1).default_directory()
    assert directory.parent.name == "batches"
    assert directory.name.startswith("a_b_.._c-")


def test_a_plan_has_points():
    with pytest.raises(ParameterError, match="at least one point"):
        BatchPlan([], 1)
