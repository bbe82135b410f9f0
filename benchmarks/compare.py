"""CPU time of a step in two checkouts, measured in short alternating intervals so that machine load affects both equally.

    python benchmarks/compare.py OLD NEW [--rows SingleIntegrator:200 game:64] [--rounds 40] [--json FILE]

OLD and NEW are folders of checkouts; a row is a model of table1.py with a number of entities, `game` with a number of worlds, or
`sequential`, the same with update="sequential". `ratio` is the median of new / old over the rounds; `least_old` and
`least_new` are the smallest times of a step [us]. OLD against itself shows the noise.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
from pathlib import Path
from typing import Any

import measuring

ROWS = ("SingleIntegrator:200", "SingleIntegrator:2000", "Unicycle:200", "Unicycle:2000", "game:1", "game:64")
PIECE = 0.04
"""Approximate CPU time of an interval [s]."""
PLAYER = """
import sys, time
sys.path[:0] = [sys.argv[1] + "/src", sys.argv[1] + "/benchmarks"]
import game, table1, tussle
assert tussle.__file__.startswith(sys.argv[1]), tussle.__file__
kind, size = sys.argv[2].split(":")
if kind in ("game", "sequential"):
    mission = game.mission(update="sequential" if kind == "sequential" else "synchronous")
    seeds = range(1, int(size) + 1)
else:
    mission, seeds = table1.mission(kind, int(size)), [1]
sim = tussle.Simulation(mission.replace(end=1e7), seeds)
sim.step(20)
for line in sys.stdin:
    if sim.is_over or int(sim.steps.max()) > 4000:
        sim.reset(range(len(seeds)))
        sim.step(20)
    begin = time.process_time()
    sim.step(int(line))
    print((time.process_time() - begin) / int(line), flush=True)
"""


def measure(folders: list[Path], row: str, rounds: int) -> dict[str, Any]:
    """Measure both checkouts in turn."""
    command = [[sys.executable, "-c", PLAYER, str(folder.resolve()), row] for folder in folders]
    both = [subprocess.Popen(c, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) for c in command]

    def piece(player: Any, steps: int) -> float:
        player.stdin.write(f"{steps}\n")
        player.stdin.flush()
        return float(player.stdout.readline())

    n = max(1, int(PIECE / max(piece(player, 10) for player in both)))
    times: list[list[float]] = [[], []]
    for k in range(rounds):
        for i in (0, 1) if k % 2 else (1, 0):
            times[i].append(piece(both[i], n))
    for player in both:
        player.stdin.close()  # type: ignore[union-attr]
        player.wait()
    ratio = statistics.median(new / old for old, new in zip(*times, strict=True))
    least = [1e6 * min(each) for each in times]
    return {"row": row, "ratio": ratio, "least_old": least[0], "least_new": least[1]}


def main() -> None:
    """Compare all rows."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "folders", type=Path, nargs=2, metavar="FOLDER", help="a checkout: first the old, then the new"
    )
    parser.add_argument("--rows", nargs="+", default=list(ROWS))
    parser.add_argument("--rounds", type=int, default=40)
    parser.add_argument("--json", type=Path, help="write the rows to this file")
    args = parser.parse_args()
    rows = [measure(args.folders, row, args.rounds) for row in args.rows]
    measuring.report("CPU time of a step, new / old", rows, args.json)


if __name__ == "__main__":
    main()
