"""What happens between two steps: collisions, crossings of regions and captures on the straight ways of a step."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Metric, Output, State
from tussle.messages import BoundaryCrossed, FlagCaptured, FlagTaken
from tussle.plugins import historic, stock
from tussle.scene import Cuboid, Plane, Polyhedron, Prism, Sphere

FINE = 2001


class Fly(Autonomy):
    """Flies with a constant velocity."""

    velocity = State("x y z", unit="m/s")
    command = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.command[:] = self.velocity


def flock(pos, vel, interactions, seeds=1, metrics=(), **values):
    """An entity of an own team at each position [m] with a velocity [m/s], (n, 3) each."""
    blocks = [
        Block(
            name=f"a{i}", team=i + 1, position=tuple(p), variance=(0, 0, 0), autonomy=Fly(), motion=stock.SingleIntegrator(max_speed=-1.0)
        )
        for i, p in enumerate(pos)
    ]  # fmt: skip
    networks = [stock.GlobalNetwork(), stock.LocalNetwork()]
    made = Mission(
        blocks=blocks, dt=0.1, end=100.0, networks=networks, interactions=interactions, metrics=metrics
    )
    sim = Simulation(made, seeds, **values)
    for i, v in enumerate(vel):
        sim.write(f"a{i}.Fly.velocity", v)
    return sim


def living(sim):
    """Ids of those that are left, by world."""
    bodies = sim.state.population.bodies
    return [set(bodies.id[bodies.world == w].tolist()) for w in range(sim.n_worlds)]


def least_distances(pos, vel, dt=0.1):
    """Least distance of each pair within a step, (n, n)."""
    least = np.full((len(pos), len(pos)), np.inf)
    for t in np.linspace(0.0, dt, FINE):
        at = pos + t * vel
        least = np.minimum(least, np.sqrt(((at[:, None] - at) ** 2).sum(axis=2)))
    np.fill_diagonal(least, np.inf)
    return least


@given(st.integers(0, 10_000), st.sampled_from([0.0, 20.0, 200.0, 2000.0]))
def test_collisions_are_those_of_the_least_distances_within_the_step(seed, speed):
    chance = np.random.default_rng(seed)
    pos, vel = chance.uniform(-40, 40, (20, 3)), chance.normal(0, speed, (20, 3))
    vel[::3] *= 0.01
    least = least_distances(pos, vel)
    limit = 3.0
    before = np.sqrt(((pos[:, None] - pos) ** 2).sum(axis=2))
    apart = (before >= limit) | np.eye(20, dtype=bool)
    kept = np.flatnonzero(apart.all(axis=1))
    least = least[np.ix_(kept, kept)]
    collision = stock.SimpleCollision(collision_range=limit, startup_collision_range=0.0)
    sims = [
        flock(pos[kept], vel[kept], [collision], **given) for given in ({}, {"seeds": [1, 2], "threads": 2})
    ]
    for sim in sims:
        sim.step()
    inside, outside = (least < limit - 0.01).any(axis=1), (least >= limit).all(axis=1)
    for left in [alive for sim in sims for alive in living(sim)]:
        assert left == living(sims[0])[0]
        assert {k + 1 for k in np.flatnonzero(outside)} <= left
        assert not left & {k + 1 for k in np.flatnonzero(inside)}


def head_on(laws, **values):
    """Two that meet between two steps, 50 m in each."""
    collision = laws.SimpleCollision(collision_range=10.0, startup_collision_range=0.0, **values)
    sim = flock([[0, 0, 9], [1025, 0, 9]], [[250, 0, 0], [-250, 0, 0]], [collision])
    sim.step(30)
    return len(living(sim)[0])


def test_two_that_pass_each_other_in_one_step_collide_unless_by_the_law_of_scrimmage():
    assert head_on(stock) == 0
    assert head_on(historic) == 2
    assert head_on(stock, enable_non_team_collisions=False) == 2


def test_those_that_fly_apart_after_a_near_start_do_not_collide_again_and_a_reset_repeats_the_game():
    pos, vel = [[0, 0, 9], [12, 0, 9], [100, 0, 9]], [[0, 0, 0], [400, 0, 0], [0, 300, 0]]
    collision = stock.SimpleCollision(collision_range=10.0, startup_collision_range=0.0)
    sim = flock(pos, vel, [collision], seeds=[1, 2])
    sim.step()
    assert living(sim) == [{1, 2, 3}] * 2
    sim = flock([[0, 0, 9], [1025, 0, 9]], [[250, 0, 0], [-250, 0, 0]], [collision], seeds=[1, 2])
    sim.step(30)
    sim.reset([1])
    for i, speed in enumerate((250.0, -250.0)):
        sim.write(f"a{i}.Fly.velocity", [[[speed, 0.0, 0.0]]] * 2)
    sim.step(30)
    assert living(sim) == [set()] * 2


class Ear(Metric):
    """Counts messages."""

    entries = State(dtype=int, per="world")
    exits = State(dtype=int, per="world")
    taken = State(dtype=int, per="world")
    captured = State(dtype=int, per="world")

    def step(self, w):
        told = w.inbox(BoundaryCrossed)
        self.entries += np.count_nonzero(told.inside)
        self.exits += np.count_nonzero(~told.inside)
        self.taken += w.inbox(FlagTaken).n
        self.captured += w.inbox(FlagCaptured).n


@pytest.mark.parametrize(
    "shape",
    [
        Sphere((0, 0, 0), 2.0),
        Cuboid((0, 0, 0), (0.1, 4, 4), (0.2, 0.1, 0.5)),
        Prism(((-1, -2), (1, -2), (1, 2), (-1, 2)), low=-1.0, high=1.0),
        Polyhedron(((-1, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 2))),
        Plane((0, 0, -3), (0, 0, 1)),
    ],
)
def test_a_way_crosses_a_region_if_one_of_its_points_is_inside(shape):
    chance = np.random.default_rng(1)
    a, b = chance.uniform(-5, 5, (2, 3, 400))
    b[:, :20] = a[:, :20]
    parts = np.linspace(0, 1, FINE)
    inside = np.stack([shape.contains(a + s * (b - a)) for s in parts]).any(axis=0)
    crossed = shape.crossed(a, b)
    assert (crossed >= inside).all()
    assert np.count_nonzero(crossed & ~inside) <= 2  # that a corner is cut between two points
    assert inside[20:].any()
    assert not inside.all()


def wall(laws, boundary, **values):
    return laws.Boundary(boundary_id=boundary, center=(52.0, 0.0, 0.0), lengths=(1.0, 50.0, 50.0), **values)


def test_who_flies_through_a_region_within_a_step_enters_and_leaves_it():
    for laws, n in ((stock, 1), (historic, 0)):
        gate = wall(laws, 3, name="gate")
        flag = laws.FlagCaptureInteraction(flag_boundary_id=4, capture_boundary_id=5, name="flag")
        regions = [wall(laws, 4, team=9, name="b4"), wall(laws, 5, team=1, name="b5")]
        sim = flock([[0, 0, 0]], [[100, 0, 0]], [gate, *regions, flag], metrics=[Ear()])
        sim.step(7)
        told = [int(sim.read(f"Ear.{name}")[0][0]) for name in ("entries", "exits", "taken", "captured")]
        assert told == [3 * n, 3 * n, n, n]


def test_a_narrow_no_fly_region_stops_those_that_jump_over_it():
    fence = stock.EnforceBoundaryInteraction(active_boundary_ids=(), no_fly_boundary_ids=(3,))
    sim = flock([[0, 0, 0], [0, 40, 0]], [[100, 0, 0], [100, 0, 0]], [wall(stock, 3), fence])
    sim.step(5)
    assert living(sim) == [{1, 2}]
    sim.step(1)
    assert living(sim) == [{2}]


def test_a_defender_captures_an_intruder_that_passes_it_within_a_step():
    for laws, left in ((stock, {1}), (historic, {1, 2})):
        region = laws.Boundary(boundary_id=1, team=1, lengths=(900.0, 900.0, 900.0))
        guard = laws.CaptureInBoundaryInteraction(boundary_id=1, capture_range=5.0)
        sim = flock([[52, 3, 0], [-8, 0, 0]], [[0, 0, 0], [400, 0, 0]], [region, guard])
        sim.step(5)
        assert living(sim) == [left]


def claimed(pos, vel, hunter, n_steps=1, referee=stock.SimpleCapture, **given):
    """Ids that are left after `n_steps`, by world, where entities of team 1 fly straight, and the last one, of team 2, is a hunter."""
    blocks = [
        Block(
            name=f"a{i}", team=1 + (i == len(pos) - 1), position=tuple(p), variance=(0, 0, 0),
            motion=stock.SingleIntegrator(max_speed=-1.0), autonomy=(Fly(), hunter) if i == len(pos) - 1 else Fly(),
        )
        for i, p in enumerate(pos)
    ]  # fmt: skip
    networks = [stock.GlobalNetwork(), stock.LocalNetwork()]
    made = Mission(
        blocks=blocks, dt=0.1, end=100.0, networks=networks, interactions=[referee(capture_range=5.0)]
    )
    sim = Simulation(made, **{"seeds": 1, **given})
    for i, v in enumerate(vel):
        sim.write(f"a{i}.Fly.velocity", v)
    sim.step(1)  # the autonomies see the velocities from the second step on
    sim.step(n_steps)
    return living(sim)


def hunter(laws, **values):
    return laws.Predator(pursue=False, prey_team_id=1, capture_range=5.0, **values)


@given(st.integers(0, 10_000), st.sampled_from([0.0, 20.0, 200.0, 2000.0]))
def test_a_predator_captures_whom_it_passes_within_range(seed, speed):
    chance = np.random.default_rng(seed)
    pos, vel = chance.uniform(-40, 40, (20, 3)), chance.normal(0, speed, (20, 3))
    vel[::3] *= 0.01
    pos[-1], vel[-1] = 0.0, vel[-1] * chance.choice([0.0, 1.0, 3.0])
    for n_steps in (1, 2):
        least = np.inf * np.ones(20)
        for step in range(n_steps):
            least = np.minimum(least, least_distances(pos + (1 + step) * 0.1 * vel, vel)[-1])
        worlds = [
            left
            for given in ({}, {"seeds": [1, 2], "threads": 2})
            for left in claimed(pos, vel, hunter(stock), n_steps, **given)
        ]
        first = (
            np.linalg.norm(pos - pos[-1], axis=1)[:-1] < 6.0 + 0.3 * speed
        )  # may be captured in the step before
        for left in worlds:
            assert left == worlds[0]
            assert {k + 1 for k in np.flatnonzero((least[:-1] >= 5.0) & ~first)} <= left
            assert not left & {k + 1 for k in np.flatnonzero(least[:-1] < 4.99)}


def test_a_fast_prey_that_passes_a_predator_is_captured_unless_by_the_law_of_scrimmage():
    pos, vel = [[-45, 3, 0], [0, 0, 0]], [[300, 0, 0], [0, 0, 0]]
    assert claimed(pos, vel, hunter(stock)) == [{2}]
    assert claimed(pos, vel, hunter(stock, between_steps=False)) == [{1, 2}]
    assert claimed(pos, vel, hunter(historic), referee=historic.SimpleCapture, n_steps=2) == [{1, 2}]
    assert claimed(
        pos, vel, stock.Escort(capture_range=5.0, intruder_team=1, network_name="GlobalNetwork")
    ) == [{2}]
    assert claimed([[-45, 6, 0], [0, 0, 0]], vel, hunter(stock)) == [{1, 2}]
    assert claimed(pos, [[300, 0, 0], [300, 0, 0]], hunter(stock)) == [{1, 2}]
