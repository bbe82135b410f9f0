"""What stands still is what the mission says, and all of it is within what is shown."""

import numpy as np
import pytest

from tussle import Block, Mission, Scene
from tussle.mission import read_mission
from tussle.scene import Base, Cuboid, FlatGround, Plane, Sphere
from tussle.stock import Boundary, Still
from tussle.view import scenery_of
from tussle.world.geodesy import Origin

ROBOT = Block(name="robot", position=(100, 0, 20), motion=Still())


def mission(scene=None, **changes):
    return Mission(blocks=[ROBOT], scene=scene or Scene()).replace(**changes)


def test_bases_boundaries_walls_and_origin():
    scene = Scene(
        origin=Origin(0.5, 0.1, 30.0),
        ground=FlatGround(-3.0),
        walls=(Cuboid((0, 0, 5), (10, 10, 10)),),
        boundaries={"field": Sphere((0, 0, 0), 300.0), 7: Plane((0, 0, 0), (0, 1, 0))},
        bases=(Base(2, (-400.0, 0.0, 0.0), 50.0, 0.5),),
    )
    fence = Boundary(
        name="fence", boundary_id=3, team=4, shape="cuboid", center=(0, 0, 50), lengths=(100, 100, 100)
    )
    seen = scenery_of(mission(scene, interactions=[fence]))
    assert seen.origin == Origin(0.5, 0.1, 30.0)
    assert seen.ground == -3.0
    (base,) = seen.bases
    assert (base.team, base.position, base.radius, base.opacity) == (2, (-400.0, 0.0, 0.0), 50.0, 0.5)
    names = [(b.name, b.team, b.is_wall, type(b.shape)) for b in seen.boundaries]
    assert names == [
        ("field", None, False, Sphere), ("7", None, False, Plane), ("wall 1", None, True, Cuboid), ("fence", 4, False, Cuboid),
    ]  # fmt: skip
    for region in seen.boundaries:
        assert len(region.mesh.faces)
        assert region.outline.shape[1:] == (2, 3)
    assert seen.low.tolist() == [-450.0, -300.0, -300.0]
    assert seen.high.tolist() == [300.0, 300.0, 300.0]
    assert seen.size == pytest.approx(np.linalg.norm(seen.high - seen.low))
    assert seen.notes == ()


def test_without_a_mission_there_is_the_extent_of_the_game():
    seen = scenery_of(None, {}, (np.array([0.0, -10.0, 5.0]), np.array([1000.0, 200.0, 80.0])))
    assert seen.low.tolist() == [0.0, -10.0, 5.0]
    assert seen.high.tolist() == [1000.0, 200.0, 80.0]
    assert (seen.ground, seen.bases, seen.boundaries, seen.terrain) == (0.0, [], [], None)


def test_a_game_in_one_point_can_be_looked_at():
    seen = scenery_of(mission())
    assert (seen.high - seen.low)[:2].tolist() == [50.0, 50.0]
    assert (0.5 * (seen.high + seen.low)).tolist() == [100.0, 0.0, 20.0]
    nothing = scenery_of(None)
    assert (nothing.high - nothing.low)[:2].tolist() == [50.0, 50.0]


def test_where_entities_begin_is_shown_before_they_have_moved():
    normal = ROBOT.replace(name="normal", count=9, variance=(100.0, 400.0, 0.0), position=(0, 0, 0))
    even = ROBOT.replace(
        name="even", count=9, placement="uniform", half_width=(5.0, 5.0, 70.0), position=(0, 0, 0)
    )
    seen = scenery_of(mission(blocks=[normal, even]))
    assert seen.low.tolist() == [-30.0, -60.0, -70.0]
    assert seen.high.tolist() == [30.0, 60.0, 70.0]


@pytest.mark.parametrize(
    ("width", "step"), [(50.0, 5.0), (390.0, 20.0), (400.0, 20.0), (401.0, 50.0), (1e4, 500.0), (3e6, 2e5)]
)
def test_the_grid_has_round_steps(width, step):
    seen = scenery_of(None, {}, (np.zeros(3), np.array([width, 10.0, 0.0])))
    assert seen.grid_step == step


def test_what_a_mission_file_says_for_the_viewer():
    viewer = {"grid_spacing": 7.0, "show_origin": True, "origin_length": 12.0, "background_color": "1 2 255"}
    seen = scenery_of(mission(), viewer)
    assert (seen.grid_step, seen.origin_length, seen.background) == (7.0, 12.0, (1, 2, 255))
    assert scenery_of(mission(), {"show_origin": False}).origin_length == 0.0
    plain = scenery_of(mission())
    assert plain.origin_length > 0.0
    assert plain.background is None


def test_what_is_not_shown_is_told():
    seen = scenery_of(mission(), {"background_color": "blue"})
    assert seen.background is None
    assert [note.split()[0] for note in seen.notes] == ["background_color"]


def test_a_shipped_mission():
    loaded = read_mission("predator_prey")
    seen = scenery_of(loaded.mission, loaded.viewer)
    assert all(np.isfinite([*seen.low, *seen.high]))
    for block in loaded.mission.blocks:
        assert (seen.low <= block.position).all()
        assert (block.position <= seen.high).all()
