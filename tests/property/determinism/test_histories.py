"""Whatever happens to a stack, each world is, bit for bit, what it would be alone after as many steps."""

from __future__ import annotations

import copy
import dataclasses
from contextlib import suppress
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from missions import NAMES, mission

from tussle import Simulation
from tussle.errors import ParameterError

LAST = 12
"""Steps after which the worlds end."""


@cache
def short(name: str):
    """A golden mission that ends early, so that some worlds of a stack end while others go on."""
    game = mission(name)
    return game.replace(end=LAST * game.dt)


@cache
def alone(name: str, seed: int) -> list[str]:
    """Hash of a world that plays alone, after 0, 1, 2 ... steps; one more where nothing happens any more."""
    sim = Simulation(short(name), seeds=seed)
    hashes = [sim.state_hash()]
    while sim.state.running.any():
        sim.step()
        hashes.append(sim.state_hash())
    return hashes


@dataclasses.dataclass
class Expected:
    """What must be: the seed of each world, and how many steps it has made."""

    name: str
    seeds: list[int]
    steps: list[int]

    def step(self, n: int) -> None:
        self.steps = [
            min(k + n, len(alone(self.name, s)) - 1) for k, s in zip(self.steps, self.seeds, strict=True)
        ]

    def hashes(self) -> list[str]:
        return [alone(self.name, s)[k] for k, s in zip(self.steps, self.seeds, strict=True)]


seed = st.integers(1, 4)
act = st.one_of(
    st.tuples(st.just("step"), st.integers(1, 7)),
    st.tuples(st.just("reset"), st.dictionaries(st.integers(0, 4), seed, min_size=1, max_size=3)),
    st.tuples(st.just("repeat"), st.integers(0, 4)),
    st.tuples(st.sampled_from(["snapshot", "restore", "look", "write back"]), st.none()),
)


class History:
    """A stack, what is expected of it, and a snapshot of both."""

    def __init__(self, name: str, seeds: list[int], threads: int) -> None:
        self.sim = Simulation(short(name), seeds=seeds, threads=threads, on_error="raise")
        self.expected = Expected(name, seeds, [0] * len(seeds))
        self.saved: Any = self.sim.snapshot(), copy.deepcopy(self.expected)

    def act(self, what: str, detail: Any) -> None:
        sim, expected = self.sim, self.expected
        if what == "step":
            sim.step(detail)
            expected.step(detail)
        elif what == "reset":
            worlds = {w % sim.n_worlds: s for w, s in detail.items()}
            sim.reset(list(worlds), seeds=list(worlds.values()))
            for world, other in worlds.items():
                expected.seeds[world], expected.steps[world] = other, 0
        elif what == "repeat":
            sim.reset([detail % sim.n_worlds])
            expected.steps[detail % sim.n_worlds] = 0
        elif what == "snapshot":
            self.saved = sim.snapshot(), copy.deepcopy(expected)
        elif what == "restore":
            sim.restore(self.saved[0])
            self.expected = copy.deepcopy(self.saved[1])
        else:
            self.look(writes=what == "write back")

    def look(self, *, writes: bool) -> None:
        sim = self.sim
        sim.result(), sim.describe()
        for block in sim.mission.blocks:
            for column in ("pos", "vel", "quat", "health"):
                values, _ = sim.read(f"{block.name}.{column}")
                if writes and values.size:
                    sim.write(f"{block.name}.{column}", values)
            for plugin in (*block.autonomy, block.motion):
                for column in (*type(plugin).states(), *type(plugin).outputs()):
                    with suppress(ParameterError):  # an output that nobody reads
                        sim.read(f"{block.name}.{plugin.instance_name}.{column}")


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=16)  # of each mission: three hundred in all
@given(
    seeds=st.lists(seed, min_size=1, max_size=5),
    threads=st.sampled_from([1, 2]),
    acts=st.lists(act, min_size=2, max_size=7),
)
def test_world_of_a_stack_with_a_past_is_as_alone(name, seeds, threads, acts):
    history = History(name, list(seeds), threads)
    with history.sim:
        for what, detail in acts:
            history.act(what, detail)
            now = [history.sim.state_hash(w) for w in range(len(seeds))]
            assert now == history.expected.hashes(), (what, detail)


@pytest.mark.parametrize("name", ["chase_synchronous", "chase_sequential"])
def test_worlds_that_end_apart_end_as_alone(name):
    game = mission(name).replace(end=60.0, end_conditions="time, one_team")
    seeds = range(1, 9)
    together = Simulation(game, seeds=seeds, on_error="raise").run()
    single = [Simulation(game, seeds=s).run()[0] for s in seeds]
    assert len({r.t for r in together}) > 2
    for one, other in zip(together, single, strict=True):
        assert (one.seed, one.t, one.end, one.scores, one.alive) == (
            other.seed,
            other.t,
            other.end,
            other.scores,
            other.alive,
        )
        assert one.state_hash == other.state_hash


@pytest.mark.parametrize("update", ["synchronous", "sequential"])
def test_sweep_gives_each_world_what_the_parameter_alone_gives(update):
    game = mission("chase_synchronous").replace(update=update, motion_multiplier=2)
    sweep = {
        "prey.Boids.goal_weight": [0.1, 0.2, 0.3, 0.1],
        "prey.Boids.averaging": ["team", "historic", "team", "historic"],
        "prey.Boids.fov_az": [6.3, 2.0, 1.0, 6.3],
        "prey.Boids.comms_range": [200.0, 50.0, 100.0, 30.0],
        "prey.speed": [1.0, 2.0, 3.0, 4.0],
        "keepers.Predator.max_speed": [35.0, 20.0, 10.0, 35.0],
        "SimpleCapture.capture_range": [20.0, 10.0, 5.0, 15.0],
    }
    sim = Simulation(game, seeds=[1, 1, 2, 2], params=sweep, on_error="raise")
    sim.step(15)
    for world, seed_ in enumerate([1, 1, 2, 2]):
        single = Simulation(game, seeds=seed_, params={path: values[world] for path, values in sweep.items()})
        single.step(15)
        assert single.state_hash() == sim.state_hash(world)


def test_threads_in_a_large_world_change_nothing():
    hashes = []
    for threads in (1, 2, 5):
        game = mission("chase_synchronous")
        blocks = [b for b in game.blocks if b.name != "prey"]
        prey = dataclasses.replace(game.blocks[0], count=1500, half_width=(900.0, 900.0, 60.0))
        with Simulation(game.replace(blocks=[prey, *blocks]), seeds=1, threads=threads) as sim:
            sim.step(4)
            assert (sim.state.context._pool is not None) == (threads > 1)
            hashes.append(sim.state_hash())
    assert len(set(hashes)) == 1


@pytest.mark.parametrize("name", NAMES)
def test_equal_seeds_give_equal_worlds_and_others_do_not(name):
    sim = Simulation(mission(name), seeds=[1, 1, 2])
    sim.step(5)
    block = mission(name).blocks[0].name
    pos, _ = sim.read(f"{block}.pos")
    assert np.array_equal(pos[0], pos[1], equal_nan=True)
    assert not np.array_equal(pos[0], pos[2], equal_nan=True)
