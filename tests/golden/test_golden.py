"""The hashes that are kept, whatever the stack, the order of worlds, the threads, and who looks on or stops the game in between."""

from __future__ import annotations

import dataclasses
import json
import multiprocessing
import pickle
import threading

import numpy as np
import pytest
from golden_runs import final_hashes, golden, hashes_now, kept, play, simulation
from missions import NAMES, SEEDS, STEPS, mission

from tussle import Simulation

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


@every_mission
def test_missions_claim_the_same_bits_everywhere(name):
    assert simulation(name, 1).grade == "portable"


# Stacks ------------------------------------------------------------------------------------------------------


@every_mission
@pytest.mark.parametrize("seed", SEEDS)
def test_world_alone(name, seed):
    agree(name, [seed], final_hashes(name, seed))


@every_mission
def test_stack_of_three_on_its_way_and_at_the_end(name):
    assert play(name) == golden()[name]


@every_mission
@pytest.mark.parametrize("order", [(2, 0, 1), (2, 1, 0), (1, 1, 0)])
def test_worlds_in_another_order(name, order):
    seeds = [SEEDS[i] for i in order]
    agree(name, seeds, final_hashes(name, seeds))


@every_mission
@pytest.mark.parametrize("threads", [1, 2])
def test_stack_of_sixteen(name, threads):
    agree(name, STACK, final_hashes(name, STACK, threads=threads))


@pytest.mark.parametrize("name", ["chase_synchronous", "two_flocks", "narrow_view"])
def test_threads_take_part_and_change_nothing(name):
    seeds = range(1, 81)
    with simulation(name, seeds, threads=3) as sim:
        sim.step(STEPS[name])
        assert sim.state.context._pool is not None  # there was enough for several threads
        agree(name, seeds, hashes_now(sim))


# Looking on, stopping and going back -------------------------------------------------------------------------


@every_mission
def test_observer_and_readers_change_nothing(name):
    seen = []

    def look(sim):
        block = sim.mission.blocks[0]
        seen.append(sim.read(f"{block.name}.pos")[0].sum())
        for column in ("vel", "yaw", "id", "health", "forward"):
            sim.read(f"{block.name}.{column}")
        for plugin in (*block.autonomy, block.motion):
            for column in (*type(plugin).states(), *type(plugin).outputs()):
                sim.read(f"{block.name}.{plugin.instance_name}.{column}")
        sim.result(), sim.describe(), sim.state_hash(1), sim.steps, sim.t

    sim = simulation(name, SEEDS)
    sim.observers.append(look)
    sim.step(STEPS[name])
    assert len(seen) == STEPS[name]
    agree(name, SEEDS, hashes_now(sim))


@every_mission
def test_pause_in_between_changes_nothing(name):
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
@pytest.mark.parametrize("where", ["same", "fresh"])
def test_snapshot_and_restore_in_between_change_nothing(name, where):
    sim = simulation(name, SEEDS)
    half = STEPS[name] // 2
    sim.step(half)
    saved = sim.snapshot()
    sim.step(5)  # into a future that is given up
    other = sim if where == "same" else simulation(name, (7, 8, 9))
    if where == "fresh":
        other.step(half + 3)
    other.restore(saved)
    assert hashes_now(other) == [golden()[name][str(seed)][0] for seed in SEEDS]
    other.step(STEPS[name] - half)
    agree(name, SEEDS, hashes_now(other))
    other.restore(saved)  # a snapshot serves more than once
    other.step(STEPS[name] - half)
    agree(name, SEEDS, hashes_now(other))


@every_mission
def test_two_simulations_take_turns(name):
    first, second = simulation(name, SEEDS), simulation(name, SEEDS[::-1])
    stranger = simulation("slow_clocks", (5, 6))
    for _ in range(STEPS[name]):
        first.step()
        stranger.step()
        second.step()
    agree(name, SEEDS, hashes_now(first))
    agree(name, SEEDS[::-1], hashes_now(second))


