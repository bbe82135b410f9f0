"""Failures beside, places at the edge of the numbers, simulations in threads: other worlds do not notice."""

from __future__ import annotations

import dataclasses
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from golden_runs import final_hashes, kept
from hypothesis import given, settings
from hypothesis import strategies as st
from missions import NAMES, SEEDS, STEPS, mission

from tussle import Simulation
from tussle.api import Autonomy, Interaction, Param
from tussle.errors import PluginError


class BadReferee(Interaction):
    """Fails in one step of a world, after it has hurt whom it could there."""

    at = Param(-1)

    def step(self, w):
        w.bodies.health[:] *= 1.0
        due = (w.step_count == self.at)[w.world]
        if due.any():
            w.bodies.health[due] = 0.5
            w.kill(due, "in a rage")
            w.fail(np.flatnonzero(due)[0], "boom")


class BadPilot(Autonomy):
    """Fails in one step of a world."""

    at = Param(-1)

    def step(self, g):
        for row in np.flatnonzero(g.step_count == self.at):
            g.fail(row, "boom")


class BadPlace(Interaction):
    """Puts everybody of a world nowhere in one step."""

    at = Param(-1)

    def step(self, w):
        w.move((w.step_count == self.at)[w.world], pos=np.full(3, np.nan))


@pytest.mark.parametrize("name", NAMES)
def test_world_that_fails_takes_no_other_along(name):
    game = mission(name)
    first, *others = game.blocks
    armed = dataclasses.replace(first, autonomy=(*first.autonomy, BadPilot()))
    game = game.replace(blocks=[armed, *others], interactions=[*game.interactions, BadReferee(), BadPlace()])
    params = {
        f"{first.name}.BadPilot.at": [4, -1, -1, -1, -1, -1, 9],
        "BadReferee.at": [-1, -1, 4, -1, -1, -1, -1],
        "BadPlace.at": [-1, -1, -1, -1, 4, 9, -1],
    }
    sim = Simulation(game, seeds=[5, SEEDS[0], 6, SEEDS[1], 7, 8, SEEDS[2]], params=params)
    sim.step(9)
    with Simulation(game, seeds=SEEDS, on_error="raise") as peaceful:
        peaceful.step(9)
        assert [sim.state_hash(world) for world in (1, 3, 6)] == [peaceful.state_hash(w) for w in range(3)]
        sim.step(STEPS[name] - 9)
        peaceful.step(STEPS[name] - 9)
        assert [sim.state_hash(world) for world in (1, 3)] == [peaceful.state_hash(w) for w in range(2)]
    failed = [isinstance(r.error, PluginError) for r in sim.result()]
    assert failed == [True, False, True, False, True, True, True]


@pytest.mark.parametrize(
    "pair",
    [("chase_synchronous", "slow_clocks"), ("births_and_radio", "births_and_radio"), ("cars", "schemas")],
)
def test_simulations_in_threads_of_one_process(pair):
    with ThreadPoolExecutor(4) as pool:
        running = [(name, pool.submit(final_hashes, name, SEEDS)) for name in pair * 4]
        for name, hashes in running:
            assert hashes.result() == [kept(name, seed) for seed in SEEDS]


# Places at the edge --------------------------------------------------------------------------------------------

coordinate = st.sampled_from([0.0, -0.0, 5e-324, 1e-300, 1.0, -1.0, 200.0, 1e3, -1e3, 1e7, -1e9, 1e13])
places = st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=10, max_size=10)


@pytest.mark.parametrize("name", ["chase_synchronous", "two_flocks", "narrow_view", "cars"])
@settings(max_examples=15)
@given(both=st.tuples(places, places))
def test_entities_in_one_place_and_far_away(name, both):
    """The wildest placement of one world leaves the others, and its own future in a stack, as they are alone."""
    block = mission(name).blocks[0].name

    def placed(seeds, spots):
        sim = Simulation(mission(name), seeds=seeds, on_error="raise")
        pos, _ = sim.read(f"{block}.pos")
        for world, spot in enumerate(spots):
            if spot is not None:
                pos[world, :10] = spot
        sim.write(f"{block}.pos", pos)
        sim.step(6)
        return [sim.state_hash(world) for world in range(len(seeds))]

    stack = placed([1, 2, 3], [both[0], None, both[1]])
    assert stack == [placed([1], [both[0]])[0], placed([2], [None])[0], placed([3], [both[1]])[0]]
