"""The directory of a batch: whatever it was left in, what is there is right and what is missing is played."""

from __future__ import annotations

import fcntl
import json
import math
import os
import shutil
import subprocess
import warnings
from itertools import pairwise

import gambles
import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

from tussle.batch import Batch, InProcess, finished_runs, load_batch, schemas, store
from tussle.batch.damage import damage_in_batch
from tussle.batch.plan import BatchPlan
from tussle.batch.store import Store
from tussle.batch.tasks import Finished
from tussle.errors import BatchError, RecordError
from tussle.record import parquet_blocks
from tussle.record.arrow_file import read_batches
from tussle.record.parquet_blocks import write_parquet
from tussle.record.stream import Stream

TABLES = (schemas.ALIVE_FILE, schemas.RESULTS_FILE, schemas.DESIGN_FILE)


@pytest.fixture
def mission(tmp_path):
    """A mission file that stays where it is while batches come and go."""
    file = tmp_path / "game.xml"
    file.write_text(gambles.MISSION)
    return file


def batch_of(mission, runs=6, **options):
    return Batch(mission, runs=runs, vary=["odds=0.1,0.3"], plugin_files=[gambles.THIS], **options)


class Stopped(Exception):
    pass


def play(batch, path, until=None, stop_after=None, stack=3):
    """Play into a directory; after so many runs, stop as if killed."""

    def watch(progress):
        if stop_after is not None and progress.n_done - progress.n_before >= stop_after:
            raise Stopped

    return batch.play(path, InProcess(stack), until=until, on_progress=watch)


def stopped(batch, path, after, until=None):
    with pytest.raises(Stopped):
        play(batch, path, until, after)


def tables_of(path):
    """All that a batch directory holds for good, but for what it cost."""
    results = pq.read_table(path / schemas.RESULTS_FILE).drop_columns(["cpu_s", "host"])
    return results, pq.read_table(path / schemas.ALIVE_FILE), pq.read_table(path / schemas.DESIGN_FILE)


def facts_of(path):
    info = json.loads((path / schemas.BATCH_FILE).read_text())
    return {k: v for k, v in info.items() if k not in ("timings", "command", "checksum")}


@pytest.fixture
def reference(mission, tmp_path):
    """A batch that nothing has disturbed."""
    play(batch_of(mission), tmp_path / "reference")
    return tmp_path / "reference"


# -- versions -----------------------------------------------------------------------------------------------------------------


def as_before_chance_was_told(path):
    """Rewrite a batch directory as versions without the column `chance` have left it."""
    if (path / schemas.RESULTS_FILE).exists():
        older = pq.read_table(path / schemas.RESULTS_FILE).drop_columns([*schemas.LATER])
        write_parquet(older, path / schemas.RESULTS_FILE)
    schema = pa.schema([column for column in schemas.PLAYED if column.name not in schemas.LATER])
    for part in list((path / schemas.PARTS).glob("*.arrow")):
        batches = list(read_batches(part, [], BatchError))
        part.unlink()
        stream = Stream(part, schema)
        for batch in batches:
            stream.write(pa.RecordBatch.from_arrays([batch[name] for name in schema.names], schema=schema))
        stream.close()


@pytest.mark.parametrize("is_killed", [False, True])
def test_directories_of_versions_that_did_not_tell_chance_are_read_and_gone_on_with(
    mission, tmp_path, reference, is_killed
):
    path = tmp_path / "older"
    if is_killed:
        stopped(batch_of(mission), path, 3)
    else:
        play(batch_of(mission, runs=2), path)
    as_before_chance_was_told(path)
    assert load_batch(path).n_runs
    play(batch_of(mission), path)
    found, wanted = (load_batch(each) for each in (path, reference))
    assert found.n_distinct == wanted.n_distinct == 12
    results, *others = tables_of(path)
    wanted_results, *wanted_others = tables_of(reference)
    assert results.drop_columns([*schemas.LATER]) == wanted_results.drop_columns([*schemas.LATER])
    assert others == wanted_others


# -- limits of memory ----------------------------------------------------------------------------------------------------------


