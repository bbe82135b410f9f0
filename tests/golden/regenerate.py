"""Writes golden.json anew: `python tests/golden/regenerate.py`. With `--check` it writes nothing and fails where a hash differs.

Only where a plugin's numbers are meant to have changed. Says which missions differ from what was kept; name these in the changelog.
With `--old-processor` all is played with what the oldest x86-64 processors can do. `--check --some` plays all missions and a fourth of
the examples, which takes a third of the time.
"""

import json
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from golden_runs import FILE, examples, golden, kept_examples, play_all, play_examples

ABOUT = (
    "hashes: state hash of each world by mission and seed, after half of the mission's steps and after all; examples: after their "
    "first steps, by folder of the plugin. Written by regenerate.py."
)


OLD_PROCESSOR = {
    "NUMBA_CPU_NAME": "x86-64-v2",
    "NUMBA_CPU_FEATURES": "",
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX,-AVX2,-FMA,-FMA4,-AVX512F,-AVX512CD,-AVX512BW,-AVX512DQ,-AVX512VL",
}


def use_old_processor() -> None:
    """Start this program again with the oldest processors' instructions in kernels, in NumPy and in the C library."""
    from numba.core.registry import cpu_target
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

    newer = [name for name in __cpu_dispatch__ if __cpu_features__.get(name)]
    if "NPY_DISABLE_CPU_FEATURES" not in os.environ:
        features = {"NPY_DISABLE_CPU_FEATURES": " ".join(newer)}
        os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | OLD_PROCESSOR | features)
    target = cpu_target.target_context.codegen().magic_tuple()
    assert not newer, newer
    assert "x86-64-v2" in target, target


def main() -> None:
    """Play all missions and say what differs."""
    if "--old-processor" in sys.argv[1:]:
        use_old_processor()
    before = golden() | kept_examples() if FILE.exists() else {}
    is_check = "--check" in sys.argv[1:]
    hashes, shown = play_all(), play_examples(4 if is_check and "--some" in sys.argv[1:] else 1)
    changed = [name for name, now in (hashes | shown).items() if now != before.get(name)]
    print("changed:", ", ".join(changed) if changed else "nothing")
    if is_check:
        sys.exit(bool(changed))
    if left_out := {*kept_examples()} - {*examples()}:
        print("not played, since a package is missing:", ", ".join(sorted(left_out)))
    kept = {"about": ABOUT, "hashes": hashes, "examples": dict(sorted((kept_examples() | shown).items()))}
    FILE.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
