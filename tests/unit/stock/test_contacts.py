"""BulletCollision: two bodies by closed forms, energy and momentum, piles that rest, and walls that hold."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_worlds import Drift

from tussle import Block, Mission, Simulation
from tussle.api import Interaction, Metric, State
from tussle.errors import MissionError, PluginError
from tussle.messages import EntityCollided, EntityHitGround
from tussle.mission import read_mission
from tussle.scene import Cuboid, FlatGround, Plane, Polyhedron, Prism, Scene, Sphere
from tussle.stock import Ballistic, BulletCollision, FreeBody, RayTrace, SingleIntegrator, Still, examples
from tussle.world.rays.surfaces import HeightField, TriangleMesh

GRAVITY = 9.81
FLOOR = Scene(ground=FlatGround(0.0))
FLAT = HeightField(np.zeros((21, 21)), -10.0, -10.0, 1.0)
CORNERS = FLAT.triangles().reshape(-1, 3)
FLOORS = {
    "ground": FLOOR,
    "terrain": Scene(terrain=FLAT),
    "mesh": Scene(meshes=[TriangleMesh(CORNERS, np.arange(len(CORNERS)).reshape(-1, 3))]),
    "wall": Scene(walls=[Cuboid((0, 0, -1), (18, 18, 2))]),
    "building": Scene(walls=[Prism([(-9, -9), (9, -9), (9, 9), (-9, 9)], -2.0, 0.0)]),
    "polyhedron": Scene(walls=[Polyhedron([(x, y, z) for x in (-9, 9) for y in (-9, 9) for z in (-2, 0)])]),
}


def ball(name, pos, vel=(0.0, 0.0, 0.0), mass=1.0, radius=1.0, gravity=0.0, **values):
    """A solid sphere."""
    i = 0.4 * mass * radius * radius
    motion = FreeBody(gravity_magnitude=gravity, inertia_matrix=(i, 0, 0, 0, i, 0, 0, 0, i))
    return Block(
        name=name, position=pos, velocity=vel, mass=mass, radius=radius, variance=(0, 0, 0), motion=motion, **values
    )  # fmt: skip


def box(name, pos, lengths=(1.0, 1.0, 1.0), gravity=GRAVITY, **values):
    """A solid box of 1 kg."""
    a, b, c = (x * x / 12.0 for x in lengths)
    motion = FreeBody(gravity_magnitude=gravity, inertia_matrix=(b + c, 0, 0, 0, a + c, 0, 0, 0, a + b))
    return Block(name=name, position=pos, box=lengths, variance=(0, 0, 0), motion=motion, **values)


class Told(Metric):
    """Numbers of collisions told."""

    pairs = State(dtype=int, per="world")
    falls = State(dtype=int, per="world")

    def step(self, w):
        np.add.at(self.pairs, w.inbox(EntityCollided).world, 1)
        np.add.at(self.falls, w.inbox(EntityHitGround).world, 1)


def play(blocks, steps=200, dt=0.01, scene=None, seeds=(1,), **values):
    game = Mission(
        blocks=blocks, dt=dt, end=1e6, scene=scene or Scene(), interactions=[BulletCollision(**values)], metrics=[Told()],
        end_conditions="time",
    )  # fmt: skip
    sim = Simulation(game, seeds=list(seeds))
    sim.step(steps)
    return sim


def bodies(sim):
    return sim.state.population.bodies


def one(sim, name):
    return sim.read(name)[0][0, 0]


# -- two bodies ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_two_spheres_head_on(e):
    """Newton: the centre's velocity is kept, the relative one is turned round and multiplied by e."""
    sim = play([ball("a", (-3, 0, 0), (10, 0, 0), 2.0), ball("b", (3, 0, 0), (-4, 0, 0))], restitution=e)
    center, relative = (2.0 * 10.0 - 4.0) / 3.0, 14.0
    assert one(sim, "a.vel") == pytest.approx([center - e * relative / 3.0, 0, 0], abs=1e-12)
    assert one(sim, "b.vel") == pytest.approx([center + 2.0 * e * relative / 3.0, 0, 0], abs=1e-12)
    assert sim.read("Told.pairs")[0].tolist() == [1]


