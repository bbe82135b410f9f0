"""The cost of a neighbour law per pair, compared with Boids and with the same law over NumPy pairs.

    python benchmarks/laws.py [--sizes 2000] [--repeats 3] [--json FILE]

Every law has a range of 200 m, in one world at the density of Table 1 with N = 2000, on one thread. `ns_per_pair` is the CPU time of
the neighbour sums alone per pair in range; `to_boids` is the ratio to the sums of Boids in the same round, median over the rounds.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import measuring
import numpy as np
import scale

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, GroupView, Output, Param, neighbors
from tussle.stock import Boids, SingleIntegrator

SIZES = (200, 2000, 20_000)
ROUNDS = 30
"""Measurements per median; the laws are measured in turn."""


class Vicsek(Autonomy):
    """Flies in the mean direction of the neighbours (Vicsek 1995), at constant speed and without noise."""

    sight = Param(200.0, unit="m", gt=0.0)
    speed = Param(30.0, unit="m/s")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    @neighbors("sight", vx="sum", vy="sum", n="count")
    @staticmethod
    def aligned(other_vel_x: float, other_vel_y: float) -> tuple[float, float, bool]:
        return other_vel_x, other_vel_y, True

    def step(self, g: GroupView) -> None:
        seen = self.aligned(g)
        mean = np.stack([seen.vx + g.vel[0], seen.vy + g.vel[1]])
        self.velocity[:2] = self.speed * mean / np.maximum(1e-9, np.sqrt(mean[0] ** 2 + mean[1] ** 2))


class Social(Autonomy):
    """A law with a branch: team mates attract, others repel, more strongly when nearer, and close entities are counted."""

    sight = Param(200.0, unit="m", gt=0.0)
    near = Param(20.0, unit="m")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    @neighbors("sight", x="sum", y="sum", z="sum", crowd="count", closest="min")
    @staticmethod
    def force(
        offset_x: float, offset_y: float, offset_z: float, distance: float, team: int, other_team: int, near: float
    ) -> tuple[float, ...]:  # fmt: skip
        pull = 1.0 / (distance + near)
        if team != other_team:
            pull = -2.0 * pull
        elif distance < near:
            pull = 0.0
        return pull * offset_x, pull * offset_y, pull * offset_z, distance < near, distance

    def step(self, g: GroupView) -> None:
        self.velocity[:] = self.force(g).values[:3]


def in_numpy(g: GroupView, sight: np.ndarray) -> None:
    """Vicsek's sums over pairs in NumPy."""
    near = g.near(sight)
    near.sum(near.vel[:2])


def laws(n: int) -> tuple[dict[str, Callable[[], Any]], float]:
    """Set up the sums of each law over the same entities, and count the pairs."""
    half = 0.5 * float(np.sqrt(n * scale.AREA_PER_AGENT))
    made: dict[str, Callable[[], Any]] = {}
    for autonomy in (Boids(), Vicsek(), Social()):
        block = Block(
            name="crowd", count=n, position=(0, 0, 200), placement="uniform", scatter_first=True, half_width=(half, half, 50.0),
            autonomy=autonomy, motion=SingleIntegrator(max_speed=30.0),
        )  # fmt: skip
        sim = Simulation(Mission(blocks=[block], dt=0.1, end=10.0))
        sim.step()
        group = sim.state.population.groups[0]
        plugin, g = group.autonomies[0].plugin, group.autonomies[0].view
        law = {"Boids": "seen", "Vicsek": "aligned", "Social": "force"}[type(autonomy).__name__]
        made[type(autonomy).__name__] = lambda plugin=plugin, g=g, law=law: getattr(plugin, law)(g)
        if isinstance(autonomy, Vicsek):
            made["Vicsek in NumPy"] = lambda plugin=plugin, g=g: in_numpy(g, plugin.sight)
            pairs = float(plugin.aligned(g).n.sum())
    return made, pairs


def measure(n: int) -> list[dict[str, Any]]:
    """Measure all laws."""
    made, pairs = laws(n)
    calls = max(1, round(200_000 / (pairs + 1)))
    cpu: dict[str, list[float]] = {name: [] for name in made}
    for _ in range(ROUNDS):
        for name, run in made.items():
            begin = time.process_time()
            for _ in range(calls):
                run()
            cpu[name].append((time.process_time() - begin) / calls)
    rows = []
    for name, times in cpu.items():
        ratio = statistics.median(a / b for a, b in zip(times, cpu["Boids"], strict=True))
        rows.append({
            "law": name, "n": n, "pairs": pairs / n, "ns_per_pair": 1e9 * statistics.median(times) / pairs, "to_boids": ratio,
            "cpu_s": sum(times),
        })  # fmt: skip
    return rows


def main() -> None:
    args = measuring.arguments(__doc__.splitlines()[0], SIZES)
    rows = []
    for n in args.sizes:
        found = sorted((measure(n) for _ in range(args.repeats)), key=lambda part: part[1]["to_boids"])
        rows += found[len(found) // 2]
    measuring.report("Neighbour sums, one thread", rows, args.json)


if __name__ == "__main__":
    main()
