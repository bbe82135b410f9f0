"""Plays golden missions and knows the hashes that are kept."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

from missions import NAMES, SEEDS, STEPS, mission

from tussle import Simulation

FILE = Path(__file__).with_name("golden.json")


@cache
def golden() -> dict[str, dict[str, list[str]]]:
    """Mission -> seed (as text) -> hashes after half of the mission's steps and after all."""
    return json.loads(FILE.read_text(encoding="utf-8"))["hashes"]


def kept(name: str, seed: int) -> str:
    """Hash that is kept of a mission's last step."""
    return golden()[name][str(seed)][1]


def simulation(name: str, seeds, **values) -> Simulation:
    """A golden mission that stops at the first failure."""
    return Simulation(mission(name), seeds=seeds, on_error="raise", **values)


def hashes_now(sim: Simulation) -> list[str]:
    """State hash of each world."""
    return [sim.state_hash(world) for world in range(sim.n_worlds)]


def final_hashes(name: str, seeds, **values) -> list[str]:
    """State hash of each world after the mission's steps."""
    with simulation(name, seeds, **values) as sim:
        sim.step(STEPS[name])
        return hashes_now(sim)


def play(name: str) -> dict[str, list[str]]:
    """What golden.json keeps of a mission, from one stack."""
    sim = simulation(name, SEEDS)
    half = STEPS[name] // 2
    sim.step(half)
    first = hashes_now(sim)
    sim.step(STEPS[name] - half)
    return {str(seed): [a, b] for seed, a, b in zip(SEEDS, first, hashes_now(sim), strict=True)}


def play_all(names=NAMES) -> dict[str, dict[str, list[str]]]:
    """The same of several missions."""
    return {name: play(name) for name in names}
