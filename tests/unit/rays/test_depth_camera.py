"""DepthCamera: closed forms, the scene's rays, noise; occlusion for cameras and radios."""

from __future__ import annotations

import math

import numpy as np
import pytest
from test_radio_network import Radio

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Input, Output
from tussle.errors import ParameterError
from tussle.scene import Cuboid, FlatGround, HeightField, Prism, Scene, TriangleMesh
from tussle.stock import (
    ContactBlobCamera,
    DepthCamera,
    FieldOfView,
    RadioNetwork,
    SingleIntegrator,
    SphereNetwork,
    Still,
)
from tussle.world.rays.solids import KINDS

WIDTH, HEIGHT = 9, 7
WALL = Cuboid((10.5, 0, 0), (1, 100, 100))


def still(name, pos, **values):
    return Block(name=name, position=pos, variance=(0.0, 0.0, 0.0), motion=Still(), **values)


def camera(**values):
    return DepthCamera(
        **{"img_width": WIDTH, "img_height": HEIGHT, "azimuth_fov": "90 deg", "elevation_fov": "60 deg", "max_range": 40.0} | values
    )  # fmt: skip


def play(*blocks, scene=None, seeds=(1,), steps=1, **values):
    sim = Simulation(Mission(blocks=blocks, scene=scene or Scene(), end=1e3, **values), list(seeds))
    sim.step(steps)
    return sim


def images(sim, name="c"):
    """Depth, kind, id, team and solid of the first entity, (HEIGHT, WIDTH) each."""
    depth = sim.read(f"{name}.DepthCamera.depth")[0][0, 0]
    shown = sim.read(f"{name}.DepthCamera.segmentation")[0][0, 0]
    return [np.reshape(each, (HEIGHT, WIDTH)) for each in (depth, *shown)]


def slopes():
    """Tangents of the angles to the left and up of the pixels, (HEIGHT, WIDTH) each."""
    left = 1.0 - (2 * np.arange(WIDTH) + 1) / WIDTH
    up = math.tan(math.pi / 6) * (1.0 - (2 * np.arange(HEIGHT) + 1) / HEIGHT)
    return np.meshgrid(left, up)


def test_a_flat_wall_has_one_depth():
    sim = play(still("c", (0, 0, 0), sensor=camera()), scene=Scene(walls=[WALL]))
    depth, kind, ids, team, solid = images(sim)
    np.testing.assert_allclose(depth, 10.0, rtol=1e-13)
    for image, value in ((kind, 2), (ids, 0), (team, -1), (solid, 0)):
        assert (image == value).all()
    # Along the rays the corners are further away than max_range.
    depth, kind, *_ = images(
        play(still("c", (0, 0, 0), sensor=camera(max_range=10.01)), scene=Scene(walls=[WALL]))
    )
    assert (np.abs(depth - 10.0) < 1e-9).all()
    assert (kind == 2).all()
    depth, kind, *_ = images(
        play(still("c", (0, 0, 0), sensor=camera(max_range=9.99)), scene=Scene(walls=[WALL]))
    )
    assert (depth == np.inf).all()
    assert (kind == 0).all()


def test_a_flat_ground_fills_the_lower_half():
    sim = play(still("c", (0, 0, 2), sensor=camera()), scene=Scene(ground=FlatGround(0.0)))
    depth, kind, *_ = images(sim)
    _, up = slopes()
    expected = np.where(up < 0.0, 2.0 / np.where(up < 0.0, -up, 1.0), np.inf)
    assert (kind == np.where(expected <= 40.0, 1, 0)).all()
    np.testing.assert_allclose(depth, np.where(expected <= 40.0, expected, np.inf), rtol=1e-12)


def test_a_sphere_in_front_has_id_and_team():
    other = still("o", (8, 1, 0.5), team=7, radius=2.0)
    sim = play(still("c", (0, 0, 0), sensor=camera(), radius=3.0), other)
    depth, kind, ids, team, solid = images(sim)
    left, up = slopes()
    # |depth (1, left, up) - centre| = radius
    a, b, c = 1.0 + left**2 + up**2, 8.0 + left + 0.5 * up, 64.0 + 1.0 + 0.25 - 4.0
    is_hit = b**2 >= a * c
    assert 4 < is_hit.sum() < 20
    expected = np.where(is_hit, (b - np.sqrt(np.maximum(b**2 - a * c, 0.0))) / a, np.inf)
    np.testing.assert_allclose(depth, expected, rtol=1e-12)
    assert (ids == np.where(is_hit, 2, 0)).all()
    assert (kind == np.where(is_hit, KINDS.index("entity"), 0)).all()
    assert (team == np.where(is_hit, 7, -1)).all()
    assert (solid == -1).all()
    hidden = play(still("c", (0, 0, 0), sensor=camera(sees_entities=False)), other)
    assert (images(hidden)[1] == 0).all()


