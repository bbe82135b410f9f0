"""Tables hold what was recorded, to the last bit, without the whole of it in memory."""

from __future__ import annotations

import io

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
import pytest
from recorded_games import hunt, record

from tussle.errors import ParameterError, RecordError, ViewError
from tussle.record import load_run
from tussle.record.schema import TRAJECTORY, TRAJECTORY_FILE
from tussle.view.export.tables import _first_line, write_tables


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    """Two worlds, in many batches."""
    return record(hunt(end=8.0), tmp_path_factory.mktemp("runs") / "run", (1, 2), flush_every=1e-9)


def read(path):
    return pa.csv.read_csv(path) if path.suffix == ".csv" else pa.parquet.read_table(path)


def assert_same(written, recorded):
    assert written.column_names == recorded.column_names
    for name in recorded.column_names:
        column = recorded[name]
        words = column.cast(pa.string()) if pa.types.is_dictionary(column.type) else column
        assert written[name].to_pylist() == words.to_pylist(), name


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_both_tables_are_there_to_the_last_bit(played, tmp_path, kind):
    told = []
    report = write_tables(played, tmp_path / f"states.{kind}", kind, show=told.append)
    run = load_run(played)
    states, events = tmp_path / f"states.{kind}", tmp_path / f"states.events.{kind}"
    assert report.paths == [states, events]
    assert sorted(tmp_path.iterdir()) == sorted(report.paths)
    assert report.rows == [len(run.trajectory_table), len(run.events_table)]
    assert told[-1] == report.rows[0]
    assert report.notes == []
    assert_same(read(states), run.trajectory_table)
    assert_same(read(events), run.events_table)


def test_readers_that_guess_types_from_the_first_rows_find_those_of_the_recording(played, tmp_path):
    polars = pytest.importorskip("polars")
    write_tables(played, tmp_path / "a.csv", "csv")
    for path, table in (
        ("a.csv", load_run(played).trajectory_table),
        ("a.events.csv", load_run(played).events_table),
    ):
        frame = polars.read_csv(tmp_path / path, infer_schema_length=1)
        real = [name for name in table.column_names if pa.types.is_floating(table[name].type)]
        assert real == [name for name in frame.columns if frame[name].dtype.is_float()]
        assert_same(frame.to_arrow(), table)


def test_a_first_line_is_as_the_others():
    """But for points in whole real numbers."""
    values = {
        "int": [-3, 7], "text": ['a "b", c', ""], "none": [None, "x"], "bool": [True, False], "real": [0.1, 1e-300],
        "nan": [np.nan, np.inf], "far": [-np.inf, 1e22], "gone": [None, 0.5],
    }  # fmt: skip
    table, stream = pa.table(values), io.BytesIO()
    pa.csv.write_csv(table, stream, pa.csv.WriteOptions(quoting_style="needed"))
    lines = [_first_line(row) for row in table.to_pylist()]
    assert stream.getvalue().decode().splitlines(keepends=True)[1:] == lines
    assert _first_line({"a": 0.0, "b": -0.0, "c": 200.0, "d": 3}) == "0.0,-0.0,200.0,3\n"


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_one_world_can_be_chosen(played, tmp_path, kind):
    report = write_tables(played, tmp_path / "one", kind, world=1)
    run = load_run(played)
    for path, table in zip(report.paths, (run.trajectory_table, run.events_table), strict=True):
        written = (pa.csv.read_csv if kind == "csv" else pa.parquet.read_table)(path)
        assert_same(written, table.filter(pa.compute.equal(table["world"], 1)))
        assert len(written)
    assert report.paths[1].name == f"one.events.{kind}"


def test_a_run_that_was_cut_gives_its_whole_batches_and_says_so(played, tmp_path):
    cut = tmp_path / "cut"
    cut.mkdir()
    data = (played / TRAJECTORY_FILE).read_bytes()
    (cut / TRAJECTORY_FILE).write_bytes(data[: len(data) // 2])
    report = write_tables(cut, tmp_path / "a.csv", "csv")
    assert_same(read(tmp_path / "a.csv"), load_run(cut).trajectory_table)
    assert 0 < report.rows[0] < len(load_run(played).trajectory_table)
    assert report.rows[1] == 0
    assert [note.split(" ", 1)[0] for note in report.notes] == [
        "run.json",
        "trajectory.arrow",
        "events.arrow",
    ]
    assert "is truncated after" in report.notes[1]


def test_a_large_run_does_not_fill_the_memory(tmp_path):
    """Sixty-four batches, of which two are in memory at once."""
    run, n = tmp_path / "run", 20_000
    run.mkdir()
    columns = [
        pa.array(["prey"] * n).dictionary_encode().cast(f.type)
        if pa.types.is_dictionary(f.type)
        else pa.array(np.arange(n), f.type)
        for f in TRAJECTORY
    ]
    batch = pa.record_batch(columns, TRAJECTORY)
    with pa.OSFile(str(run / TRAJECTORY_FILE), "wb") as file, pa.ipc.new_stream(file, TRAJECTORY) as stream:
        for _ in range(64):
            stream.write_batch(batch)
    size = (run / TRAJECTORY_FILE).stat().st_size
    del batch, columns
    pool = pa.system_memory_pool()
    before, default = pool.max_memory(), pa.default_memory_pool()
    pa.set_memory_pool(pool)
    try:
        report = write_tables(run, tmp_path / "a.csv", "csv")
    finally:
        pa.set_memory_pool(default)
    assert report.rows == [64 * n, 0]
    assert pool.max_memory() - before < 0.15 * size


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_what_cannot_be_is_refused_and_leaves_nothing(played, tmp_path, kind):
    with pytest.raises(ParameterError, match=r"kind = 'cvs' is not allowed \(did you mean 'csv'\?\)"):
        write_tables(played, tmp_path / "a.cvs", "cvs")
    with pytest.raises(RecordError, match="it is not a run directory"):
        write_tables(tmp_path, tmp_path / "a", kind)
    for world in (2, 0.5, "a"):
        with pytest.raises(RecordError, match=f"there is no world {world}; there are worlds 0 to 1"):
            write_tables(played, tmp_path / "a", kind, world=world)
    (tmp_path / "link").symlink_to("/dev/full")
    with pytest.raises(ViewError, match="link: cannot be written: it is no regular file"):
        write_tables(played, tmp_path / "link", kind)
    assert [p.name for p in tmp_path.iterdir()] == ["link"]
