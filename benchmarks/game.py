"""The 500 s predator/prey game: CPU seconds per world, alone and in a stack.

    python benchmarks/game.py [--update sequential] [--sizes 1 64] [--repeats 3] [--json FILE]

100 prey, 5 + 5 predators, dt 0.1 s, 12 motion substeps, captures on; sizes are worlds in the stack. The original takes 2.5 CPU s.
"""

from __future__ import annotations

from typing import Any

import measuring

from tussle import Block, Mission, Simulation
from tussle.stock import Boids, Predator, SimpleCapture, SimpleCaptureMetrics, Unicycle

SIZES = (1, 8, 64, 256)
UPDATES = ("synchronous", "sequential")
ORIGINAL = 2.5


def mission(motion_multiplier: int = 12, end: float = 500.0, **changes: Any) -> Mission:
    """The game of section 6.5 of the paper."""

    def predators(name: str, team: int, north: float, switching: bool) -> Block:
        return Block(
            name=name,
            team=team,
            count=5,
            position=(2000, north, 200),
            placement="uniform",
            half_width=(500, 500, 100),
            heading="180 deg",
            autonomy=Predator(max_speed=35.0, allow_prey_switching=switching),
            motion=Unicycle(vel_max=35.0, turn_rate_max=2.0, pitch_rate_max=1.5, use_pitch=True),
        )

    prey = Block(
        name="prey",
        team=1,
        count=100,
        position=(0, 0, 200),
        placement="uniform",
        half_width=(200, 200, 100),
        autonomy=Boids(),
        motion=Unicycle(vel_max=30.0, use_pitch=True),
    )
    return Mission(
        blocks=[prey, predators("keepers", 2, -1000, False), predators("switchers", 3, 1000, True)],
        dt=0.1,
        end=end,
        motion_multiplier=motion_multiplier,
        end_conditions="time, one_team, all_dead",
        interactions=[SimpleCapture()],
        metrics=[SimpleCaptureMetrics()],
        name="predator/prey",
    ).replace(**changes)


def measure(n_worlds: int, update: str) -> dict[str, Any]:
    game = mission(update=update)
    runs = 0

    def make() -> Simulation:
        nonlocal runs
        runs += n_worlds
        return Simulation(game, seeds=range(1, n_worlds + 1))

    cpu, simulated, agent_steps, sim = measuring.play(make)
    alive = sum(sum(r.alive.values()) for r in sim.result()) / n_worlds
    row = {"model": "Unicycle", "n": n_worlds, "cpu_s_per_world": cpu / runs, "sim_per_cpu": simulated / cpu}
    row |= {
        "ratio": ORIGINAL / (cpu / runs),
        "cpu_s": cpu,
        "alive": alive,
        "captures": measuring.captures(sim),
    }
    return row | {"pairs": float("nan") if not agent_steps else measuring.mean_pairs(game, 200.0, every=100)}


def main() -> None:
    args = measuring.arguments(__doc__.splitlines()[0], SIZES, update=UPDATES)
    rows = [
        measuring.median_of(args.repeats, lambda n=n: measure(n, args.update), "cpu_s_per_world")
        for n in args.sizes
    ]
    measuring.report("The 500 s game, CPU seconds a world by worlds in the stack (n)", rows, args.json)


if __name__ == "__main__":
    main()
