"""Terrain is read from a grid beside the mission, and from nowhere else."""

import numpy as np
import pytest

from tussle import Recorder, Simulation
from tussle.errors import ViewError
from tussle.mission import read_mission
from tussle.view import Live, Recording, scenery_of
from tussle.view.terrain import MOST_DRAWN, Terrain, read_terrain

GRID = """ncols 3
nrows 2
xllcorner -5
yllcorner -10
cellsize 10
NODATA_value -1
3 4 5
0 1 -1
"""
MISSION = """<runscript name="hilly"><run dt="0.1" end="1"/><terrain>hills.asc</terrain>
<entity><team_id>1</team_id><motion_model>Still</motion_model></entity></runscript>
"""


@pytest.fixture
def hills(tmp_path):
    (tmp_path / "hills.asc").write_text(GRID)
    return tmp_path / "hills.asc"


def test_a_grid_lies_where_it_says_with_its_first_line_in_the_north(hills):
    terrain = read_terrain(hills)
    assert terrain.x.tolist() == [0.0, 10.0, 20.0]
    assert terrain.y.tolist() == [-5.0, 5.0]
    assert terrain.height.tolist() == [[0.0, 1.0, 0.0], [3.0, 4.0, 5.0]]
    hills.write_text(GRID.replace("corner", "center"))
    assert read_terrain(hills).x.tolist() == [-5.0, 5.0, 15.0]


def test_its_surface_is_seen_from_above(hills):
    terrain = read_terrain(hills)
    mesh = terrain.mesh()
    assert len(mesh.faces) == 4
    for x, y, z in mesh.vertices:
        assert terrain.height[np.searchsorted(terrain.y, y), np.searchsorted(terrain.x, x)] == z
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    up = np.cross(b - a, c - a)[:, 2]
    assert (up > 0.0).all()
    assert 0.5 * up.sum() == pytest.approx(200.0)


def test_large_ones_are_drawn_coarsely():
    x = np.arange(1000.0)
    terrain = Terrain(x, x, x[:, None] + x)
    thin = terrain.thinned()
    assert 0.5 * MOST_DRAWN < thin.height.size <= MOST_DRAWN
    np.testing.assert_array_equal(thin.height, thin.y[:, None] + thin.x)
    assert len(terrain.mesh().vertices) == thin.height.size
    assert terrain.thinned(10**6) is not None
    assert terrain.thinned(10**6).height.size == 10**6


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (GRID.replace("ncols 3", "ncols 4"), "there are 6 heights; needed are 4 x 2"),
        (GRID.replace("ncols 3\n", ""), "has no ncols"),
        (GRID.replace("ncols 3", "ncols 2.5"), "has no ncols, or one that is not allowed"),
        (GRID.replace("ncols", "ncolls"), r":1: a terrain has no 'ncolls' \(did you mean 'ncols'\?\)"),
        (GRID.replace("cellsize 10", "cellsize ten"), ":5: cellsize takes one number"),
        (GRID.replace("cellsize 10", "cellsize 0"), "every 0 m is not allowed"),
        (GRID.replace("ncols 3", "ncols 3000000"), "is not allowed"),
        (GRID.replace("3 4 5", "3 4 x"), "not all heights are numbers"),
        (GRID.replace("3 4 5\n0 1", "-1 -1 -1\n-1 -1"), "no cell has a height"),
        ("", "has no ncols"),
        ("ncols ä", "cannot be read"),
    ],
)
def test_what_is_no_grid(tmp_path, text, told):
    path = tmp_path / "x.asc"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ViewError, match=told):
        read_terrain(path)


def test_too_much_is_not_read(tmp_path):
    path = tmp_path / "x.asc"
    with path.open("wb") as file:
        file.truncate(65_000_000)
    with pytest.raises(ViewError, match="more than 64 MB"):
        read_terrain(path)


def test_it_is_found_beside_the_mission_and_beside_the_recording(tmp_path, hills):
    (tmp_path / "hilly.xml").write_text(MISSION)
    loaded = read_mission(tmp_path / "hilly.xml")
    live = Live(Simulation(loaded.mission), threaded=False, viewer=loaded.viewer, folder=tmp_path)
    assert live.scenery.terrain.height.max() == 5.0
    assert live.scenery.notes == ()
    with Recorder(Simulation(loaded.mission), tmp_path / "run", mission_text=loaded.text) as recorder:
        recorder.sim.run()
    recording = Recording(tmp_path / "run")
    assert recording.scenery.terrain is None
    assert "hills.asc: the terrain cannot be read" in recording.scenery.notes[0]
    (tmp_path / "run" / "hills.asc").write_text(GRID)
    assert Recording(tmp_path / "run").scenery.terrain.height.max() == 5.0


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("../hills.asc", "only files in the mission's folder"),
        ("/etc/hills.asc", "only files"),
        ("none.asc", "cannot be read"),
    ],
)
def test_nothing_is_read_from_elsewhere(tmp_path, hills, name, told):
    inner = tmp_path / "inner"
    inner.mkdir()
    seen = scenery_of(None, {"terrain": name}, folder=inner)
    assert seen.terrain is None
    assert told in seen.notes[0]
    assert seen.notes[0].endswith("a flat ground is shown")
    assert "no folder" in scenery_of(None, {"terrain": "hills.asc"}).notes[0]
    link = inner / "link.asc"
    link.symlink_to(hills)
    assert "only files" in scenery_of(None, {"terrain": "link.asc"}, folder=inner).notes[0]