def test_limits_of_memory_at_their_smallest_change_nothing(mission, tmp_path, reference, monkeypatch):
    """Some runs in tables, others in several files that are read again and again; the tables come a run at a time."""
    wanted = load_batch(reference)
    monkeypatch.setattr(finished_runs, "RUNS_AT_ONCE", 1)
    monkeypatch.setattr(finished_runs, "MAX_OPEN_PARTS", 1)
    monkeypatch.setattr(parquet_blocks, "ROWS_OF_GROUP", 1)
    monkeypatch.setattr(store, "MAX_IN_PART", 2)
    monkeypatch.setattr(store, "MAX_HELD", 0)
    path = tmp_path / "out"
    play(batch_of(mission, runs=2), path)
    for after in (1, 3, 2):
        stopped(batch_of(mission), path, after)
        found = load_batch(path)
        runs = found.runs["run"].to_pylist()
        assert runs == sorted(set(found.table["run"].to_pylist()))
        assert found.alive.equals(wanted.alive.filter(pc.is_in(wanted.alive["run"], pa.array(runs))))
    play(batch_of(mission), path)
    assert tables_of(path) == tables_of(reference)
    found = load_batch(path)
    assert found.alive.equals(wanted.alive)
    timed = ["cpu_s", "host"]
    assert found.table.drop_columns(timed).equals(wanted.table.drop_columns(timed))
    assert found.runs.drop_columns(timed).equals(wanted.runs.drop_columns(timed))


def test_a_table_read_later_holds_the_runs_that_were_there_when_the_batch_was_loaded(
    mission, tmp_path, monkeypatch
):
    monkeypatch.setattr(store, "MAX_HELD", 0)
    path = tmp_path / "out"
    play(batch_of(mission, runs=2), path)
    before = load_batch(path)
    play(batch_of(mission), path)
    assert before.runs["run"].to_pylist() == sorted(set(before.table["run"].to_pylist())) == [0, 1, 2, 3]
    assert set(before.alive["run"].to_pylist()) <= {0, 1, 2, 3}


@pytest.mark.parametrize("size", [1, 2, 7, 1000])
def test_a_file_does_not_depend_on_how_many_rows_are_written_at_once(tmp_path, monkeypatch, size):
    monkeypatch.setattr(parquet_blocks, "ROWS_OF_GROUP", 5)
    monkeypatch.setattr(parquet_blocks, "GROUPS_OF_SIZE", 3)
    table = pa.table({"run": np.repeat(np.arange(60), np.arange(60) % 13), "value": np.arange(340.0)})
    write_parquet(table, tmp_path / "whole.parquet")
    with parquet_blocks.ParquetBlocks(tmp_path / "parts.parquet", table.schema) as file:
        for first in range(0, len(table), size):
            file.add(table.slice(first, size))
    assert (tmp_path / "parts.parquet").read_bytes() == (tmp_path / "whole.parquet").read_bytes()
    groups = pq.ParquetFile(tmp_path / "whole.parquet")
    runs = [set(groups.read_row_group(i)["run"].to_pylist()) for i in range(groups.num_row_groups)]
    assert all(a.isdisjoint(b) for a, b in pairwise(runs))
    assert len(runs) < 20  # groups grow


# -- tables -------------------------------------------------------------------------------------------------------------------


def made(number, metrics, alive=(), **more):
    values = {
        "end": "time", "t": 1.0, "steps": 10, "winner": None, "state_hash": "ab", "error": "", "cpu_s": 0.1, "host": "h", **more,
    }  # fmt: skip
    return Finished(number=number, metrics=list(metrics), alive=list(alive), **values)


def tables(*finished, n=4):
    batches = [finished_runs.row(f) for f in finished]
    return finished_runs.tables(
        pa.Table.from_batches(batches, schemas.PLAYED), BatchPlan([{"x": 1.5}], n, first_seed=7).table()
    )


def test_a_run_is_a_row_for_each_team_and_metric_in_order():
    first = made(1, [(2, "score", 3.0), (1, "score", math.nan), (None, "M.n", 4.0), (1, "alive", math.inf)])
    second = made(0, [(1, "score", 1.0)], error="it fell", end="error", winner=1)
    results, _ = tables(first, second)
    assert results.schema.equals(schemas.RESULTS)
    assert [tuple(row[k] for k in ("run", "point", "seed", "team", "metric", "value")) for row in results.to_pylist()] == [
        (0, 0, 7, 1, "score", 1.0),
        (1, 0, 8, None, "M.n", 4.0),
        (1, 0, 8, 1, "alive", math.inf),
        (1, 0, 8, 1, "score", None),
        (1, 0, 8, 2, "score", 3.0),
    ]  # fmt: skip
    assert results["error"].to_pylist() == ["it fell", None, None, None, None]
    assert results["winner"].to_pylist() == [1, None, None, None, None]


