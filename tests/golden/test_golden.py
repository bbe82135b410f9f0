"""The hashes that are kept, whatever the stack, the threads, and who stops the game in between.

What else a stack may go through is drawn at random in property/determinism and property/fuzz.
"""

from __future__ import annotations

import pickle
import threading

import numpy as np
import pytest
from golden_runs import (
    JSBSIM,
    LEARNED,
    SERVED,
    example_of,
    examples,
    final_hashes,
    golden,
    hashes_now,
    kept,
    kept_examples,
    play,
    play_example,
    simulation,
)
from missions import NAMES, SEEDS, STEPS, mission

from tussle import Simulation
from tussle.plugins import stock

STACK = (11, 2, 12, 13, 1, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 3)
"""Sixteen seeds; those that are kept stand at places 4, 1 and 15."""

every_mission = pytest.mark.parametrize("name", NAMES)


def agree(name, seeds, hashes):
    """Whether the hashes of all kept seeds are as kept."""
    known = [(seed, now) for seed, now in zip(seeds, hashes, strict=True) if seed in SEEDS]
    assert known
    assert dict(known) == {seed: kept(name, seed) for seed, _ in known}


def test_all_missions_are_kept():
    assert list(golden()) == list(NAMES)
    every = [one for mission_ in golden().values() for hashes in mission_.values() for one in hashes]
    assert len(set(every)) == len(every) == 2 * len(SEEDS) * len(NAMES)
    assert {example_of(name) for name in (*kept_examples(), *JSBSIM, *LEARNED, *SERVED)} == {
        *stock.examples().values()
    }


@every_mission
def test_stack_of_three_on_its_way_and_at_the_end(name):
    assert play(name) == golden()[name]


@every_mission
def test_world_alone_and_a_pickled_mission_in_a_stack_of_sixteen(name):
    agree(name, [2], final_hashes(name, 2))
    with Simulation(pickle.loads(pickle.dumps(mission(name))), seeds=STACK, threads=2) as sim:
        assert sim.grade == "portable"
        sim.step(STEPS[name])
        agree(name, STACK, hashes_now(sim))


# Of seed 2, a vehicle of Unicycle3D begins inside its turning circle about a waypoint.
@pytest.mark.filterwarnings("ignore:GoTo. an entity skips a waypoint:RuntimeWarning")
@pytest.mark.parametrize("kind", sorted({name.partition("/")[0] for name in examples()}))
def test_examples_alone_and_second_in_a_stack_of_two(kind):
    names = [name for name in examples() if name.startswith(f"{kind}/")]
    assert {name: play_example(name) for name in names} == {name: [kept_examples()[name]] for name in names}
    assert [name for name in names if play_example(name, [2, 1])[1] != kept_examples()[name]] == []


@pytest.mark.parametrize("name", ["chase_synchronous", "two_flocks", "narrow_view"])
def test_threads_take_part_and_change_nothing(name):
    seeds = range(1, 81)
    with simulation(name, seeds, threads=3) as sim:
        sim.step(STEPS[name])
        assert sim.state.context._pool is not None  # there was enough for several threads
        agree(name, seeds, hashes_now(sim))


# Stopping and going back ---------------------------------------------------------------------------------------


def test_pause_in_between_changes_nothing():
    name = "births_and_radio"
    sim = simulation(name, SEEDS)
    goal = STEPS[name]

    def pause_once(sim):
        if sim.steps.max() == goal // 2:
            sim.pause()
            threading.Timer(0.02, sim.resume).start()

    sim.observers.append(pause_once)
    sim.run_until(lambda sim: sim.steps.max() == goal)
    agree(name, SEEDS, hashes_now(sim))


@every_mission
def test_a_snapshot_is_restored_into_another_simulation_more_than_once(name):
    sim, other = simulation(name, SEEDS), simulation(name, (7, 8, 9))
    half = STEPS[name] // 2
    sim.step(half)
    saved = sim.snapshot()
    other.step(half + 3)
    for _ in range(2):
        other.restore(saved)
        assert hashes_now(other) == [golden()[name][str(seed)][0] for seed in SEEDS]
        other.step(STEPS[name] - half)
        agree(name, SEEDS, hashes_now(other))


# What must change a hash ---------------------------------------------------------------------------------------


def states_of(plugin, path):
    """Paths of all numbers that a plugin and those inside it keep."""
    path = f"{path}.{plugin.instance_name}"
    yield from (f"{path}.{name}" for name, column in type(plugin).states().items() if not column.ragged)
    for name in type(plugin).children():
        for child in plugin.values[name]:
            yield from states_of(child, path)


@every_mission
def test_one_ulp_in_any_value_of_one_world_changes_its_hash_only(name):
    sim = simulation(name, SEEDS)
    sim.step(3)
    before, saved, n_changed = hashes_now(sim), sim.snapshot(), 0
    for block in sim.mission.blocks:
        for path in (
            f"{block.name}.pos",
            *(each for plugin in block.plugins for each in states_of(plugin, block.name)),
        ):
            values, alive = sim.read(path)
            if values.dtype == float and alive[1].any():
                place = (1, np.flatnonzero(alive[1])[0], *[0] * (values.ndim - 2))
                values[place] = np.nextafter(values[place], np.inf) if np.isfinite(values[place]) else 0.0
                sim.write(path, values)
                assert [a == b for a, b in zip(before, hashes_now(sim), strict=True)] == [
                    True,
                    False,
                    True,
                ], path
                sim.restore(saved)
                n_changed += 1
    assert n_changed
