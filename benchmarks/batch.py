"""Batches of the 500 s predator/prey game: wall time, CPU time and memory by processes, stack size and number of runs.

    python benchmarks/batch.py [--runs 1000] [--parts game processes stacks flat one large] [--json FILE]

Each row runs `tussle batch` in a separate process, start-up included, with 12 motion substeps, as in the measurement of the original.
The original takes 2.5 CPU s per game, about 21 minutes of wall time for 1,000 games on two cores.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import measuring
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from tussle.record.parquet_blocks import ParquetBlocks

ORIGINAL = 2.5
PARTS = ("game", "processes", "stacks", "flat", "one", "large")
GAME = ["predator_prey", "run.motion_multiplier=12"]
SHORT = ["predator_prey", "prey=20", "predators=2", "--end", "10"]


def tussle(*arguments: str) -> dict[str, float]:
    """Wall time, CPU time of all processes, and peak memory of the largest process."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begun = time.perf_counter()
    # A separate process, so that its children are the processes of the batch only.
    script = (
        "import resource, subprocess, sys\n"
        "subprocess.run([sys.executable, '-m', 'tussle.cli', *sys.argv[1:]], check=True, "
        "stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)\n"
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, *arguments], check=True, capture_output=True, text=True
    )
    wall = time.perf_counter() - begun
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {"wall_s": wall, "cpu_s": cpu, "mb": int(done.stdout) / 1024}


def batch(mission: list[str], n: int, **options: int) -> dict[str, Any]:
    """Run one batch of n runs."""
    with tempfile.TemporaryDirectory() as folder:
        more = [item for name, value in options.items() for item in (f"--{name}", str(value))]
        row = tussle("batch", *mission, "--runs", str(n), "--out", f"{folder}/b", *more)
    return {"runs": n, **options, **row, "cpu_s_per_run": row["cpu_s"] / n}


def game(n: int) -> list[dict[str, Any]]:
    """All runs on all cores."""
    row = batch(GAME, n)
    return [row | {"ratio": ORIGINAL * n / row["cpu_s"]}]


def processes(n: int) -> list[dict[str, Any]]:
    rows = [batch(GAME, max(n // 5, 20), processes=k) for k in (1, 2)]
    return [row | {"speedup": rows[0]["wall_s"] / row["wall_s"]} for row in rows]


def stacks(n: int) -> list[dict[str, Any]]:
    rows = [
        batch(GAME, max(min(n // 4, 256), size // 4, 8), processes=1, stack=size)
        for size in (1, 4, 16, 64, 256)
    ]
    return [row | {"speedup": rows[0]["cpu_s_per_run"] / row["cpu_s_per_run"]} for row in rows]


def flat(n: int) -> list[dict[str, Any]]:
    """100, 1,000 and 10,000 short games, to measure the overhead of the batch."""
    return [batch(SHORT, 10 * n // factor) for factor in (100, 10, 1)]


def one(_: int) -> list[dict[str, Any]]:
    """A batch of one run against `tussle run`, both with default recording; medians of pairs run in turn."""
    pairs = []
    with tempfile.TemporaryDirectory() as folder:
        for k in range(7):
            plain = tussle("run", *GAME, "--out", f"{folder}/r{k}")
            pairs.append((plain, tussle("batch", *GAME, "--runs", "1", "--out", f"{folder}/b{k}")))
    rows = []
    for place, name in enumerate(("tussle run", "tussle batch --runs 1")):
        rows.append(
            {"command": name} | {key: statistics.median(p[place][key] for p in pairs) for key in pairs[0][0]}
        )
    ratio = statistics.median(b["cpu_s"] / a["cpu_s"] for a, b in pairs)
    return [rows[0], rows[1] | {"cpu_ratio": ratio}]


def large(_: int) -> list[dict[str, Any]]:
    """A million games to analyse: 2,000 in which something happens, whose rows are repeated with other numbers."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "b"
        tussle("batch", *SHORT[:-1], "100", "--runs", "2000", "--out", str(path))
        repeat(path, 500)
        report = "report", str(path), "--out", f"{folder}/report.html"
        return [{"command": name} | tussle(name, *more) for name, *more in (("analyze", str(path)), report)]


def repeat(path: Path, times: int) -> None:
    """Write the runs of a complete batch without variables so many times, with the numbers and seeds that follow."""
    info = json.loads((path / "batch.json").read_text(encoding="utf-8"))
    n = info["n_runs"]
    for name in ("design.parquet", "results.parquet", "alive.parquet"):
        table = pq.read_table(path / name)
        run = table["run"].to_numpy()
        with ParquetBlocks(path / name, table.schema) as file:
            for first in range(0, times * n, n):
                new = {"run": run + first, "seed": (run + first + info["first_seed"]).astype(np.uint64)}
                columns = [new.get(column, table[column]) for column in table.column_names]
                file.add(pa.table(columns, schema=table.schema))
    info |= {"n_runs": times * n, "n_seeds": times * n}
    info.pop("checksum")
    (path / "batch.json").write_text(json.dumps(info), encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--runs", type=int, default=1000, help="games of the first part; the others follow it"
    )
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS, help="which parts to measure")
    parser.add_argument("--json", type=Path, help="write the rows to this file")
    args = parser.parse_args()
    titles = {
        "game": "The game, on all cores",
        "processes": "One and two processes",
        "stacks": "Worlds side by side in one process",
        "flat": "More and more runs of a short game: cost of a run, memory",
        "one": "A batch of one",
        "large": "A million games, to analyse and to report",
    }
    found = []
    for part in args.parts:
        rows = {
            "game": game, "processes": processes, "stacks": stacks, "flat": flat, "one": one, "large": large
        }[part](args.runs)  # fmt: skip
        measuring.report(titles[part], rows, None)
        print()
        found += [{"part": part, **row} for row in rows]
    if args.json:
        args.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
