"""Worlds that outgrow their limits end with an error; the others of their stack go on as if they were alone."""

from __future__ import annotations

import re
import time

import numpy as np
import pytest
from small_worlds import Drift, Reaper, Wander, alone, block, mission

from tussle import Simulation
from tussle.api import Autonomy, Interaction, Param, Publish
from tussle.engine import population
from tussle.engine.group import Group
from tussle.errors import MissionError, PluginError
from tussle.messages import SpawnEntity
from tussle.mission import Limits
from tussle.stock import SimpleCollision

WILD = {"Breeder.litter": [0, 7, 1]}
"""World 1 of three grows beyond 40 entities in ten steps, the others do not."""


class Breeder(Interaction):
    """Ask for some entities in every step."""

    litter = Param(0)

    def step(self, w):
        w.spawn("a", np.repeat(np.arange(w.n_worlds), self.litter))


class Calling(Autonomy):
    """Ask for another entity in every step, by message."""

    births = Publish(SpawnEntity)

    def step(self, g):
        self.births.publish(np.arange(g.n), block=["a"] * g.n, pos=g.pos, vel=g.vel)


class Shut(Interaction):
    """Reject every place after the first ones, in the worlds that are shut."""

    is_shut = Param(False)
    admits = Param(2)

    def rejects(self, w, world, pos, taken):
        return bool(self.is_shut[world] and taken.shape[1] >= self.admits[world])


def crowd(**values):
    values = {"limits": Limits(rows=40), "interactions": [Breeder()], **values}
    return mission(block(count=3, autonomy=Wander(), variance=(9, 9, 9)), **values)


@pytest.mark.parametrize("limit", [{"rows": 40}, {"rows": 40, "sequential": 40}], ids=["rows", "sequential"])
def test_a_world_that_outgrows_its_limit_ends_and_the_others_are_as_alone(limit):
    update = "sequential" if "sequential" in limit else "synchronous"
    game = crowd(limits=Limits(**limit), update=update)
    results = Simulation(game, seeds=[1, 2, 3], params=WILD).run()
    assert [r.end for r in results] == ["time", "error", "time"]
    assert isinstance(results[1].error, PluginError)
    assert (results[1].error.world, results[1].error.step) == (1, 6)
    assert re.search(rf" 7 more .* 2 are .*{update}.* 40;.*allow_large", str(results[1].error))
    for world in (0, 2):
        one = alone(game, world + 1, {"Breeder.litter": WILD["Breeder.litter"][world]})
        assert results[world].state_hash == one.state_hash()


def test_births_by_message_are_counted():
    game = mission(block(count=4, autonomy=[Drift(), Calling()]), limits=Limits(rows=40))
    with pytest.raises(PluginError, match=r"world 0, step 4: .* 32 more .* 8 are"):
        Simulation(game).run()


def test_allowing_much_lifts_the_limit():
    results = Simulation(crowd(limits=Limits.large()), seeds=[1, 2, 3], params=WILD).run()
    assert [r.end for r in results] == ["time"] * 3


def test_the_entities_of_the_blocks_always_have_room():
    game = mission(
        block("a", count=30, rate=30.0, slots=3), block("b", count=20),
        limits=Limits(rows=4), interactions=[Breeder()],
    )  # fmt: skip
    assert Simulation(game).run()[0].end == "time"
    with pytest.raises(PluginError, match=r" 1 more .* 0 are"):
        Simulation(game, params={"Breeder.litter": 1}).run()


def test_the_dead_make_room_but_not_where_their_calls_stay():
    game = crowd(interactions=[Reaper(team=0, at=0.0), Breeder(litter=7)], limits=Limits(rows=20))
    assert Simulation(game).run()[0].end == "time"
    with pytest.raises(PluginError, match=r"update='sequential'.* 20;"):
        Simulation(game.replace(update="sequential", limits=Limits(sequential=20))).run()


def test_a_world_without_a_place_ends_and_the_others_are_as_alone():
    game = crowd(interactions=[Shut()])
    results = Simulation(game, seeds=[1, 2], params={"Shut.is_shut": [False, True]}).run()
    assert [r.end for r in results] == ["time", "error"]
    assert "block 'a': no free position for entity 3 of 3" in str(results[1].error)
    assert results[0].state_hash == alone(game, 1).state_hash()


def test_a_birth_without_a_place_ends_its_world_only():
    late = block("late", count=2, rate=5.0, first_birth=0.5, variance=(1, 1, 1), without_space="fail")
    game = mission(block(count=2, variance=(9, 9, 9)), late, interactions=[Shut()])
    results = Simulation(game, seeds=[1, 2], params={"Shut.is_shut": [False, True]}).run()
    assert [(r.end, r.steps) for r in results] == [("time", 10), ("error", 5)]
    assert results[0].state_hash == alone(game, 1).state_hash()


def test_tries_to_place_entities_are_counted_over_all_of_them():
    crowded = block(count=2000, variance=(100, 100, 0))  # a disc that 600 fill
    begin = time.process_time()
    with pytest.raises(MissionError, match=r"entity \d+ of 2000 after \d+ tries, and 5,000 in all"):
        Simulation(mission(crowded, interactions=[SimpleCollision()], limits=Limits(tries=5000)))
    assert time.process_time() - begin < 20.0


def test_limits_are_limits():
    with pytest.raises(MissionError, match="limits = 40 is not a Limits"):
        crowd(limits=40)


def test_groups_of_a_sequential_mission_are_not_sorted_anew_for_each_entity(monkeypatch):
    looked_at = []

    class Watched(Group):
        @property
        def place(self):
            looked_at.append(self)
            return self.__dict__["place"]

        @place.setter
        def place(self, value):
            self.__dict__["place"] = value

    monkeypatch.setattr(population, "Group", Watched)
    sim = Simulation(mission(block(count=200), update="sequential"))
    assert [g.__dict__["place"] for g in sim.state.population.groups] == list(range(1, 201))
    assert len(looked_at) < 200 * 12  # n log n comparisons, and a look for each label
