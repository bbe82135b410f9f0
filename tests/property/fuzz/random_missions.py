"""Random missions: any plugins of the manifest that fit together, any counts, parameters in their ranges, births, messages, rates."""

from __future__ import annotations

import math
import random
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2] / "golden"))

from golden_plugins import Beacon, Car, Nursery, Wanderer

from tussle import Block, Mission
from tussle.api import (
    Autonomy,
    Behavior,
    Controller,
    InertiaParam,
    Interaction,
    Metric,
    MotionModel,
    Network,
    Output,
    Param,
    Plugin,
    Sensor,
)
from tussle.plugins import stock

KINDS = (Behavior, Autonomy, Controller, MotionModel, Sensor, Interaction, Metric, Network)
ON_FILES = ("GraphInteraction", "MapGen2D", "TrajectoryRecordPlayback")
"""Plugins that read a file, which random missions do not have."""
UNFIT = ("Absence", "TerrainGenerator", *(name for name in stock.manifest() if "JSBSim" in name))
"""Plugins that random companions and parameters hardly ever suit: two equal resolutions, an aircraft's files."""
RATES = (1.0, 2.5, 3.0, 4.0, 9.0)


def plugins(kind: type) -> list[type[Plugin]]:
    """All classes of a kind: those that ship and the golden missions' own."""
    every = dict.fromkeys(map(stock.load, stock.manifest()))
    shipped = [c for c in every if c.grade != "external" and c.__name__ not in (*ON_FILES, *UNFIT)]
    known = [*shipped, Beacon, Wanderer, Car, Nursery]
    return [c for c in known if next(k for k in KINDS if issubclass(c, k)) is kind]


def _channels() -> dict[str, str]:
    """Channel -> unit of all inputs of controllers and motion models."""
    takers = [*plugins(Controller), *plugins(MotionModel)]
    return {
        channel: unit
        for taker in takers
        for column in taker.inputs().values()
        for channel, unit in zip(column.channels, column.units, strict=True)
    }


CHANNELS = _channels()


class Stir(Autonomy):
    """Write drawn numbers into every channel that anybody takes, for those that no other plugin writes."""

    grade = "portable"
    size = Param(5.0)
    commands = Output(" ".join(CHANNELS), unit=" ".join(unit or "1" for unit in CHANNELS.values()))

    def step(self, g):
        self.commands[:] = self.size * g.normal("commands", len(CHANNELS))


def number(chance: random.Random, param: Param, default: float) -> float:
    """A number in the parameter's range, of its default's order of magnitude."""
    size = abs(default) if 0.0 < abs(default) < math.inf else 30.0
    value = (
        chance.choice([0.0, 1.0, -1.0]) * size * 10.0 ** chance.uniform(-1.0, 1.0)
        if chance.random() < 0.9
        else default
    )
    low = param.ge if param.ge is not None else -math.inf if param.gt is None else param.gt + 1e-3 * size
    high = param.le if param.le is not None else math.inf if param.lt is None else param.lt - 1e-3 * size
    value = min(max(value, low), high)
    return int(value) if param.dtype is int else value


def value(chance: random.Random, param: Param, teams: list[int]) -> Any:
    """A value that the parameter allows."""
    default = param.default
    if param.choices:
        return chance.choice(param.choices)
    if param.is_text or param.ragged or isinstance(param, InertiaParam):
        return default
    if param.dtype is bool:
        return chance.random() < 0.5
    if "team" in param.name:
        return chance.choice(teams)
    if param.fields:
        return tuple(number(chance, param, d) for d in default)
    return number(chance, param, default)


def made(chance: random.Random, kind: type[Plugin], teams: list[int], blocks: list[str]) -> Plugin:
    """A plugin with some of its parameters drawn, and sometimes a rate."""
    values = {
        name: value(chance, param, teams) for name, param in kind.params().items() if chance.random() < 0.3
    }
    for low in kind.params():
        high = low.replace("min", "max")
        ends = [
            values.get(name, kind.params()[name].default) for name in (low, high) if name in kind.params()
        ]
        if high != low and len(ends) == 2 and ends[0] > ends[1]:
            values[low], values[high] = reversed(ends)
    for name in kind.params():
        if name in ("template", "block"):
            values[name] = chance.choice(blocks)
        elif name in ("network", "network_name"):
            values[name] = chance.choice(["GlobalNetwork", "SphereNetwork", "LocalNetwork"])
        elif name == "capture_range":
            values[name] = chance.choice([5.0, 15.0, 60.0])
    for name, column in kind.children().items():
        fitting = [c for k in KINDS for c in plugins(k) if issubclass(c, column.kind) and not c.children()]
        inner = [made(chance, c, teams, blocks).replace(rate=None) for c in fitting]
        values[name] = chance.sample(inner, chance.randint(1, min(4, len(inner))))
    if kind.kind in ("autonomy", "controller", "sensor", "interaction", "metric") and chance.random() < 0.25:
        values["rate"] = chance.choice(RATES)
    return kind(**values)


COMMON = ("Predator", "Beacon", "SimpleCapture")
"""Plugins that half of all blocks or missions have: hunts, messages and deaths are where worlds could meet."""


