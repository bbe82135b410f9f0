"""The cost of resetting one world of a stack, in steps of the whole stack.

    python benchmarks/resets.py [--sizes 64] [--repeats 3] [--json FILE]

The predator/prey game with captures; sizes are worlds in the stack. `reset` is the CPU time of a reset and the following step, minus
that of a step without a reset, in steps; the median over the rounds.
"""

from __future__ import annotations

import itertools
import statistics
import time
from typing import Any

import game
import measuring

from tussle import Simulation

SIZES = (8, 64)
ROUNDS = 100


def row(n_worlds: int) -> dict[str, Any]:
    """Measure steps with and without a preceding reset, in turn."""
    sim = Simulation(game.mission(end=10_000.0), range(1, n_worlds + 1))
    sim.step(100)
    seeds, costs, steps = itertools.count(10_000), [], []
    for k in range(ROUNDS):
        begin = time.process_time()
        sim.step()
        middle = time.process_time()
        sim.reset([k % n_worlds], [next(seeds)])
        sim.step()
        end = time.process_time()
        sim.step()
        bare = 0.5 * (middle - begin + time.process_time() - end)
        steps.append(bare)
        costs.append((end - middle) / bare - 1.0)
    return {
        "worlds": n_worlds,
        "rows": sim.state.population.bodies.n,
        "step_ms": 1e3 * statistics.median(steps),
        "reset": statistics.median(costs),
    }


def main() -> None:
    """Measure all sizes."""
    args = measuring.arguments(__doc__.splitlines()[0], SIZES)
    rows = [measuring.median_of(args.repeats, lambda n=n: row(n), "reset") for n in args.sizes]
    measuring.report("Resets of one world", rows, args.json)


if __name__ == "__main__":
    main()