@pytest.mark.parametrize("dt", [0.001, 0.05])
def test_a_fast_glancing_hit_has_the_normal_of_the_first_touch(dt):
    """Centres 2 m apart at the touch, 1 m aside: the normal is at 30 degrees, whatever the step, here up to 15 m."""
    sim = play(
        [ball("a", (-30, 1, 0), (300, 0, 0)), ball("b", (3, 0, 0))], 400, dt, restitution=1.0, friction=0.0
    )
    root = math.sqrt(3.0)
    assert one(sim, "b.vel") == pytest.approx([225.0, -75.0 * root, 0.0], rel=1e-6)
    assert one(sim, "a.vel") == pytest.approx([75.0, 75.0 * root, 0.0], rel=1e-6)


def test_fast_spheres_that_miss_each_other_are_left_alone():
    sim = play([ball("a", (-30, 2.01, 0), (300, 0, 0)), ball("b", (3, 0, 0))], 20, 0.05)
    assert one(sim, "a.vel").tolist() == [300, 0, 0]
    assert one(sim, "b.vel").tolist() == [0, 0, 0]


def test_rough_spheres_take_a_share_of_the_slip_as_spin():
    """Equal solid spheres at the normal x, with the relative velocity (1, 1, 0): half of the speed, 1/7 of the slip, 5/14 as spin.

    1 / m_t = 2 (1 / m + r^2 / I) = 7 / m; omega = impulse r / I.
    """
    sim = play([ball("a", (-1.05, -0.05, 0), (1, 1, 0)), ball("b", (1, 0, 0))], 10, friction=10.0)
    assert one(sim, "a.vel") == pytest.approx([0.5, 6.0 / 7.0, 0.0], abs=1e-9)
    assert one(sim, "b.vel") == pytest.approx([0.5, 1.0 / 7.0, 0.0], abs=1e-9)
    assert bodies(sim).omega[2] == pytest.approx([-5.0 / 14.0, -5.0 / 14.0], abs=1e-9)


def test_a_ball_keeps_bouncing():
    """With restitution 1 the energy stays what it was, for 500 bounces."""
    sim = play([ball("a", (0, 0, 10.0), gravity=GRAVITY)], 1, scene=FLOOR, restitution=1.0)
    start = 10.0 * GRAVITY
    heights = []
    for _ in range(60):
        sim.step(100)
        x, v = one(sim, "a.pos"), one(sim, "a.vel")
        heights.append(x[2])
        assert 0.5 * v[2] * v[2] + GRAVITY * x[2] == pytest.approx(start, rel=1e-9)
    assert max(heights) > 9.0
    assert min(heights) < 4.0


