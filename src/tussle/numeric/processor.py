"""The processor that kernels are compiled for: a level that many processors have, so that kernels of a wheel run on all of them.

The levels are those of the x86-64 psABI and the first processors of a kind. The bits of results do not depend on them.
"""

from __future__ import annotations

import platform
import re
from functools import cache

LEVELS = {
    "x86-64-v4": {
        "avx512f",
        "avx512bw",
        "avx512cd",
        "avx512dq",
        "avx512vl",
        "avx2",
        "bmi",
        "bmi2",
        "fma",
        "lzcnt",
        "movbe",
    },
    "x86-64-v3": {"avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "xsave"},
    "x86-64-v2": {"cx16", "popcnt", "sahf", "sse4.2", "ssse3"},
}
"""Levels of x86-64 processors, the highest first, with the features they need, as LLVM calls them."""
WIDE = {"x86-64-v4": "-prefer-256-bit"}
"""What else LLVM is told of a level: loops too take whole registers of v4, each eight lanes, and not half of them."""


def levels() -> list[str]:
    """The levels that this processor has, as LLVM calls them, the highest first; none for processors without one."""
    if platform.machine() in {"arm64", "aarch64"}:
        return ["apple-m1" if platform.system() == "Darwin" else "generic"]
    from llvmlite import binding

    try:
        features = {name for name, is_there in binding.get_host_cpu_features().items() if is_there}
    except RuntimeError:  # LLVM cannot tell
        return []
    return [name for name, needed in LEVELS.items() if needed <= features]


def level() -> str:
    """The highest level that this processor has; empty for processors without one."""
    return next(iter(levels()), "")


@cache
def choose(name: str = "") -> None:
    """Let Numba compile for a level, by default this processor's, unless it has compiled already or the user has chosen a processor."""
    from numba.core import config
    from numba.core.registry import cpu_target

    settings = vars(config)
    is_begun = "_toplevel_target_context" in vars(cpu_target)
    is_chosen = settings["CPU_NAME"] is not None or settings["CPU_FEATURES"] is not None
    if not (is_begun or is_chosen or not settings["ENABLE_AVX"]) and (name := name or level()):
        settings["CPU_NAME"], settings["CPU_FEATURES"] = name, WIDE.get(name, "")


def target() -> tuple[str, ...]:
    """System, processor and features that Numba compiles for. Versions of the system's kernel are left out."""
    from numba.core.registry import cpu_target

    choose()
    system, *rest = cpu_target.target_context.codegen().magic_tuple()
    return re.sub(r"(darwin|macosx)[\d.]+$", r"\1", system), *rest
