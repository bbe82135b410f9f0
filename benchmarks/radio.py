"""The speed of radio networks: every node sends 100 bytes at 10 Hz, and reads all that it receives.

    python benchmarks/radio.py [--sizes 2000] [--repeats 3] [--json FILE]

Nodes drift in a plane, with 16 others within the range of 100 m. One world, one thread. `copies` is the number of copies of messages
that are received in a step, `wall_ms` and `cpu_ms` are per step, `to_real_time` is simulated time over CPU time: 10 is wanted
of 2,000 nodes with SphereNetwork, on one core.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

import measuring
import numpy as np

from tussle import Block, Mission, Recorder, Simulation
from tussle.api import Autonomy, Field, GroupView, Message, Output, Publish, State, Subscribe
from tussle.stock import RadioNetwork, SingleIntegrator, SphereNetwork, Still

SIZES = (200, 2000, 20_000)
AREA = np.pi * 100.0**2 / 16.0
"""Area per node [m^2]."""
STEPS = 50


class Report(Message):
    """Position, velocity and three more numbers: 100 bytes with the headers of UDP."""

    pos = Field("x y z", unit="m")
    vel = Field("vx vy vz", unit="m/s")
    more = Field("a b c")


class Node(Autonomy):
    """Drifts, reports its state, and averages the positions of the others."""

    mean = State("east north up", unit="m")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")
    reports = Publish(Report, network="radio")
    heard = Subscribe(Report, network="radio")

    def step(self, g: GroupView) -> None:
        rows, heard = self.heard.pairs()
        count = np.maximum(1, np.bincount(rows, minlength=g.n))
        for axis in range(3):
            self.mean[axis] = np.bincount(rows, heard.pos[axis], g.n) / count
        self.reports.publish(np.arange(g.n), pos=g.pos, vel=g.vel)
        self.velocity[:] = g.forward


RADIOS = {
    "SphereNetwork": SphereNetwork(name="radio", prob_transmit=0.9),
    "RadioNetwork": RadioNetwork(
        name="radio", prob_transmit=0.9, bandwidth=1e6, half_duplex=True, is_stochastic_delay=True, delay_jitter=0.01, jammer_team=2,
    ),
    "with fading": RadioNetwork(name="radio", fading="rayleigh", bandwidth=1e6, half_duplex=True, jammer_team=2),
}  # fmt: skip


def radio_mission(n: int, network: Any) -> Mission:
    """The nodes, and a jammer for each hundred."""
    half = 0.5 * float(np.sqrt(n * AREA))
    place = {"placement": "uniform", "half_width": (half, half, 1.0), "heading_variance": 9.0}
    return Mission(
        blocks=[
            Block(name="node", count=n, autonomy=Node(), motion=SingleIntegrator(), **place),
            Block(name="jammer", team=2, count=max(1, n // 100), motion=Still(), **place),
        ],
        networks=[network], end=0.1 * (STEPS + 10), end_conditions="time",
    )  # fmt: skip


def measure(name: str, n: int, is_recorded: bool) -> dict[str, Any]:
    """Measure a radio, with or without a run directory."""
    with tempfile.TemporaryDirectory() as folder, Simulation(radio_mission(n, RADIOS[name]), 1) as sim:
        recorder = Recorder(sim, Path(folder) / "run") if is_recorded else None
        sim.step(3)
        begin, cpu = time.perf_counter(), time.process_time()
        sim.step(STEPS)
        wall, cpu = time.perf_counter() - begin, time.process_time() - cpu
        if recorder:
            recorder.close("measured")
        copies = sim.result()[0].metrics["radio"]["delivered"] / (3 + STEPS)
    return {
        "network": name, "nodes": n, "recorded": is_recorded, "copies": copies, "wall_ms": 1e3 * wall / STEPS,
        "cpu_ms": 1e3 * cpu / STEPS, "to_real_time": 0.1 * STEPS / cpu,
    }  # fmt: skip


def main() -> None:
    args = measuring.arguments(__doc__.splitlines()[0], SIZES)
    rows = [
        measuring.median_of(args.repeats, lambda n=n, name=name, kept=kept: measure(name, n, kept), "cpu_ms")
        for name in RADIOS
        for n in args.sizes
        for kept in (False, True)
    ]
    measuring.report("Radios, each node sends 100 bytes at 10 Hz", rows, args.json)


if __name__ == "__main__":
    main()
