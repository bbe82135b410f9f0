"""The cost of watching a game: CPU time of its thread besides the steps, and of each part of the view.

    python benchmarks/watching.py [--sizes 20 200 2000 20000] [--repeats 3] [--json FILE]

Sizes are entities in two flocks, played as fast as possible by `tussle.view.Live`. `idle` is the time of snapshots, frame history and
bookkeeping relative to the time of the steps, without a viewer; `watched` is the same while frame, result, shapes and an entity are
requested 20 times per second. Both are measured in one run, so that other load on the machine affects neither. The other columns
are microseconds per step, frame, snapshot and restore.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import measuring

from tussle import Block, Mission, Simulation
from tussle.stock import Boids, Unicycle
from tussle.view import Live, frame_of

SIZES = (20, 200, 2000, 20000)
MIN_CPU = 2.0
"""CPU time of the steps in each measurement [s]."""
PERIOD = 0.05
"""Time between two requests [s]."""


def mission(n: int) -> Mission:
    """Two flocks at constant density."""
    half = 10.0 * n**0.5
    flock = {
        "count": n // 2, "placement": "uniform", "half_width": (half, half, 20.0), "position": (0, 0, 200),
        "autonomy": Boids(), "motion": Unicycle(vel_max=20.0, turn_rate_max=1.0, pitch_rate_max=1.0),
    }  # fmt: skip
    return Mission(blocks=[Block(name="one", team=1, **flock), Block(name="two", team=2, **flock)], end=1e6)


def share(n: int, is_watched: bool) -> float:
    """CPU time of the thread besides the steps, relative to that of the steps."""
    sim = Simulation(mission(n))
    sim.step(20)  # loads what the game needs
    inside, thread, step = [0.0], [0.0, 0.0], sim.step

    def timed(k: int = 1) -> None:
        begun = time.thread_time()
        step(k)
        now = time.thread_time()
        inside[0] += now - begun
        thread[1] = now
        thread[0] = thread[0] or begun

    sim.step = timed  # type: ignore[method-assign]
    with Live(sim, pace=None) as live:
        while inside[0] < MIN_CPU:
            time.sleep(PERIOD)
            if is_watched:
                live.frame(), live.result(), live.shapes(), live.entity(1), live.warp_reached
        steps = int(sim.steps[0]) - 20
    beside = (
        thread[1] - thread[0] - inside[0] - 1e-6 * steps * cost(time.thread_time, 1)
    )  # of the two readings one lies beside
    return beside / inside[0]


def cost(do: Callable[[], Any], n: int) -> float:
    """Smallest CPU time of several tries [us]."""
    k = max(2, 5000 // n)
    tries = []
    for _ in range(5):
        begun = time.thread_time()
        for _ in range(k):
            do()
        tries.append((time.thread_time() - begun) / k)
    return 1e6 * min(tries)


def measure(n: int) -> dict[str, Any]:
    sim = Simulation(mission(n))
    sim.step(20)
    saved = sim.snapshot()
    return {
        "n": n,
        "idle": share(n, is_watched=False),
        "watched": share(n, is_watched=True),
        "step_us": cost(sim.step, n),
        "frame_us": cost(lambda: frame_of(sim), n),
        "snapshot_us": cost(sim.snapshot, n),
        "restore_us": cost(lambda: sim.restore(saved), n),
    }


def main() -> None:
    args = measuring.arguments(__doc__.splitlines()[0], SIZES)
    rows = [measuring.median_of(args.repeats, lambda n=n: measure(n), "watched") for n in args.sizes]
    measuring.report("A game that is watched, by entities (n)", rows, args.json)


if __name__ == "__main__":
    main()
