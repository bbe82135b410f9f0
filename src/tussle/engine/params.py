"""Parameters that differ between worlds, by path, and the variants of blocks that structural parameters lead to."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from tussle.api.plugin import Plugin
from tussle.declare.columns import Param
from tussle.errors import ParameterError
from tussle.mission import Block, Mission, paths
from tussle.mission.spec import WORLD_VALUES

Key: TypeAlias = tuple[str, tuple[str, ...], str]
"""Owner, plugin path and parameter."""


class Overrides:
    """Parameters set per world, by path: "prey.Boids.gain", "prey.speed", "SimpleCapture.capture_range".

    Attributes:
        columns: (owner, plugin path, parameter) -> values, (n_worlds,) or (n_worlds, k), valid where `given` is true.
        given: The same keys -> worlds in which the parameter is set, (n_worlds,).
    """

    def __init__(self, mission: Mission, n_worlds: int) -> None:
        self.mission = mission
        self.n_worlds = n_worlds
        self.columns: dict[Key, np.ndarray] = {}
        self.given: dict[Key, np.ndarray] = {}
        self.structural: dict[Key, list[Any]] = {}
        self._block_values: dict[tuple[str, tuple[str, ...]], tuple[np.ndarray, list[int]]] = {}
        self._variants: dict[tuple[Any, ...], tuple[Block, ...]] = {}

    def set(self, values: Mapping[str, Any], worlds: np.ndarray) -> None:
        """Set parameters of `worlds`; each value is one for all worlds, or one per world along its first axis.

        Raises:
            ParameterError: A path does not exist, or a value is not allowed, alone or with the other parameters of its plugin.
        """
        found = [(*self._find(path), items) for path, items in self.checked(values, len(worlds)).items()]
        self._check_together(found, worlds)
        for key, column, _, items in found:
            if column.structural:
                row = self.structural.setdefault(key, [None] * self.n_worlds)
                for w, item in zip(worlds, items, strict=True):
                    row[w] = item
                continue
            if key not in self.columns:
                self.columns[key] = np.zeros((self.n_worlds, *column.shape), column.dtype)
                self.given[key] = np.zeros(self.n_worlds, bool)
            self.columns[key][worlds] = items
            self.given[key][worlds] = True

    def checked(self, values: Mapping[str, Any], n_worlds: int) -> dict[str, list[Any]]:
        """Values of n_worlds worlds by path, in SI units; nothing is set.

        Raises:
            ParameterError: As in `set`.
        """
        found = {}
        for path, value in values.items():
            _, column, _ = self._find(path)
            is_many = isinstance(value, (list, np.ndarray)) and _depth(value) > len(column.shape)
            if is_many and len(value) != n_worlds:
                raise ParameterError(
                    f"{path!r} has {len(value)} values for {n_worlds} worlds; give one value, or one per world"
                )
            found[path] = [column.convert(v, path) for v in (value if is_many else [value] * n_worlds)]
        return found

    def clear(self, worlds: np.ndarray) -> None:
        """Give `worlds` the mission's own values again."""
        for given in self.given.values():
            given[worlds] = False
        for row in self.structural.values():
            for w in worlds:
                row[w] = None

    def save(self) -> list[dict[Any, Any]]:
        """Copy all values, for snapshots."""
        return copy.deepcopy([self.columns, self.given, self.structural])

    def restore(self, saved: list[dict[Any, Any]]) -> None:
        """Restore the values that `save` returned."""
        self.columns, self.given, self.structural = copy.deepcopy(saved)

    def _check_together(self, found: Sequence[tuple[Key, Param, Any, list[Any]]], worlds: np.ndarray) -> None:
        """Check values that plugins compare, such as lower and upper limits, with what the worlds have already; nothing is set."""
        plugins: dict[tuple[str, tuple[str, ...]], Plugin] = {
            key[:2]: owner
            for key, _, owner, _ in found
            if isinstance(owner, Plugin) and type(owner).check_values is not Plugin.check_values
        }
        for place, plugin in plugins.items():
            kept = [key for key in self.columns if key[:2] == place]
            seen: set[tuple[Any, ...]] = set()
            for i, world in enumerate(worlds.tolist()):
                values = {key[2]: item_of(self.columns[key][world]) for key in kept if self.given[key][world]}
                values |= {key[2]: items[i] for key, _, _, items in found if key[:2] == place}
                if (one := tuple(values.items())) not in seen:
                    seen.add(one)
                    try:
                        plugin.check_values_with(values)
                    except ParameterError as error:
                        raise ParameterError(f"world {world}: {place[0]!r}: {error}") from None

    def _find(self, path: str) -> tuple[Key, Param, Any]:
        """Return the key of a path, its declaration, and its block or plugin."""
        owners, name = paths.resolve(path, paths.MissionRoot(self.mission), paths.inside, paths.settable)
        column, names = paths.declared(owners[-1], name), path.split(".")
        if isinstance(owners[0], Block):
            plugins, is_own = tuple(names[1:-1]), len(owners) > 1 or name in WORLD_VALUES
        else:
            plugins, is_own = (names[0],), isinstance(owners[0], Plugin) and len(owners) == 1
            is_own = is_own and column is not None and not column.structural
        if column is None or column.ragged or not is_own:
            raise ParameterError(f"{path!r} is the same in all worlds of a stack; set it in the mission")
        return (names[0], plugins, name), column, owners[-1]

    def block_values(self, block: Block, names: Sequence[str], world: np.ndarray) -> np.ndarray:
        """Values of a block for entities of the worlds `world`, a row for each component, (k, m), or (k, 1) if all are equal."""
        cache_key = block.name, tuple(names)
        if cache_key not in self._block_values:
            own = [np.array(getattr(block, name), float).reshape(-1, 1) for name in names]
            self._block_values[cache_key] = np.concatenate(own), np.cumsum([len(v) for v in own]).tolist()
        values, ends = self._block_values[cache_key]
        keys = [(block.name, (), name) for name in names] if self.columns else []
        if any(key in self.columns for key in keys):
            values = np.repeat(values, len(world), axis=1)
            for first, end, key in zip([0, *ends[:-1]], ends, keys, strict=True):
                if key in self.columns:
                    given = self.given[key][world]
                    values[first:end, given] = self.columns[key][world[given]].reshape(-1, end - first).T
        return values

    def fill(self, owner: str, path: tuple[str, ...], name: str, base: Any, world: np.ndarray) -> np.ndarray:
        """Values of a parameter for rows of the worlds `world`, (m,) or (k, m)."""
        out = np.repeat(np.asarray(base)[..., None], len(world), axis=-1)
        key = (owner, path, name)
        if key in self.columns:
            given = self.given[key][world]
            out[..., given] = self.columns[key][world[given]].T
        return out

    def variant(self, world: int) -> tuple[Block, ...]:
        """Blocks of a world: the mission's, with the structural parameters that are set for this world."""
        key = tuple((path, row[world]) for path, row in self.structural.items() if row[world] is not None)
        if key not in self._variants:
            mission = self.mission
            for (owner, plugins, name), value in key:
                mission = paths.with_value(mission, ".".join((owner, *plugins, name)), value)
            self._variants[key] = tuple(mission.blocks)
        return self._variants[key]


def item_of(value: Any) -> Any:
    """A value of a column as plugins keep it."""
    item = value.tolist()
    return tuple(item) if isinstance(item, list) else item


def _depth(value: Any) -> int:
    """Number of axes of a list of numbers or texts, whose items may differ in form."""
    return 1 + max(map(_depth, value), default=0) if isinstance(value, (list, tuple)) else np.ndim(value)
