"""A process that plays game after game takes no more memory than one that has played a few."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy
from tussle.api.bodies import KEPT_INDEXES
from tussle.stock import Boids, Still, Unicycle, manifest

N_GAMES = int(os.environ.get("TUSSLE_MEMORY_GAMES", "120"))
"""Games per model; the promise is about two thousand, which takes minutes."""
MAX_GROWTH = (
    1.0 + 0.002 * N_GAMES
)  # [MB]; allocators settle for some thousand games. What was kept took 20 kB a game and more
SHIPPED = [
    name
    for name, path in manifest().items()
    if ".motion." in path and ("JSBSim" not in name or find_spec("jsbsim"))
]
MODELS = [*SHIPPED, "an author's own", "classes made on the fly"]


class Looker(Autonomy):
    """Look another distance far in each step."""

    def step(self, g):
        g.near(10.0 + float(g.t[0]))


@pytest.mark.slow
def test_games_leave_no_memory_behind():
    """In a fresh process, over the games of each model, after a few for warmth."""
    command = [sys.executable, str(Path(__file__).with_name("many_games.py")), str(N_GAMES), *MODELS]
    run = subprocess.run(command, check=False, capture_output=True, text=True, timeout=3000)
    assert run.returncode == 0, run.stderr
    grown = {model: float(by) for model, by in (line.rsplit(" ", 1) for line in run.stdout.splitlines())}
    assert list(grown) == MODELS
    assert {model: by for model, by in grown.items() if by >= MAX_GROWTH} == {}


def test_radii_that_change_at_each_reset_keep_no_index_each():
    block = Block(name="boids", team=1, count=5, autonomy=[Boids()], motion=Unicycle())
    sim = Simulation(Mission(blocks=[block], end=100.0, dt=0.1), seeds=range(4))
    for k in range(3 * KEPT_INDEXES):
        sim.reset([k % 4], [k], {"boids.Boids.comms_range": 50.0 + k})
        sim.step()
    kept = sim.state.population.bodies._laid_out
    assert 0 < len(kept) <= KEPT_INDEXES


def test_radii_that_change_at_each_step_keep_no_index_each():
    sim = Simulation(
        Mission(
            blocks=[Block(name="looker", team=1, count=5, autonomy=[Looker()], motion=Still())],
            end=100.0,
            dt=0.1,
        )
    )
    sim.step(3 * KEPT_INDEXES)
    bodies = sim.state.population.bodies
    assert 0 < len(bodies._laid_out) <= KEPT_INDEXES
