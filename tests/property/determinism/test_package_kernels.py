"""An edit of the package itself: the new code runs, and only what depends on it compiles anew."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import tussle
from tussle.numeric import store

PACKAGE = Path(tussle.__file__).parent

GAME = """
import gc, json
from tussle.numeric import store

made, save = [], store.save
store.save = lambda name, key, data: (made.append(name), save(name, key, data))[1]

from tussle import Block, Mission, Simulation
from tussle.numeric.kernel import Kernel, stats
from tussle.stock import Boids, NoisyState, Unicycle

motion = Unicycle(vel_max=20.0, turn_rate_max=0.5, pitch_rate_max=0.5)
flock = Block(name="flock", count=40, variance=(400.0, 400.0, 100.0), autonomy=Boids(), motion=motion, sensor=NoisyState())
sim = Simulation(Mission(blocks=[flock]), seeds=1)
"""
PLAY = f"""{GAME}
sim.step(4)
assert stats.compiled == len(made), (stats, made)
print(json.dumps({{"hash": sim.state_hash(), "made": sorted(made), "loaded": stats.loaded}}))
"""
KEYS = f"""{GAME}
print(json.dumps([[each.name, each.key()] for each in gc.get_objects() if issubclass(type(each), Kernel)]))
"""
"""The keys under which kernels are stored: another key means that the kernel compiles anew."""


@pytest.fixture(scope="module")
def plain_cache(tmp_path_factory):
    """A copy of the user's kernels, in which those of the program are: other tests need most of them too."""
    run(PACKAGE.parent, store.directory())
    folder = tmp_path_factory.mktemp("kernels")
    for path in store.directory().glob("tussle.*.kernel"):
        with contextlib.suppress(FileNotFoundError):  # another process has just removed an old one
            shutil.copy2(path, folder)
    return folder


@pytest.fixture(scope="module")
def plain(plain_cache):
    found = run(PACKAGE.parent, plain_cache)
    assert found["made"] == []
    return found


@pytest.fixture
def edited(tmp_path, plain_cache, plain):
    """Runs a program on a copy of the package in which a text is replaced, with a copy of the filled cache."""

    def play(module: str, old: str, new: str, program: str = PLAY):
        source, cache = tmp_path / "src", tmp_path / "cache"
        shutil.copytree(PACKAGE, source / "tussle")
        shutil.copytree(plain_cache, cache, copy_function=os.link)
        path = source / "tussle" / module
        text = path.read_text(encoding="utf-8")
        assert text.count(old) == 1, f"{module} has {old!r} {text.count(old)} times"
        path.write_text(text.replace(old, new), encoding="utf-8")
        return run(source, cache, program)

    return play


@pytest.fixture(scope="module")
def plain_keys(plain_cache):
    return {tuple(each) for each in run(PACKAGE.parent, plain_cache, KEYS)}


@pytest.fixture
def new_keys(edited, plain_keys):
    """Names of all kernels that the game may call, with whether an edit gives them another key."""

    def compare(*edit: str) -> dict[bool, set[str]]:
        after = {tuple(each) for each in edited(*edit, KEYS)}
        return {
            True: {name for name, _ in after - plain_keys},
            False: {name for name, _ in after & plain_keys},
        }

    return compare


def run(source, cache, program=PLAY):
    env = dict(os.environ, PYTHONPATH=str(source), TUSSLE_CACHE_DIR=str(cache), PYTHONDONTWRITEBYTECODE="1")
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program], env=env, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
def test_moved_copy_and_comments_compile_nothing(edited, plain):
    after = edited(
        "numeric/elementary.py",
        "@device\ndef sine_near_zero",
        "# A comment.\n\n\n@device\ndef sine_near_zero",
    )
    assert after == plain


@pytest.mark.slow
def test_constant_of_the_sine_reaches_all_that_turns_or_draws(new_keys):
    is_new = new_keys("numeric/elementary.py", "8.33333333332248946124e-03", "8.33333333e-03")
    assert {
        "tussle.plugins.stock.motion.unicycle.kernels.pitched",
        "tussle.numeric.rng.fill_normal",
    } <= is_new[True]
    assert not [name for name in is_new[True] if name.startswith("tussle.numeric.neighbors")]
    assert is_new[False]


@pytest.mark.slow
def test_code_generator_of_the_lanes_reaches_the_laws_that_use_lanes(edited, plain):
    after = edited("numeric/neighbors/lanes_codegen.py", '(operator.sub, "fsub")', '(operator.sub, "fadd")')
    assert after["hash"] != plain["hash"]
    assert any(".Boids.mates+" in name for name in after["made"])
    assert not [
        name
        for name in after["made"]
        if name.startswith(("tussle.plugins.stock.motion", "tussle.numeric.rng", "tussle.numeric"))
    ]
    assert after["loaded"] > len(after["made"])


@pytest.mark.slow
def test_callee_of_one_motion_model_reaches_no_other_module(edited, plain):
    head = 'def clamp(value, limit):\n    """Value clamped to [-limit, limit]."""\n'
    after = edited("plugins/stock/motion/unicycle/kernels.py", head, f"{head}    value = 0.5 * value\n")
    assert after["hash"] != plain["hash"]
    assert after["made"]
    assert {name.rsplit(".", 1)[0] for name in after["made"]} == {
        "tussle.plugins.stock.motion.unicycle.kernels"
    }


@pytest.mark.slow
def test_round_of_the_random_numbers_reaches_the_draws_only(new_keys):
    is_new = new_keys("numeric/rng.py", "mix(a, b, np.uint64(42))", "mix(a, b, np.uint64(43))")
    drawing = {name for name in is_new[True] if not name.startswith("tussle.numeric.rng.")}
    assert drawing == {"tussle.engine.kernels.place_newborn", "tussle.engine.kernels.scatter"}
    assert is_new[False]
