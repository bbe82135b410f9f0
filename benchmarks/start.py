"""Time to import tussle and to the first step: with cached kernels, without, and after an edit of one kernel.

    python benchmarks/start.py [--repeats 3] [--json FILE]

Each figure is the wall time of a fresh process. The kernel is edited in a copy of the package.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import measuring

import tussle

FIRST_STEP = "import sys; sys.path.insert(0, {here!r}); import game; game.Simulation(game.mission()).step()"
EDITED = "plugins/stock/autonomy/boids/kernels.py"
BEFORE, AFTER = "2.0 * (w * z + x * y)", "(w * z + x * y) * 2.0"


def run(code: str, package: Path, cache: Path) -> float:
    """Wall seconds of a fresh Python process that runs code with the copy of the package."""
    environment = {**os.environ, "PYTHONPATH": str(package), "TUSSLE_CACHE_DIR": str(cache)}
    begin = time.perf_counter()
    subprocess.run([sys.executable, "-c", code], check=True, env=environment)
    return time.perf_counter() - begin


def edit(path: Path) -> None:
    """Change the code of a kernel without changing its results."""
    text = path.read_text(encoding="utf-8")
    assert text.count(BEFORE) >= 1
    path.write_text(text.replace(BEFORE, AFTER, 1), encoding="utf-8")


def measure() -> dict[str, Any]:
    here = str(Path(__file__).parent)
    first_step = FIRST_STEP.format(here=here)
    with tempfile.TemporaryDirectory() as folder:
        package, cache = Path(folder) / "src", Path(folder) / "cache"
        shutil.copytree(Path(tussle.__file__).parent, package / "tussle")
        bare = run("pass", package, cache)
        run("import tussle", package, cache)
        row = {"model": "start", "n": 110, "import_s": run("import tussle", package, cache) - bare}
        row["first_step_cold_s"] = run(first_step, package, cache)
        row["first_step_warm_s"] = run(first_step, package, cache)
        edit(package / "tussle" / EDITED)
        row["first_step_edited_s"] = run(first_step, package, cache)
    return row


def main() -> None:
    args = measuring.arguments(__doc__.splitlines()[0], (110,))
    row = measuring.median_of(args.repeats, measure, "first_step_warm_s")
    measuring.report("Seconds of wall time, fresh processes", [row], args.json)


if __name__ == "__main__":
    main()
