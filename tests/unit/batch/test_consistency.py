"""A batch or search directory whose files contradict one another is refused with the file and what does not fit."""

from __future__ import annotations

import json
import os

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from made_batches import made_batch, write_batch

from tussle.batch import load_batch, schemas, store
from tussle.batch.store import Store
from tussle.batch.variables import Choice, Range
from tussle.errors import BatchError, RecordError

VARIED = [Range("speed", 20.0, 30.0, unit="kt"), Choice("tactic", ("keep", "switch"))]
POINTS = [{"speed": s, "tactic": t} for s in (20.0, 30.0) for t in ("keep", "switch")]


A_FILE = {
    "made_in": "file",
    "file": "a.xml",
    "settings": {},
    "ends_by_time": True,
    "plugin_files": [],
    "options": {},
}


@pytest.fixture
def made(tmp_path):
    stored = made_batch(
        {2: np.arange(12.0).reshape(3, 4), 3: np.ones((3, 4))}, variables=VARIED, points=POINTS
    )
    return write_batch(stored, tmp_path / "made")


def change(path, table_name, **columns):
    """Replace columns of a table: by values, or by none to drop one."""
    table = pq.read_table(path / table_name)
    for name, values in columns.items():
        i = table.schema.get_field_index(name)
        table = table.remove_column(i)
        if values is not None:
            table = table.add_column(i, name, values if isinstance(values, pa.Array) else pa.array(values))
    pq.write_table(table, path / table_name)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"n_runs": 11}, "n_runs = 11 is not allowed; n_points and n_seeds make 12"),
        ({"n_runs": 10**8, "n_seeds": 25 * 10**6}, "n_seeds = 25000000 is not allowed; it takes a whole number from 1 to 10000000"),
        ({"n_seeds_kept": 4}, "n_seeds_kept = 4 is not allowed; there are 3 seeds"),
        ({"mission": {"made_in": "fill"}}, "mission.made_in = 'fill' is not allowed .did you mean 'file'"),
        ({"mission": {"made_in": "file"}}, "mission lacks file, settings"),
        ({"mission": A_FILE | {"file": "../../secret.xml"}},
         "mission.file = '../../secret.xml' is not allowed; it takes a path inside the directory"),
        ({"mission": A_FILE | {"options": {"stric": True}}},
         "mission.options.stric is not allowed .did you mean 'strict'"),
        ({"variables": [{"kind": "range", "name": "x", "low": 1.0, "high": 0.0, "is_int": False, "is_log": False,
          "unit": "", "is_text": False}]},
         r"variables\[0\]: x: the low bound 1 is above the high bound 0"),
        ({"variables": [{"kind": "choice", "name": "x", "values": [None], "is_text": False}]},
         r"variables\[0\].values\[0\] = None is not allowed"),
        ({"variables": [{"kind": "range", "name": "x"}]}, r"variables\[0\] lacks low, high"),
        ({"teams": {"two": "keepers"}}, "teams: the name 'two' is not allowed"),
        ({"timings": {"wall_s": -1.0, "cpu_s": 0.0}}, "timings.wall_s = -1.0 is not allowed"),
    ],
)  # fmt: skip
def test_a_field_of_the_batch_that_cannot_be_is_named(made, changed, said):
    info = json.loads((made / schemas.BATCH_FILE).read_text())
    (made / schemas.BATCH_FILE).write_text(json.dumps(info | changed))
    with pytest.raises(BatchError, match=rf"batch\.json: {said}"):
        load_batch(made)