def test_a_turned_camera_sees_what_the_scene_says():
    from scipy.spatial.transform import Rotation

    hills = HeightField.generate((80.0, 80.0), cell=2.0, z_std=0.5, seed=3)
    mesh = TriangleMesh([(6, -9, -9), (6, 9, -9), (9, 0, 12)], [(0, 1, 2)])
    house = Prism([(-9, 2), (2, 9), (-9, 9)], low=-9.0, high=9.0)
    scene = Scene(terrain=hills, meshes=[mesh], walls=[house])
    seen = set()
    for heading, roll, rpy in (
        (0.3, 0.2, (0.1, 0.5, -0.2)),
        (2.2, -0.4, (0.0, 0.2, 0.6)),
        (-2.0, 0.0, (0.0, 0.3, 0.0)),
    ):
        xyz = np.array([0.5, -0.3, 0.2])
        sensor = camera(xyz=xyz, rpy=rpy)
        sim = play(still("c", (1, -2, 4), heading=heading, roll=roll, sensor=sensor), scene=scene)
        turn = Rotation.from_quat(np.roll(sim.read("c.quat")[0][0, 0], -1))
        left, up = (each.ravel() for each in slopes())
        ways = np.stack([np.ones(left.size), left, up], axis=1)
        aims = (turn * Rotation.from_euler("ZYX", rpy[::-1])).apply(ways)
        start = np.array([1.0, -2.0, 4.0]) + turn.apply(xyz)
        hits = scene.cast(np.repeat(start[:, None], len(aims), axis=1), aims.T)
        expected = hits.distance / np.linalg.norm(ways, axis=1)
        depth, kind, _, _, solid = (each.ravel() for each in images(sim))
        is_near = expected <= 40.0
        np.testing.assert_allclose(depth, np.where(is_near, expected, np.inf), rtol=1e-9)
        assert (solid == np.where(is_near, hits.solid, -1)).all()
        assert (kind == np.array([2, 3, 1, 0])[np.where(is_near, hits.solid, 3)]).all()
        seen |= set(kind)
    assert seen == {0, 1, 2, 3}


def test_noise_losses_and_limits_are_of_the_depth_alone():
    noisy = camera(depth_noise=0.1, depth_noise_square=0.004, dropout=0.2)
    sim = Simulation(
        Mission(blocks=[still("c", (0, 0, 0), sensor=noisy)], scene=Scene(walls=[WALL]), end=1e3), seeds=[1]
    )
    found = []
    for _ in range(60):
        sim.step()
        depth, kind, *_ = images(sim)
        assert (kind == 2).all()
        found.append(depth)
    found = np.array(found)
    is_lost, n = np.isnan(found), found.size
    assert abs(is_lost.mean() - 0.2) < 5.0 * math.sqrt(0.2 * 0.8 / n)
    errors = found[~is_lost] - 10.0
    sd = 0.1 + 0.004 * 100.0
    assert abs(errors.mean()) < 5.0 * sd / math.sqrt(n)
    assert abs(errors.std() / sd - 1.0) < 5.0 / math.sqrt(n)
    near = play(still("c", (0, 0, 0), sensor=camera(min_range=10.1)), scene=Scene(walls=[WALL]))
    depth, kind, *_ = images(near)
    assert (depth == -np.inf).all()
    assert (kind == 2).all()


