"""The cost of recording every step of the 500 s game: the same games with and without recording, in turn.

    python benchmarks/logging_cost.py [--sizes 1 8] [--repeats 5] [--json FILE]

Sizes are worlds in the stack. The time of a game includes opening and closing the run directory, which is in the temporary folder.
`cost` is the CPU or wall time added by recording, relative to the time without recording. `columns` counts the table columns of plugins
that are recorded with the states: none, the goals of the prey, or all states and outputs of all plugins.
"""

from __future__ import annotations

import statistics
import tempfile
import time
import warnings
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import game
import measuring

from tussle import Recorder, Simulation, load_run

SIZES = (1, 8)


COLUMNS = ("", "prey.Boids.target", "*")
"""Columns of plugins."""


def play(
    n_worlds: int, seed: int, folder: str | None, period: float | None = None, columns: str = ""
) -> tuple[float, float]:
    """CPU and wall seconds of one stack of games, with or without recording."""
    sim = Simulation(game.mission(), seeds=range(seed, seed + n_worlds))
    with ExitStack() as stack:
        cpu, wall = time.process_time(), time.perf_counter()
        if folder is not None:
            stack.enter_context(Recorder(sim, folder, period=period, columns=columns))
        sim.run()
        stack.close()
        return time.process_time() - cpu, time.perf_counter() - wall


def measure(n_worlds: int, repeats: int, period: float | None, columns: str) -> dict[str, Any]:
    """Medians over pairs of games with the same seeds, played in turn."""
    cpu, wall, mega = [], [], 0.0
    for i in range(repeats + 1):
        seed = 1 + i * n_worlds
        with tempfile.TemporaryDirectory() as folder:
            plain = play(n_worlds, seed, None)
            recorded = play(n_worlds, seed, f"{folder}/run", period, columns)
            n_columns = sum(
                len(column.parts) for column in load_run(f"{folder}/run", is_mapped=True).columns.values()
            )
            mega = sum(f.stat().st_size for f in Path(folder).rglob("*") if f.is_file()) / 1e6
        if i:  # the first pair warms up
            cpu.append((plain[0], recorded[0]))
            wall.append((plain[1], recorded[1]))
    row: dict[str, Any] = {"n": n_worlds, "period_s": period or 0.1, "columns": n_columns, "MB": mega}
    for name, pairs in (("cpu", cpu), ("wall", wall)):
        row[f"{name}_s"] = statistics.median(p for p, _ in pairs)
        row[f"{name}_s_recorded"] = statistics.median(r for _, r in pairs)
        row[f"{name}_cost"] = statistics.median(r / p - 1.0 for p, r in pairs)
    return row


def main() -> None:
    args = measuring.arguments(__doc__.splitlines()[0], SIZES)
    warnings.filterwarnings("ignore", message="not recorded")  # outputs that nobody reads
    kinds = [(None, columns) for columns in COLUMNS] + [(1.0, "")]
    rows = [measure(n, args.repeats, period, columns) for n in args.sizes for period, columns in kinds]
    measuring.report("The 500 s game without and with recording, by worlds in the stack (n)", rows, args.json)


if __name__ == "__main__":
    main()
