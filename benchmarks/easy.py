"""The cost of easy mode per entity and step, by the features that the behaviour uses.

    python benchmarks/easy.py [--sizes 200] [--repeats 5] [--json FILE]

N chasers and N prey in one world; the prey use a NumPy plugin. `us_per_entity_step` is the CPU time of the chasers' calls alone,
`us_least` that of the fastest step, an estimate without other load on the machine. `keeps` is the Chaser of the guide, which searches
for prey when it has none; `looks` searches for the nearest in every step. `plain` is its arithmetic alone, on plain Python objects.
"""

from __future__ import annotations

import math
import time
from functools import partial
from types import SimpleNamespace
from typing import Any

import measuring
import numpy as np

from tussle import Block, Mission, Simulation
from tussle.api import (
    Autonomy,
    EasyAutonomy,
    EntityRef,
    GroupView,
    Me,
    Output,
    Param,
    Publish,
    State,
    Subscribe,
    wrap,
)
from tussle.engine.schedule import Call
from tussle.messages import CaptureEntity
from tussle.stock import Unicycle

SIZES = (200,)
STEPS = 100


class Prey(Autonomy):
    """Fly on."""

    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")

    def step(self, g: GroupView) -> None:
        self.speed[:] = 20.0


class Keeps(EasyAutonomy):
    """Chases the nearest prey until it is gone."""

    prey_team = Param(1, doc="Team that is hunted.")
    max_speed = Param(35.0, unit="m/s", ge=0.0)
    capture_range = Param(0.0, unit="m", ge=0.0)
    target = EntityRef(doc="Prey being chased; None when it is gone.")
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")
    capture = Publish(CaptureEntity)

    def step_one(self, me: Me) -> None:
        me.target = me.target or me.nearest(team=me.prey_team)
        if me.target is None:
            me.speed = me.turn_rate = me.pitch_rate = 0.0
            return
        east, north, up = me.target.pos - me.pos
        me.speed = me.max_speed
        me.turn_rate = wrap(math.atan2(north, east) - me.yaw)
        me.pitch_rate = math.atan2(up, math.hypot(east, north)) - me.climb
        if me.distance(me.target) < me.capture_range:
            me.publish("capture", target=me.target)


class Looks(Keeps):
    """Chases the nearest prey, chosen in every step."""

    def step_one(self, me: Me) -> None:
        me.target = None
        super().step_one(me)


class Flocks(Keeps):
    """Flies to the centroid of the team mates within 100 m."""

    def step_one(self, me: Me) -> None:
        near = me.near(100.0, team=me.team)
        me.speed = me.max_speed
        if near:
            east, north, _ = sum(other.pos for other in near) / len(near) - me.pos
            me.turn_rate = wrap(math.atan2(north, east) - me.yaw)


class Claims(Keeps):
    """Sends a message in every step and reads the messages received."""

    claims = Subscribe(CaptureEntity, network="LocalNetwork")
    claim = Publish(CaptureEntity, network="LocalNetwork")
    heard = State(dtype=int)

    def step_one(self, me: Me) -> None:
        for claim in me.claims:
            if claim.target:
                me.heard = me.heard + 1
        me.publish("claim", target=me.id)


class Wanders(Keeps):
    """Turns at random."""

    def step_one(self, me: Me) -> None:
        me.speed = me.max_speed
        me.turn_rate = 0.5 * me.normal("turn")


BEHAVIOURS = (Keeps, Looks, Flocks, Claims, Wanders)


def mission(n: int, autonomy: Any) -> Mission:
    """N chasers of one team, N prey of another."""
    from tussle.stock import LocalNetwork

    common: dict[str, Any] = {
        "count": n,
        "variance": (1e5, 1e5, 1e3),
        "scatter_first": True,
        "motion": Unicycle(vel_max=35.0),
    }
    chaser = Block(name="chaser", team=2, autonomy=autonomy, **common)
    prey = Block(name="prey", team=1, autonomy=Prey(), **common)
    return Mission(
        blocks=[chaser, prey], networks=[LocalNetwork()], dt=0.1, end=0.1 * STEPS, end_conditions="time"
    )


def measure(behaviour: type[EasyAutonomy], n: int) -> dict[str, Any]:
    """Play one game and measure the calls of one plugin."""
    spent: list[float] = []
    sim = Simulation(mission(n, behaviour()))
    sim.step(3)
    calls = sim.schedule.calls
    for i, call in enumerate(calls):
        if behaviour.__name__ in call.label:
            calls[i] = Call(call.label, _timed(call.run, spent))
    sim.run()
    return row(behaviour.__name__.lower(), n, spent)


def measure_plain(n: int) -> dict[str, Any]:
    """Measure the arithmetic of `Keeps` on plain objects outside a simulation."""
    entities = []
    for i in range(n):
        prey = SimpleNamespace(pos=np.array([i, 50.0, 0.0]))
        values = {"pos": np.zeros(3), "target": prey, "yaw": 0.1, "climb": 0.1, "max_speed": 35.0}
        entities.append(SimpleNamespace(**values, capture_range=0.0, distance=lambda other: 50.0))
    step_one, spent = Keeps().step_one, []

    def step() -> None:
        for entity in entities:
            step_one(entity)

    timed = _timed(step, spent)
    for _ in range(STEPS):
        timed()
    return row("plain", n, spent)


def row(name: str, n: int, spent: list[float]) -> dict[str, Any]:
    """One line of the table."""
    cost = {"us_per_entity_step": 1e6 * sum(spent) / len(spent) / n, "us_least": 1e6 * min(spent) / n}
    return {"behaviour": name, "n": n, **cost, "cpu_s": sum(spent)}


def _timed(run: Any, spent: list[float]) -> Any:
    def timed() -> None:
        begin = time.process_time()
        run()
        spent.append(time.process_time() - begin)

    return timed


def main() -> None:
    args = measuring.arguments(__doc__.splitlines()[0], SIZES)
    runs = (*(partial(measure, b) for b in BEHAVIOURS), measure_plain)
    rows = [
        measuring.median_of(args.repeats, partial(run, n), "us_per_entity_step")
        for n in args.sizes
        for run in runs
    ]
    measuring.report("Easy mode, one world, one thread", rows, args.json)


if __name__ == "__main__":
    main()
