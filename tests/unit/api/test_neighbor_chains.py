"""Neighbour laws whose kernels run in one call give the bits that the kernels give one by one."""

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output, Param, State, laws, neighbors, together
from tussle.engine import joined_calls
from tussle.mission import read_mission
from tussle.numeric.address import caller
from tussle.numeric.bound import Bound
from tussle.numeric.kernel import kernel
from tussle.numeric.neighbors.chain import Chain, TurnChain
from tussle.stock import RandomAttrit, SingleIntegrator

ALWAYS, NEVER = 1, 10**9
"""Numbers of steps after which the kernels of a law are chained."""


class Crowd(Autonomy):
    """Gathers at the origin, by a law that reads columns of all kinds: computed, written in place, whole numbers, its own state."""

    sight = Param(40.0, unit="m")
    seen = State(dtype=int)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    @neighbors("sight", n="count", yaw="mean", climb="max", health="min", id="nearest", roll="sum")
    @staticmethod
    def near(other_yaw, other_climb, other_health, other_id, other_roll, seen):
        return True, other_yaw, other_climb, other_health, other_id, other_roll + seen

    @neighbors("sight", teams="other", vx="sum", north="sum")
    @staticmethod
    def rivals(other_vel_x, other_forward_y):
        return other_vel_x, other_forward_y

    every = together(near, rivals)

    def step(self, g):
        found = self.every(g)
        self.seen[:] = found.near_n
        finite = [np.where(np.isfinite(v), v, 0.0) for v in found]
        self.velocity[:] = -0.8 * g.pos + np.stack(finite[3:6]) * 0.1 + finite[1] + finite[6] + finite[7]
        g.bodies.health  # noqa: B018 - as others read it


class Turning(Autonomy):
    """Flies as its neighbours do; its law reads computed columns only."""

    sight = Param(40.0, unit="m")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    @neighbors("sight", yaw="mean", north="sum", vy="max", x="sum")
    @staticmethod
    def near(other_yaw, other_forward_y, other_vel_y, offset_x, vel_x):
        return other_yaw, other_forward_y, other_vel_y, offset_x + vel_x

    def step(self, g):
        found = self.near(g)
        top = np.where(np.isfinite(found.vy), found.vy, 0.0)
        self.velocity[:] = -0.5 * g.pos + np.stack([found.yaw + found.north, 0.5 * top, 0.01 * found.x])


def crowd(autonomy=Crowd, **changes):
    """Two teams that are far apart at first, and close together soon."""
    blocks = [
        Block(
            name=name, team=team, count=60, placement="uniform", half_width=(150, 150, 20), scatter_first=True,
            autonomy=autonomy(sight=sight), motion=SingleIntegrator(max_speed=60.0),
        )
        for name, team, sight in (("a", 1, 40.0), ("b", 2, 55.0))
    ]  # fmt: skip
    return Mission(blocks=blocks, end=8.0, dt=0.1, interactions=[RandomAttrit(rate=0.02)]).replace(**changes)


MISSIONS = {
    "crowd": crowd(),
    "crowd, no deaths": crowd(interactions=()),
    "predator_prey": read_mission("predator_prey").mission.replace(end=12.0),
}


IN_TURN = {
    "crowd": crowd(update="sequential", end=3.0),
    "turning": crowd(Turning, update="random", end=3.0),
    "predator_prey": read_mission("predator_prey").mission.replace(update="sequential", end=2.0),
    "predator_prey, random": read_mission("predator_prey").mission.replace(
        update="random_in_blocks", end=2.0
    ),
}


def hashes(mission, seeds, uses, monkeypatch):
    monkeypatch.setattr(joined_calls, "AFTER_LAWS", NEVER)
    with Simulation(mission, seeds=seeds) as simulation:
        simulation.state.context.steady_steps = uses, uses
        simulation.state.context.steady = uses
        return [result.state_hash for result in simulation.run()]


