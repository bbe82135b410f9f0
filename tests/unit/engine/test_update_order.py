"""Synchronous and sequential: who sees whom where."""

from __future__ import annotations

import numpy as np
import pytest
from small_worlds import VELOCITY, Drift, block, mission

from tussle import Simulation
from tussle.api import Autonomy, EasyAutonomy, Interaction, Output, Param, State, neighbors
from tussle.batch.stack import stack_size
from tussle.errors import MissionError


class Follow(Autonomy):
    """Fly so that this step ends where the nearest other is seen now."""

    seen = State(unit="m")
    velocity = Output(VELOCITY, unit="m/s")

    def step(self, g):
        found = g.nearest()
        self.seen[:] = g.bodies.pos[0, found.other[0]]
        self.velocity[:] = found.offset[:, 0] / g.dt


class EasyFollow(EasyAutonomy):
    seen = State(unit="m")
    velocity = Output(VELOCITY, unit="m/s")

    def step_one(self, me):
        other = me.nearest()
        me.seen = other.pos[0]
        me.velocity = (other.pos - me.pos) / me.dt


class NearFollow(Autonomy):
    """The same by pairs within a range."""

    seen = State(unit="m")
    velocity = Output(VELOCITY, unit="m/s")

    def step(self, g):
        near = g.near(1e3)
        self.seen[near.row] = near.pos[0]
        self.velocity[:] = near.mean(near.offset) / g.dt


def pair(update, leader_first, follow):
    runner = block("runner", position=(10.0, 0, 0), autonomy=Drift(to=(30.0, 0, 0)))
    follower = block("follower", autonomy=follow())
    blocks = [runner, follower] if leader_first else [follower, runner]
    return mission(*blocks, update=update, end=0.3)


@pytest.mark.parametrize("follow", [Follow, EasyFollow, NearFollow])
@pytest.mark.parametrize(
    ("update", "leader_first", "seen"),
    [
        # The runner is at 10, 13, 16 m at the steps' beginnings; in each it moves 3 m.
        ("synchronous", True, [10.0, 13.0, 16.0]),
        ("synchronous", False, [10.0, 13.0, 16.0]),
        ("sequential", True, [13.0, 16.0, 19.0]),  # it has moved already when the follower looks
        ("sequential", False, [10.0, 13.0, 16.0]),
    ],
)
def test_what_a_follower_sees(update, leader_first, seen, follow):
    sim = Simulation(pair(update, leader_first, follow))
    found = []
    while not sim.is_over:
        sim.step()
        found.append(float(sim.read(f"follower.{follow.__name__}.seen")[0][0, 0]))
        assert sim.read("follower.pos")[0][0, 0, 0] == pytest.approx(found[-1])
    assert found == pytest.approx(seen)


CALLS = []


class Tell(Autonomy):
    """Tells that it decides."""

    velocity = Output(VELOCITY, unit="m/s")

    def step(self, g):
        CALLS.extend(g.id.tolist())


def orders(update, seed, steps=200, count=3):
    """The ids of all entities, step by step in the order in which they decide, (steps, n)."""
    CALLS.clear()
    a, b = (block(name, count=count, autonomy=Tell(), variance=(9.0, 9.0, 9.0)) for name in "ab")
    sim = Simulation(mission(a, b, update=update, end=1e3), seeds=seed)
    sim.step(steps)
    return np.array(CALLS).reshape(steps, 2 * count)


def test_each_step_has_its_own_random_order():
    found = orders("random", 1)
    assert (np.sort(found, axis=1) == np.arange(1, 7)).all()
    assert len(np.unique(found, axis=0)) > 150  # of 720
    first = np.bincount(found[:, 0], minlength=7)[1:]
    assert (np.abs(first - 200 / 6) < 5.0 * np.sqrt(200 * 5 / 36)).all()
    assert (orders("random", 1) == found).all()
    assert (orders("random", 2) != found).any()


def test_the_order_may_be_random_within_blocks():
    found = orders("random_in_blocks", 1)
    assert (np.sort(found[:, :3], axis=1) == [1, 2, 3]).all()
    assert (np.sort(found[:, 3:], axis=1) == [4, 5, 6]).all()
    assert len(np.unique(found, axis=0)) == 36


def test_in_a_random_order_a_follower_sees_what_has_moved_and_what_has_not():
    game = pair("random", True, Follow).replace(end=20.0)
    sim = Simulation(game)
    ahead = []
    while not sim.is_over:
        before = float(sim.read("runner.pos")[0][0, 0, 0])
        sim.step()
        ahead.append(round(float(sim.read("follower.Follow.seen")[0][0, 0]) - before, 6))
    assert set(ahead) == {0.0, 3.0}
    assert 60 < ahead.count(3.0) < 140


def test_a_random_order_goes_on_after_a_restore_and_a_reset():
    walkers = block("a", count=5, autonomy=NearFollow(), variance=(90.0, 90.0, 90.0))
    sim = Simulation(mission(walkers, update="random", end=4.0), seeds=5)
    sim.step(13)
    saved = sim.snapshot()
    (whole,) = sim.run()
    for begin in (lambda: sim.restore(saved), lambda: sim.reset([0])):
        begin()
        (again,) = sim.run()
        assert again.state_hash == whole.state_hash


def test_a_random_order_takes_one_world_and_batches_give_it_one():
    game = mission(block("a", count=2, autonomy=Tell()), update="random", end=1.0)
    with pytest.raises(MissionError, match="update='random' takes one world at a time, not a stack of 2"):
        Simulation(game, seeds=[1, 2])
    assert stack_size(game) == 1


