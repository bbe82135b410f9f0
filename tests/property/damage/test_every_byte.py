"""Every byte of a small run and of a small batch, flipped; and every length to which a file can be cut."""

from __future__ import annotations

import os
from pathlib import Path

import gambles
import pytest
from recorded_games import hunt, record

from tussle import load_run
from tussle.batch import Batch, InProcess, load_batch, schemas
from tussle.batch.damage import damage_in_batch
from tussle.batch.finished_runs import FinishedRuns
from tussle.batch.schemas import BATCH
from tussle.documents import Document
from tussle.errors import BatchError, RecordError, TussleError
from tussle.record.arrow_file import read_batches
from tussle.record.damage import damage_in_run, file_damage, stream_damage
from tussle.record.parquet_blocks import intact_groups
from tussle.record.schema import RUN, TRAJECTORY

pytestmark = pytest.mark.slow
READ_EVERY = 29
"""Damaged bytes of which one is also read by the whole loader."""


class Stopped(Exception):
    pass


def stop(progress):
    if progress.n_done >= 2:
        raise Stopped


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return record(hunt(n_prey=2, end=0.3), tmp_path_factory.mktemp("run") / "run", flush_every=1e-9)


@pytest.fixture(scope="module")
def batches(tmp_path_factory):
    """A batch that was stopped, with a part of two runs, and a whole one."""
    place = tmp_path_factory.mktemp("batch")
    (place / "game.xml").write_text(gambles.MISSION)
    games = Batch(place / "game.xml", runs=3, plugin_files=[gambles.THIS])
    with pytest.raises(Stopped):
        games.play(place / "cut", InProcess(1), on_progress=stop)
    games.play(place / "whole", InProcess(1))
    return place


def flipped(path: Path):
    """Flip one bit of each byte in turn, in the file itself: writing it anew would wait for the disk."""
    data = path.read_bytes()
    with path.open("r+b", buffering=0) as file:
        for at, byte in enumerate(data):
            os.pwrite(file.fileno(), bytes([byte ^ 1 << at % 8]), at)
            yield at
            os.pwrite(file.fileno(), data[at : at + 1], at)


def cut(path: Path):
    """Cut a file shorter and shorter."""
    data = path.read_bytes()
    for size in range(len(data) - 1, -1, -1):
        os.truncate(path, size)
        yield size
    path.write_bytes(data)


def tells_document(document: Document, path: Path) -> bool:
    try:
        document.read(path)
    except TussleError:
        return True
    return False


def tells_groups(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            found = intact_groups(file, path.stat().st_size)
    except ValueError:
        return True
    return found is None or len(found[0]) < found[1]


def test_each_flipped_byte_of_a_run_is_told(run):
    whole = {row["t"]: row for row in load_run(run).trajectory_table.to_pylist()}
    for at in flipped(run / "trajectory.arrow"):
        assert (
            stream_damage(run / "trajectory.arrow")[0] or at >= (run / "trajectory.arrow").stat().st_size - 8
        ), at
        if at % READ_EVERY == 0:
            notes: list[str] = []
            batches = list(
                read_batches(run / "trajectory.arrow", notes, RecordError, TRAJECTORY, damage=notes)
            )
            assert notes
            assert all(row["t"] in whole for batch in batches for row in batch.to_pylist())
    checksums = RUN.read(run / "run.json")["checksums"]
    for name in ("mission.xml", "summary.csv"):
        assert all(file_damage(run, {name: checksums[name]}, "run.json") for _ in flipped(run / name))
    assert damage_in_run(run) == ([], [])


@pytest.mark.parametrize("kind", ["run", "whole"])
def test_each_flipped_byte_of_a_document_is_told_or_changes_no_value(run, batches, kind):
    document, path = (RUN, run / "run.json") if kind == "run" else (BATCH, batches / "whole/batch.json")
    values = document.read(path)
    for at in flipped(path):
        if not tells_document(document, path):
            found = document.read(path)
            assert {k: v for k, v in found.items() if k in values} == values, at


def finished(path, design):
    """The results of the runs that are not in the tables yet, and what is told of damage."""
    notes: list[str] = []
    return [row for results, _ in FinishedRuns(path, design, notes) for row in results.to_pylist()], notes


def test_each_flipped_byte_of_a_batch_is_told(batches):
    part, design = batches / "cut" / schemas.PARTS / "0001.arrow", load_batch(batches / "cut").design
    rows = finished(batches / "cut", design)[0]
    assert rows
    for at in flipped(part):
        found, notes = finished(batches / "cut", design)
        assert notes or found == rows, at  # all are there if only the end mark is damaged
        assert all(row in rows for row in found), at
    table = load_batch(batches / "whole").table.to_pylist()
    for name in (schemas.RESULTS_FILE, schemas.ALIVE_FILE, schemas.DESIGN_FILE):
        for at in flipped(batches / "whole" / name):
            assert tells_groups(batches / "whole" / name), at
            if at % READ_EVERY == 0 and name != schemas.DESIGN_FILE:
                loaded = load_batch(batches / "whole")
                assert all(row in table for row in loaded.table.to_pylist()), at
    assert damage_in_batch(batches / "whole") == ([], [])


def test_each_cut_of_a_file_is_told(run, batches):
    for size in cut(run / "events.arrow"):
        if size % READ_EVERY == 0:
            assert damage_in_run(run)[0], size
    for at in cut(batches / "whole" / schemas.RESULTS_FILE):
        assert tells_groups(batches / "whole" / schemas.RESULTS_FILE), at
    part = batches / "cut" / schemas.PARTS / "0001.arrow"
    order = [batch["run"][0].as_py() for batch in read_batches(part, [], BatchError)]
    design = load_batch(batches / "cut").design
    rows = finished(batches / "cut", design)[0]
    for size in cut(part):
        found = finished(batches / "cut", design)[0]
        runs = {row["run"] for row in found}
        assert runs == set(order[: len(runs)]), size
        assert found == [row for row in rows if row["run"] in runs], size
