"""A recording for Rerun tells the whole run on the timeline of simulated time."""

import re
import sys
import tomllib
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from recorded_games import hunt, record

from tussle.errors import MissingExtraError
from tussle.scene import Base, Cuboid
from tussle.view import MODELS, Recording
from tussle.view.export.mcap_file import default_scale
from tussle.view.export.rerun_file import FRAMES_AT_ONCE, write_rerun
from tussle.view.scenery import Region, Scenery
from tussle.view.solids import Terrain, mesh_of, outline_of
from tussle.world.geodesy import Origin

COLUMNS = "*.Boids.target,*.Predator.target"


@pytest.fixture(scope="module")
def hunted(tmp_path_factory):
    """Births in the middle of it, captures, deaths, columns of plugins; more frames than are sent at once."""
    directory = tmp_path_factory.mktemp("runs") / "run"
    return Recording(record(hunt(n_prey=8, end=30.0), directory, (5,), columns=COLUMNS))


def read(path):
    """Values of each component on the timeline: (path, component) -> list of (time [s] or None, values)."""
    from rerun.chunk import RrdReader

    found = defaultdict(list)
    for chunk in RrdReader(path).store().stream():
        batch = chunk.to_record_batch()
        times = (
            batch["t"].to_numpy().astype(float) / 1e9 if "t" in batch.schema.names else [None] * len(batch)
        )
        for name in batch.schema.names:
            if ":" in name:
                found[chunk.entity_path, name].extend(
                    (t, v) for t, v in zip(times, batch[name].to_pylist(), strict=True) if v is not None
                )
    return found


@pytest.fixture(scope="module")
def written(hunted, tmp_path_factory):
    import needs

    needs.require("rerun")
    path = tmp_path_factory.mktemp("rerun") / "run.rrd"
    told = []
    report = write_rerun(hunted, path, show=lambda n, total: told.append((n, total)))
    assert report.n_frames == hunted.n_frames > FRAMES_AT_ONCE
    assert report.n_entities == len([event for event in hunted.events if event.kind == "birth"])
    assert told == [(FRAMES_AT_ONCE, hunted.n_frames), (hunted.n_frames, hunted.n_frames)]
    assert list(path.parent.iterdir()) == [path]
    return read(path)


def test_poses_are_the_recorded_states(written, hunted):
    seen = defaultdict(dict)
    for (path, component), values in written.items():
        if component.startswith("Transform3D:"):
            for t, value in values:
                seen[round(t, 6)].setdefault(path, {})[component] = value[0]
    for k in range(hunted.n_frames):
        frame, poses = hunted.frame(k), seen[round(float(hunted.t[k]), 6)]
        names = [f"/world/{hunted.blocks[b]}/{i}" for i, b in zip(frame.id, frame.block, strict=True)]
        assert sorted(poses) == sorted(names)
        for row, name in enumerate(names):
            np.testing.assert_allclose(poses[name]["Transform3D:translation"], frame.pos[row], rtol=1e-6)
            x, y, z, w = poses[name]["Transform3D:quaternion"]
            np.testing.assert_allclose([w, x, y, z], frame.quat[row], atol=1e-6)


def test_models_are_there_from_birth_to_removal_in_their_colours(written, hunted):
    begins = {path: values for (path, name), values in written.items() if name == "Mesh3D:vertex_positions"}
    ends = {path: values[0][0] for (path, name), values in written.items() if name == "Clear:is_recursive"}
    assert ends
    for k in range(hunted.n_frames):
        frame, now = hunted.frame(k), float(hunted.t[k])
        shown = {p for p, ((t, _),) in begins.items() if t <= now + 1e-9 and now + 1e-9 < ends.get(p, np.inf)}
        assert shown == {f"/world/{hunted.blocks[b]}/{i}" for i, b in zip(frame.id, frame.block, strict=True)}
    block = hunted.blocks.index("prey")
    faces = MODELS[hunted.style.model(block)].faces
    ((_, corners),) = begins["/world/prey/1"]
    assert len(corners) == faces.size
    length = np.ptp(np.array(corners)[:, 0]) / hunted.style.lengths(block)[0]
    assert length == pytest.approx(
        default_scale(hunted) * np.ptp(MODELS["aircraft"].vertices[:, 0]), rel=1e-3
    )
    ((_, (colour,)),) = written["/world/prey/1", "Mesh3D:albedo_factor"]
    assert tuple(colour.to_bytes(4, "big")) == (*hunted.style.block_colour(block), 255)


