"""All modules, a game and a batch where the parts of Python and of the operating system that Windows or macOS lacks are hidden."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import tussle

HIDE = """
import os, signal, sys
sys.modules |= {"fcntl": None, "resource": None}
for module, names in {
    os: "sched_getaffinity geteuid getuid O_NOFOLLOW O_NONBLOCK O_CLOEXEC",
    signal: "pthread_sigmask SIGKILL SIGHUP SIGUSR1",
}.items():
    for name in names.split():
        delattr(module, name)
"""

PLAY = """
import importlib, pkgutil, warnings

import tussle
from tussle import Block, Mission, Simulation
from tussle.batch import Batch, Processes
from tussle.stock import Still

mission = Mission(blocks=[Block(name="a", count=3, variance=(9.0, 9.0, 0.0), motion=Still())], dt=0.1, end=0.3)

if __name__ == "__main__":
    sim = Simulation(mission, seeds=[1, 2])
    alone = [result.state_hash for result in sim.run()]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        results = Batch(mission, runs=2).play("out", Processes(1))
    assert results.runs["state_hash"].to_pylist() == alone, (results.runs, alone)
    assert any("has no locks" in str(each.message) for each in caught), caught
    assert Processes().n >= 1
    for module in pkgutil.walk_packages(tussle.__path__, "tussle."):
        if ".templates." in module.name or module.name.endswith("__main__"):
            continue
        try:
            importlib.import_module(module.name)
        except tussle.errors.MissingExtraError as error:
            with_torch = "tussle.rl.actor_critic", "tussle.rl.rollout", "tussle.rl.train"
            assert module.name in with_torch, error  # PyTorch is not in the test extra
"""


@pytest.mark.slow
def test_a_game_and_a_batch_play_without_what_other_systems_lack(tmp_path):
    (tmp_path / "sitecustomize.py").write_text(HIDE)  # spawned processes read it too
    (tmp_path / "play.py").write_text(PLAY)
    source = Path(tussle.__file__).parents[1]
    cache = tmp_path / "cache"
    env = os.environ | {"PYTHONPATH": f"{tmp_path}:{source}", "TUSSLE_CACHE_DIR": str(cache)}
    subprocess.run([sys.executable, "play.py"], cwd=tmp_path, env=env, check=True)
    assert list(cache.glob("*.kernel"))
    assert not list(cache.glob(".*.lock"))