def test_a_ball_that_slides_begins_to_roll():
    """A solid sphere: v = 5/7 v0 and omega = v / r when a solid sphere rolls, whatever the friction (Routh 1905)."""
    sim = play([ball("a", (0, 0, 1.0), (7.0, 0, 0), gravity=GRAVITY)], 300, scene=FLOOR, friction=0.3)
    assert one(sim, "a.vel") == pytest.approx([5.0, 0.0, 0.0], abs=1e-9)
    assert bodies(sim).omega[:, 0] == pytest.approx([0.0, 5.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("mu", [0.6, 0.5])
def test_a_box_on_a_slope_slides_if_the_friction_is_below_the_tangent(mu):
    """The tangent of 30 degrees is 0.577; else v = g t (sin - mu cos)."""
    a = math.radians(30.0)
    normal = (-math.sin(a), 0.0, math.cos(a))
    sim = play(
        [box("b", tuple(0.5 * x for x in normal), climb=a)], 200, scene=Scene(walls=[Plane((0, 0, 0), normal)]), friction=mu
    )  # fmt: skip
    speed = float(np.linalg.norm(one(sim, "b.vel")))
    assert speed == pytest.approx(
        0.0 if mu > 0.577 else GRAVITY * 2.0 * (math.sin(a) - mu * math.cos(a)), rel=1e-3, abs=1e-9
    )


# -- many bodies -----------------------------------------------------------------------------------------------------------------


def gas(n, room, **values):
    """Spheres that fly about in a room with walls."""
    motion = FreeBody(gravity_magnitude=0.0, inertia_matrix=(0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1))

    class Stir(Interaction):
        def start(self, w):
            w.move(np.arange(w.n), vel=8.0 * w.uniform_by("v", w.world, w.id, w.id) * w.forward)

    block = Block(
        name="gas", count=n, radius=0.5, placement="uniform", half_width=(4.0, 4.0, 4.0), scatter_first=True, heading_variance=9.0,
        motion=motion,
    )  # fmt: skip
    sides = [
        Cuboid(tuple(s * 6.0 * (i == k) for i in range(3)), tuple(2.0 if i == k else 14.0 for i in range(3)))
        for k in range(3)
        for s in (-1.0, 1.0)
    ]
    game = Mission(
        blocks=[block], dt=0.01, end=1e6, scene=Scene(walls=sides if room else []),
        interactions=[Stir(), BulletCollision(**values)],
    )  # fmt: skip
    return Simulation(game, seeds=[1])


def test_elastic_spheres_in_a_room_keep_their_energy():
    sim = gas(60, True, restitution=1.0, friction=0.0, bounce_speed=0.0)
    sim.step(200)  # those that overlapped at the start have parted
    energy = [float((bodies(sim).vel ** 2).sum())]
    for _ in range(4):
        sim.step(250)
        energy.append(float((bodies(sim).vel ** 2).sum()))
    assert energy[0] > 60.0
    assert energy == pytest.approx([energy[0]] * 5, rel=5e-3)
    assert np.abs(bodies(sim).pos).max() < 5.0 - 0.5 + 0.02


def test_momentum_is_kept_in_any_collision():
    sim = gas(60, False, restitution=0.4)
    sim.step(1)
    before, state = bodies(sim).vel.sum(axis=1), bodies(sim).vel.copy()
    sim.step(150)
    assert np.abs(bodies(sim).vel - state).max() > 1.0
    assert bodies(sim).vel.sum(axis=1) == pytest.approx(before, abs=1e-11)


@pytest.mark.parametrize("floor", FLOORS)
def test_a_stack_of_boxes_rests(floor):
    stack = [box(f"b{i}", (0.3, 0.2, 0.5 + i)) for i in range(4)]
    sim = play(stack, 300, scene=FLOORS[floor], iterations=30)
    b = bodies(sim)
    assert b.pos[2] == pytest.approx([0.5, 1.5, 2.5, 3.5], abs=0.02)
    assert np.abs(b.pos[:2] - [[0.3], [0.2]]).max() < 0.06
    assert np.abs(b.vel).max() < 0.02


def test_a_stack_of_eight_boxes_rests():
    """With 20 passes; what is left of the sway after 10 s is less than a millimetre in a second."""
    sim = play([box(f"b{i}", (0.3, 0.2, 0.5 + i)) for i in range(8)], 1000, scene=FLOOR, iterations=20)
    assert bodies(sim).pos[2] == pytest.approx(0.5 + np.arange(8), abs=0.02)
    assert np.abs(bodies(sim).pos[:2] - [[0.3], [0.2]]).max() < 0.005
    assert np.abs(bodies(sim).vel).max() < 1e-3


def test_a_pile_of_spheres_rests():
    """A pyramid of 14 falls together and does not flow: friction holds it."""
    spheres = []
    for layer, k in enumerate((3, 2, 1)):
        for i in range(k):
            for j in range(k):
                shift, height = 0.5 * layer, 0.5 + layer * math.sqrt(0.5)
                spheres.append(
                    ball(f"s{layer}{i}{j}", (i + shift, j + shift, height), radius=0.5, gravity=GRAVITY)
                )
    walls = [Cuboid((x, 1.0, 0.2), (1.0, 5.0, 0.4)) for x in (-1.0, 3.0)]
    walls += [Cuboid((1.0, y, 0.2), (5.0, 1.0, 0.4)) for y in (-1.0, 3.0)]
    start = np.array([b.position for b in spheres]).T
    sim = play(spheres, 500, scene=Scene(ground=FlatGround(0.0), walls=walls))
    assert np.abs(bodies(sim).vel).max() < 1e-3
    assert np.abs(bodies(sim).pos - start).max() < 0.05


@pytest.mark.parametrize("floor", FLOORS)
def test_nothing_falls_through_a_floor(floor):
    """Down at 80 m/s, 4 m in a step; it comes to rest on the surface."""
    shapes = [
        ball("ball", (-4.3, 0.2, 30.0), (0, 0, -80), radius=0.5, gravity=GRAVITY),
        box("pill", (0.3, 4.2, 5.0), (2.0, 0.6, 0.6), velocity=(0, 0, -5)),
        box("crate", (4.4, 0.3, 5.0), velocity=(0, 0, -5), roll=0.5),
    ]
    sim = play(shapes, 200, 0.02, scene=FLOORS[floor], capsules="pill")
    z = [one(sim, f"{name}.pos")[2] for name in ("ball", "pill", "crate")]
    assert z == pytest.approx([0.5, 0.3, 0.5], abs=0.02)
    assert sim.read("Told.falls")[0].tolist()[0] >= 3


def test_a_ball_rolls_off_a_sphere_that_stands_still():
    sim = play(
        [ball("a", (0.1, 0, 6.0), gravity=GRAVITY, radius=0.5)],
        300,
        scene=Scene(walls=[Sphere((0, 0, 0), 5.0)]),
    )
    x = one(sim, "a.pos")
    assert x[0] > 1.0
    assert np.linalg.norm(x) > 5.4


def test_capsules_lie_across_each_other_and_across_a_box():
    shapes = [
        box("low", (0, 0, 0.5), (2.0, 2.0, 1.0)),
        box("one", (0, 0, 1.4), (1.6, 0.4, 0.4)),
        box("two", (0, 0, 1.9), (1.6, 0.4, 0.4), heading=math.pi / 2),
    ]
    sim = play(shapes, 100, scene=FLOOR, capsules="one, two")
    assert [one(sim, f"{n}.pos")[2] for n in ("low", "one", "two")] == pytest.approx(
        [0.5, 1.2, 1.6], abs=0.02
    )


def test_crossed_edges_of_boxes_hold():
    """Two long beams, each turned by 45 degrees about its own axis, lie crosswise on each other: edge on edge."""
    beams = [
        box("low", (0, 0, 0), (4.0, 1.0, 1.0), gravity=0.0, roll=math.pi / 4),
        box(
            "high",
            (0, 0, 1.5),
            (4.0, 1.0, 1.0),
            gravity=0.0,
            roll=math.pi / 4,
            heading=math.pi / 2,
            velocity=(0, 0, -1),
        ),
    ]
    sim = play(beams, 40, fixed="low", friction=0.0)
    assert one(sim, "high.pos")[2] == pytest.approx(math.sqrt(2.0), abs=0.01)
    assert one(sim, "low.pos").tolist() == [0, 0, 0]


def test_boxes_of_each_world_are_the_same_alone_and_in_a_stack():
    """Still entities with a box, which the seed places: rays of the lidar and contacts meet those of their own world."""
    crates = Block(
        name="crate", count=6, box=(2, 2, 4), placement="uniform", half_width=(12, 12, 0), scatter_first=True, motion=Still(),
    )  # fmt: skip
    rover = Block(
        name="rover", radius=0.5, position=(0, 0, 0), variance=(0, 0, 0), sensor=RayTrace(num_rays_horiz=24, angle_res_horiz="15 deg"),
        autonomy=Drift(to=(3, 1, 0)), motion=SingleIntegrator(),
    )  # fmt: skip
    game = Mission(
        blocks=[rover, crates],
        dt=0.05,
        end=1e6,
        interactions=[BulletCollision(fixed="crate")],
        end_conditions="time",
    )
    stack = Simulation(game, seeds=[3, 4, 5])
    stack.step(120)
    alone = Simulation(game, seeds=[4])
    alone.step(120)
    scans = [stack.read("rover.RayTrace.points")[0][k, 0] for k in range(3)]
    assert np.array_equal(scans[1], alone.read("rover.RayTrace.points")[0][0, 0])
    assert not np.array_equal(scans[0], scans[1])
    assert np.array_equal(stack.read("rover.pos")[0][1], alone.read("rover.pos")[0][0])
    assert np.array_equal(stack.read("crate.pos")[0][1], alone.read("crate.pos")[0][0])


# -- rules and messages ------------------------------------------------------------------------------------------------------------


def test_bodies_that_follow_commands_are_kept_apart():
    blocks = [
        Block(name=n, position=(x, 0, 0), variance=(0, 0, 0), autonomy=Drift(to=(v, 0, 0)), motion=SingleIntegrator())
        for n, x, v in (("a", -3.0, 5.0), ("b", 3.0, -5.0))
    ]  # fmt: skip
    sim = play(blocks, 300, 0.02)
    assert one(sim, "b.pos")[0] - one(sim, "a.pos")[0] == pytest.approx(2.0, abs=0.3)


def test_a_contact_is_told_once_and_again_after_a_pause():
    sim = play([ball("a", (0, 0, 1.5), gravity=GRAVITY)], 60, scene=FLOOR)
    assert sim.read("Told.falls")[0].tolist() == [1]
    sim.step(100)
    assert sim.read("Told.falls")[0].tolist() == [1]
    bouncing = play([ball("a", (0, 0, 1.5), gravity=GRAVITY)], 130, scene=FLOOR, restitution=1.0)
    assert bouncing.read("Told.falls")[0].tolist() == [2]  # at 0.32 s and 0.96 s


def crossing(**values):
    blocks = [
        ball("a", (-3, 0, 0), (10, 0, 0), team=1),
        ball("b", (3, 0, 0), (-4, 0, 0), team=values.pop("other_team", 2)),
    ]
    return play(blocks, 100, **values)


def test_remove_on_collision():
    sim = crossing(remove_on_collision=True)
    assert bodies(sim).n == 0
    assert sim.read("Told.pairs")[0].tolist() == [1]
    assert (
        bodies(play([ball("a", (0, 0, 3), gravity=GRAVITY)], 200, scene=FLOOR, remove_on_collision=True)).n
        == 0
    )


@pytest.mark.parametrize(
    ("other_team", "values", "meet"),
    [
        (1, {"enable_team_collisions": False}, False),
        (2, {"enable_team_collisions": False}, True),
        (2, {"enable_non_team_collisions": False}, False),
        (2, {"enable_collision_detection": False}, False),
    ],
)
def test_which_pairs_collide(other_team, values, meet):
    sim = crossing(other_team=other_team, **values)
    assert bool(one(sim, "a.vel")[0] != 10.0) is meet


def test_fixed_bodies_are_not_pushed():
    sim = crossing(fixed="b", restitution=1.0)
    assert one(sim, "b.vel").tolist() == [-4.0, 0.0, 0.0]
    assert one(sim, "a.vel")[0] == pytest.approx(-18.0)


def test_terrain_can_be_left_out_and_a_plane_added():
    assert (
        one(play([ball("a", (0, 0, 3), gravity=GRAVITY)], 200, scene=FLOOR, enable_terrain=False), "a.pos")[2]
        < -5.0
    )
    drop = play(
        [ball("a", (0, 0, 3), gravity=GRAVITY)], 200, enable_ground_plane=True, ground_plane_height=-2.0
    )
    assert one(drop, "a.pos")[2] == pytest.approx(-1.0, abs=0.02)


def test_masses_without_inertia_do_not_turn():
    blocks = [
        Block(name="a", position=(0, 0, 1.0), velocity=(7, 0, 0), variance=(0, 0, 0), motion=Ballistic())
    ]
    sim = play(blocks, 100, scene=FLOOR, friction=0.3)
    assert one(sim, "a.vel")[0] == pytest.approx(7.0 - 0.3 * GRAVITY * 1.0, rel=1e-2)
    assert bodies(sim).omega.tolist() == [[0.0], [0.0], [0.0]]


@pytest.mark.parametrize(
    ("values", "error", "text"),
    [
        ({"capsules": "a"}, PluginError, "block 'a' has no box"),
        ({"fixed": "aa"}, MissionError, "there is no block 'aa' .did you mean 'a'"),
    ],
)
def test_blocks_that_do_not_fit(values, error, text):
    with pytest.raises(error, match=text):
        play([ball("a", (0, 0, 0))], 1, **values)


def test_a_state_that_is_not_finite_ends_its_own_world_only():
    class Spoil(Interaction):
        def step(self, w):
            w.move(np.flatnonzero((w.world == 0) & (w.id == 1)), vel=np.full(3, np.nan))

    blocks = [ball("a", (-1.5, 0, 0), (1, 0, 0)), ball("b", (1.5, 0, 0))]
    game = Mission(blocks=blocks, dt=0.1, end=2.0, interactions=[BulletCollision(), Spoil()])
    first, second = Simulation(game, seeds=[1, 2]).run()
    assert first.end == "error"
    assert second.end == "time"


# -- the same in any stack ----------------------------------------------------------------------------------------------------------


def test_a_pile_is_the_same_in_stacks_and_threads_and_after_a_snapshot():
    game = read_mission(examples()["BulletCollision"]).mission
    with Simulation(game, seeds=[1, 2, 3], threads=2) as stack, Simulation(game, seeds=[2]) as alone:
        stack.step(150)
        alone.step(80)
        saved = alone.snapshot()
        alone.step(70)
        assert alone.state_hash(0) == stack.state_hash(1)
        alone.restore(saved)
        alone.step(70)
        assert alone.state_hash(0) == stack.state_hash(1)
