"""The state hash sees all that the future depends on, also what no column of an entity shows."""

from __future__ import annotations

import numpy as np
import pytest
from golden_plugins import Nursery

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Field, Interaction, Message, Output, Param, Publish, RaggedColumn, Subscribe
from tussle.stock import SingleIntegrator, SphereNetwork


def hashes(mission, seeds, params=None, steps=1):
    sim = Simulation(mission, seeds=seeds, params=params, on_error="raise")
    sim.step(steps)
    return [sim.state_hash(w) for w in range(sim.n_worlds)]


class Rest(Autonomy):
    """Stays where it is."""

    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.velocity[:] = 0.0


def still(name="a", count=2, autonomy=(), **values):
    """A block of points that rest in one place."""
    autonomy = [Rest(), *autonomy]
    motion = SingleIntegrator()
    return Block(name=name, count=count, variance=(0.0, 0.0, 0.0), autonomy=autonomy, motion=motion, **values)


class Wind(Interaction):
    """Pushes or twists everybody for the next step."""

    push = Param(0.0, unit="N")
    twist = Param(0.0, unit="N m")

    def step(self, w):
        w.bodies.force[0] += self.push[w.world]
        w.bodies.torque[2] += self.twist[w.world]


def test_worlds_alike_have_hashes_alike():
    assert len(set(hashes(Mission(blocks=[still()], interactions=[Wind()]), [7, 7, 7]))) == 1


@pytest.mark.parametrize("name", ["push", "twist"])
def test_force_and_torque_count(name):
    game = Mission(blocks=[still()], interactions=[Wind()])
    assert len(set(hashes(game, [1, 1, 1], {f"Wind.{name}": [0.0, 1.0, 2.0]}))) == 3


def test_times_of_births_to_come_count():
    born = still(rate=2.0, interval_sd=0.2)
    sim = Simulation(Mission(blocks=[born]), seeds=[1, 2])
    sim.step()
    assert np.array_equal(*sim.read("a.pos")[0], equal_nan=True)  # alike but for when the second will be born
    assert sim.state_hash(0) != sim.state_hash(1)


def test_entities_asked_for_count():
    late = still("late", 0)

    class Asking(Interaction):
        east = Param(0.0, unit="m")
        n = Param(1)

        def step(self, w):
            worlds = np.repeat(np.arange(w.n_worlds), self.n.astype(int))
            w.spawn("late", worlds, pos=np.array([self.east[worlds], 0.0 * worlds, 0.0 * worlds]))

    params = {"Asking.east": [0.0, 1.0, 0.0, 0.0], "Asking.n": [1, 1, 2, 0]}
    found = hashes(Mission(blocks=[still(), late], interactions=[Asking()]), [1] * 4, params)
    assert len(set(found)) == 4
    alone = [
        hashes(
            Mission(blocks=[still(), late], interactions=[Asking()]), 1, {k: v[w] for k, v in params.items()}
        )
        for w in range(4)
    ]
    assert [one for (one,) in alone] == found


def test_stack_and_place_do_not_count():
    late = still("late", 0)
    game = Mission(blocks=[still(), late], interactions=[Nursery()])
    for steps in (3, 4, 5):  # a wish stands after the fourth
        stack = hashes(game, [4, 2, 9], steps=steps)
        assert stack == [hashes(game, seed, steps=steps)[0] for seed in (4, 2, 9)]
        assert stack == hashes(game, [9, 2, 4], steps=steps)[::-1]


class Talk(Message):
    """A number and a list."""

    number = Field()
    points = Field("x y", ragged=True)


class Speaker(Autonomy):
    """Says a number and a list that nobody hears yet."""

    number = Param(0.0)
    length = Param(1)
    last = Param(0.0)
    said = Publish(Talk, network="SphereNetwork")

    def step(self, g):
        rows = [
            np.array([[0.0, 1.0]] * (int(k) - 1) + [[0.0, x]]).T
            for k, x in zip(self.length, self.last, strict=True)
        ]
        points = RaggedColumn.from_rows(rows, Talk.fields["points"])
        self.said.publish(np.arange(g.n), number=self.number, points=points)


class Hearer(Autonomy):
    """Hears and forgets."""

    heard = Subscribe(Talk, network="SphereNetwork")

    def step(self, g):
        pass


def test_messages_on_their_way_count():
    block = still(autonomy=[Speaker(), Hearer()])
    game = Mission(blocks=[block], networks=[SphereNetwork(comm_delay=0.5)])
    params = {
        "a.Speaker.number": [0.0, 1.0, 0.0, 0.0],
        "a.Speaker.length": [1, 1, 2, 1],
        "a.Speaker.last": [0.0, 0.0, 0.0, 1.0],
    }
    assert len(set(hashes(game, [1] * 4, params))) == 4
