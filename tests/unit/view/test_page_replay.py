"""Recorded runs as the page reads them, and where two of them part."""

import json
from itertools import pairwise
from urllib.error import HTTPError
from urllib.request import urlopen

import numpy as np
import pyarrow as pa
import pytest
from page_reader import Bytes, read_chunk
from recorded_games import hunt

from tussle import Recorder, Simulation
from tussle.errors import RecordError, ViewError
from tussle.view import Recording
from tussle.view.page import recorded as recorded_data
from tussle.view.page.compare import Comparison, first_difference, what_differs
from tussle.view.page.recorded import RecordedData, chunk_bounds
from tussle.view.page.server import Page


def recorded(folder, seed=3, steps=40, **changes):
    with Simulation(hunt(**changes), seed) as simulation, Recorder(simulation, folder):
        simulation.step(steps)
    return folder


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A run, the same again and longer, and one with another seed."""
    base = tmp_path_factory.mktemp("runs")
    return (recorded(base / "one"), recorded(base / "longer", steps=50), recorded(base / "other", seed=4))


# -- one run ----------------------------------------------------------------------------------------------------------------------


def test_chunks_cover_all_frames_and_share_their_ends():
    counts = np.full(1000, 100)
    bounds = chunk_bounds(counts, 3000, 4)
    assert bounds[0][0] == 0
    assert bounds[-1][1] == 999
    assert all(a[1] == b[0] for a, b in pairwise(bounds))
    assert {last - first for first, last in bounds[:-1]} == {29}
    assert chunk_bounds(np.array([5]), 100, 4) == [(0, 0)]
    assert chunk_bounds(np.full(9, 10**6), 100, 4) == [(0, 3), (3, 6), (6, 8)]
    assert chunk_bounds(np.zeros(5000, int), 100, 4)[0] == (0, 1023)


@pytest.mark.parametrize("is_mapped", [False, True])
def test_a_served_run_is_what_was_recorded(runs, monkeypatch, is_mapped):
    monkeypatch.setattr(recorded_data, "SERVED_STATES", 100)
    recording = Recording(runs[0], is_mapped=is_mapped)
    with Page(recording, warp=2.0, is_paused=True) as page:

        def blob(name):
            with urlopen(f"{page.url}/{name}", timeout=60) as answer:
                return answer.read()

        document = json.loads(blob("").split(b'id="document">')[1].split(b"</script>")[0])
        assert (document["source"], document["warp"], document["isPlaying"]) == ("range", 2.0, False)
        assert (Bytes(blob("times")).reals(document["nFrames"]) == recording.t).all()
        assert len(document["chunks"]) > 5
        for i, (first, last) in enumerate(document["chunks"]):
            chunk = read_chunk(blob(f"chunk-{i}"))
            for k in range(first, last + 1):
                frame, seen = recording.frame(k), chunk.frames[k - first]
                assert sorted(seen) == frame.id.tolist()
                off = np.array([seen[who].pos for who in frame.id.tolist()]) - frame.pos
                assert np.linalg.norm(off, axis=1).max() <= document["positionError"] + 1e-11
        assert len(json.loads(blob("events"))) == len(recording.events)
        curves = {
            (c["name"], c["team"]): dict(zip(c["t"], c["v"], strict=True)) for c in json.loads(blob("curves"))
        }
        assert curves["left", 1][0.0] + curves["left", 2][0.0] == len(recording.frame(0))
        with pytest.raises(HTTPError, match="404") as told:
            blob("chunk-999")
        told.value.close()


def columns_of(data, number):
    """Values of each column of plugins in a chunk, by frame and id."""
    document = data.document()
    first, last = document["chunks"][number]
    read = Bytes(data.blob(f"columns-{number}"))
    counts = read.ints(last - first + 1)
    ids = np.array(read.ints(sum(counts)))
    frames = np.repeat(np.arange(first, last + 1), counts)
    found = {}
    for column in document["columns"]:
        values = np.stack([read.reals(len(ids)) for _ in column["fields"] or [""]], axis=1)
        found[column["name"]] = dict(
            zip(zip(frames.tolist(), ids.tolist(), strict=True), values, strict=True)
        )
    return found


@pytest.mark.parametrize("is_mapped", [False, True])
def test_columns_of_plugins_are_served_chunk_by_chunk(tmp_path, monkeypatch, is_mapped):
    monkeypatch.setattr(recorded_data, "SERVED_STATES", 100)
    with Simulation(hunt(), [2, 3]) as sim, Recorder(sim, tmp_path / "run", columns="*.target,*.x"):
        sim.step(40)
    recording = Recording(tmp_path / "run", world=1, is_mapped=is_mapped)
    data = RecordedData(recording, is_file=False)
    about = {each["name"]: each for each in data.document()["columns"]}
    assert about["Boids.target"]["units"] == ["m", "m", "m"]
    assert (about["Predator.target"]["kind"], about["Predator.target"]["doc"]) == (
        "int",
        "Prey being hunted.",
    )
    assert "columns-0" in data.names
    for number, (first, last) in enumerate(data.chunks):
        found = columns_of(data, number)
        for name, column in found.items():
            for i in range(first, last + 1):
                ids = recording.frame(i).id.tolist()
                expected = recording.values(i, name).astype(float).filled(np.nan)
                np.testing.assert_array_equal([column[i, who] for who in ids], expected)
    assert data.blob(f"columns-{len(data.chunks)}") is None


def test_a_run_without_columns_of_plugins_has_none_to_serve(runs):
    data = RecordedData(Recording(runs[0]), is_file=True)
    assert data.document()["columns"] == []
    assert not [name for name in data.names if name.startswith("columns")]
    assert data.blob("columns-0") is None


def test_of_two_runs_the_columns_are_those_of_both(runs, tmp_path):
    with Simulation(hunt(), 4) as sim, Recorder(sim, tmp_path / "run", columns="*.Boids.target"):
        sim.step(40)
    a, b = Recording(runs[0]), Recording(tmp_path / "run")
    both = Comparison(a, b)
    assert list(both.columns) == ["Boids.target"]
    values = both.values(20, "Boids.target")
    assert len(values) == len(both.frame(20))
    n = len(a.frame(20))
    assert values[:n].mask.all()
    np.testing.assert_array_equal(values[n:].filled(0.0), b.values(20, "Boids.target").filled(0.0))


def test_data_that_cannot_be_made_is_told_and_the_page_goes_on(runs, monkeypatch):
    with Page(Recording(runs[0])) as page:

        def fail(*_):
            raise RuntimeError("no such thing")

        monkeypatch.setattr(recorded_data, "pack", fail)
        with pytest.raises(HTTPError, match="500") as told:
            urlopen(f"{page.url}/chunk-0", timeout=60)
        with told.value as answer:
            assert b"the page: RuntimeError: no such thing" in answer.read()
        assert isinstance(page.error, RuntimeError)
        with urlopen(f"{page.url}/times", timeout=60) as answer:
            assert answer.status == 200


def test_a_run_that_stays_in_its_file_is_the_same_run(runs):
    whole, mapped = Recording(runs[0]), Recording(runs[0], is_mapped=True)
    assert (mapped.t == whole.t).all()
    assert (mapped.counts == whole.counts).all()
    assert (mapped.blocks, mapped.teams, mapped.is_complete) == (whole.blocks, whole.teams, True)
    for i in (0, 17, -1):
        for name in ("id", "team", "block", "pos", "quat", "vel", "health"):
            assert (getattr(mapped.frame(i), name) == getattr(whole.frame(i), name)).all()
    for one, other in zip(mapped.extent, whole.extent, strict=True):
        assert one == pytest.approx(other, abs=1.0)


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [("x", np.nan, "not finite"), ("id", 3, "ids do not ascend"), ("qw", np.inf, "not finite")],
)
def test_a_wrong_value_of_a_run_that_stays_in_its_file_is_told_when_it_is_seen(
    tmp_path, monkeypatch, name, value, told
):
    monkeypatch.setattr("tussle.view.recording.MAX_SAMPLED", 2)
    directory = recorded(tmp_path / "run")
    path = directory / "trajectory.arrow"
    batches = list(pa.ipc.open_stream(path.read_bytes()))
    schema = batches[0].schema.remove_metadata()  # which says that each block has a checksum
    with pa.OSFile(str(path), "wb") as file, pa.ipc.new_stream(file, schema) as writer:
        for batch in batches:
            values, rows = np.asarray(batch[name]).copy(), np.flatnonzero(np.asarray(batch["step"]) == 5)
            values[rows[7:8]] = value
            columns = [pa.array(values) if field.name == name else batch[field.name] for field in schema]
            writer.write_batch(pa.RecordBatch.from_arrays(columns, schema=schema))
    recording = Recording(directory, is_mapped=True)
    recording.frame(4)
    with pytest.raises(RecordError, match=f"step 5: .*{told}"):
        recording.frame(5)


# -- two runs ---------------------------------------------------------------------------------------------------------------------


def test_the_same_game_twice_does_not_differ(runs):
    one, longer = Recording(runs[0]), Recording(runs[1])
    assert first_difference(one, longer) is None
    assert "do not differ up to t = 4 s" in Comparison(one, longer).lead


def test_two_runs_begin_where_they_part_and_say_what_differs(runs):
    pair = Comparison(Recording(runs[0]), Recording(runs[2]))
    assert pair.difference.step == 0
    assert "they differ first at t = 0 s (step 0): pos of entities" in pair.lead
    assert pair.lead in pair.notes
    assert any(event.kind == "difference" for event in pair.events)
    with Page(pair) as page, urlopen(page.url, timeout=60) as answer:
        assert b"they differ first at t = 0 s" in answer.read()
        assert pair.lead in page.notes


def test_the_first_difference_is_found_after_a_common_beginning(tmp_path):
    with Simulation(hunt(), 3) as simulation, Recorder(simulation, tmp_path / "a"):
        simulation.step(20)
    with Simulation(hunt(), 3) as simulation, Recorder(simulation, tmp_path / "b"):
        simulation.step(12)
        speed, _ = simulation.read("hunters.vel")
        simulation.write("hunters.vel", speed * 1.5)
        simulation.step(8)
    found = first_difference(Recording(tmp_path / "a"), Recording(tmp_path / "b"))
    assert found.step in (12, 13)
    assert "of entities 13, 14, 15" in found.text


def test_runs_side_by_side_stand_apart_and_over_each_other_do_not(runs):
    a, b = Recording(runs[0]), Recording(runs[2])
    beside, over = Comparison(a, b), Comparison(a, b, is_over_each_other=True)
    n = len(a.at(0.0))
    assert beside.frame(0).pos[n:, 0].min() > beside.frame(0).pos[:n, 0].max()
    assert np.array_equal(over.frame(0).pos[n:], b.at(0.0).pos)
    frame = over.frame(0)
    assert (np.diff(frame.id) > 0).all()
    assert (frame.id[n:] - over.id_shift == b.frame(0).id).all()
    assert [over.blocks[frame.block[i]] for i in (0, n)] == ["A prey", "B prey"]
    assert over.style.block_colour(0) != over.style.block_colour(len(a.blocks))
    assert over.counts[0] == len(frame)
    assert (beside.scenery.high[0] - beside.scenery.low[0]) > (over.scenery.high[0] - over.scenery.low[0])


def test_one_that_has_ended_stays_as_it_was(runs):
    pair = Comparison(Recording(runs[0]), Recording(runs[1]))
    assert len(pair.t) == 51
    last = pair.frame(50)
    assert (last.pos[: len(pair.a.frame(-1))] == pair.a.frame(-1).pos).all()
    data = RecordedData(pair, is_file=False)
    assert sorted(read_chunk(data.blob("chunk-0")).frames[0]) == pair.frame(0).id.tolist()


def test_who_is_in_one_run_only_is_named(runs):
    frame = Recording(runs[0]).frame(0)
    fewer = type(frame)(*(v[2:] if isinstance(v, np.ndarray) else v for v in vars(frame).values()))
    assert what_differs(frame, fewer) == "entities 1, 2 only in A"
    assert what_differs(fewer, frame) == "entities 1, 2 only in B"
    assert what_differs(frame, frame) == ""


def test_a_run_without_moments_cannot_be_compared_or_served(runs, tmp_path):
    with Simulation(hunt(), 3) as simulation, Recorder(simulation, tmp_path / "none"):
        pass
    empty = Recording(tmp_path / "none")
    empty.t = empty.t[:0]
    with pytest.raises(ViewError, match="nothing was recorded"):
        Comparison(Recording(runs[0]), empty)
    with pytest.raises(ViewError, match="nothing was recorded"):
        Page(empty)
