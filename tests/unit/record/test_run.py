"""What was recorded can be loaded, whole or cut."""

import json
import shutil

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest
from recorded_games import hunt, record

from tussle import load_run
from tussle.errors import MissingExtraError, ParameterError, RecordError
from tussle.record import run as run_module
from tussle.record.schema import EVENTS, TRAJECTORY


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A short game with a batch for every step."""
    return record(hunt(end=2.0), tmp_path_factory.mktemp("runs") / "run", flush_every=1e-9)


@pytest.fixture
def copied(recorded, tmp_path):
    return shutil.copytree(recorded, tmp_path / "run")


def test_frames_are_pandas_or_polars(recorded):
    pandas, polars = load_run(recorded, frames="pandas"), load_run(str(recorded), frames="polars")
    for name in ("trajectory", "events", "summary"):
        one, two = getattr(pandas, name), getattr(polars, name)
        assert isinstance(one, pd.DataFrame)
        assert isinstance(two, pl.DataFrame)
        assert list(one.columns) == two.columns
        assert one.shape == two.shape
    np.testing.assert_array_equal(pandas.trajectory["x"], polars.trajectory["x"].to_numpy())
    assert pandas.trajectory["block"].astype(str).to_list() == polars.trajectory["block"].to_list()
    assert isinstance(load_run(recorded).events, pd.DataFrame)
    assert repr(pandas).endswith("complete>")
    assert "<runscript" in pandas.mission
    with pytest.raises(ParameterError, match="did you mean 'polars'"):
        load_run(recorded, frames="polar")


def test_without_pandas_and_polars_the_tables_are_there(recorded, monkeypatch):
    monkeypatch.setattr(run_module, "find_spec", lambda name: None)
    run = load_run(recorded)
    assert run.trajectory_table.num_rows
    with pytest.raises(MissingExtraError, match=r"pip install 'tussle\[frames\]'"):
        _ = run.events
    with pytest.raises(MissingExtraError, match="frames need polars"):
        _ = load_run(recorded, frames="polars").events
    monkeypatch.setattr(run_module, "find_spec", lambda name: name == "polars" or None)
    assert isinstance(load_run(recorded).events, pl.DataFrame)


def test_a_file_cut_anywhere_gives_its_whole_batches_and_no_complete_run(recorded, copied):
    whole = load_run(recorded).trajectory_table
    data = (recorded / "trajectory.arrow").read_bytes()
    rng = np.random.default_rng(1)
    before = 0
    for size in sorted(
        {0, 1, 7, 8, 100, len(data) - 1, len(data) - 8, *rng.integers(0, len(data), 60).tolist()}
    ):
        (copied / "trajectory.arrow").write_bytes(data[:size])
        run = load_run(copied)
        assert not run.is_complete
        assert run.notes
        table = run.trajectory_table
        assert before <= table.num_rows <= whole.num_rows
        assert table.schema.names == whole.schema.names
        assert table == whole.slice(0, table.num_rows)
        before = table.num_rows
    assert before == whole.num_rows  # all batches; the end mark alone was missing


def test_what_is_missing_is_told(copied):
    (copied / "run.json").write_text('{"format": 1, "is_comp')
    with pytest.raises(RecordError, match=r"run.json: cannot be read: .*; if the file is removed"):
        load_run(copied)
    (copied / "run.json").unlink()
    run = load_run(copied)
    assert run.info == {}
    assert not run.is_complete
    assert "run.json is missing" in run.notes[0]
    assert run.trajectory_table.num_rows
    for name in ("trajectory.arrow", "mission.xml", "events.arrow", "summary.csv"):
        (copied / name).unlink()
        if name == "trajectory.arrow":
            run = load_run(copied)
    assert run.trajectory_table == TRAJECTORY.empty_table()
    assert run.events_table.schema == EVENTS
    assert "trajectory.arrow is missing" in run.notes[1]
    with pytest.raises(RecordError, match=r"summary.csv is missing: run.json is missing"):
        _ = run.summary
    with pytest.raises(RecordError, match="not a run directory"):
        load_run(copied)
    (copied / "file").touch()
    with pytest.raises(RecordError, match="it is a file"):
        load_run(copied / "file")


def test_rows_that_were_written_and_are_gone_are_told(recorded, copied):
    # A file that ends with its end mark, and yet is not the one that the run wrote.
    with pa.OSFile(str(copied / "trajectory.arrow"), "wb") as file, pa.ipc.new_stream(file, TRAJECTORY):
        pass
    run = load_run(copied)
    assert not run.is_complete
    assert "were written" in run.notes[0]
    shutil.copy(recorded / "events.arrow", copied / "trajectory.arrow")
    with pytest.raises(RecordError, match=r"trajectory.arrow: cannot be read: it has no column 'block'"):
        load_run(copied)


def test_another_format_is_refused(copied):
    info = json.loads((copied / "run.json").read_text())
    del info["checksum"]
    (copied / "run.json").write_text(json.dumps(info | {"format": 2}))
    with pytest.raises(RecordError, match="format 2"):
        load_run(copied)


def test_json_holds_what_json_does_not_know():
    from tussle.record.run_file import plain

    odd = {
        1: np.float64("nan"),
        "b": (np.int64(2), float("-inf")),
        "c": np.array([True]),
        "d": None,
        "e": hunt,
    }
    assert plain(odd) == {"1": "nan", "b": [2, "-inf"], "c": [True], "d": None, "e": str(hunt)}
