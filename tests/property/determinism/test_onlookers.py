"""An onlooker changes nothing, a resumed run is the run, caches with room for one thing change nothing.

Each game is played for so long that radii which change have passed more sizes than a cache of neighbour indexes keeps.
"""

from __future__ import annotations

import dataclasses

import pytest
from missions import NAMES, mission
from onlookers import pushed_flocks, radius_at, watched

from tussle import Recorder, Simulation, load_run
from tussle.api import bodies
from tussle.numeric.neighbors.index import next_size

STEPS = 220
EVERY = 20
PUSHED = {"pushed_flocks": ("synchronous", 12), "pushed_flocks_sequential": ("sequential", 4)}
GAMES = (
    "chase_synchronous", "chase_sequential", "two_flocks", "schemas", "births_and_radio", "narrow_view", "slow_clocks", *PUSHED
)  # fmt: skip


def game(name: str):
    """A golden mission, or flocks whose bodies bounce, over all the steps."""
    found = mission(name) if name in NAMES else pushed_flocks(*PUSHED[name])
    return found.replace(end=2 * STEPS * found.dt, end_conditions="time")


def play(sim: Simulation, steps: int) -> list[str]:
    """State hash after each few steps."""
    shown = []
    for _ in range(steps // EVERY):
        sim.step(EVERY)
        shown.append(sim.state_hash())
    return shown


def hashes(found, **values) -> list[str]:
    """State hashes of a whole game."""
    with Simulation(found, seeds=3, on_error="raise", **values) as sim:
        return play(sim, STEPS)


def test_the_radii_pass_more_sizes_than_are_kept():
    assert len({float(next_size(radius_at(step))) for step in range(STEPS)}) > 2 * bodies.KEPT_INDEXES


@pytest.mark.parametrize("name", GAMES)
def test_neither_looks_nor_a_resume_nor_small_caches_change_a_game(name, monkeypatch):
    """Neither the game nor the onlookers' own states, alone, in threads, resumed in the same simulation and in another one."""
    found = watched(game(name), looks=True)
    expected = hashes(found)
    assert hashes(watched(game(name), looks=False)) == expected

    with Simulation(found, seeds=3, on_error="raise") as sim, Simulation(found, seeds=4) as other:
        sim.step(3 * EVERY)
        saved = sim.snapshot()
        other.step(4 * EVERY)
        for each in (sim, other):
            each.restore(saved)
            assert play(each, STEPS - 3 * EVERY) == expected[3:]

    monkeypatch.setattr(bodies, "KEPT_INDEXES", 1)
    monkeypatch.setattr(bodies, "KEPT_RANGES", 0)
    assert hashes(found, threads=2) == expected


def test_with_caches_without_bound_the_game_is_the_same(monkeypatch):
    found = watched(game("pushed_flocks"), looks=True)
    expected = hashes(found)
    monkeypatch.setattr(bodies, "KEPT_INDEXES", 10**9)
    monkeypatch.setattr(bodies, "KEPT_RANGES", 10**9)
    assert hashes(found) == expected


@pytest.mark.parametrize("name", PUSHED)
def test_an_onlooker_far_away_changes_nothing(name):
    """It is a block of its own, of the flock's team."""
    found = game(name)
    far = dataclasses.replace(found.blocks[0], name="far", count=2, position=(1e5, 0.0, 100.0))
    alone = found.replace(blocks=[*found.blocks, far])
    looking = alone.replace(blocks=[*found.blocks, *watched(alone.replace(blocks=[far]), looks=True).blocks])
    places = []
    for each in (alone, looking):
        with Simulation(each, seeds=3, on_error="raise") as sim:
            sim.step(STEPS)
            places.append(sim.read("west.pos")[0].tobytes() + sim.read("east.pos")[0].tobytes())
    assert places[0] == places[1]


@pytest.mark.filterwarnings("ignore:not recorded, since no plugin")
@pytest.mark.parametrize("name", GAMES)
def test_recording_every_column_of_every_plugin_changes_nothing(name, tmp_path):
    found = game(name)
    with Simulation(found, seeds=[3, 4]) as sim, Simulation(found, seeds=[3, 4]) as plain:
        with Recorder(sim, tmp_path / "run", columns="*"):
            assert play(sim, STEPS) == play(plain, STEPS)
        assert [sim.state_hash(w) for w in range(2)] == [plain.state_hash(w) for w in range(2)]
    assert load_run(tmp_path / "run").columns