def test_teams_are_counted_columns_are_told_and_events_are_words(written, hunted):
    n = [(float(hunted.t[k]), [float((hunted.frame(k).team == 1).sum())]) for k in range(hunted.n_frames)]
    np.testing.assert_allclose(
        [(t, v) for t, (v,) in written["/teams/1", "Scalars:scalars"]], [(t, v) for t, (v,) in n], rtol=1e-9
    )
    alive = [k for k in range(hunted.n_frames) if hunted.frame(k).row_of(1) >= 0]
    targets = [hunted.values(k, "Boids.target")[hunted.frame(k).row_of(1)] for k in alive]
    told = written["/columns/prey/1/Boids/target", "Scalars:scalars"]
    np.testing.assert_array_equal([v for _, v in told], targets)
    names = [f"Boids.target.{axis}" for axis in "xyz"]
    assert written["/columns/prey/1/Boids/target", "SeriesLines:names"] == [(None, names)]
    words = [text for _, (text,) in written["/events", "TextLog:text"]]
    assert len(words) == len(hunted.events)
    death = next(event for event in hunted.events if event.kind == "death")
    assert any(word.endswith(f"died: captured (hunters/{death.other})") for word in words)


@pytest.mark.needs("rerun")
def test_what_stands_is_there_at_all_times(hunted, tmp_path, monkeypatch):
    low, high = np.full(3, -40.0), np.full(3, 40.0)
    shape = Cuboid(center=(0, 0, 10), lengths=(60, 60, 20))
    zone = Region("zone", 2, shape, False, mesh_of(shape, low, high), outline_of(shape, low, high))
    ground = Terrain(np.arange(5.0), np.arange(4.0), np.ones((4, 5)))
    base = Base(1, (1.0, 2.0, 3.0), 8.0, 1.0)
    scenery = Scenery(Origin(), 10.0, 0.0, low, high, 10.0, [base], [zone], ground)
    monkeypatch.setitem(hunted.__dict__, "scenery", scenery)
    write_rerun(hunted, tmp_path / "a.rrd", period=10.0)
    found = read(tmp_path / "a.rrd")
    assert found["/scenery/base\\ 1", "Ellipsoids3D:centers"] == [(None, [[1.0, 2.0, 3.0]])]
    assert found["/scenery/base\\ 1", "Ellipsoids3D:half_sizes"] == [(None, [[8.0, 8.0, 8.0]])]
    ((_, outline),) = found["/scenery/zone/outline", "LineStrips3D:strips"]
    assert len(outline) == 12
    ((_, (colour,)),) = found["/scenery/zone/surface\\ 0", "Mesh3D:albedo_factor"]
    assert tuple(colour.to_bytes(4, "big"))[:3] == hunted.style.colour(2)
    ((_, corners),) = found["/scenery/terrain/surface\\ 0", "Mesh3D:vertex_positions"]
    assert len(corners) == 3 * 2 * 3 * 4


def test_what_cannot_be_is_refused_and_leaves_nothing(hunted, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(MissingExtraError, match=r"rerun-sdk, .* pip install 'tussle\[rerun\]'"):
        write_rerun(hunted, tmp_path / "a.rrd")
    assert not list(tmp_path.iterdir())


@pytest.mark.needs("rerun")
def test_the_extra_brings_all_that_is_needed(hunted, tmp_path, monkeypatch):
    project = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text())["project"]
    view, own = (
        {re.split(r"[->]", each)[0] for each in project["optional-dependencies"][extra]}
        for extra in ("view", "rerun")
    )
    lacking = view - own
    assert "foxglove" in lacking
    for name in {*lacking, *(each for each in sys.modules if each.split(".")[0] in lacking)}:
        monkeypatch.setitem(sys.modules, name, None)
    assert write_rerun(hunted, tmp_path / "a.rrd", period=10.0).n_frames
