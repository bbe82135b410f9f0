"""Entities are placed by the rules of SCRIMMAGE."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_worlds import Drift, block, mission

from tussle import Simulation
from tussle.plugins import historic, stock

STILL = Drift(to=(0.0, 0.0, 0.0))


def placed(*blocks, seeds=1, **values):
    """Position, heading and velocity of the entities of block a, (n_worlds, n, 3), (n_worlds, n), (n_worlds, n, 3)."""
    sim = Simulation(mission(*blocks, compat="scrimmage", **values), seeds=seeds)
    pos, quat, vel = (sim.read(f"a.{name}")[0] for name in ("pos", "quat", "vel"))
    return pos, 2.0 * np.arctan2(quat[..., 3], quat[..., 0]), vel


def test_a_block_stands_on_one_point_unless_an_interaction_rejects_that():
    five = block("a", count=5, position=(1, 2, 3), variance=(100, 100, 4), autonomy=STILL)
    assert (placed(five)[0] == [1, 2, 3]).all()
    apart = placed(five, interactions=[stock.SimpleCollision()])[0][0]
    assert apart[0].tolist() == [1, 2, 3]
    assert len({tuple(p) for p in apart}) == 5
    scattered = placed(
        block("a", count=400, position=(1, 2, 3), variance=(100, 25, 4), scatter_first=True, autonomy=STILL)
    )[0][0]
    assert scattered.std(axis=0) == pytest.approx([10, 5, 2], rel=0.15)
    assert (scattered == np.char.mod("%.6f", scattered).astype(float)).all()


def test_headings_walk_along_a_block_and_are_those_of_texts():
    walk = block("a", count=300, heading="20 deg", heading_variance=1e-4, autonomy=STILL)
    _, heading, _ = placed(walk, seeds=[1, 2])
    steps = np.diff(heading[0])
    assert steps.std() == pytest.approx(0.01, rel=0.15)
    assert np.degrees(heading) == pytest.approx(np.round(np.degrees(heading), 6), abs=1e-9)
    assert (heading[0] == placed(walk, seeds=1)[1][0]).all()
    third = block("a", heading=1.0 / 3.0, autonomy=STILL)
    assert placed(third)[1].item() == pytest.approx(math.radians(19.098593), abs=1e-15)


def test_the_initial_speed_points_east():
    moving = {"autonomy": (), "motion": stock.Ballistic()}
    north = block("a", heading="90 deg", speed=5.0, **moving)
    assert placed(north)[2].ravel().tolist() == [5.0, 0.0, 0.0]
    given = block("a", heading="90 deg", velocity=(0.0, 2.0, 1.0), **moving)
    assert placed(given)[2].ravel().tolist() == [0.0, 2.0, 1.0]


def test_a_slot_gives_birth_once_per_step_and_counts_from_there():
    """Every 0.15 s with steps of 0.1 s: in steps 0, 2, 4 ...; tussle keeps the rate on average."""
    fast = block("a", count=30, rate=1 / 0.15, slots=2, autonomy=STILL)
    for compat, counts in (("scrimmage", [2, 2, 4, 4, 6, 6]), ("", [2, 2, 4, 6, 6, 8])):
        sim = Simulation(mission(fast, compat=compat), seeds=1)
        found = []
        for _ in range(6):
            sim.step()
            found.append(int(sim.read("a.pos")[1].sum()))
        assert found == counts


@pytest.mark.slow
def test_what_a_plugin_spawns_is_placed_as_it_says():
    clone = stock.Straight(generate_entities=True, template="b")
    flying = {"motion": stock.SimpleAircraft(), "controller": stock.SimpleAircraftControllerPID()}
    game = mission(
        block("a", autonomy=clone, **flying), block("b", count=0, autonomy=historic.Boids(), **flying), end=2.3, compat="scrimmage"
    )  # fmt: skip
    sim = Simulation(game, seeds=1)
    sim.step(22)
    assert sim.read("b.pos")[1].sum() == 1


def test_a_game_ends_when_the_living_are_of_one_team_whoever_began_or_is_to_come():
    one = block("a", team=1, autonomy=STILL)
    late = block("b", team=2, autonomy=STILL, rate=1.0, first_birth=0.5)
    for blocks, condition in (([one], "one_team"), ([one, late], "one_team"), ([late], "all_dead")):
        ends = [
            Simulation(mission(*blocks, end_conditions=("time", condition), compat=compat), seeds=1).run()[0]
            for compat in ("scrimmage", "")
        ]
        assert [(r.end, r.steps) for r in ends] == [(condition, 1), ("time", 10)]
