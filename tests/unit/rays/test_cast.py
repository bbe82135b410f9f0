"""Rays against brute force in NumPy, in scenes, among entities, in stacks and threads."""

from __future__ import annotations

import pickle
from typing import ClassVar

import numpy as np
import pytest
from small_worlds import Drift, mission

from tussle import Block, Simulation
from tussle.api import Metric, Output, Sensor, State
from tussle.errors import ParameterError
from tussle.numeric.quaternion import quat_rotate_inverse
from tussle.scene import Cuboid, FlatGround, HeightField, Plane, Prism, Scene, Sphere, TriangleMesh
from tussle.stock import SingleIntegrator, Still


def brute(triangles, origin, direction):
    """Distance of each ray to the nearest triangle, by the inverse of a matrix for each pair (Moeller and Trumbore's equations)."""
    a, b, c = (triangles[:, k][None] for k in range(3))
    o, d = origin.T[:, None], (direction / np.linalg.norm(direction, axis=0)).T[:, None]
    matrix = np.stack(np.broadcast_arrays(-d, b - a, c - a), axis=-1)
    with np.errstate(all="ignore"):
        det = np.linalg.det(matrix)
        flat = np.abs(det) < 1e-14
        matrix[flat] = np.eye(3)
        t, u, v = np.moveaxis(np.linalg.solve(matrix, (o - a)[..., None])[..., 0], -1, 0)
    hit = ~flat & (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0)
    return np.where(hit, t, np.inf).min(axis=1, initial=np.inf)


def rays(rng, n, size=20.0):
    return rng.uniform(-size, size, (3, n)), rng.normal(size=(3, n)) * rng.choice([0.01, 1.0, 50.0], n)


def soup(rng, n=200, size=20.0, edge=3.0):
    corners = rng.uniform(-size, size, (n, 1, 3)) + rng.normal(0.0, edge, (n, 3, 3))
    return TriangleMesh(corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3))