@pytest.mark.parametrize(
    ("table", "columns", "said"),
    [
        (schemas.DESIGN_FILE, {"run": np.arange(1, 13)}, "run = 1 in row 0 is not allowed; it is 0"),
        (
            schemas.DESIGN_FILE,
            {"point": pa.array([7] * 12, pa.int32())},
            "point = 7 in row 0 is not allowed; it is 0",
        ),
        (
            schemas.DESIGN_FILE,
            {"seed": pa.array([5] * 12, pa.uint64())},
            "seed = 5 in row 0 is not allowed; it is 1",
        ),
        (schemas.DESIGN_FILE, {"speed": None}, "has no column 'speed', which varies by batch.json"),
        (schemas.DESIGN_FILE, {"speed": ["fast"] * 12}, "column 'speed' holds string, which no variable"),
        (schemas.DESIGN_FILE, {"speed": [np.nan] * 12}, "column 'speed' lacks values"),
        (schemas.DESIGN_FILE, {"tactic": [None, *["keep"] * 11]}, "column 'tactic' lacks values"),
        (schemas.ALIVE_FILE, {"t": None}, "is another table; it has no column 't' of double"),
    ],
)
def test_a_table_that_does_not_fit_is_named(made, table, columns, said):
    change(made, table, **columns)
    with pytest.raises(BatchError, match=f"{table}: {said}"):
        load_batch(made)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("run", 12, "run = 12 is not allowed; the batch has runs 0 to 11"),
        ("run", 0, "the rows are not in the order of their runs"),
        ("point", 1, "a run has another point than in the design"),
        ("seed", 9, "a run has another seed than in the design"),
        ("steps", -1, "steps = -1 in row .* is not allowed; it takes 0 to 2147483647"),
        ("end", None, "column 'end' is null in row"),
        (
            "value",
            1e101,
            "value = 1e.101 of run .* is not allowed; a metric is infinite, or 1e.100 at the most",
        ),
        ("team", 9, "team 9 has one of the metrics 'alive' and 'start', and not the other"),
        ("metric", "a" * 300, r"quantity 'a+\.\.\.' has 303 characters"),
    ],
)
def test_a_row_of_the_results_that_does_not_fit_is_named(made, name, value, said):
    column = pq.read_table(made / schemas.RESULTS_FILE)[name]
    change(made, schemas.RESULTS_FILE, **{name: pa.array([*column.to_pylist()[:-1], value], column.type)})
    with pytest.raises(BatchError, match=rf"results\.parquet: {said}"):
        load_batch(made)


def test_a_design_of_another_number_of_runs_is_refused(made):
    table = pq.read_table(made / schemas.DESIGN_FILE)
    for n in (0, 3):
        pq.write_table(table.slice(0, n), made / schemas.DESIGN_FILE)
        with pytest.raises(BatchError, match=rf"has {n} runs; batch.json says 12, of 4 points"):
            load_batch(made)


def test_results_that_would_make_a_far_larger_table_of_runs_are_refused(made):
    table = pq.read_table(made / schemas.RESULTS_FILE)
    rows = table.take(pa.array(np.repeat(np.arange(len(table)), 200)))
    names = pa.array([f"m{i}" for i in range(len(rows))])
    for metric, team in (
        (names, rows["team"]),
        (
            pa.array([f"m{i % 2000}" for i in range(len(rows))]),
            pa.array(np.arange(len(rows), dtype=np.int32)),
        ),
    ):
        changed = rows.set_column(4, "metric", metric).set_column(3, "team", team)
        pq.write_table(changed, made / schemas.RESULTS_FILE)
        with pytest.raises(
            BatchError, match=r"results\.parquet: [\d,]+ metrics of [\d,]+ teams in 12 runs are too many"
        ):
            load_batch(made)


def test_a_lock_that_is_a_link_or_a_pipe_is_left_alone(made, tmp_path):
    (tmp_path / "mine").write_text("precious")
    (made / store.LOCK).symlink_to(tmp_path / "mine")
    with pytest.raises(RecordError, match="cannot be written: Too many levels of symbolic links"):
        Store(made)
    assert (tmp_path / "mine").read_text() == "precious"
    (made / store.LOCK).unlink()
    os.mkfifo(made / store.LOCK)
    with pytest.raises(RecordError, match=r"cannot be written: .*not seekable"):
        Store(made)


def test_drafts_that_are_links_are_replaced_and_not_followed(made, tmp_path):
    (tmp_path / "mine").write_text("precious")
    for name in (schemas.BATCH_FILE, schemas.DESIGN_FILE):
        (made / f"{name}.part").symlink_to(tmp_path / "mine")
    held = Store(made)
    held.write_info(held.info)
    held.write_table(schemas.DESIGN_FILE, pq.read_table(made / schemas.DESIGN_FILE))
    held.close()
    assert (tmp_path / "mine").read_text() == "precious"
    assert load_batch(made).n_runs == 12


def test_a_batch_without_variables_and_with_seeds_of_their_own_is_read(tmp_path):
    stored = made_batch({2: np.ones((3, 1))}, independent=True)
    assert load_batch(write_batch(stored, tmp_path / "made")).n_runs == 3
