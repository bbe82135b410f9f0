"""The cost of each motion model, alone and with each controller that fits it.

    python benchmarks/library.py [--sizes 1000 10000] [--repeats 5] [--json FILE]

N entities of one kind in one world, on one thread. `ns_per_substep` is the CPU time of a substep of controller and motion model alone
(without autonomies), per entity: the median of the repetitions; `ns_least` is the fastest one, an estimate without other load on the
machine. Commands are those of the conformance kit. The models and controllers are those of the manifest; a line without a number says
why there is none.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Iterator
from typing import Any

import measuring

from tussle import Block, Mission, Simulation, stock
from tussle.engine.schedule import compose
from tussle.errors import TussleError
from tussle.testing.partners import driver

SIZES = (1_000, 10_000)
LEAST_CPU = 0.1
"""Smallest CPU time of a measurement [s]."""
WARM = 20
"""Steps before the measurement, in which kernels are compiled and vehicles get going."""


def classes(kind: str) -> Iterator[Any]:
    """Stock plugin classes of a kind."""
    for name, path in stock.manifest().items():
        if f".{kind}." in path:
            yield stock.load(name)


def required(cls: Any) -> set[str]:
    """Channels that the plugin needs with its default parameters."""
    plugin, inputs = cls(), cls.inputs()
    names = plugin.active_inputs() if hasattr(plugin, "active_inputs") else inputs
    return {channel for k in names if not inputs[k].optional for channel in inputs[k].channels}


def pairs() -> Iterator[tuple[Any, Any]]:
    """Motion models, each with None and with each controller that writes what it needs."""
    for motion in classes("motion"):
        yield motion, None
        needs = required(motion)
        for controller in classes("controller"):
            gives = {c for column in controller.outputs().values() for c in column.channels}
            if needs and needs <= gives and not controller.passthrough:
                yield motion, controller


def measure(motion: Any, controller: Any, n: int) -> dict[str, Any]:
    """Measure a motion model with a controller or None."""
    row = {"motion": motion.__name__, "controller": controller.__name__ if controller else "", "n": n}
    first = controller or motion
    try:
        pilot = driver(first.inputs().values(), (), (), ())
        block = Block(
            name="a", count=n, position=(0, 0, 500), variance=(1e4, 1e4, 1e2), heading_variance=1.0, speed=20.0, autonomy=pilot,
            controller=[controller()] if controller else (), motion=motion(),
        )  # fmt: skip
        sim = Simulation(Mission(blocks=[block], end=1e6), threads=1)
        sim.step(WARM)
    except (TussleError, ImportError) as error:
        return row | {"ns_per_substep": math.nan, "note": str(error).splitlines()[0]}
    calls = [call.run for call in compose(sim.state) if call.label.startswith(("control", "motion"))]
    for times in (10 * 2**k for k in itertools.count()):
        begin = time.process_time()
        for _ in range(times):
            for call in calls:
                call()
        cpu = time.process_time() - begin
        if cpu >= LEAST_CPU:
            break
    return row | {"ns_per_substep": 1e9 * cpu / (times * n)}


def main() -> None:
    args = measuring.arguments(__doc__.splitlines()[0], SIZES)
    rows = []
    for motion, controller in pairs():
        for n in args.sizes:
            found = sorted(
                (measure(motion, controller, n) for _ in range(args.repeats)),
                key=lambda row: row["ns_per_substep"],
            )
            rows.append(found[len(found) // 2] | {"ns_least": found[0]["ns_per_substep"]})
    measuring.report("Motion models and controllers, one thread", rows, args.json)


if __name__ == "__main__":
    main()