class Brake(Autonomy):
    """Drives towards what the middle of its image shows, and stops before it."""

    depth_image = Input(unit="m", ragged=True)
    segmentation_image = Input(fields="kind id team solid", ragged=True)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        for row in range(g.n):
            image = self.depth_image[row]
            ahead = np.reshape(image, (HEIGHT, WIDTH))[HEIGHT // 2, WIDTH // 2] if image.size else 0.0
            self.velocity[:, row] = np.clip(ahead - 2.0, 0.0, 5.0) * g.forward[:, row]


def test_an_autonomy_brakes_by_its_image_as_in_a_stack():
    car = Block(
        name="c", position=(0, 0, 0), heading_variance=0.1, sensor=camera(rate=5.0, depth_noise=0.01), autonomy=Brake(),
        motion=SingleIntegrator(),
    )  # fmt: skip
    runner = still("o", (5, -3, 0), radius=0.5)
    stack = play(car, runner, scene=Scene(walls=[WALL]), seeds=[1, 2], steps=60)
    alone = play(car, runner, scene=Scene(walls=[WALL]), seeds=[2], steps=60)
    assert stack.state_hash(1) == alone.state_hash()
    pos = alone.read("c.pos")[0][0, 0]
    yaw = alone.read("c.yaw")[0][0, 0]
    assert (10.0 - pos[0]) == pytest.approx(2.0, abs=0.1) or abs(yaw) > 0.2


def test_an_image_is_limited():
    with pytest.raises(ParameterError, match="img_width = 5000"):
        DepthCamera(img_width=5000)
    with pytest.raises(ParameterError, match="azimuth_fov"):
        DepthCamera(azimuth_fov="180 deg")


# Occlusion -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sensor", [FieldOfView, ContactBlobCamera])
def test_cameras_do_not_see_what_is_hidden(sensor):
    exact = (
        {}
        if sensor is FieldOfView
        else {"false_positive_probability": 0.0, "false_negative_probability": 0.0}
    )
    others = [
        still("near", (6, 0, 0), radius=1.0),
        still("behind", (9, 0.2, 0), radius=0.5),
        still("beside", (9, 3.5, 0), radius=0.5),
        still("walled", (20, 8, 0), radius=0.5),
        still("touching", (0.55, -0.45, 0), radius=0.22),
        still("box", (9, -3, 0), radius=0.1, box=(1.0, 1.0, 1.0)),
    ]
    scene = Scene(walls=[Cuboid((15, 8, 0), (1, 4, 4))], ground=FlatGround(0.0))
    seen = {}
    for occlusion in (False, True):
        watch = sensor(occlusion=occlusion, azimuth_fov="85 deg", elevation_fov="85 deg", **exact)
        sim = play(still("c", (0, 0, 0), sensor=watch, radius=0.5), *others, scene=scene)
        ids = sim.read(f"c.{watch.instance_name}.{'seen' if sensor is FieldOfView else 'blobs'}")[0][0, 0][0]
        seen[occlusion] = sorted(ids.astype(int))
    assert seen[False] == [2, 3, 4, 5, 6, 7]
    # Nothing fits between the camera and what touches it; a box that is larger than its sphere does not hide itself.
    assert seen[True] == [2, 4, 6, 7]


def test_lines_of_sight_end_at_the_spheres():
    scene = Scene(ground=FlatGround(0.0), walls=[Cuboid((5, 0, 0), (1, 1, 1))])
    sim = play(
        still("a", (0, 0, 0), radius=0.5),
        still("b", (10, 0, 0), radius=0.5), still("d", (0, 10, 0), radius=0.5), still("e", (0, 5, 0), radius=0.4),
        scene=scene,
    )  # fmt: skip
    view = sim.state.world_view
    row, other = np.array([0, 1, 0, 2, 0, 3, 1, 2]), np.array([1, 0, 2, 0, 3, 0, 2, 1])
    assert view.line_of_sight(row, other).tolist() == [False, False, False, False, True, True, True, True]
    assert view.line_of_sight(row, other, entities=False).tolist() == [
        False,
        False,
        True,
        True,
        True,
        True,
        True,
        True,
    ]


@pytest.mark.parametrize("network", [SphereNetwork, RadioNetwork])
@pytest.mark.parametrize(
    ("blocked_by", "n_blocked"), [("nothing", 0), ("scene", 1), ("scene and entities", 2)]
)
def test_radios_need_a_line_of_sight(network, blocked_by, n_blocked):
    name = network.__name__
    listens = {"autonomy": Radio(first=10**6, network=name), "radius": 0.5}
    blocks = [
        still("s", (0, 0, 0), autonomy=Radio(last=10**6, network=name), radius=0.5),
        still("free", (0, -9, 0), **listens),
        still("walled", (9, 0, 0), **listens),
        still("between", (0, 5, 0), radius=0.5),
        still("behind", (0, 9, 0), **listens),
    ]
    mission = Mission(
        blocks=blocks, networks=[network(blocked_by=blocked_by)], scene=Scene(walls=[Cuboid((5, 0, 0), (1, 1, 1))]), end=3.0,
    )  # fmt: skip
    sim = Simulation(mission)
    (result,) = sim.run()
    heard = [int(sim.read(f"{each}.Radio.n_heard")[0][0, 0]) for each in ("free", "walled", "behind")]
    assert [n > 0 for n in heard] == [True, n_blocked < 1, n_blocked < 2]
    assert result.metrics[name]["lost_blocked"] == 30 * n_blocked
