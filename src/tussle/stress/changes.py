"""Missions that lack one thing: an entity, a plugin, the losses of a network or its messages; all else, and all draws, stay."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from typing import Any

import numpy as np

from tussle.api import Interaction, Messages, Network, Param, WorldView
from tussle.api.timed_fault import TimedFault
from tussle.mission import Mission, paths
from tussle.plugins import stock

Change = tuple[str, ...]
"""("entity", block, number) with number 0 for the whole block, ("plugin", path), ("reach all", network) or ("reach none", network)."""


class Removal(Interaction):
    """Removes an entity of a block as soon as it is there; the ids of the others stay."""

    grade = "portable"
    block = Param("", doc="Name of the block.")
    number = Param(0, ge=0, doc="Number of the entity, from 1; 0 for all.")

    def start(self, w: WorldView) -> None:
        """Remove it before the first step."""
        block, number = w.context.block_names.index(self.block), self.number[w.world]
        w.kill((w.block == block) & ((number == 0) | (w.block_index == number - 1)), "removed")

    def step(self, w: WorldView) -> None:
        """Remove it where it was born later."""
        self.start(w)


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
        removal = Removal(block=name, number=int(number[0]), name="Removal of stress")
        return mission.replace(interactions=(*mission.interactions, removal))
    if kind == "plugin":
        return _without(mission, name)
    (place,) = (i for i, network in enumerate(mission.networks) if network.instance_name == name)
    networks = list(mission.networks)
    networks[place] = (stock.load("GlobalNetwork") if kind == "reach all" else Silence)(name=name)
    return mission.replace(networks=networks)


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
    for path, plugin in _plugins(paths.MissionRoot(mission)):
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


def _plugins(owner: Any, path: Sequence[str] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    for name, part in paths.inside(owner).items():
        if hasattr(part, "instance_name"):
            yield (*path, name), part
        yield from _plugins(part, (*path, name))
