"""The comparison of games with those of SCRIMMAGE: benchmarks/validity.py plays by the right laws and finds what differs."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np
import pytest

from tussle import Simulation
from tussle.plugins import historic

BENCHMARKS = Path(__file__).parents[3] / "benchmarks"


@pytest.fixture
def validity(monkeypatch):
    monkeypatch.syspath_prepend(BENCHMARKS)
    return importlib.import_module("validity")


def test_the_game_of_2025_has_its_laws_and_plays(validity):
    game = validity.mission("synchronous", "scrimmage")
    small = game.replace(blocks=[b.replace(count=2) for b in game.blocks], end=1.0)
    result = Simulation(small, seeds=1).run()[0]
    assert result.alive == {1: 2, 2: 2, 3: 2}
    assert type(game.interactions[0]) is historic.SimpleCapture
    for block, autonomy in zip(game.blocks, ("Boids", "Predator", "Predator"), strict=True):
        assert type(block.motion) is historic.Unicycle
        assert block.motion.use_pitch
        assert type(block.autonomy[0]) is historic.load(autonomy)


def test_samples_of_one_distribution_agree_and_others_do_not(validity):
    draw = np.random.default_rng(1)
    ours, theirs = (
        np.stack([np.arange(n), draw.poisson(12, n), draw.poisson(8, n), 100 - draw.poisson(13, n), draw.normal(400, 50, n)]).T
        for n in (200, 1000)
    )  # fmt: skip
    alike = validity.compare(ours, theirs)
    assert {row["measure"] for row in alike} >= {
        "KS distance: end time [s]",
        "mean: prey lost",
        "share: ties",
    }
    assert all(row["difference"] <= row["limit"] for row in alike)
    other = ours + np.array([0, 2, 0, 0, 30])
    found = {row["measure"] for row in validity.compare(other, theirs) if row["difference"] > row["limit"]}
    assert {"mean: score of team 2", "KS distance: score of team 2", "KS distance: end time [s]"} <= found
    assert "KS distance: score of team 3" not in found
