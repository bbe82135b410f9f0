"""Steps of a motion model per CPU second that planners try: the batched search, and OMPL's RRT with the model as its propagator.

    python benchmarks/planning.py [--repeats 3] [--json FILE]

A unicycle between two walls with a gap, as in docs/planning.md; both plan the same problem, in turn. `first` is the CPU time until the
first plan [s].
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import time
from pathlib import Path
from typing import Any

from tussle.plan import Plan, Problem, solve, solve_with_ompl
from tussle.scene import Cuboid, Scene
from tussle.stock import Unicycle

WALLS = [
    Cuboid(center=(50, 40, 0), lengths=(10, 80, 20)),
    Cuboid(center=(50, 97, 0), lengths=(10, 6, 20)),
]
PROBLEM = Problem(
    motion=Unicycle(vel_max=5.0, turn_rate_max=1.0, use_pitch=False),
    start={"x": 10.0, "y": 10.0},
    goal=(90.0, 10.0, 0.0),
    goal_radius=3.0,
    bounds={"x": (0, 100), "y": (0, 100), "yaw": (-math.tau, math.tau)},
    commands={"speed": (2.0, 5.0), "turn_rate": (-1.0, 1.0)},
    scene=Scene(walls=WALLS),
    radius=1.0,
    dt=0.2,
)


def timed(plan: Any) -> tuple[Plan, float]:
    """A plan, and the CPU seconds that it took."""
    begin = time.process_time()
    return plan(), time.process_time() - begin


def main() -> None:
    """Measure both in turn."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    solve(PROBLEM, branches=2000)
    speeds: dict[str, list[float]] = {"tussle": [], "OMPL RRT": []}
    firsts: dict[str, list[float]] = {"tussle": [], "OMPL RRT": []}
    for seed in range(1, options.repeats + 1):
        plan, cpu = timed(lambda seed=seed: solve(PROBLEM, seed=seed))
        speeds["tussle"].append(plan.n_propagated / cpu)
        firsts["tussle"].append(timed(lambda seed=seed: solve(PROBLEM, seed=seed, stop_at_first=True))[1])
        plan, cpu = timed(lambda seed=seed: solve_with_ompl(PROBLEM, seed=seed, seconds=20.0))
        speeds["OMPL RRT"].append(plan.n_propagated / cpu)
        firsts["OMPL RRT"].append(cpu if plan.is_solved else math.inf)
    rows = {
        name: {"steps/s": statistics.median(speeds[name]), "first": statistics.median(firsts[name])}
        for name in speeds
    }
    print("          steps per s   first plan [s]")
    for name, row in rows.items():
        print(f"{name:9} {row['steps/s']:11,.0f} {row['first']:16.2f}")
    ratio = rows["tussle"]["steps/s"] / rows["OMPL RRT"]["steps/s"]
    print(f"ratio of the speeds: {ratio:.0f}")
    if options.json:
        options.json.write_text(json.dumps({**rows, "ratio": ratio}, indent=1))


if __name__ == "__main__":
    main()
