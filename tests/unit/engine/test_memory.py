"""A process that plays game after game takes no more memory than one that has played a few."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

N_GAMES = int(os.environ.get("TUSSLE_MEMORY_GAMES", "120"))
"""Games per model; the promise is about two thousand, which takes minutes."""
MOST_GROWTH = (
    1.0 + 0.002 * N_GAMES
)  # [MB]; allocators settle for some thousand games. What was kept took 20 kB a game and more
MODELS = [
    "HarmonicOscillator", "SimpleAircraft", "SingleIntegrator", "Still", "External", "Unicycle", "Unicycle3D", "an author's own",
    "classes made on the fly",
]  # fmt: skip


@pytest.fixture(scope="module")
def grown():
    """Model -> growth of a fresh process over the games of that model, after a few for warmth [MB]."""
    script = Path(__file__).with_name("many_games.py")
    run = subprocess.run(
        [sys.executable, str(script), str(N_GAMES), *MODELS],
        check=False,
        capture_output=True,
        text=True,
        timeout=3000,
    )
    assert run.returncode == 0, run.stderr
    return dict(line.rsplit(" ", 1) for line in run.stdout.splitlines())


@pytest.mark.parametrize("model", MODELS)
def test_games_leave_no_memory_behind(grown, model):
    assert float(grown[model]) < MOST_GROWTH


def test_all_motion_models_that_ship_are_measured():
    from tussle.stock import manifest

    shipped = {name for name, path in manifest().items() if ".motion." in path}
    assert shipped == set(MODELS) - {"an author's own", "classes made on the fly"}