def test_of_a_run_that_is_there_twice_the_first_counts_and_others_than_planned_do_not():
    results, alive = tables(
        made(2, [(1, "score", 1.0)], [(1, 0.0, 5)]),
        made(2, [(1, "score", 2.0)], [(1, 0.0, 6)]),
        made(9, [(1, "score", 3.0)], [(1, 0.0, 7)]),
    )
    assert results["value"].to_pylist() == [1.0]
    assert alive.to_pylist() == [{"run": 2, "team": 1, "t": 0.0, "alive": 5}]


def test_runs_come_back_from_their_table():
    runs = [
        made(0, [(None, "M.n", 4.0), (1, "score", 3.0), (2, "score", math.nan)], winner=1),
        made(3, [(1, "score", 0.0)], end="error", error="it fell", t=0.0, steps=0),
    ]
    back = list(finished_runs.finished_in(tables(*runs)[0]))
    assert repr(back) == repr(runs)


# -- killed, and the same command again ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("after", [0, 5, 12])
def test_a_batch_that_was_stopped_goes_on(mission, reference, tmp_path, after):
    path = tmp_path / "out"
    stopped(batch_of(mission), path, after)
    before = load_batch(path)
    assert before.n_runs == after
    assert before.notes == [f"the batch is not complete: {after} of 12 runs are finished"]
    done = []
    results = batch_of(mission).play(
        path, InProcess(5), on_progress=lambda p: done.append((p.n_before, p.n_done))
    )
    assert (done[0], done[-1]) == ((after, after), (after, 12))
    assert results.notes == []
    assert tables_of(path) == tables_of(reference)
    assert facts_of(path) == facts_of(reference)
    assert not (path / schemas.PARTS).exists()


def torn(state, tmp_path, mission, whole):
    """A batch that was killed as it ended, in one of the states of that order: alive, results, design, parts, batch.json."""
    path = tmp_path / "torn"
    stopped(batch_of(mission), path, 5)
    stopped(batch_of(mission), path, 7)
    order = [*TABLES, *sorted(p.name for p in (path / schemas.PARTS).iterdir())]
    assert order[3:] == ["0001.arrow", "0002.arrow"]
    for name in order[:state]:
        if name.endswith(".arrow"):
            (path / schemas.PARTS / name).unlink()
        else:
            shutil.copy(whole / name, path / name)
    if state > len(order):
        (path / schemas.PARTS).rmdir()
    for name in [*TABLES, schemas.BATCH_FILE]:  # and always as another file was half written
        (path / f"{name}.part").write_bytes(b"PAR1 and no more")
    return path


@pytest.mark.parametrize("state", range(7))
def test_a_batch_that_was_killed_as_it_ended_goes_on(mission, reference, tmp_path, state):
    path = torn(state, tmp_path, mission, reference)
    assert load_batch(path).n_runs == 12
    results = play(batch_of(mission), path)
    assert results.notes == []
    assert tables_of(path) == tables_of(reference)
    assert facts_of(path) == facts_of(reference)


@pytest.mark.parametrize("state", range(4))
def test_a_batch_that_was_killed_as_it_was_extended_goes_on(mission, tmp_path, state):
    path, whole = tmp_path / "out", tmp_path / "whole"
    play(batch_of(mission, 9), whole)
    play(batch_of(mission, 6), path)
    stopped(batch_of(mission, 9), path, 6)
    for name in TABLES[:state]:
        shutil.copy(whole / name, path / name)
    play(batch_of(mission, 9), path)
    assert tables_of(path) == tables_of(whole)
    assert facts_of(path) == {**facts_of(whole), "n_seeds": 9}


