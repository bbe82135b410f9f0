"""The experiment of the paper: wins in 1,000 games, compared with the code of the paper.

    python benchmarks/validity.py [--update sequential|synchronous|random|random_in_blocks] [--law historic|corrected]
                                  [--seeds 1000] [--processes 2]
                                  [--csv FILE] [--reference FILE] [--json FILE]
    python benchmarks/validity.py --compat [--seeds 200] [--reference FILE]

`--law historic` uses Boids with the means of the paper's code and credits each valid claim; `corrected` uses the default Boids
with the scoring of the paper. A reference is a table of (seed, score of team 2, score of team 3, prey left, end time ...), one run per
line, from the original code; with it, every distance is printed next to its two-sample limit at the 1 % level.
`--compat` plays the game by the laws of SCRIMMAGE of 2025 (`Mission(compat="scrimmage")`), for comparison with its runs.
Published: of 1,000 games team 2 (follows one prey) wins 593, team 3 (switches) wins 361, and 46 are ties.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import time
from pathlib import Path
from typing import Any

import game
import numpy as np

from tussle import Mission, Simulation
from tussle.mission.spec import SHUFFLED, UPDATES
from tussle.stock import Boids, Predator, SimpleCapture, SimpleCollision

Z_99 = 2.5758
"""Two-sided 1 % point of the normal distribution."""
KS_99 = 1.6276
"""1 % point of the two-sample Kolmogorov-Smirnov distance, in units of sqrt((n + m) / (n m))."""
PUBLISHED = (593, 361, 46)
STACK = 125
GOAL_AHEAD = 1e4  # [m], in the paper's mission


def mission_2025() -> Mission:
    """The same by the laws of SCRIMMAGE of 2025, which places entities normally distributed, and apart."""
    base = game.mission(motion_multiplier=1)
    blocks = [b.replace(placement="normal", variance=b.half_width) for b in base.blocks]
    rules = [SimpleCapture(), SimpleCollision(startup_collisions_only=True)]
    return base.replace(blocks=blocks, interactions=rules, compat="scrimmage")


def mission(update: str, law: str) -> Mission:
    """The mission of section 6.5 of the paper, one motion step per decision."""
    if law == "scrimmage":
        return mission_2025()
    averaging = "historic" if law == "historic" else "team"
    base = game.mission(motion_multiplier=1)
    minds = [Boids(averaging=averaging, goal_distance=GOAL_AHEAD)]
    minds += [
        Predator(max_speed=35.0, allow_prey_switching=switches, between_steps=False)
        for switches in (False, True)
    ]
    blocks = [block.replace(autonomy=mind) for block, mind in zip(base.blocks, minds, strict=True)]
    rules = [SimpleCapture(credit="each", between_steps=False)]
    return base.replace(blocks=blocks, update=update, interactions=rules)


def play(job: tuple[str, str, list[int]]) -> list[tuple[int, int, int, int, float]]:
    """(seed, score of team 2, score of team 3, prey left, end time) of each seed."""
    update, law, seeds = job
    game = mission(update, law)
    size = 1 if update in SHUFFLED else len(seeds)  # these take one world at a time
    results = [
        r for i in range(0, len(seeds), size) for r in Simulation(game, seeds=seeds[i : i + size]).run()
    ]
    return [(r.seed, int(r.scores[2]), int(r.scores[3]), r.alive[1], r.t) for r in results]


def shares(scores: np.ndarray) -> np.ndarray:
    """Shares of team 2 winning, team 3 winning, ties."""
    won, lost = scores[:, 1] > scores[:, 2], scores[:, 1] < scores[:, 2]
    return np.array([won.mean(), lost.mean(), (~won & ~lost).mean()])


def ks_distance(a: np.ndarray, b: np.ndarray) -> float:
    """Largest distance between two empirical distribution functions."""
    grid = np.union1d(a, b)
    return float(
        np.abs(
            np.searchsorted(np.sort(a), grid, "right") / len(a)
            - np.searchsorted(np.sort(b), grid, "right") / len(b)
        ).max()
    )


def compare(ours: np.ndarray, theirs: np.ndarray) -> list[dict[str, Any]]:
    """Each measure of both samples, their difference, and its 99 % limit for samples of the same distribution."""
    n, m = len(ours), len(theirs)
    rows = []
    for name, a, b in zip(("team 2 wins", "team 3 wins", "ties"), shares(ours), shares(theirs), strict=True):
        pooled = (a * n + b * m) / (n + m)
        limit = Z_99 * math.sqrt(pooled * (1.0 - pooled) * (1.0 / n + 1.0 / m))
        rows.append(
            {"measure": f"share: {name}", "ours": a, "theirs": b, "difference": abs(a - b), "limit": limit}
        )
    columns = {"score of team 2": (ours[:, 1], theirs[:, 1]), "score of team 3": (ours[:, 2], theirs[:, 2])}
    columns["prey lost"] = (100 - ours[:, 3], 100 - theirs[:, 3])
    if theirs.shape[1] > 4:
        columns["end time [s]"] = (np.round(ours[:, 4]), np.round(theirs[:, 4]))
    for name, (x, y) in columns.items():
        limit = Z_99 * math.sqrt(x.var(ddof=1) / n + y.var(ddof=1) / m)
        rows.append(
            {
                "measure": f"mean: {name}",
                "ours": x.mean(),
                "theirs": y.mean(),
                "difference": abs(x.mean() - y.mean()),
                "limit": limit,
            }
        )
    for name, (x, y) in columns.items():
        limit = KS_99 * math.sqrt((n + m) / (n * m))
        rows.append(
            {
                "measure": f"KS distance: {name}",
                "ours": x.std(ddof=1),
                "theirs": y.std(ddof=1),
                "difference": ks_distance(x, y),
                "limit": limit,
            }
        )
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--update", choices=UPDATES, default="sequential")
    parser.add_argument("--law", choices=("historic", "corrected"), default="historic")
    parser.add_argument("--compat", action="store_true", help="play by the laws of SCRIMMAGE of 2025")
    parser.add_argument("--seeds", type=int, default=1000)
    parser.add_argument("--processes", type=int, default=multiprocessing.cpu_count())
    for option in ("--csv", "--reference", "--json"):
        parser.add_argument(option, type=Path)
    args = parser.parse_args()
    if args.compat:
        args.update, args.law = "synchronous", "scrimmage"
    seeds = list(range(1, args.seeds + 1))
    size = 5 if args.update in SHUFFLED else STACK
    jobs = [(args.update, args.law, seeds[i : i + size]) for i in range(0, len(seeds), size)]
    begin = time.perf_counter()
    with multiprocessing.get_context("spawn").Pool(args.processes) as pool:
        rows = [row for part in pool.imap(play, jobs) for row in part]
    wall = time.perf_counter() - begin
    ours = np.array(rows, float)
    won, lost, tied = (shares(ours) * len(ours)).round().astype(int)
    print(f"{args.update}, {args.law} law: {len(ours)} games in {wall:.0f} s on {args.processes} processes")
    print(
        f"team 2 wins {won}, team 3 wins {lost}, ties {tied}   (published: {PUBLISHED[0]} / {PUBLISHED[1]} / {PUBLISHED[2]} of 1000)"
    )
    for name, column in (
        ("score of team 2", ours[:, 1]),
        ("score of team 3", ours[:, 2]),
        ("prey lost", 100 - ours[:, 3]),
    ):
        print(
            f"{name:<16} mean {column.mean():6.2f}  sd {column.std(ddof=1):6.2f}  median {np.median(column):4.0f}"
        )
    if args.csv:
        np.savetxt(
            args.csv,
            ours,
            fmt=["%d", "%d", "%d", "%d", "%.1f"],
            delimiter=",",
            header="seed,score_2,score_3,prey_left,end_time",
            comments="",
        )
    report: list[dict[str, Any]] = []
    if args.reference:
        report = compare(ours, np.genfromtxt(args.reference, delimiter=",", skip_header=1)[:, :5])
        print(f"{'measure':<30} {'ours':>9} {'theirs':>9} {'distance':>9} {'1 % limit':>9}")
        for row in report:
            mark = "" if row["difference"] <= row["limit"] else "   DIFFERENT"
            print(
                f"{row['measure']:<30} {row['ours']:9.4f} {row['theirs']:9.4f} {row['difference']:9.4f} {row['limit']:9.4f}{mark}"
            )
    if args.json:
        args.json.write_text(
            json.dumps({"wall_s": wall, "wins": [int(won), int(lost), int(tied)], "rows": report}, indent=1)
            + "\n",
            encoding="utf-8",
        )


if __name__ == "__main__":
    main()
