"""Shapes that plugins draw, recorded and shown again."""

import json
import struct

import numpy as np
import pyarrow as pa
import pytest
from watched_plugins import clickable

from tussle import Recorder, Simulation, load_run
from tussle.errors import RecordError
from tussle.record.schema import SHAPES
from tussle.view import Live, Recording
from tussle.view.page.compare import Comparison
from tussle.view.page.drawing import drawing_message
from tussle.view.page.recorded import RecordedData

SEEDS = [1, 2]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run of two worlds whose plugins draw arrows in each step, and a text that is seen for 0.35 s."""
    folder = tmp_path_factory.mktemp("shapes") / "run"
    with Simulation(clickable(), SEEDS) as simulation, Recorder(simulation, folder, shapes=True):
        simulation.run(until=2.0)
    return folder


@pytest.mark.parametrize("world", [0, 1])
def test_a_frame_shows_the_shapes_that_were_seen_live(folder, world):
    recording = Recording(folder, world)
    assert recording.has_shapes
    with Simulation(clickable(), SEEDS[world]) as simulation:
        live = Live(simulation, threaded=False)
        live.shapes()
        for i in range(1, 12):
            live.step()
            one, other = (drawing_message(shapes)[:2] for shapes in (live.shapes(), recording.shapes(i)))
            assert one == other, i
            assert len(one[0]["parts"]) == 1
    assert recording.shapes(0) == ()


def test_a_run_without_them_has_no_file(tmp_path):
    with Simulation(clickable()) as simulation, Recorder(simulation, tmp_path):
        simulation.run(until=0.5)
    assert not (tmp_path / "shapes.arrow").exists()
    recording = Recording(tmp_path)
    assert not recording.has_shapes
    assert RecordedData(recording, is_file=True).document()["shapeFrames"] == 0


def test_steps_that_are_played_again_are_recorded_once(tmp_path):
    with Simulation(clickable()) as simulation, Recorder(simulation, tmp_path, shapes=True):
        live = Live(simulation, threaded=False)
        live.step(20)
        live.seek(0.5)
        live.step(20)
    step = np.asarray(load_run(tmp_path).shapes_table["step"])
    assert np.unique(step, return_counts=True)[1].tolist() == [2] * 25


def test_data_of_the_page_have_each_drawing_once(folder):
    data = RecordedData(Recording(folder), is_file=True)
    assert data.document()["shapeFrames"] == 64
    assert "shapes-0" in data.names
    blob, at, frames = data.blob("shapes-0"), 0, []
    while at < len(blob):
        frame, length = struct.unpack_from("<2I", blob, at)
        header_length = struct.unpack_from("<I", blob, at + 8)[0]
        header = json.loads(blob[at + 12 : at + 12 + header_length])
        frames.append((frame, [part["n"] for part in header["parts"]]))
        at += 8 + length
    assert frames[:2] == [(0, []), (1, [3])]
    assert data.blob("shapes-1") is None


def test_two_runs_show_the_shapes_of_both(folder):
    one, other = Recording(folder, 0), Recording(folder, 1)
    pair = Comparison(one, other)
    a, _, b, _ = [shape for shape in pair.shapes(1) if shape.kind in ("vectors", "text")]
    assert np.allclose(np.array(a.attributes["pos"]), one.frame(0).pos.T)
    assert np.allclose(np.array(b.attributes["pos"]), other.frame(0).pos.T + pair.shift[:, None])


@pytest.mark.parametrize(("kind", "attributes"), [("sphere", "[1]"), ("sphere", "{"), ("__class__", "{}")])
def test_a_row_that_holds_no_shape(folder, tmp_path, kind, attributes):
    for path in folder.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "run.json").unlink()
    row = pa.RecordBatch.from_pylist(
        [{"world": 0, "t": 0.0, "step": 0, "kind": kind, "lifetime": 0.0, "attributes": attributes}], SHAPES
    )
    with pa.ipc.new_stream(tmp_path / "shapes.arrow", SHAPES) as writer:
        writer.write_batch(row)
    with pytest.raises(RecordError, match="row 0 of world 0"):
        Recording(tmp_path).shapes(1)


def test_values_that_json_does_not_know_stop_no_game(tmp_path):
    with Simulation(clickable()) as simulation, Recorder(simulation, tmp_path, shapes=True):
        draw = simulation.state.context.draw
        draw.sphere(pos=object(), radius=np.float32(2.0), lifetime="long")
        draw.text(pos=(0, 0, 0), text=np.nan, lifetime=np.inf)
        simulation.step()
    recording = Recording(tmp_path)
    assert [shape.kind for shape in recording.shapes(1)] == ["sphere", "text", "vectors", "text"]
    header, _, notes = drawing_message(recording.shapes(1))
    assert [text for text, *_ in header["texts"]] == ["nan", "goal"]
    assert any("sphere" in note for note in notes)
