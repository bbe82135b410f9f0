"""Missions that lack one thing: an entity, a plugin, the losses of a network or its messages; all else, and all draws, stay."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from typing import Any

import numpy as np

from tussle.api import Messages, Network, WorldView
from tussle.api.channel_fault import TimedFault
from tussle.mission import Block, Mission, paths
from tussle.plugins import stock

Change = tuple[str, ...]
"""("entity", block, number) with number 0 for the whole block, ("plugin", path), ("reach all", network) or ("reach none", network)."""


class Silence(Network):
    """Loses all messages."""

    grade = "portable"

    def route(self, w: WorldView, messages: Messages) -> Any:
        """Nobody."""
        return np.empty(0, np.int64), np.empty(0, np.int64)


def changed(mission: Mission, change: Change) -> Mission:
    """A mission that lacks something.

    Raises:
        TussleError: The mission is none without it.
    """
    kind, name, *number = change
    if kind == "entity":
        return without(mission, name, [int(n) for n in number if n != "0"])
    if kind == "plugin":
        return _without(mission, name)
    (place,) = (i for i, network in enumerate(mission.networks) if network.instance_name == name)
    networks = list(mission.networks)
    networks[place] = (stock.load("GlobalNetwork") if kind == "reach all" else Silence)(name=name)
    return mission.replace(networks=networks)


def without(mission: Mission, block: str, numbers: Sequence[int]) -> Mission:
    """A mission without entities of a block, by their numbers from 1; without numbers all of them. The draws of the others stay.

    Raises:
        TussleError: The mission is none without them.
    """
    kept = [p for p in mission.interactions if not is_absence(p, block)]
    absence = stock.load("Absence")(block=block, numbers=tuple(numbers), name=f"without {block}")
    return mission.replace(interactions=(*kept, absence))


def absent(mission: Mission, block: Block) -> set[int]:
    """Numbers of the entities that are left out of a block."""
    found = [tuple(p.values["numbers"]) for p in mission.interactions if is_absence(p, block.name)]
    return {n for numbers in found for n in range(1, block.count + 1) if n in numbers or not numbers}


def is_absence(part: Any, block: str = "") -> bool:
    """Whether part of a mission leaves out entities of a block, or of any."""
    return type(part).__name__ == "Absence" and block in ("", part.values["block"])


def _without(mission: Mission, path: str) -> Mission:
    """A mission without a plugin; a fault stays, and does not happen."""
    owners, _ = paths.resolve(f"{path}.x", paths.MissionRoot(mission), paths.inside, lambda _: None)
    plugin = owners[-1]
    if isinstance(plugin, TimedFault):
        for name, value in (("start_after", math.inf), ("failure_rate", 0.0)):
            mission = paths.with_value(mission, f"{path}.{name}", value)
        return mission
    if len(owners) == 1:
        return mission.replace(interactions=[p for p in mission.interactions if p is not plugin])
    block = owners[0]
    kept = {
        kind: [p for p in getattr(block, kind) if p is not plugin]
        for kind in ("autonomy", "controller", "sensor")
    }
    return mission.replace(blocks=[b.replace(**kept) if b is block else b for b in mission.blocks])


def removable(mission: Mission, networks: Collection[str]) -> Iterator[Change]:
    """Yield what can be left out beside entities.

    That is each fault, each other plugin of a block but its motion model, each interaction, and the messages of the given networks.
    """
    for path, plugin in members(paths.MissionRoot(mission)):
        is_own = len(path) == 2 and any(
            plugin in (*b.autonomy, *b.controller, *b.sensor) for b in mission.blocks
        )
        if isinstance(plugin, TimedFault) or is_own or plugin in mission.interactions:
            yield "plugin", ".".join(path)
    for network in mission.networks:
        if network.instance_name not in networks:
            continue
        yield "reach none", network.instance_name
        if type(network).losses:
            yield "reach all", network.instance_name


def members(owner: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield path and part of all that is inside an owner of `paths`."""
    for name, part in paths.inside(owner).items():
        yield (*path, name), part
        yield from members(part, (*path, name))
