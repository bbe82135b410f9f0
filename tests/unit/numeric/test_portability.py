"""The same bits under every instruction set that this machine can play, and no call into the machine's mathematical library."""

from __future__ import annotations

import gc
import importlib
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

import tussle
from tussle.numeric import processor, store
from tussle.numeric.kernel import Kernel, kernel
from tussle.numeric.neighbors.walk import make_walk
from tussle.numeric.rk4 import driver
from tussle.stock import Boids

PROGRAM = Path(__file__).with_name("portable_values.py")
PACKAGE = Path(tussle.__file__).parent
DISABLED = " ".join(name for name in __cpu_dispatch__ if __cpu_features__.get(name))
SETTINGS = {
    "x86-64-v2": {
        "NUMBA_CPU_NAME": "x86-64-v2",
        "NUMBA_CPU_FEATURES": "",
        "NPY_DISABLE_CPU_FEATURES": DISABLED,
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA",
    },
    "x86-64-v3": {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": ""},
    "unoptimised": {"NUMBA_OPT": "0"},
}
"""Besides what this process plays, which is the highest level that this machine has."""
if processor.level() == "x86-64-v3":
    del SETTINGS["x86-64-v3"]
HASH = "6253fd21ad5e16a14a2ea4ee17c8ac88"
"""What PROGRAM prints; another one is a change of numbers, which the changelog tells."""


def test_this_process_gives_these_bits(capsys):
    runpy.run_path(str(PROGRAM), run_name="__main__")
    assert capsys.readouterr().out.strip() == HASH


@pytest.mark.slow
@pytest.mark.skipif(os.uname().machine != "x86_64", reason="the settings name x86-64 processors")
@pytest.mark.parametrize("name", SETTINGS)
def test_all_instruction_sets_give_the_same_bits(name):
    settings = SETTINGS[name]
    env = dict(
        os.environ,
        PYTHONPATH=str(PACKAGE.parent),
        TUSSLE_CACHE_DIR=str(store.directory() / name),
        **settings,
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", PROGRAM], env=env, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == HASH


# Assembly --------------------------------------------------------------------------------------------------

LIBM = (
    "sin|cos|tan|sincos|asin|acos|atan|atan2|sinh|cosh|tanh|asinh|acosh|atanh|exp|exp2|exp10|expm1|"
    "log|log2|log10|log1p|pow|hypot|cbrt|erf|erfc|tgamma|lgamma|fma|powi|__powidf2|ldexp"
)
CALL = re.compile(
    rf"(?<![\w.])(_?(?:__svml_|_ZGV\w+_|numba_|npy_)?(?:{LIBM})f?\d?)(?:@PLT|@GOTPCREL)?(?![\w.])"
)

FUSED = re.compile(r"\bv?fn?m(?:add|sub)\w*", re.IGNORECASE)


def suspicious(assembly: str) -> set[str]:
    """Calls of the mathematical library and fused multiply-adds in assembly text."""
    found = set()
    for line in assembly.splitlines():
        if line.startswith("\t") and not line.startswith(("\t.asci", "\t.section", "\t.file")):
            found.update(match.group(0) for match in (CALL.search(line), FUSED.search(line)) if match)
    return found


def kernel_modules() -> list[str]:
    """Modules of the package whose text declares kernels."""
    paths = [path for path in sorted(PACKAGE.rglob("*.py")) if "@kernel(" in path.read_text()]
    parts = [
        path.relative_to(PACKAGE).with_suffix("").parts
        for path in paths
        if path.name not in ("kernel.py", "rk4.py")
    ]
    return [".".join(("tussle", *names)).removesuffix(".__init__") for names in parts]


def kernels_of(module: str) -> list[Kernel]:
    """All kernels that exist after the module is imported and that are its own; generated ones too."""
    loaded = importlib.import_module(module)
    gc.unfreeze()  # conftest.py takes what collection makes from the collector, which then does not list it
    # By type(): isinstance would ask weak proxies whose object is gone.
    alive = [value for value in gc.get_objects() if issubclass(type(value), Kernel)]
    own = [each for each in alive if each.py_func.__globals__ is vars(loaded)]
    assert own
    return own


@pytest.mark.slow
@pytest.mark.parametrize("module", kernel_modules())
def test_no_kernel_of_the_package_calls_the_mathematical_library(module):
    # Nor assigns an array to a slice: Numba's text for sizes that differ has log10 in it, and takes 4 s to compile.
    for each in kernels_of(module):
        assert not suspicious(each.assembly()), each.name


def test_the_walk_of_a_neighbour_law_neither_fuses_nor_calls_the_library():
    for law in (Boids.seen, Boids.historic_in_view):
        walk = make_walk(law.laws, law.where, lambda name: "I" if name == "team" else "F")
        assert not suspicious(walk.run.assembly())


def test_nor_does_the_integrator():
    assert not suspicious(driver().assembly())


@pytest.mark.parametrize(
    "expression",
    ["math.sin(x)", "math.exp(x)", "x**1.7", "math.atan2(x, 2.0)", "np.log(x)", "math.hypot(x, 1.0)"],
)
def test_the_reading_of_assembly_finds_such_calls(expression):
    import math

    scope = {"math": math, "np": np}
    exec(f"def f(x):\n    return {expression}\n", scope)
    assert suspicious(kernel("f8 -> f8")(scope["f"]).assembly())
