"""The terrain of a mission is shown by the viewer and in recordings."""

import numpy as np
import pytest

from tussle import Recorder, Simulation
from tussle.mission import read_mission
from tussle.view import Live, Recording
from tussle.view.solids import MAX_DRAWN, Terrain
from tussle.world.rays.files import read_surface

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
    terrain = Terrain.of(read_surface(hills))
    assert terrain.x.tolist() == [0.0, 10.0, 20.0]
    assert terrain.y.tolist() == [-5.0, 5.0]
    assert terrain.height.tolist() == [[0.0, 1.0, 0.0], [3.0, 4.0, 5.0]]
    hills.write_text(GRID.replace("corner", "center"))
    assert Terrain.of(read_surface(hills)).x.tolist() == [-5.0, 5.0, 15.0]


def test_its_surface_is_seen_from_above(hills):
    terrain = Terrain.of(read_surface(hills))
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
    assert 0.5 * MAX_DRAWN < thin.height.size <= MAX_DRAWN
    np.testing.assert_array_equal(thin.height, thin.y[:, None] + thin.x)
    assert len(terrain.mesh().vertices) == thin.height.size
    assert terrain.thinned(10**6) is not None
    assert terrain.thinned(10**6).height.size == 10**6


def test_it_is_found_beside_the_mission_and_beside_the_recording(tmp_path, hills):
    (tmp_path / "hilly.xml").write_text(MISSION)
    loaded = read_mission(tmp_path / "hilly.xml")
    live = Live(Simulation(loaded.mission), threaded=False, viewer=loaded.viewer)
    assert live.scenery.terrain.height.max() == 5.0
    assert live.scenery.notes == ()
    with Recorder(Simulation(loaded.mission), tmp_path / "run", mission_text=loaded.text) as recorder:
        recorder.sim.run()
    recording = Recording(tmp_path / "run")
    assert recording.scenery.terrain is None
    assert any("there is no 'hills.asc' beside the mission" in note for note in recording.notes)
    (tmp_path / "run" / "hills.asc").write_text(GRID)
    assert Recording(tmp_path / "run").scenery.terrain.height.max() == 5.0
