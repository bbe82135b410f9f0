"""Time of a step with contacts.

    python benchmarks/contacts.py [--sizes 2000 5000] [--repeats 20] [--json FILE]

A pile of spheres, or of boxes and capsules, in a tray, that has come to rest: every body touches its neighbours. `contacts` is the
number of contact points of a step; `interaction` the CPU time of the plugin alone, on one thread, `step` that of the whole step."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import measuring
import numpy as np

from tussle import Block, Mission, Simulation
from tussle.scene import Cuboid, FlatGround, Scene
from tussle.stock import Ballistic, BulletCollision, FreeBody
from tussle.world.contacts import found

SETTLING = 300
SOLID = 0.4 * 0.25
"""Moment of inertia of a solid sphere of 1 kg and 0.5 m [kg m^2]."""


def tray(n: int, block: dict[str, Any], plugin: BulletCollision) -> Simulation:
    """n bodies that fall into a tray about four layers deep."""
    side = 1.1 * (n / 4.0) ** 0.5
    wall = ((side / 2 + 1, 0.0), (-side / 2 - 1, 0.0), (0.0, side / 2 + 1), (0.0, -side / 2 - 1))
    walls = [Cuboid((x, y, 5.0), (2.0, side + 4.0, 10.0) if x else (side + 4.0, 2.0, 10.0)) for x, y in wall]
    body = Block(
        name="body", count=n, radius=0.5, placement="uniform", half_width=(side / 2 - 0.6, side / 2 - 0.6, 3.0),
        position=(0.0, 0.0, 4.0), scatter_first=True, **block,
    )  # fmt: skip
    scene = Scene(ground=FlatGround(0.0), walls=walls)
    return Simulation(Mission(blocks=[body], scene=scene, interactions=[plugin], dt=0.01, end=1e6), seeds=[1])


CASES = {
    "spheres that slide": {"motion": Ballistic()},
    "spheres that roll": {"motion": FreeBody(inertia_matrix=(SOLID, 0, 0, 0, SOLID, 0, 0, 0, SOLID))},
    "boxes": {
        "box": (1.0, 0.8, 0.6),
        "motion": FreeBody(inertia_matrix=(1 / 12, 0, 0, 0, 0.11, 0, 0, 0, 0.14)),
    },
}


def rows(n: int, repeats: int) -> Iterator[dict[str, Any]]:
    for what, block in CASES.items():
        with tray(n, block, BulletCollision(friction=0.5)) as sim:
            sim.step(SETTLING)
            call = next(c for c in sim.schedule if "BulletCollision" in c.label)
            counts: list[int] = []
            find = found.find

            def counted(*args: Any, counts: list[int] = counts, find: Any = find) -> Any:
                contacts = find(*args)
                counts.append(len(contacts))
                return contacts

            found.find = counted
            whole, own = [], []
            for _ in range(repeats):
                start = time.process_time()
                sim.step()
                whole.append(time.process_time() - start)
                start = time.process_time()
                call.run()  # once more, on the same states
                own.append(time.process_time() - start)
            found.find = find
        ms, contacts = 1e3 * float(np.median(own)), float(np.median(counts))
        yield {
            "bodies": n, "what": what, "contacts": round(contacts), "step_ms": 1e3 * float(np.median(whole)), "interaction_ms": ms,
            "ms_per_5000_contacts": 5000.0 * ms / contacts,
        }  # fmt: skip


def main() -> None:
    args = measuring.arguments(__doc__.splitlines()[0], (2000,))
    found_rows = [row for n in args.sizes for row in rows(n, args.repeats)]
    measuring.report("Contacts, one thread", found_rows, args.json)


if __name__ == "__main__":
    main()