@pytest.mark.parametrize(
    "gone", [("mission",), ("mission", "design.parquet"), ("mission", "design.parquet", "batch.json")]
)
def test_a_batch_that_was_killed_as_it_began_goes_on(mission, reference, tmp_path, gone):
    path = tmp_path / "out"
    stopped(batch_of(mission), path, 0)
    shutil.rmtree(path / schemas.PARTS, ignore_errors=True)
    for name in gone:
        target = path / name
        if target.is_dir():
            target.rename(path / "mission.part")
        else:
            target.rename(path / f"{name}.part")
    if "batch.json" in gone:
        shutil.rmtree(path / "mission.part")
        (path / "design.parquet.part").unlink()
    elif "design.parquet" in gone:
        with pytest.raises(
            BatchError, match=r"design[.]parquet is missing; the command of the batch writes it again"
        ):
            load_batch(path)
    play(batch_of(mission), path)
    assert tables_of(path) == tables_of(reference)
    assert sorted(p.name for p in path.iterdir()) == sorted(p.name for p in reference.iterdir())


@pytest.mark.parametrize("name", ["design.parquet", "results.parquet", "alive.parquet"])
@pytest.mark.parametrize("data", [None, b"", b"text", "half", "flipped"])
def test_a_complete_batch_without_one_of_its_tables_is_told_and_made_whole_by_its_command(
    mission, reference, tmp_path, name, data
):
    path = tmp_path / "out"
    shutil.copytree(reference, path)
    before = (path / name).read_bytes()
    made = {
        "half": before[: len(before) // 2],
        "flipped": before[:40] + bytes([before[40] ^ 8]) + before[41:],
    }
    if data is None:
        (path / name).unlink()
    else:
        (path / name).write_bytes(made.get(data, data))
    (told,) = damage_in_batch(path)[0]
    assert name in told
    if name == schemas.DESIGN_FILE or data is None:
        with pytest.raises(BatchError, match=f"{name} .*; the command of the batch writes it again"):
            load_batch(path)
    else:
        assert load_batch(path).notes[-1].startswith("0 of ")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        play(batch_of(mission), path)
    assert tables_of(path) == tables_of(reference)
    assert damage_in_batch(path) == ([], [])


def test_a_part_that_was_cut_at_any_byte_gives_its_whole_runs(mission, reference, tmp_path):
    path = tmp_path / "out"
    stopped(batch_of(mission), path, 4)
    part = path / schemas.PARTS / "0001.arrow"
    data = part.read_bytes()
    whole = store.load(path).table
    assert len(store.load(path).runs) == 4
    n_rows = {}
    for size in [
        *range(0, len(data), 5),
        len(data),
    ]:  # five has no divisor in common with the eight bytes by which all is aligned
        part.write_bytes(data[:size])
        found = store.load(path)
        assert found.table.equals(whole.slice(0, found.table.num_rows))
        # A cut between two runs looks like an end.
        assert len(found.notes) <= 2
        n_rows.setdefault(found.runs.num_rows, size)
    assert list(n_rows) == [0, 1, 2, 3, 4]
    # The directory goes on from each number of whole runs, and from the middle of one.
    for size in [*n_rows.values(), n_rows[2] - 5]:
        part.write_bytes(data[:size])
        copy = tmp_path / f"from {size}"
        shutil.copytree(path, copy)
        play(batch_of(mission), copy)
        assert tables_of(copy) == tables_of(reference)


def test_zeros_at_the_end_of_a_part_are_no_runs(mission, tmp_path):
    path = tmp_path / "out"
    stopped(batch_of(mission), path, 4)
    part = path / schemas.PARTS / "0001.arrow"
    whole = store.load(path).table
    with part.open("r+b") as file:
        file.truncate(part.stat().st_size - 8)  # the end mark, which a killed batch does not have
        file.truncate(part.stat().st_size + 4096)
    assert store.load(path).table.equals(whole)


# -- what is no batch, or a damaged one ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [schemas.RESULTS_FILE, schemas.ALIVE_FILE])
def test_a_table_that_is_damaged_is_told_and_never_believed(mission, reference, name):
    file = reference / name
    data = file.read_bytes()
    wanted = tables_of(reference)[0].to_pylist()
    for place in [*range(0, len(data), 41), len(data) - 1]:
        changed = bytearray(data)
        changed[place] ^= 0xFF
        file.write_bytes(bytes(changed))
        found = load_batch(reference)
        assert any(note.startswith(name) for note in found.notes), place
        assert all(row in wanted for row in found.table.drop_columns(["cpu_s", "host"]).to_pylist())
    for size in (0, 1, 100, len(data) - 1):
        file.write_bytes(data[:size])
        assert load_batch(reference).n_runs == 0
    with pytest.warns(RuntimeWarning, match=f"{name} cannot be read.* are played again"):
        play(batch_of(mission), reference)
    assert tables_of(reference)[0].to_pylist() == wanted
    pq.write_table(pa.table({"run": [1]}), file)
    with pytest.raises(BatchError, match="is another table; it has no column"):
        load_batch(reference)


@pytest.mark.parametrize(
    "text", ["", '{"format": 1, "name"', "[1, 2]", '{"format": 2}', '{"format": 1, "name": "x"}', "\udc80"]
)
def test_a_batch_file_that_says_something_else_is_refused(mission, reference, text):
    (reference / schemas.BATCH_FILE).write_bytes(text.encode("utf-8", "surrogateescape"))
    for attempt in (lambda: load_batch(reference), lambda: play(batch_of(mission), reference)):
        with pytest.raises(BatchError, match=r"batch\.json: "):
            attempt()


def test_what_is_no_batch_is_left_as_it_is(mission, tmp_path):
    for name in ("mission", "parts"):
        (tmp_path / "theirs" / name).mkdir(parents=True)
    (tmp_path / "theirs" / "lock").write_text("mine")
    with pytest.raises(BatchError, match=r"theirs: holds something that is no batch \(mission\)"):
        play(batch_of(mission), tmp_path / "theirs")
    assert sorted(p.name for p in (tmp_path / "theirs").iterdir()) == ["lock", "mission", "parts"]
    assert (tmp_path / "theirs" / "lock").read_text() == "mine"
    with pytest.raises(BatchError, match=r"theirs: this is no batch directory; it has no batch.json"):
        load_batch(tmp_path / "theirs")
    with pytest.raises(BatchError, match="there is no such batch directory"):
        load_batch(tmp_path / "nowhere")
    with pytest.raises(RecordError, match=r"game.xml: cannot be written: File exists"):
        play(batch_of(mission), mission)
    with pytest.raises(RecordError, match="cannot be written: Not a directory"):
        play(batch_of(mission), mission / "below")


def test_only_one_plays_at_a_time(mission, tmp_path):
    first = Store(tmp_path / "out")
    with pytest.raises(BatchError, match="out: another process is playing this batch"):
        play(batch_of(mission), tmp_path / "out")
    first.close()
    play(batch_of(mission), tmp_path / "out")


def test_where_there_are_no_locks_it_is_said(tmp_path, monkeypatch):
    def no_locks(*_):
        raise OSError(95, os.strerror(95))

    monkeypatch.setattr(fcntl, "flock", no_locks)
    with pytest.warns(RuntimeWarning, match="this system has no locks"):
        Store(tmp_path / "out").close()


# -- full disks ---------------------------------------------------------------------------------------------------------------


@pytest.fixture
def small_disk(tmp_path):
    """A disk of little room; a function gives it more."""
    place = tmp_path / "disk"
    place.mkdir()

    def mount(size, *more):
        return subprocess.run(
            ["mount", "-t", "tmpfs", "-o", ",".join([f"size={size}k", *more]), "tmpfs", place], check=False, capture_output=True
        )  # fmt: skip

    if shutil.which("mount") is None or mount(64).returncode != 0:
        pytest.skip("needs root, who may mount a small disk")
    yield place, lambda size: mount(size, "remount").check_returncode()
    subprocess.run(["umount", place], check=True)


def refused(batch, path):
    """Why a batch could not be written, "" where it could."""
    try:
        play(batch, path)
    except RecordError as error:
        return str(error)
    return ""


def test_a_full_disk_is_told_and_with_more_room_the_batch_goes_on(mission, tmp_path, small_disk):
    disk, make_room = small_disk
    batch = batch_of(mission, 40)
    play(batch, tmp_path / "reference")
    n_runs = []
    for size in (64, 128, 176, 212, 260):  # it is full at other places each time: in a part, in a table
        make_room(size)
        said = refused(batch, disk / "out")
        if said:
            assert "cannot be written: No space left on device" in said
            assert "\n" not in said
            n_runs.append(load_batch(disk / "out").n_runs)
    assert len(n_runs) >= 2
    assert n_runs == sorted(n_runs)
    assert n_runs[0] > 10
    make_room(2000)
    play(batch, disk / "out")
    assert tables_of(disk / "out") == tables_of(tmp_path / "reference")
    assert facts_of(disk / "out") == facts_of(tmp_path / "reference")