class InRange(Autonomy):
    """Notes whom queries find within two radii, and where they are."""

    sight = Param(12.0, unit="m")
    reach = Param(np.inf, unit="m")
    found = State(
        "law where listed near",
        doc="Number found by a law and its place, numbers found by a list and by a query.",
    )

    @neighbors("sight", "reach", n="count", east="sum")
    @staticmethod
    def law(offset_x: float):
        return True, offset_x

    @neighbors("sight", "reach", east="each")
    @staticmethod
    def listing(offset_x: float):
        return offset_x

    def step(self, g):
        sums, near = self.law(g), g.near(self.sight)
        self.found[:2] = sums.n, sums.east
        self.found[2] = np.bincount(self.listing(g).row, minlength=g.n)
        self.found[3] = near.count
        assert np.array_equal(near.distance, near.offset[0])


class EasyInRange(EasyAutonomy):
    sight = Param(12.0, unit="m")
    reach = Param(np.inf, unit="m")
    found = State("law where listed near")

    def step_one(self, me):
        others = [other for other in me.near(me.sight) if me.distance(other) < me.reach]
        me.found = (
            len(others),
            sum(other.pos[0] - me.pos[0] for other in others),
            len(others),
            len(me.near(me.sight)),
        )


@pytest.mark.parametrize("query", [InRange, EasyInRange])
@pytest.mark.parametrize(
    ("update", "leader_first", "sight", "reach", "found"),
    [
        # The runner is at 10 m at the beginning of the step, and at 13 m after its move.
        ("synchronous", True, 12.0, np.inf, (1, 10, 1, 1)),
        ("sequential", False, 12.0, np.inf, (1, 10, 1, 1)),
        ("sequential", True, 12.0, np.inf, (1, 13, 1, 1)),  # in range at the beginning, seen where it is
        ("sequential", True, 12.0, 12.5, (0, 0, 0, 1)),  # a second radius is compared with where it is
        ("sequential", True, 9.0, np.inf, (0, 0, 0, 0)),
        ("synchronous", True, 9.0, np.inf, (0, 0, 0, 0)),
    ],
)
def test_who_is_in_range_is_decided_at_the_beginning_of_the_step(
    update, leader_first, sight, reach, found, query
):
    runner = block("runner", position=(10.0, 0, 0), autonomy=Drift(to=(30.0, 0, 0)))
    follower = block("follower", autonomy=[query(sight=sight, reach=reach), Drift(to=(0.0, 0.0, 0.0))])
    game = mission(*([runner, follower] if leader_first else [follower, runner]), update=update, end=0.3)
    sim = Simulation(game)
    sim.step()
    assert sim.read(f"follower.{query.__name__}.found")[0][0, 0] == pytest.approx(found)


def test_interactions_see_who_is_in_range_after_all_have_moved():
    """One that comes into range by its move is found in the same step."""

    class Touches(Interaction):
        sight = Param(12.0, unit="m")
        n = State(per="world")

        @neighbors("sight", n="count")
        @staticmethod
        def law():
            return True

        def step(self, w):
            self.n[:] = np.bincount(w.world, self.law(w).n, w.n_worlds)
            assert w.near(12.0).count.sum() == self.n.sum()

    runner = block("runner", position=(14.0, 0, 0), autonomy=Drift(to=(-30.0, 0, 0)))
    follower = block("follower", autonomy=Drift(to=(0.0, 0.0, 0.0)))
    sim = Simulation(mission(runner, follower, update="sequential", interactions=[Touches()]))
    sim.step()
    assert sim.read("Touches.n")[0][0] == 2


def test_sequential_with_structural_params_is_restored_into_the_right_groups():
    from small_worlds import Talker

    from tussle.stock import Unicycle

    class Steady(Autonomy):
        speed = Output(unit="m/s")
        turn_rate = Output(unit="rad/s")
        pitch_rate = Output(unit="rad/s")

        def step(self, g):
            self.speed[:] = g.id.astype(float)

    game = mission(
        block(count=3, autonomy=[Steady(), Talker()], motion=Unicycle(vel_max=9.0)), update="sequential"
    )
    sim = Simulation(game, seeds=[1, 2])
    sim.step(3)
    saved = sim.snapshot()
    first = [r.state_hash for r in sim.run()]
    ended = sim.read("a.pos")[0].copy()
    sim.reset([1], params={"a.Unicycle.enable_roll": True})  # new groups come between the old ones
    sim.run()
    assert np.array_equal(sim.read("a.pos")[0][0], ended[0])
    sim.restore(saved)
    assert [r.state_hash for r in sim.run()] == first


def test_the_schedule_lists_the_places_one_by_one():
    text = Simulation(pair("sequential", True, Follow)).describe()
    lines = [line.split(maxsplit=1)[1] for line in text.splitlines()[1:7]]
    assert lines == ["index start positions", "autonomy     runner 1: Drift", "motion       runner 1: SingleIntegrator",
                     "autonomy     follower 2: Follow", "motion       follower 2: SingleIntegrator", "index current positions"]  # fmt: skip


def test_sequential_substeps_are_all_of_one_entity_before_the_next():
    def seen(multiplier):
        sim = Simulation(pair("sequential", True, Follow).replace(motion_multiplier=multiplier))
        sim.step()
        return float(sim.read("follower.Follow.seen")[0][0, 0])

    assert seen(1) == pytest.approx(seen(4)) == pytest.approx(13.0)
