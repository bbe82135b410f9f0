"""Speed by number of entities, Table 1 of the paper, compared with the original.

    python benchmarks/table1.py [--sizes 200 2000] [--repeats 3] [--json FILE]

One thread, logs off, prey fly at 30 m/s, dt 0.1 s with 12 motion substeps. `original` is SCRIMMAGE (revision of 2025-08-12, Release
build, one thread, logs off) in simulated seconds per CPU second on a 2-core 2.6 GHz Xeon virtual machine; `ratio` holds on such a machine.
"""

from __future__ import annotations

from typing import Any

import measuring

from tussle import Block, Mission, Simulation
from tussle.stock import (
    Boids,
    LocalNetwork,
    Predator,
    SimpleCapture,
    SimpleCaptureMetrics,
    SimpleCollision,
    SingleIntegrator,
    Unicycle,
    UnicyclePID,
)

SIZES = (200, 500, 800, 1100, 1400, 1700, 2000)
ORIGINAL = {
    "SingleIntegrator": dict(zip(SIZES, (114, 23.6, 9.38, 5.03, 3.04, 2.12, 1.55), strict=True)),
    "Unicycle": dict(zip(SIZES, (78.9, 17.4, 7.32, 3.90, 2.50, 1.76, 1.31), strict=True)),
}
MODELS: dict[str, dict[str, Any]] = {
    "SingleIntegrator": {"motion": SingleIntegrator(max_speed=30.0)},
    "Unicycle": {"motion": Unicycle(vel_max=30.0)},
    "Unicycle+UnicyclePID": {"motion": Unicycle(vel_max=30.0), "controller": UnicyclePID()},
}


def mission(model: str, n: int) -> Mission:
    """A mission of n - 10 prey and 5 + 5 predators for 20 s."""

    def predators(name: str, team: int, switching: bool) -> Block:
        hunter = Predator(max_speed=35.0, capture_range=5.0, allow_prey_switching=switching)
        legs = Unicycle(vel_max=35.0, turn_rate_max=2.0, pitch_rate_max=1.5)
        return Block(
            name=name,
            team=team,
            count=5,
            position=(1000, 0, 200),
            heading="180 deg",
            autonomy=hunter,
            motion=legs,
        )

    prey = Block(
        name="prey",
        team=1,
        count=n - 10,
        position=(0, 0, 200),
        variance=(400_000, 400_000, 1000),
        autonomy=Boids(),
        **MODELS[model],
    )
    return Mission(
        blocks=[prey, predators("keepers", 2, False), predators("switchers", 3, True)],
        dt=0.1,
        end=20.0,
        motion_multiplier=12,
        networks=[LocalNetwork()],
        interactions=[SimpleCollision(startup_collisions_only=True), SimpleCapture()],
        metrics=[SimpleCaptureMetrics()],
        name=f"table 1, {model}, N = {n}",
    )


def measure(model: str, n: int) -> dict[str, Any]:
    game = mission(model, n)
    cpu, simulated, agent_steps, sim = measuring.play(lambda: Simulation(game))
    row = {
        "model": model,
        "n": n,
        "sim_per_cpu": simulated / cpu,
        "us_per_step": 1e6 * cpu / simulated * game.dt,
    }
    row |= {
        "ns_per_agent_step": 1e9 * cpu / agent_steps,
        "cpu_s": cpu,
        "alive": sim.state.population.bodies.n,
    }
    original = ORIGINAL.get(model, {}).get(n)
    if original:
        row |= {"original": original, "ratio": simulated / cpu / original}
    return row | {"alive": sum(sim.result()[0].alive.values()), "captures": measuring.captures(sim)}


def main() -> None:
    args = measuring.arguments(__doc__.splitlines()[0], SIZES)
    rows = []
    for model in MODELS:
        for n in args.sizes:
            row = measuring.median_of(args.repeats, lambda model=model, n=n: measure(model, n), "sim_per_cpu")
            rows.append(row | {"pairs": measuring.mean_pairs(mission(model, n), 200.0)})
    measuring.report("Simulated seconds per CPU second, one thread", rows, args.json)


if __name__ == "__main__":
    main()