def some(chance: random.Random, kind: type, most: int, *rest: Any) -> list[Plugin]:
    """Up to `most` plugins of a kind."""
    known = plugins(kind)
    chosen = chance.sample(known, chance.randint(0, min(most, len(known))))
    chosen += [c for c in known if c.__name__ in COMMON and c not in chosen and chance.random() < 0.5]
    return [made(chance, c, *rest) for c in chosen]


def needed_channels(kind: type[Plugin]) -> dict[str, None]:
    """Channels without which a plugin cannot be played, in order."""
    inputs = [column for column in kind.inputs().values() if not column.optional]
    return dict.fromkeys(channel for column in inputs for channel in column.channels)


def written_channels(kind: type[Plugin]) -> set[str]:
    """Channels that a plugin writes."""
    return {channel for column in kind.outputs().values() for channel in column.channels}


def block(chance: random.Random, name: str, teams: list[int], blocks: list[str]) -> Block:
    """Entities whose plugins may or may not fit together."""
    rest = teams, blocks
    motion = made(chance, chance.choice(plugins(MotionModel)), *rest)
    needed = needed_channels(type(motion))
    fitting = [c for c in plugins(Controller) if needed.keys() <= written_channels(c)]
    controllers = [made(chance, chance.choice(fitting), *rest)] if fitting and chance.random() < 0.6 else []
    passed = " ".join(f"[ {channel}, 1.0, NonZero, true, 0.0 ]" for channel in needed)
    controllers = [
        c.replace(depletion_map=passed) if "depletion_map" in c.params() else c for c in controllers
    ]
    autonomies = [Stir(size=chance.choice([0.5, 5.0])), *some(chance, Autonomy, 2, *rest)]
    sensors = some(chance, Sensor, 1, *rest) if chance.random() < 0.4 else []
    sensors += [
        made(chance, chance.choice(writers), *rest)
        for autonomy in autonomies
        for channel in needed_channels(type(autonomy))
        if (writers := [c for c in plugins(Sensor) if channel in written_channels(c)])
        and not any(channel in written_channels(type(sensor)) for sensor in sensors)
    ]
    spread = chance.choice([0.0, 25.0, 400.0, 4000.0])
    births: dict[str, Any] = {}
    if chance.random() < 0.4:
        births = {
            "rate": chance.choice([2.0, 5.0, 9.0]), "slots": chance.randint(1, 3), "interval_sd": chance.choice([0.0, 0.2]),
            "first_birth": chance.choice([0.0, 0.3]),
        }  # fmt: skip
    return Block(
        name=name, team=chance.choice(teams), count=chance.choice([1, 1, 2, 3, 5, 9, 14]), variance=(spread, spread, 0.2 * spread),
        position=(*(chance.uniform(-60.0, 60.0) for _ in range(2)), chance.uniform(5.0, 60.0)), heading_variance=chance.choice([0.0, 1.0]),
        speed=chance.choice([0.0, 5.0, 20.0]), health=chance.choice([1.0, 2.0]),
        autonomy=autonomies, controller=controllers, motion=motion, sensor=sensors, **births,
    )  # fmt: skip


def draw(seed: int) -> Mission:
    """The random mission of a number.

    Raises:
        TussleError: Its parts do not fit together.
    """
    chance = random.Random(seed)
    teams = [1, 2, 3][: chance.randint(1, 3)]
    blocks = [f"b{i}" for i in range(chance.randint(1, 3))]
    rest = teams, blocks
    world = {"interactions": (Interaction, 3), "metrics": (Metric, 2)}
    crowds = [block(chance, name, *rest) for name in blocks]
    drawn = {name: some(chance, kind, most, *rest) for name, (kind, most) in world.items()}
    every = [*drawn["interactions"], *(plugin for crowd in crowds for plugin in crowd.plugins)]
    named = {i for plugin in every for inner in plugin.walk() for i in inner.named_regions()}
    named -= {region.boundary for plugin in drawn["interactions"] for region in plugin.regions()}
    values = {"lengths": (90.0, 90.0, 90.0), "center": (0.0, 0.0, 30.0)}
    drawn["interactions"] += [
        stock.load("Boundary")(name=f"region {i:g}", boundary_id=int(i), team=chance.choice(teams), **values)
        for i in sorted(named)
    ]
    rates = [
        p.rate
        for p in [*drawn["interactions"], *drawn["metrics"], *(p for c in crowds for p in c.plugins)]
        if p.rate
    ]
    return Mission(
        blocks=crowds, dt=chance.choice([dt for dt in (0.1, 0.1, 0.05, 0.25) if dt * max(rates, default=0.0) <= 1.0]),
        motion_multiplier=chance.choice([1, 1, 2, 5]), update=chance.choice(["synchronous", "sequential"]), end=10.0,
        end_conditions=chance.choice(["time", "time, one_team", "time, all_dead"]),
        networks=[stock.load("SphereNetwork")(range=chance.choice([30.0, 100.0]), comm_delay=chance.choice([0.0, 0.0, 0.3]))],
        **drawn,
    )  # fmt: skip
