"""Damage to one block of a file is told, and stops nothing else."""

import itertools
import json
import shutil
from types import SimpleNamespace

import gambles
import numpy as np
import pyarrow as pa
import pytest
from cli_process import call
from recorded_games import hunt, record

from tussle import load_run
from tussle.batch import Batch, InProcess, load_batch, schemas
from tussle.batch.damage import damage_in_batch
from tussle.errors import BatchError, RecordError
from tussle.record import parquet_blocks, recorder
from tussle.record.arrow_blocks import find_blocks
from tussle.record.arrow_file import read_batches
from tussle.record.damage import damage_in_run
from tussle.record.schema import TRAJECTORY
from tussle.record.stream import Stream


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    return record(hunt(end=1.0), tmp_path_factory.mktemp("runs") / "run", flush_every=1e-9)


@pytest.fixture
def run(recorded, tmp_path):
    return shutil.copytree(recorded, tmp_path / "run")


def flip(path, at, bit=0):
    data = bytearray(path.read_bytes())
    data[at] ^= 1 << bit
    path.write_bytes(data)


def test_a_flipped_bit_costs_its_block_only(recorded, run):
    whole, file = load_run(recorded).trajectory_table, run / "trajectory.arrow"
    blocks = find_blocks(file).intact
    assert len(blocks) > 5
    flip(file, blocks[3].end - 50)
    found = load_run(run)
    assert not found.is_complete
    start, end = blocks[3].start, blocks[3].end
    assert f"trajectory.arrow is damaged between bytes {start:,} and {end:,}" in found.notes[0]
    steps = np.unique(whole["step"].to_numpy())
    np.testing.assert_array_equal(np.unique(found.trajectory_table["step"].to_numpy()), np.delete(steps, 1))
    assert load_run(run, is_mapped=True).trajectory_table == found.trajectory_table


@pytest.mark.parametrize("at", [0, 4, 100])
def test_without_the_schema_of_the_file_that_of_the_table_is_used(recorded, run, at):
    flip(run / "trajectory.arrow", at)
    found = load_run(run)
    assert "is damaged between bytes 0 and" in found.notes[0]
    assert found.trajectory_table == load_run(recorded).trajectory_table


def test_what_follows_a_wrong_length_is_found(recorded, run):
    """The header of a block is overwritten, so that its end is not known."""
    file = run / "trajectory.arrow"
    block = find_blocks(file).intact[4]
    with file.open("r+b") as opened:
        opened.seek(block.start)
        opened.write(bytes(40))
    whole, found = load_run(recorded).trajectory_table, load_run(run)
    assert 0 < whole.num_rows - found.trajectory_table.num_rows < 0.2 * whole.num_rows
    assert find_blocks(file).lost == [(block.start, block.end)]


def test_other_programs_read_the_files(recorded):
    with pa.OSFile(str(recorded / "trajectory.arrow")) as file, pa.ipc.open_stream(file) as reader:
        assert reader.read_all().equals(load_run(recorded).trajectory_table)


def test_files_without_checksums_are_read(recorded, run):
    table = load_run(recorded).trajectory_table
    with (
        pa.OSFile(str(run / "trajectory.arrow"), "wb") as file,
        pa.ipc.new_stream(file, TRAJECTORY) as writer,
    ):
        writer.write_table(table, max_chunksize=10)
    (run / "run.json").unlink()
    assert load_run(run).trajectory_table == table
    damage, unchecked = damage_in_run(run)
    assert (damage, unchecked) == ([], ["trajectory.arrow has no checksums"])


def test_a_text_that_looks_like_a_checksum_is_none(tmp_path):
    schema = pa.schema(
        [pa.field("block", pa.dictionary(pa.int32(), pa.string())), pa.field("text", pa.string())]
    )
    fake = "tussle-crc32:00000000"
    batch = pa.RecordBatch.from_arrays(
        [pa.array([fake, fake]).dictionary_encode(), pa.array([fake, "groups:, tussle-crc32:01234567"])],
        schema=schema,
    )
    stream = Stream(tmp_path / "a.arrow", schema)
    for _ in range(3):
        stream.write(batch)
    stream.close()
    assert not find_blocks(tmp_path / "a.arrow").lost
    assert len(list(read_batches(tmp_path / "a.arrow", [], RecordError, schema))) == 3