@every_mission
def test_worlds_whose_clocks_are_apart(name):
    sim = simulation(name, (4, 2, 3))
    goal = STEPS[name]
    sim.step(7)
    sim.reset([0], seeds=[1])
    sim.step(goal - 7)
    agree(name, (4, 2, 3), [None, *hashes_now(sim)[1:]])
    sim.reset([2, 1], seeds=[2, 3])  # world 2 plays seed 2, world 1 plays seed 3
    sim.step(7)
    assert sim.state_hash(0) == kept(name, 1)
    sim.step(goal - 7)
    assert hashes_now(sim)[1:] == [kept(name, 3), kept(name, 2)]


# What must change a hash ---------------------------------------------------------------------------------------


@every_mission
def test_another_seed_changes_the_hash(name):
    assert final_hashes(name, 4)[0] not in [kept(name, seed) for seed in SEEDS]


@every_mission
def test_one_ulp_in_one_position_changes_the_hash(name):
    path = f"{mission(name).blocks[0].name}.pos"
    sim = simulation(name, SEEDS)
    sim.step(3)
    before = hashes_now(sim)
    pos, alive = sim.read(path)
    first = np.flatnonzero(alive[1])[0]
    pos[1, first, 0] = np.nextafter(pos[1, first, 0], np.inf)
    sim.write(path, pos)
    assert [a == b for a, b in zip(before, hashes_now(sim), strict=True)] == [True, False, True]


@every_mission
def test_one_ulp_in_the_mission_changes_the_hash(name):
    game = mission(name)
    first = game.blocks[0]
    east, *rest = first.position
    moved = dataclasses.replace(first, position=(float(np.nextafter(east, 1e9)), *rest), scatter_first=False)
    other = game.replace(blocks=[moved, *game.blocks[1:]])
    same = game.replace(blocks=[dataclasses.replace(moved, position=first.position), *game.blocks[1:]])
    hashes = [Simulation(each, seeds=1).state_hash() for each in (other, same)]
    assert hashes[0] != hashes[1]


STATES = {
    "chase_synchronous": ("prey.Boids.target", 0),
    "chase_sequential": ("prey.Boids.target", 0),
    "two_flocks": ("west.SingleIntegrator.x", 6),
    "aircraft": ("plane.SimpleAircraftControllerPID.lateral", 0),
    "schemas": ("robot.MotorSchemas.MoveToGoalMS.integral", None),
    "births_and_radio": ("first.Beacon.rumour", 1),
    "narrow_view": ("narrow.Boids.target", 2),
    "slow_clocks": ("prey.UnicyclePID.heading", 2),
    "cars": ("car.Wanderer.wish", None),
    "hunters_first": ("prey.Boids.target", 0),
    "last_captured_first": ("prey.Boids.target", 0),
    "births_synchronous": ("slow.Beacon.rumour", 0),
    "births_sequential": ("slow.Beacon.rumour", 0),
    "machines": ("robot.MotorSchemas.MoveToGoalMS.integral", None),
    "errands": ("head.AuctionAssign.deadline", None),
}


@every_mission
def test_one_state_value_changes_the_hash(name):
    path, component = STATES[name]
    sim = simulation(name, SEEDS)
    sim.step(3)
    before = hashes_now(sim)
    values, _ = sim.read(path)
    at = (2, 1) if component is None else (2, 1, component)
    values[at] = np.nextafter(values[at], np.inf)
    sim.write(path, values)
    assert [a == b for a, b in zip(before, hashes_now(sim), strict=True)] == [True, True, False]


@every_mission
def test_writing_what_was_read_changes_nothing(name):
    sim = simulation(name, SEEDS)
    sim.step(3)
    block = sim.mission.blocks[0].name
    for path in (STATES[name][0], f"{block}.pos", f"{block}.vel", f"{block}.quat", f"{block}.health"):
        sim.write(path, sim.read(path)[0])
    sim.step(STEPS[name] - 3)
    agree(name, SEEDS, hashes_now(sim))


# Other processes -----------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_spawned_process_gives_the_same():
    context = multiprocessing.get_context("spawn")
    with context.Pool(1) as pool:
        assert json.dumps(pool.map(play, NAMES)) == json.dumps([golden()[name] for name in NAMES])


@every_mission
def test_mission_that_was_pickled_plays_the_same(name):
    sim = Simulation(pickle.loads(pickle.dumps(mission(name))), seeds=SEEDS)
    sim.step(STEPS[name])
    agree(name, SEEDS, hashes_now(sim))
