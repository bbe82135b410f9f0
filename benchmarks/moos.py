"""Vehicles that helms of MOOS steer: whether a simulation keeps the pace of MOOS's clock, and what it costs.

    python benchmarks/moos.py [--sizes 1 20] [--repeats 3] [--json FILE]

Each vehicle has a MOOSDB and a helm, those of the tests, all in one other process; every vehicle reports itself and all others in each
step of 0.1 s. With `clock` the time warp is 5: `to_real_time` is simulated over wall time and is 5 if the pace is kept; `late_ms` is the
largest delay of a step behind MOOS's clock. With `lockstep` a step takes as long as the slowest helm's answer. `cpu_ms` is the CPU time of
the simulation per step, `reports` the number of messages that it sends per second.
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import measuring
import numpy as np

from tussle import Block, Mission, Simulation
from tussle.stock import MOOSAutonomy, SimpleCar, SimpleCarControllerHeading

SIZES = (1, 20)
WARP = 5.0
STEPS = 300
FOLDER = Path(__file__).parents[1] / "tests" / "unit" / "moos"
PEERS = """
import sys
sys.path.insert(0, sys.argv[1])
from moos_database import MoosDatabase
from moos_helm import MoosHelm
n = int(sys.argv[2])
with MoosDatabase(n) as database, MoosHelm(*range(database.port, database.port + n)):
    print(database.port, flush=True)
    sys.stdin.read()
"""


def fleet(n: int, port: int, mode: str) -> Mission:
    """n boats, 20 m apart on average."""
    autonomy = MOOSAutonomy(
        moos_port=port, port_step=1, moos_time_warp=WARP, lockstep=mode == "lockstep", timeout=60.0
    )
    boat = Block(
        name="boat", count=n, variance=(400.0 * n, 400.0 * n, 0.0), autonomy=autonomy,
        controller=SimpleCarControllerHeading(p_gain=0.5), motion=SimpleCar(length=4.0, max_velocity=3.0),
    )  # fmt: skip
    return Mission(blocks=[boat], end=1e6)


def measure(n: int, mode: str) -> dict[str, Any]:
    """One row."""
    command = [sys.executable, "-c", PEERS, str(FOLDER), str(n)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as peers:
        assert peers.stdin
        assert peers.stdout
        with Simulation(fleet(n, int(peers.stdout.readline()), mode)) as sim:
            sim.step(20)
            cpu, begun = time.process_time(), time.perf_counter()
            ends = []
            for _ in range(STEPS):
                sim.step()
                ends.append(time.perf_counter() - begun)
            cpu = time.process_time() - cpu
        peers.stdin.close()
    due = np.arange(1, STEPS + 1) * 0.1 / WARP
    late = 1e3 * (np.array(ends) - due)
    return {
        "n": n, "mode": mode, "to_real_time": 0.1 * STEPS / ends[-1], "late_ms": np.ptp(late) if mode == "clock" else "",
        "step_ms": 1e3 * ends[-1] / STEPS, "cpu_ms": 1e3 * cpu / STEPS, "reports": n * (n + 5) * STEPS / ends[-1],
    }  # fmt: skip


def main() -> None:
    args = measuring.arguments(__doc__.splitlines()[0], SIZES)
    rows = [
        measuring.median_of(args.repeats, lambda n=n, mode=mode: measure(n, mode), "to_real_time")
        for mode in ("clock", "lockstep")
        for n in args.sizes
    ]
    measuring.report(f"Vehicles steered by helms of MOOS, time warp {WARP:g}", rows, args.json)


if __name__ == "__main__":
    main()
