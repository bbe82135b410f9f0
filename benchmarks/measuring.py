"""Shared by the benchmarks: options, CPU time of stepping, medians, tables and JSON files."""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tussle import Mission, Simulation

MIN_CPU = 2.0
"""Smallest CPU time of a measurement [s]."""


def arguments(description: str, sizes: Sequence[int], **choices: Sequence[str]) -> argparse.Namespace:
    """Parse the options of all benchmarks, --sizes, --repeats and --json, and the choices of one benchmark; the first is the default."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--sizes", type=int, nargs="+", default=list(sizes), help="which sizes to measure")
    parser.add_argument("--repeats", type=int, default=3, help="measurements per row; the median is reported")
    parser.add_argument("--json", type=Path, help="write the rows to this file")
    for name, allowed in choices.items():
        parser.add_argument(f"--{name}", choices=allowed, default=allowed[0])
    return parser.parse_args()


def play(make: Callable[[], Simulation]) -> tuple[float, float, int, Simulation]:
    """Play whole simulations until MIN_CPU is reached.

    Returns:
        CPU seconds of stepping, simulated seconds (of all worlds together), agent-steps, the last simulation.
    """
    cpu = simulated = 0.0
    agent_steps = 0
    while cpu < MIN_CPU:
        sim = make()
        while not sim.is_over:
            n, k = sim.state.population.bodies.n, int(sim.steps.sum())
            begin = time.process_time()
            sim.step(10)
            cpu += time.process_time() - begin
            made = int(sim.steps.sum()) - k
            agent_steps += n * made // max(1, sim.n_worlds)
            simulated += made * sim.mission.dt
    return cpu, simulated, agent_steps, sim


def mean_pairs(mission: Mission, radius: float, every: int = 20) -> float:
    """Mean number of neighbours of all teams within radius [m], per entity and step, over one run with seed 1."""
    sim = Simulation(mission)
    counts: list[float] = []
    while not sim.is_over:
        bodies = sim.state.population.bodies
        if bodies.n:
            counts.append(len(sim.state.world_view.near(radius)) / bodies.n)
        sim.step(every)
    return float(np.mean(counts))


def captures(sim: Simulation) -> float:
    """Mean number of captures per world."""
    return sum(sum(r.scores.values()) for r in sim.result()) / sim.n_worlds


def median_of(repeats: int, measure: Callable[[], dict[str, Any]], key: str) -> dict[str, Any]:
    """Return the measurement whose `key` is the median."""
    rows = sorted((measure() for _ in range(repeats)), key=lambda row: row[key])
    row = rows[len(rows) // 2]
    row["spread"] = round((rows[-1][key] - rows[0][key]) / statistics.median(r[key] for r in rows), 3)
    return row


def report(title: str, rows: list[dict[str, Any]], path: Path | None) -> None:
    """Print the rows as a table, and write them to the file of --json."""
    print(title)
    columns = list(dict.fromkeys(k for row in rows for k in row))
    text = [[_text(row.get(c, "")) for c in columns] for row in rows]
    widths = [max(len(c), *(len(line[i]) for line in text)) for i, c in enumerate(columns)]
    print("  ".join(c.rjust(w) for c, w in zip(columns, widths, strict=True)))
    for line in text:
        print("  ".join(v.rjust(w) for v, w in zip(line, widths, strict=True)))
    if path:
        path.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if abs(value) < 1000 else f"{value:.0f}"
    return str(value)
