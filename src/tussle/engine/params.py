"""Values that differ from world to world: parameters by path, and the blocks that structural ones make."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

import numpy as np

from tussle.columns import Param
from tussle.errors import MissionError, ParameterError, listed, nearest_name
from tussle.mission import Block, Mission

BLOCK_VALUES = {
    "heading": Param(0.0, unit="rad", text_unit="deg"),
    "climb": Param(0.0, unit="rad", text_unit="deg"),
    "roll": Param(0.0, unit="rad", text_unit="deg"),
    "speed": Param(0.0, unit="m/s", ge=0.0),
    "health": Param(1.0, gt=0.0),
    "radius": Param(1.0, unit="m", gt=0.0),
    "mass": Param(1.0, unit="kg", gt=0.0),
}
"""Numbers of a block that may differ from world to world, with the bounds that the block itself has."""


class Overrides:
    """Parameters set per world, by paths such as "prey.Boids.gain", "prey.speed" or "SimpleCapture.capture_range".

    Attributes:
        columns: (owner, plugin path, parameter) -> one value per world, (n_worlds,) or (n_worlds, k); NaN-free; `given` says where.
    """

    def __init__(self, mission: Mission, n_worlds: int) -> None:
        self.mission = mission
        self.n_worlds = n_worlds
        self.blocks = {b.name: i for i, b in enumerate(mission.blocks)}
        self.columns: dict[tuple[str, tuple[str, ...], str], np.ndarray] = {}
        self.given: dict[tuple[str, tuple[str, ...], str], np.ndarray] = {}
        self.structural: dict[tuple[str, tuple[str, ...], str], list[Any]] = {}
        self._variants: dict[tuple[Any, ...], tuple[Block, ...]] = {}

    def set(self, values: Mapping[str, Any], worlds: np.ndarray) -> None:
        """Set parameters of `worlds`; each value is one for all of them, or one per world along its first axis.

        Raises:
            ParameterError: The path leads nowhere, or a value is not allowed.
        """
        checked = []  # all of them before any is set
        for path, value in values.items():
            key, column = self._find(path)
            if column.ragged:
                raise ParameterError(
                    f"{path!r} is a list, which is no column of a stack; set it in the mission"
                )
            many = (
                isinstance(value, (list, np.ndarray))
                and len(value) == len(worlds)
                and np.ndim(value) > len(column.shape)
            )
            is_list = isinstance(value, (list, np.ndarray)) and np.ndim(value) > len(column.shape)
            if is_list and not many and not column.is_text:
                raise ParameterError(
                    f"{path!r} has {len(value)} values for {len(worlds)} worlds; it takes one value, or one per world"
                )
            items = [column.convert(v, path) for v in (value if many else [value] * len(worlds))]
            checked.append((key, column, items))
        for key, column, items in checked:
            if column.structural:
                row = self.structural.setdefault(key, [None] * self.n_worlds)
                for w, item in zip(worlds, items, strict=True):
                    row[w] = item
                continue
            if key not in self.columns:
                self.columns[key] = np.zeros((self.n_worlds, *column.shape))
                self.given[key] = np.zeros(self.n_worlds, bool)
            self.columns[key][worlds] = np.asarray(items, float)
            self.given[key][worlds] = True

    def save(self) -> list[dict[Any, Any]]:
        """What has been set, for snapshots."""
        return [
            {k: copy.copy(v) for k, v in part.items()} for part in (self.columns, self.given, self.structural)
        ]

    def restore(self, saved: list[dict[Any, Any]]) -> None:
        """Go back to what `save` gave."""
        self.columns, self.given, self.structural = (
            {k: copy.copy(v) for k, v in part.items()} for part in saved
        )

    def _find(self, path: str) -> tuple[tuple[str, tuple[str, ...], str], Param]:
        head, *rest = path.split(".")
        world = {p.instance_name: p for p in self.mission.world_plugins}
        if head in self.blocks and len(rest) == 1 and rest[0] in BLOCK_VALUES:
            column = copy.copy(BLOCK_VALUES[rest[0]])
            column.name, column.owner = rest[0], head
            return (head, (), rest[0]), column
        if head in self.blocks:
            block = self.mission.blocks[self.blocks[head]]
            plugins = {p.instance_name: p for p in block.plugins}
        elif head in world:
            plugins, rest = {head: world[head]}, [head, *rest]
        else:
            allowed = [*self.blocks, *world]
            raise ParameterError(
                f"{path!r}: there is no block or world plugin {head!r}{nearest_name(head, allowed)}; {listed(allowed)}"
            )
        names: list[str] = []
        while len(rest) > 1:
            name = rest.pop(0)
            if name not in plugins:
                raise ParameterError(
                    f"{path!r}: {head} has no plugin {name!r}{nearest_name(name, plugins)}; {listed(plugins)}"
                )
            names.append(name)
            plugin = plugins[name]
            plugins = {c.instance_name: c for k in type(plugin).children() for c in plugin.values[k]}
        if not names or not rest:
            allowed = [*plugins, *(BLOCK_VALUES if head in self.blocks else ())]
            missing = rest[0] if rest else ""
            raise ParameterError(
                f"{path!r} names no parameter{nearest_name(missing, allowed)}; {head} has: {', '.join(allowed)}"
            )
        params = type(plugin).params()
        if rest[0] not in params:
            raise ParameterError(
                f"{path!r}: {names[-1]} has no parameter {rest[0]!r}{nearest_name(rest[0], params)}; {listed(params)}"
            )
        return (head, tuple(names), rest[0]), params[rest[0]]

    def block_value(self, block: Block, name: str, world: np.ndarray) -> float | np.ndarray:
        """A number of a block for entities of the worlds `world`: one for all, or (m,)."""
        value, key = float(getattr(block, name)), (block.name, (), name)
        if key not in self.columns:
            return value
        return np.where(self.given[key][world], self.columns[key][world], value)

    def fill(self, owner: str, path: tuple[str, ...], name: str, base: Any, world: np.ndarray) -> np.ndarray:
        """A parameter for rows of the worlds `world`, (m,) or (k, m)."""
        out = np.asarray(base, float)[..., None] + np.zeros(len(world))
        key = (owner, path, name)
        if key in self.columns:
            given = self.given[key][world]
            out[..., given] = self.columns[key][world[given]].T
        return out

    def variant(self, world: int) -> tuple[Block, ...]:
        """The blocks of a world: those of the mission, but for structural parameters set for it."""
        key = tuple((path, row[world]) for path, row in self.structural.items() if row[world] is not None)
        if key not in self._variants:
            blocks = list(self.mission.blocks)
            for (owner, path, name), value in key:
                if owner not in self.blocks:
                    raise MissionError(
                        f"{'.'.join(path)}.{name} is structural, so a stack of worlds shares it; set it in the mission"
                    )
                i = self.blocks[owner]
                blocks[i] = _with_param(blocks[i], path, name, value)
            self._variants[key] = tuple(blocks)
        return self._variants[key]


def _with_param(block: Block, path: tuple[str, ...], name: str, value: Any) -> Block:
    import dataclasses

    def change(plugin: Any, names: tuple[str, ...]) -> Any:
        if plugin.instance_name != names[0]:
            return plugin
        if len(names) == 1:
            return plugin.replace(**{name: value})
        inner = {k: [change(c, names[1:]) for c in plugin.values[k]] for k in type(plugin).children()}
        return plugin.replace(**inner)

    return dataclasses.replace(
        block,
        autonomy=[change(p, path) for p in block.autonomy],
        controller=[change(p, path) for p in block.controller],
        motion=change(block.motion, path),
        sensor=[change(p, path) for p in block.sensor],
    )