@pytest.mark.parametrize("name", MISSIONS)
@pytest.mark.parametrize("seeds", [[1], [2, 3, 4]], ids=["alone", "stack"])
def test_the_bits_are_those_of_the_kernels_one_by_one(name, seeds, monkeypatch):
    calls, run = [], Chain.run
    monkeypatch.setattr(Chain, "run", lambda self: calls.append(self) or run(self))
    chained = hashes(MISSIONS[name], seeds, ALWAYS, monkeypatch)
    assert len(calls) > 20
    del calls[:]
    assert chained == hashes(MISSIONS[name], seeds, NEVER, monkeypatch)
    assert not calls


@pytest.mark.parametrize("name", IN_TURN)
def test_where_entities_move_one_after_another_too(name, monkeypatch):
    calls, run = [], TurnChain.run
    monkeypatch.setattr(TurnChain, "run", lambda self, rows: calls.append(rows) or run(self, rows))
    seeds = [1] if IN_TURN[name].update.startswith("random") else [2, 3]
    chained = hashes(IN_TURN[name], seeds, ALWAYS, monkeypatch)
    assert (len(calls) > 200) == (name != "crowd")  # its law reads a column that others write in place
    del calls[:]
    assert chained == hashes(IN_TURN[name], seeds, NEVER, monkeypatch)
    assert not calls


def test_blocks_that_need_more_room_get_it(monkeypatch):
    found, run = [], Chain.run
    monkeypatch.setattr(Chain, "run", lambda self: found.append(run(self)) or found[-1])
    simulation, other = (Simulation(crowd(interactions=()), seeds=[1]) for _ in range(2))
    simulation.state.context.steady, other.state.context.steady = ALWAYS, NEVER
    for step in range(30):
        if step == 10:  # as if the spans had been few before
            for group in simulation.state.population.groups:
                for kept in group.autonomy_view.kept.values():
                    if isinstance(kept, laws.Gathered):
                        kept.chain._call = (*kept.chain._call[:-1], (*kept.chain._call[-1][:-1], 1))
        simulation.step()
    other.step(30)
    assert any(each is None for each in found)
    assert simulation.state_hash() == other.state_hash()


def test_what_a_law_returns_stays_as_it_is():
    kept = []

    class Keeper(Crowd):
        def step(self, g):
            super().step(g)
            found = self.every(g)
            kept.append((found.values, found.values.copy()))

    with Simulation(
        crowd(blocks=[b.replace(autonomy=Keeper()) for b in crowd().blocks]), seeds=[1]
    ) as simulation:
        simulation.state.context.steady = ALWAYS
        simulation.step(20)
    assert all(np.array_equal(now, then, equal_nan=True) for now, then in kept)


@kernel("F (F2 f8 b1 u8) i8 -> f8 i8")
def mixed(x, t, k):
    return x[1] + t[1] + t[0][1, 0], k + int(t[2]) + int(t[3])


call_entry = caller("i8")


@kernel("i8 i8")
def call_bound(entry, words):
    call_entry(entry, words)


def test_bound_arguments_are_those_of_a_call():
    x, table = np.arange(5.0), np.array([[1.0, 2.0], [30.0, 4.0]])
    arguments = x, (table, 0.5, True, 7), -9
    bound = Bound(mixed, *arguments)
    call_bound(bound.entry, bound.words.ctypes.data)
    first, second = mixed(*arguments)
    assert (bound.words[1:2].view(float)[0], bound.words[2]) == (first, second)
    table[1, 0] = 31.0  # read when called
    call_bound(bound.entry, bound.words.ctypes.data)
    assert bound.words[1:2].view(float)[0] == first + 1.0


def test_arguments_of_other_types_are_refused_when_they_are_bound():
    with pytest.raises(TypeError, match=r"kernel .*mixed: a bound argument is .*int64 array"):
        Bound(mixed, np.arange(5), (np.zeros((2, 2)), 0.5, True, 7), 1)
