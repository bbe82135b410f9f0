"""Steps of JSBSim per second: in a plain Python loop, in JSBSimControl, and in JSBSimControl with two processes.

    python benchmarks/jsbsim_processes.py [--sizes 100] [--repeats 3] [--json FILE]

The aircraft, c172p, are trimmed at 50 m/s; their step is 1/120 s, and they get commands every 12 steps, or every step. `loop` writes the
four commands, calls `fdm.run()` and reads the twelve numbers of a state, for one aircraft after another; `run` only calls `fdm.run()`.
`cpu` is CPU time, of all processes together, and `relative` the speed by it relative to `loop`; `wall` is time of a clock. All are the
shortest of the repeats, which take turns."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

import jsbsim
import measuring
import numpy as np
import psutil

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output
from tussle.plugins.stock.motion.jsbsim_model.flight import STATE
from tussle.stock import JSBSimControl

STEP = 1 / 120  # [s]
COMMANDS = {
    "fcs/throttle-cmd-norm": 0.7, "fcs/elevator-cmd-norm": 0.0, "fcs/aileron-cmd-norm": 0.001, "fcs/rudder-cmd-norm": 0.0,
}  # fmt: skip
STEPS = 480
"""Steps of each aircraft in a measurement."""


class Stick(Autonomy):
    """Gives the constant commands."""

    throttle, elevator, aileron, rudder = Output(), Output(), Output(), Output()

    def step(self, g: Any) -> None:
        for out, value in zip(
            (self.throttle, self.elevator, self.aileron, self.rudder), COMMANDS.values(), strict=True
        ):
            out[:] = value


def aircraft(n: int) -> list[Any]:
    """Aircraft as those of the simulations, without tussle."""
    flown = []
    for _ in range(n):
        fdm = jsbsim.FGFDMExec(None)
        fdm.set_debug_level(0)
        fdm.load_model("c172p")
        fdm.set_dt(STEP)
        fdm["ic/h-sl-ft"], fdm["ic/u-fps"] = 1500.0 / 0.3048, 50.0 / 0.3048
        fdm.run_ic()
        fdm["propulsion/set-running"] = -1
        fdm.do_trim(0)
        flown.append(fdm)
    return flown


def run(flown: list[Any], substeps: int) -> None:
    for _ in range(0, STEPS, substeps):
        for fdm in flown:
            for _ in range(substeps):
                fdm.run()


def loop(flown: list[Any], substeps: int) -> None:
    for _ in range(0, STEPS, substeps):
        for fdm in flown:
            for name, value in COMMANDS.items():
                fdm[name] = value
            for _ in range(substeps):
                fdm.run()
            [fdm[name] for name in STATE]


def serve(pipe: Connection, n: int) -> None:
    """Run `loop` on request, in a process of its own."""
    flown = aircraft(n)
    pipe.send(None)
    while (substeps := pipe.recv()) is not None:
        loop(flown, substeps)
        pipe.send(None)


class Loops:
    """`loop` in two processes."""

    def __init__(self, n: int) -> None:
        context = get_context("spawn")
        self.pipes = []
        for part in (n - n // 2, n // 2):
            ours, theirs = context.Pipe()
            context.Process(target=serve, args=(theirs, part), daemon=True).start()
            self.pipes.append(ours)
        self.wait()

    def wait(self) -> None:
        for pipe in self.pipes:
            pipe.recv()

    def __call__(self, substeps: int) -> None:
        for pipe in self.pipes:
            pipe.send(substeps)
        self.wait()

    def close(self) -> None:
        for pipe in self.pipes:
            pipe.send(None)


def simulation(n: int, substeps: int, processes: int) -> Simulation:
    motion = JSBSimControl(aircraft="c172p", trim="longitudinal", processes=processes)
    block = Block(
        name="a",
        count=n,
        position=(0.0, 0.0, 1500.0),
        velocity=(50.0, 0.0, 0.0),
        motion=motion,
        autonomy=Stick(),
    )
    sim = Simulation(Mission(blocks=[block], dt=substeps * STEP, motion_multiplier=substeps, end=1e6))
    sim.step(12 // substeps)
    return sim


def seconds(call: Callable[[], Any]) -> tuple[float, float]:
    """CPU time of this process and its children, and time of a clock [s]."""
    here = psutil.Process()
    everyone = [here, *here.children(recursive=True)]

    def cpu() -> float:
        return sum(sum(each.cpu_times()[:2]) for each in everyone)

    begin, start = cpu(), time.perf_counter()
    call()
    took = time.perf_counter() - start
    return cpu() - begin, took


def rows(n: int, repeats: int) -> Iterator[dict[str, Any]]:
    flown, loops = aircraft(n), Loops(n)
    for substeps in (12, 1):
        sims = {processes: simulation(n, substeps, processes) for processes in (1, 2)}
        calls: dict[tuple[str, int], Callable[[], Any]] = {
            ("run", 1): lambda k=substeps: run(flown, k),
            ("loop", 1): lambda k=substeps: loop(flown, k),
            ("JSBSimControl", 1): lambda k=substeps, sim=sims[1]: sim.step(STEPS // k),
            ("loop", 2): lambda k=substeps: loops(k),
            ("JSBSimControl", 2): lambda k=substeps, sim=sims[2]: sim.step(STEPS // k),
        }
        times: dict[tuple[str, int], list[tuple[float, float]]] = {key: [] for key in calls}
        for _ in range(repeats):
            for key, call in calls.items():
                times[key].append(seconds(call))
        assert all(np.isfinite(sim.state.population.bodies.pos).all() for sim in sims.values())
        for (what, processes), each in times.items():
            (cpu, wall), base = map(min, zip(*each, strict=True)), min(times["loop", processes])[0]
            yield {
                "aircraft": n,
                "substeps": substeps,
                "what": what,
                "processes": processes,
                "cpu_us_per_step": 1e6 * cpu / (n * STEPS),
                "wall_us_per_step": 1e6 * wall / (n * STEPS),
                "relative": base / cpu,
            }
        for sim in sims.values():
            sim.close()
    loops.close()


def main() -> None:
    args = measuring.arguments(__doc__.splitlines()[0], (100,))
    found = [row for n in args.sizes for row in rows(n, args.repeats)]
    measuring.report("JSBSim", found, args.json)


if __name__ == "__main__":
    main()
