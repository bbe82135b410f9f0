"""The cost of each motion model, alone and with each controller that fits it.

    python benchmarks/library.py [--sizes 1000 10000] [--repeats 5] [--json FILE]

N entities of one kind in one world, on one thread. `ns_per_substep` is the CPU time of a substep of controller and motion model alone
(without autonomies), per entity: the median of the repetitions; `ns_least` is the fastest one, an estimate without other load on the
machine. Commands are those of the conformance kit. The models and controllers are those of the manifest; a line without a number says
why there is none. `limit` is what is wanted: 300 ns of a model and of a controller, 1,000 ns of a model with six degrees of freedom; none
of a flight model outside.

`existing` is the CPU time of SCRIMMAGE (2025-08-12, one thread of a 2.6 GHz Xeon) for the mission of table1.py with 200 entities, by entity
and substep: with its autonomies, for it can't be measured without them. There is no other measurement of it.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Iterator
from typing import Any

import measuring

from tussle import Block, Mission, Simulation
from tussle.api import RigidBodyModel
from tussle.engine.schedule import compose
from tussle.errors import TussleError
from tussle.plugins import stock
from tussle.testing.partners import driver

SIZES = (1_000, 10_000)
MIN_CPU = 0.1
"""Smallest CPU time of a measurement [s]."""
LIMIT, LIMIT_SIX_DEGREES = 300.0, 1000.0
"""Wanted [ns]."""
OUTSIDE = ("JSBSimModel", "JSBSimControl", "External")
"""Models without a limit: what moves them is not ours."""
EXISTING = {
    name: 1e9 / (to_real_time * 10 * 12 * 200)
    for name, to_real_time in (("SingleIntegrator", 114.0), ("Unicycle", 78.9), ("JSBSimModel", 2.63))
}
"""Its CPU time [ns], from simulated seconds per CPU second; 10 steps of 12 substeps per second."""
START = {"UUV6DOF": {"position": (0, 0, -50), "speed": 1.0}}
"""Where a model can't start as the others do."""
HAWK = {"jsbsim_root": str(stock.examples()["JSBSimModel"].with_name("hawk"))}
PARAMS = {
    "JSBSimCompiled": HAWK | {"aircraft": "hawk"},
    "JSBSimControl": HAWK | {"aircraft": "hawk"},
    "JSBSimModel": HAWK | {"script_name": "patrol.xml"},
}
"""Parameters of models that need some."""
WARM = 20
"""Steps before the measurement, in which kernels are compiled and vehicles get going."""


def classes(kind: str) -> Iterator[Any]:
    """Stock plugin classes of a kind."""
    for name in {path: name for name, path in stock.manifest().items() if f".{kind}." in path}.values():
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
            takes = {c for column in controller.inputs().values() for c in column.channels}
            if (
                needs and needs <= gives and not controller.passthrough and not needs & takes
            ):  # nor one in series
                yield motion, controller


def limit_of(motion: Any, controller: Any) -> float | str:
    """Limit of a model and its controller [ns]."""
    if motion.__name__ in OUTSIDE:
        return ""
    return (LIMIT_SIX_DEGREES if issubclass(motion, RigidBodyModel) else LIMIT) + bool(controller) * LIMIT


def measure(motion: Any, controller: Any, n: int) -> dict[str, Any]:
    """Measure a motion model with a controller or None."""
    row = {"motion": motion.__name__, "controller": controller.__name__ if controller else "", "n": n}
    row |= {"limit": limit_of(motion, controller), "existing": EXISTING.get(motion.__name__, "")}
    first = controller or motion
    try:
        pilot = driver(first.inputs().values(), (), (), ())
        block = Block(
            name="a", count=n, variance=(1e4, 1e4, 1e2), heading_variance=1.0, autonomy=pilot,
            controller=[controller()] if controller else (), motion=motion(**PARAMS.get(motion.__name__, {})),
            **{"position": (0, 0, 500), "speed": 20.0} | START.get(motion.__name__, {}),
        )  # fmt: skip
        dt = 0.01 if issubclass(motion, RigidBodyModel) else 0.1
        sim = Simulation(Mission(blocks=[block], dt=dt, end=1e6), threads=1)
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
        if cpu >= MIN_CPU:
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
