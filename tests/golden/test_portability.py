"""The golden hashes with what the oldest x86-64 processors can do: in kernels, in NumPy and in the C library.

.ci/run plays the same with x86-64-v3, which has wider vectors and fused multiply-adds. Kernels for other processors are compiled once
and then kept in the user's cache.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from golden_runs import golden, kept_examples
from numba.core.registry import cpu_target
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

import tussle
from tussle.numeric import store

PROGRAM = Path(__file__).with_name("print_hashes.py")
GLIBC = "-AVX,-AVX2,-FMA,-FMA4,-AVX512F,-AVX512CD,-AVX512BW,-AVX512DQ,-AVX512VL"
OLD = {
    "NPY_DISABLE_CPU_FEATURES": " ".join(name for name in __cpu_dispatch__ if __cpu_features__.get(name)),
    "GLIBC_TUNABLES": f"glibc.cpu.hwcaps={GLIBC}",
    "NUMBA_CPU_NAME": "x86-64-v2",
    "NUMBA_CPU_FEATURES": "",
}


@pytest.mark.slow
@pytest.mark.skipif(os.uname().machine != "x86_64", reason="the settings name x86-64 processors")
def test_an_old_processor_gives_the_golden_hashes():
    folder = store.directory() / OLD["NUMBA_CPU_NAME"]
    env = (
        os.environ
        | {"PYTHONPATH": str(Path(tussle.__file__).parents[1]), "TUSSLE_CACHE_DIR": str(folder)}
        | OLD
    )
    command = [sys.executable, "-W", "error", str(PROGRAM)]
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    played = json.loads(done.stdout)
    n_features, *target = played["processor"]
    assert not OLD["NPY_DISABLE_CPU_FEATURES"] or n_features < sum(__cpu_features__.values())
    assert target != list(cpu_target.target_context.codegen().magic_tuple())
    assert [name for name, hashes in golden().items() if played["hashes"][name] != hashes] == []
    assert [name for name, one in played["examples"].items() if one != kept_examples()[name]] == []