def test_a_damaged_end_leaves_the_tables(recorded, run):
    text = (run / "run.json").read_text()
    (run / "run.json").write_text(text.replace('"steps": 1', '"steps": 2', 1))
    found = load_run(run)
    assert found.info == {}
    assert "run.json is damaged" in found.notes[0]
    assert found.trajectory_table == load_run(recorded).trajectory_table
    edited = json.loads(text)
    del edited["checksum"]
    (run / "run.json").write_text(json.dumps(edited))
    assert load_run(run).is_complete


@pytest.mark.parametrize("name", ["summary.csv", "mission.xml"])
def test_damaged_texts_are_refused(run, name):
    flip(run / name, 30)
    assert damage_in_run(run)[0] == [
        f"{name} is damaged, or was edited: its checksum is not that in run.json"
    ]
    with pytest.raises(RecordError, match="is damaged"):
        _ = load_run(run).summary if name == "summary.csv" else load_run(run).mission


# -- batches ------------------------------------------------------------------------------------------------------------------


@pytest.fixture
def games(tmp_path):
    (tmp_path / "game.xml").write_text(gambles.MISSION)
    return Batch(tmp_path / "game.xml", runs=6, plugin_files=[gambles.THIS])


class Stopped(Exception):
    pass


def stop(progress):
    if progress.n_done >= 4:
        raise Stopped


def values_of(path):
    return load_batch(path).table.drop_columns(["cpu_s", "host"])


def test_the_runs_of_a_damaged_part_are_played_again(games, tmp_path):
    games.play(tmp_path / "whole", InProcess(1))
    with pytest.raises(Stopped):
        games.play(tmp_path / "out", InProcess(1), on_progress=stop)
    part = next((tmp_path / "out" / schemas.PARTS).glob("*.arrow"))
    block = find_blocks(part).intact[2]
    flip(part, block.end - 40, 3)
    results = load_batch(tmp_path / "out")
    assert results.n_runs == 3
    assert "0001.arrow is damaged" in results.notes[1]
    assert "parts/0001.arrow is damaged" in damage_in_batch(tmp_path / "out")[0][0]
    with pytest.warns(RuntimeWarning, match=r"0001.arrow is damaged .* are played again"):
        games.play(tmp_path / "out", InProcess(1))
    assert values_of(tmp_path / "out") == values_of(tmp_path / "whole")
    assert damage_in_batch(tmp_path / "out") == ([], [])


@pytest.mark.parametrize("name", ["results.parquet", "alive.parquet", "design.parquet"])
@pytest.mark.parametrize("place", [0.2, 0.7, 0.95])
def test_the_runs_of_a_damaged_table_are_played_again(games, tmp_path, monkeypatch, name, place):
    monkeypatch.setattr(parquet_blocks, "ROWS_OF_GROUP", 2)
    out = tmp_path / "out"
    games.play(out, InProcess(2))
    whole, size = values_of(out), (out / name).stat().st_size
    flip(out / name, int(place * size))
    assert damage_in_batch(out)[0]
    assert not games.is_played_in(out)
    if name == "design.parquet":
        with pytest.raises(BatchError, match=r"damaged|cannot be read"):
            load_batch(out)
    else:
        assert load_batch(out).n_runs < 6
        assert "the command of the batch plays the others again" in load_batch(out).notes[1]
    with (
        pytest.warns(RuntimeWarning, match="played again")
        if name != "design.parquet"
        else pytest.MonkeyPatch.context()
    ):
        games.play(out, InProcess(2))
    assert values_of(out) == whole
    assert damage_in_batch(out) == ([], [])


def test_the_command_tells_damage(recorded, run):
    assert call("check", recorded).returncode == 0
    flip(run / "events.arrow", 900)
    result = call("check", run)
    assert result.returncode == 1
    assert "events.arrow is damaged" in result.stderr


def test_a_clock_that_jumps_changes_nothing(tmp_path, monkeypatch):
    times = itertools.cycle((5.0, -1e9, 1e9, 7.0))
    monkeypatch.setattr(recorder, "time", SimpleNamespace(monotonic=lambda: next(times)))
    jumped = record(hunt(end=1.0), tmp_path / "jumped")
    assert damage_in_run(jumped) == ([], [])
    run = load_run(jumped)
    assert run.is_complete
    assert np.unique(run.trajectory_table["step"].to_numpy()).tolist() == list(range(11))
