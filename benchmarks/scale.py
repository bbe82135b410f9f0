"""Cost per agent and step, and memory, from 100 to 100,000 entities at constant density.

    python benchmarks/scale.py [--sizes 1000 20000] [--repeats 3] [--json FILE]

Unicycle boids at the density of Table 1 with N = 2000 (there normal with 632 m; here uniform over the square with the same mean number
of neighbours), dt 0.1 s, one motion step. `real_time` is simulated seconds per CPU second, `in_wall_time` per wall second. From 100,000
on with one and with two threads; `state` is the hash after two steps, the same for both, and `cpu_per_wall` is the mean number of
cores used.
"""

from __future__ import annotations

import math
import resource
import time
from pathlib import Path
from typing import Any

import measuring

from tussle import Block, Mission, Simulation
from tussle.stock import Boids, Unicycle

SIZES = (100, 300, 1000, 3000, 10_000, 20_000, 30_000, 100_000)
SIGMA = math.sqrt(400_000.0)
AREA_PER_AGENT = 4.0 * math.pi * SIGMA**2 / 2000.0
"""Area per agent [m^2] at which uniformly placed agents have the same mean number of neighbours as 2,000 normally placed ones."""
STEPS = 50
THREADED = 100_000


def mission(n: int) -> Mission:
    """A mission of n boids at the density of Table 1 with N = 2000."""
    half = 0.5 * math.sqrt(n * AREA_PER_AGENT)
    block = Block(
        name="prey",
        team=1,
        count=n,
        position=(0, 0, 200),
        placement="uniform",
        scatter_first=True,
        half_width=(half, half, 50.0),
        autonomy=Boids(),
        motion=Unicycle(vel_max=30.0),
    )
    return Mission(blocks=[block], dt=0.1, end=STEPS * 0.1, name=f"{n} boids")


def measure(n: int, threads: int = 1) -> dict[str, Any]:
    cpu, wall, steps = 0.0, 0.0, 0
    while cpu < measuring.MIN_CPU:
        sim = Simulation(mission(n), threads=threads)
        sim.step(2)
        state = sim.state_hash(0)
        begin, wall_begin = time.process_time(), time.perf_counter()
        while not sim.is_over:
            sim.step()
            steps += 1
            if n >= 30_000 and time.process_time() - begin > 2.0 * measuring.MIN_CPU:
                break
        cpu += time.process_time() - begin
        wall += time.perf_counter() - wall_begin
    row = {
        "model": "Unicycle",
        "n": n,
        "threads": threads,
        "ns_per_agent_step": 1e9 * cpu / steps / n,
        "real_time": steps * 0.1 / cpu,
        "in_wall_time": steps * 0.1 / wall,
        "cpu_per_wall": cpu / wall,
        "state": state[:8],
        "cpu_s": cpu,
    }
    row |= {"alive": sim.state.population.bodies.n, "captures": 0, "resident_mb": _resident_mb()}
    return row | {"pairs": len(sim.state.world_view.near(200.0)) / n}


def _resident_mb() -> float:
    """Current memory of this process, including the interpreter and compiled kernels [MB]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 1e6


def main() -> None:
    args = measuring.arguments(__doc__.splitlines()[0], SIZES)
    rows = [
        measuring.median_of(args.repeats, lambda n=n, t=threads: measure(n, t), "ns_per_agent_step")
        for n in args.sizes
        for threads in ((1, 2) if n >= THREADED else (1,))
    ]
    measuring.report("Unicycle boids at constant density", rows, args.json)


if __name__ == "__main__":
    main()
