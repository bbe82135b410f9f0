"""The golden hashes under every instruction set that this machine can play, in fresh processes.

Kernels for other processors are compiled once and then kept in the user's cache.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from golden_runs import golden
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

import tussle
from tussle.numeric import store

PROGRAM = Path(__file__).with_name("print_hashes.py")
SOURCE = Path(tussle.__file__).parents[1]
DISABLED = " ".join(name for name in __cpu_dispatch__ if __cpu_features__.get(name))
GLIBC = "-AVX,-AVX2,-FMA,-FMA4,-AVX512F,-AVX512CD,-AVX512BW,-AVX512DQ,-AVX512VL"
SETTINGS = {
    "default": {},
    "numpy": {"NPY_DISABLE_CPU_FEATURES": DISABLED},
    "glibc": {"GLIBC_TUNABLES": f"glibc.cpu.hwcaps={GLIBC}"},
    "x86-64-v2": {"NUMBA_CPU_NAME": "x86-64-v2", "NUMBA_CPU_FEATURES": ""},
    "x86-64-v3": {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": ""},
}


def played_under(settings, folder):
    """What print_hashes.py says in a process with these settings."""
    env = dict(os.environ, PYTHONPATH=str(SOURCE), TUSSLE_CACHE_DIR=str(folder), **settings)
    command = [sys.executable, "-W", "error", str(PROGRAM)]
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
@pytest.mark.skipif(os.uname().machine != "x86_64", reason="the settings name x86-64 processors")
@pytest.mark.parametrize("name", SETTINGS)
def test_every_instruction_set_gives_the_golden_hashes(name):
    own = store.directory() if "NUMBA_CPU_NAME" not in SETTINGS[name] else store.directory() / name
    played = played_under(SETTINGS[name], own)
    assert played["compiled"] + played["loaded"] > 40
    differing = [mission for mission, hashes in golden().items() if played["hashes"][mission] != hashes]
    assert not differing


@pytest.mark.slow
@pytest.mark.skipif(os.uname().machine != "x86_64", reason="the settings name x86-64 processors")
def test_settings_have_an_effect():
    """Otherwise the test above would compare a process with itself."""
    lines = (
        "from numpy._core._multiarray_umath import __cpu_features__ as f\n"
        "from numba.core.registry import cpu_target\n"
        "print(sum(f.values()), cpu_target.target_context.codegen().magic_tuple()[1:])"
    )

    def said(settings):
        env = dict(os.environ, **settings)
        return subprocess.run(
            [sys.executable, "-c", lines], env=env, capture_output=True, text=True, check=True
        ).stdout

    plain = said({})
    if DISABLED:
        assert said(SETTINGS["numpy"]) != plain
    assert said(SETTINGS["x86-64-v2"]) != said(SETTINGS["x86-64-v3"])
    assert said(SETTINGS["x86-64-v2"]) != plain