@pytest.mark.parametrize("seed", range(6))
def test_meshes_against_brute_force(seed):
    rng = np.random.default_rng(seed)
    mesh = soup(rng, [1, 7, 60, 200, 200, 400][seed], edge=[3.0, 3.0, 0.1, 9.0, 3.0, 1.0][seed])
    origin, direction = rays(rng, 400)
    direction[:, :30] *= np.array([[1.0], [0.0], [0.0]])  # along an axis
    far = brute(mesh.triangles(), origin, direction)
    hits = Scene(meshes=[mesh]).cast(origin, direction)
    np.testing.assert_allclose(hits.distance, far, rtol=1e-9)
    assert np.isfinite(far).any() or seed < 3
    assert ((hits.solid == 0) == np.isfinite(far)).all()
    near = Scene(meshes=[mesh]).cast(origin, direction, 8.0).distance
    np.testing.assert_allclose(near, np.where(far <= 8.0, far, np.inf), rtol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_height_fields_against_brute_force(seed):
    rng = np.random.default_rng(seed)
    field = HeightField(rng.normal(0.0, 2.0, (9 + seed, 14)), west=-11.0, south=-7.0, cell=1.7)
    origin, direction = rays(rng, 600, 14.0)
    direction[2, :300] *= 0.1
    direction[:2, 590:] = 0.0  # up or down
    expected = brute(field.triangles(), origin, direction)
    hits = Scene(terrain=field).cast(origin, direction)
    np.testing.assert_allclose(hits.distance, expected, rtol=1e-9)
    assert np.isfinite(expected).sum() > 60
    as_mesh = TriangleMesh(
        field.triangles().reshape(-1, 3), np.arange(3 * len(field.triangles())).reshape(-1, 3)
    )
    meshed = Scene(meshes=[as_mesh]).cast(origin, direction)
    np.testing.assert_allclose(hits.distance, meshed.distance, rtol=1e-9)
    np.testing.assert_allclose(hits.normal, meshed.normal, atol=1e-9)


def test_no_ray_slips_between_triangles():
    # Rays through corners, edges and diagonals of a closed box and of a field, whose coordinates are no round numbers.
    box = Cuboid((0.1, 0.2, 0.3), (0.7, 1.1, 1.3), (0.1, 0.2, 0.3))
    corners = np.concatenate(
        [box.triangles().reshape(-1, 3), box.triangles().mean(axis=1), box.triangles()[:, :2].mean(axis=1)]
    )
    middle = np.array([[0.1], [0.2], [0.3]]) + 0.01
    inside = np.repeat(middle, len(corners), axis=1)
    assert np.isfinite(Scene(walls=[box]).cast(inside, corners.T - inside).distance).all()
    field = HeightField(np.random.default_rng(1).normal(size=(40, 30)), -3.3, -2.2, 0.3)
    points = field.triangles()[:, :2].mean(axis=1).T
    inner = points[:, (np.abs(points[0] - 1.0) < 4.0) & (np.abs(points[1] - 3.6) < 5.5)]
    above = inner + np.array([[0.37], [-0.11], [30.0]])
    assert (Scene(terrain=field).cast(above, inner - above).distance < 40.0).all()
    straight = inner + np.array([[0.0], [0.0], [9.0]])
    found = Scene(terrain=field).cast(straight, np.repeat([[0.0], [0.0], [-1.0]], inner.shape[1], axis=1))
    np.testing.assert_allclose(found.points, inner, atol=1e-12)


def test_all_parts_of_a_scene_and_their_normals():
    building = Prism(((-1, -6), (1, -6), (1, -4), (0, -5), (-1, -4)), -1, 1)
    walls = (
        Cuboid((5, 0, 0), (2, 2, 2), (0.3, 0.2, 0.9)),
        Sphere((0, 6, 0), 1.5),
        Plane((-4, 0, 0), (1, 0, 0)),
        building,
    )
    rng = np.random.default_rng(7)
    scene = Scene(
        walls=walls,
        ground=FlatGround(-3.0),
        terrain=HeightField.generate((6.0, 6.0), 0.5, center=(0, 0, -2)),
        meshes=[soup(rng, 20)],
    )
    origin, direction = rays(rng, 500, 3.0)
    distance = [wall.ray(origin, direction) for wall in (*walls, scene.ground)]
    distance += [brute(part.triangles(), origin, direction) for part in (*scene.meshes, scene.terrain)]
    hits = scene.cast(origin, direction)
    np.testing.assert_allclose(hits.distance, np.min(distance, axis=0), rtol=1e-9)
    order = [0, 1, 2, 3, 5, 6, 4]  # in the order of `solids`
    is_hit = np.isfinite(hits.distance)
    assert (hits.solid[is_hit] == np.argmin(np.array(distance)[order], axis=0)[is_hit]).all()
    assert set(hits.solid) >= set(range(7))
    assert (hits.id == 0).all()
    # Each normal is of length 1, faces the origin, and is that of the finite difference between rays beside one another.
    assert np.linalg.norm(hits.normal[:, is_hit], axis=0) == pytest.approx(1.0)
    assert ((hits.normal * direction).sum(axis=0) <= 0.0).all()
    beside = [
        scene.cast(origin, direction / np.linalg.norm(direction, axis=0) + 1e-6 * rng.normal(size=(3, 1)))
        for _ in range(2)
    ]
    smooth = is_hit & (beside[0].solid == hits.solid) & (beside[1].solid == hits.solid)
    for other in beside:
        between = other.points[:, smooth] - hits.points[:, smooth]
        assert np.median(np.abs((between * hits.normal[:, smooth]).sum(axis=0))) < 1e-9
    assert pickle.loads(pickle.dumps(scene)) == scene


def test_height_free_and_line_of_sight():
    field = HeightField(np.array([[0.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 0.0]]), -10.0, -10.0, 10.0)
    house = Cuboid((30.0, 0.0, 2.5), (10.0, 10.0, 5.0))
    scene = Scene(terrain=field, walls=[house])
    assert scene.height([0.0, 5.0, 30.0, 99.0], [0.0, 0.0, 1.0, 0.0]).tolist() == [4.0, 2.0, 5.0, -np.inf]
    assert Scene(ground=FlatGround(7.0)).height(3.0, 4.0) == 7.0
    points = np.array(
        [[0, 0, 4.5], [0, 0, 3.0], [30, 0, 2], [30, 6, 2], [30, 6, 2], [36, 6, 2], [200, 0, -5]], float
    ).T
    radius = [0.4, 0.1, 0.1, 1.1, 0.9, 1.4, 1.0]
    assert scene.free(points, radius).tolist() == [True, False, False, False, True, True, True]
    assert not scene.free(points, np.inf).any()
    ball = Scene(walls=[Sphere((0.0, 0.0, 0.0), 0.5)])  # smaller than those that touch it
    assert ball.free(np.array([[0.6, 2.4, 2.6], [0, 0, 0], [0, 0, 0]]), 2.0).tolist() == [False, False, True]
    rng = np.random.default_rng(2)
    mesh = soup(rng, 60)
    at = rng.uniform(-20, 20, (3, 80))
    corners = mesh.triangles()
    samples = np.stack(np.meshgrid(*[np.linspace(0, 1, 31)] * 2)).reshape(2, -1)
    u, v = samples[:, samples.sum(axis=0) <= 1.0]
    cloud = (
        corners[:, :1]
        + u[None, :, None] * (corners[:, 1:2] - corners[:, :1])
        + v[None, :, None] * (corners[:, 2:] - corners[:, :1])
    )
    gap = np.sqrt(((at.T[:, None] - cloud.reshape(-1, 3)[None]) ** 2).sum(axis=2).min(axis=1))
    free = Scene(meshes=[mesh]).free(at, 2.0)
    assert not free[gap < 2.0].any()
    assert free[gap > 2.3].all()
    a, b = np.array([[0.0, 0, 6], [0, -9, 1], [20, 0, 2]]).T, np.array([[0.0, 9, 6], [0, 9, 1], [40, 0, 2]]).T
    assert scene.line_of_sight(a, b).tolist() == [True, False, False]


class Radar(Sensor):
    """Casts rays to all sides."""

    n_rays = 24
    seen = Output(fields="distance id", unit="m 1", ragged=True)

    def step(self, g):
        angle = np.linspace(0.0, 6.0, self.n_rays)
        way = np.stack([np.cos(angle), np.sin(angle), 0.1 * np.sin(5 * angle)])
        rows = np.repeat(np.arange(g.n), self.n_rays)
        hits = g.cast(g.pos[:, rows], np.tile(way, g.n), 60.0, row=rows)
        self.seen.set(self.n_rays * np.arange(g.n + 1), np.stack([hits.distance, hits.id]))


def crowd(count=40, box=None):
    look = Block(
        name="r", count=count, variance=(300.0, 300.0, 4.0), radius=1.5, heading_variance=3.0, sensor=Radar(),
        autonomy=Drift(to=(0.0, 0.0, 0.0)), motion=SingleIntegrator(), box=box, roll=0.3, climb=0.2,
    )  # fmt: skip
    return mission(look, scene=Scene(walls=[Cuboid((0, 0, 0), (4, 4, 4))]))


@pytest.mark.parametrize("box", [None, (4.0, 2.0, 1.0)])
def test_entities_against_brute_force(box):
    game = crowd(box=box)
    sim = Simulation(game, seeds=[5])
    sim.step()
    lists = sim.read("r.Radar.seen")[0][0]
    pos, quat = sim.read("r.pos")[0][0].T, sim.read("r.quat")[0][0].T
    angle = np.linspace(0.0, 6.0, Radar.n_rays)
    way = np.stack([np.cos(angle), np.sin(angle), 0.1 * np.sin(5 * angle)])
    seen = set()
    for me in range(40):
        origin = np.repeat(pos[:, [me]], Radar.n_rays, axis=1)
        least, who = game.scene.cast(origin, way, 60.0).distance, np.zeros(Radar.n_rays)
        for other in range(40):
            if other == me:
                continue
            if box is None:
                found = Sphere(tuple(pos[:, other]), 1.5).ray(origin, way)
            else:
                turned = np.repeat(quat[:, [other]], Radar.n_rays, axis=1)
                local = quat_rotate_inverse(turned, origin - pos[:, [other]])
                found = Cuboid((0, 0, 0), box).ray(local, quat_rotate_inverse(turned, way))
            nearer = found < np.minimum(least, 60.0)
            least, who = np.where(nearer, found, least), np.where(nearer, other + 1, who)
        np.testing.assert_allclose(lists[me][0], least, rtol=1e-9)
        assert (lists[me][1] == who).all()
        seen |= set(who)
    assert len(seen) > 20


class Probe(Metric):
    """Asks for heights, free space and sight at random places of each world."""

    answers: ClassVar[list] = []

    def step(self, w):
        rng = np.random.default_rng(7)
        world = np.repeat(np.arange(w.n_worlds), 300)
        a, b = (np.tile(rng.uniform(-20, 20, (3, 300)), w.n_worlds) for _ in range(2))
        self.answers.append(
            np.stack([w.height(a[0], a[1], world=world), w.free(a, 1.5, world=world), w.is_clear(a, b, world=world)])
        )  # fmt: skip


@pytest.mark.parametrize("box", [None, (9.0, 5.0, 3.0)])
def test_height_free_and_sight_among_the_boxes_of_each_world(box):
    crates = Block(
        name="crate", count=25, radius=2.0, box=box, variance=(120.0, 120.0, 30.0), heading_variance=3.0, roll=0.3,
        climb=0.2, motion=Still(),
    )  # fmt: skip
    game = mission(
        crates, metrics=[Probe()], scene=Scene(ground=FlatGround(-12.0), walls=[Sphere((3.0, 3.0, 0.0), 4.0)])
    )
    rng = np.random.default_rng(7)
    a, b = rng.uniform(-20, 20, (3, 300)), rng.uniform(-20, 20, (3, 300))
    Probe.answers.clear()
    with Simulation(game, seeds=[5, 6]) as sim:
        sim.step()
        pos, quat = sim.read("crate.pos")[0], sim.read("crate.quat")[0]
    found = Probe.answers.pop().reshape(3, 2, 300)
    for world in range(2):
        with Simulation(game, seeds=[5 + world]) as alone:
            alone.step()
        assert np.array_equal(Probe.answers.pop(), found[:, world])
        height, free = game.scene.height(a[0], a[1]), game.scene.free(a, 1.5)
        clear = game.scene.line_of_sight(a, b)
        start, down = (
            np.stack([a[0], a[1], np.full(300, 90.0)]),
            np.repeat([[0.0], [0.0], [-1.0]], 300, axis=1),
        )
        way = b - a
        for center, turn in zip(pos[world], quat[world], strict=True):
            shape = Sphere((0, 0, 0), 2.0) if box is None else Cuboid((0, 0, 0), box)
            turned = np.repeat(turn[:, None], 300, axis=1)

            def local(vector, turned=turned):
                return quat_rotate_inverse(turned, vector)

            own = local(a - center[:, None])
            if box is None:
                gap = np.sqrt((own * own).sum(axis=0)) - 2.0
            else:
                out = np.maximum(np.abs(own) - np.array(box)[:, None] / 2, 0.0)
                gap = np.sqrt((out * out).sum(axis=0))
            free &= gap > 1.5
            height = np.maximum(height, 90.0 - shape.ray(local(start - center[:, None]), local(down)))
            length = np.sqrt((way * way).sum(axis=0))
            clear &= shape.ray(own, local(way / length)) > length
        np.testing.assert_allclose(found[0, world], height, rtol=1e-9)
        assert np.array_equal(found[1, world], free)
        assert np.array_equal(found[2, world], clear)
        assert 20 < free.sum() < 280
        assert 20 < clear.sum() < 280
    assert not np.array_equal(found[:, 0], found[:, 1])


def test_rays_do_not_depend_on_stack_and_threads():
    alone = [Simulation(crowd(), seeds=[seed]) for seed in (1, 2, 3)]
    together = Simulation(crowd(), seeds=[3, 1, 2], threads=2)
    for sim in (*alone, together):
        sim.step()
    lists = together.read("r.Radar.seen")[0]
    for place, one in ((1, alone[0]), (2, alone[1]), (0, alone[2])):
        for a, b in zip(lists[place], one.read("r.Radar.seen")[0][0], strict=True):
            assert a.tobytes() == b.tobytes()


class Looks(Metric):
    """Casts a ray at each entity from the east and from above."""

    seen = State("distance id x y z", per="world")
    above = State("distance id x y z", per="world")

    def step(self, w):
        for out, way in ((self.seen, [[10.0], [0.0], [0.0]]), (self.above, [[0.0], [0.0], [10.0]])):
            hits = w.cast(w.pos + way, np.repeat(np.negative(way), w.n, axis=1), world=w.world)
            out[:] = np.concatenate([hits.distance[None], hits.id[None], hits.normal])


@pytest.mark.parametrize(("box", "x", "z"), [(None, 9.0, 9.0), ((2.0, 4.0, 6.0), 9.0, 7.0)])
def test_normals_of_entities(box, x, z):
    one = Block(name="r", box=box, autonomy=Drift(), motion=SingleIntegrator())
    sim = Simulation(mission(one, metrics=[Looks()]), seeds=[1, 2])
    sim.step()
    assert sim.read("Looks.seen")[0].tolist() == [[x, 1, 1, 0, 0]] * 2
    assert sim.read("Looks.above")[0].tolist() == [[z, 1, 0, 0, 1]] * 2


def looking(rows=None, world=None):
    """Cast a ray with wrong rows or worlds."""
    sim = Simulation(crowd(1), seeds=[1])
    sim.state.world_view.cast(np.zeros((3, 1)), np.ones((3, 1)), row=rows, world=world)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s: s.cast(np.zeros(3), np.zeros((3, 1))), r"origins have shape \(3,\); they take \(3, n\)"),
        (lambda s: s.cast(np.zeros((3, 2)), np.zeros((3, 1))), "there are 2 origins and 1 directions"),
        (lambda s: s.cast([[0], [np.nan], [0]], np.zeros((3, 1))), r"origins: vector 0 is \[0.0, nan, 0.0\]"),
        (lambda s: s.cast(np.zeros((3, 1)), np.zeros((3, 1)), -1.0), "max_range has the value -1; it takes"),
        (lambda s: s.cast(np.zeros((3, 1)), np.zeros((3, 1)), [1.0, 2.0]), r"max_range has shape \(2,\)"),
        (lambda s: s.free(np.zeros((3, 1)), np.nan), "radius has the value .*nan"),
        (lambda s: s.free_between(np.zeros((3, 1)), np.zeros((3, 2)), 1.0), "must be equal"),
        (lambda s: s.free_between(np.zeros((3, 1)), np.ones((3, 1)), -1.0), "radius has the value"),
        (
            lambda s: s.line_of_sight(np.zeros((3, 1)), np.zeros((3, 2))),
            r"a has shape \(3, 1\) and b \(3, 2\)",
        ),
        (lambda s: looking(rows=np.zeros(3, int)), "there are 1 rays or places and 3 rows or worlds"),
        (lambda s: looking(world=np.ones(1, int)), "world 1 is not allowed; there are worlds 0 to 0"),
        (lambda s: Scene(walls=[3]), "Scene.walls has 3; it takes Volume"),
        (lambda s: Scene(terrain=s), "Scene.terrain has .*; it takes HeightField"),
        (lambda s: HeightField([[0, 1]]), r"shape \(1, 2\); it takes"),
        (lambda s: HeightField([[0, 1], [0, np.nan]]), "HeightField.height has the coordinate .*nan"),
        (lambda s: HeightField(np.zeros((2, 2)), cell=0.0), "HeightField.cell = 0.0"),
        (lambda s: HeightField.generate(technique="RANDOM"), "did you mean 'RANDOM_WALK'"),
        (lambda s: HeightField.generate((1e9, 1e9)), "heights are not allowed; at most 4,000,000"),
        (lambda s: HeightField.generate(cell=-1.0), "take lengths > 0 m"),
        (lambda s: TriangleMesh(np.zeros((3, 2)), [[0, 1, 2]]), r"vertices have shape \(3, 2\)"),
        (lambda s: TriangleMesh(np.eye(3), np.zeros((0, 3), int)), "TriangleMesh has 0 triangles"),
        (lambda s: TriangleMesh(np.eye(3), [[0, 1, 3]]), "refer to other than the 3 vertices"),
        (
            lambda s: TriangleMesh(np.full((3, 3), np.inf), [[0, 1, 2]]),
            "TriangleMesh.vertices has the coordinate",
        ),
        (lambda s: TriangleMesh(np.zeros((3, 3)), [[0, 1, 2]]), "no triangle with an area"),
    ],
)
def test_hostile_input(call, message):
    with pytest.raises(ParameterError, match=message):
        call(Scene())
    assert Scene().cast(np.zeros((3, 1)), np.zeros((3, 1))).distance.tolist() == [np.inf]


def test_generated_hills():
    hills = HeightField.generate((60.0, 40.0), 2.0, z_std=0.5, center=(5.0, 6.0, 30.0), seed=4)
    assert hills.height.shape == (21, 31)
    assert hills == HeightField.generate((60.0, 40.0), 2.0, z_std=0.5, center=(5.0, 6.0, 30.0), seed=4)
    assert hills != HeightField.generate((60.0, 40.0), 2.0, z_std=0.5, center=(5.0, 6.0, 30.0), seed=5)
    assert (hills.west, hills.south) == (-25.0, -14.0)
    assert hills.height.mean() == pytest.approx(30.0)
    plane = HeightField.generate((60.0, 40.0), 2.0, technique="LINEAR", seed=4).height
    assert np.ptp(np.diff(plane, axis=0)) + np.ptp(np.diff(plane, axis=1)) < 1e-12
    # A step of the walk: each height minus the mean of its neighbours to the south, west and south-west is a draw of sd 0.5.
    h = hills.height
    draws = h[1:, 1:] - (h[:-1, 1:] + h[1:, :-1] + h[:-1, :-1]) / 3.0
    assert draws.std() == pytest.approx(0.5, rel=0.1)
