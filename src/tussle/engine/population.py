"""All entities of all worlds: the body table, the groups, and the one operation that changes who is in them."""

from __future__ import annotations

import warnings
from bisect import insort
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.api import kernels
from tussle.api.bodies import Bodies
from tussle.api.context import Context
from tussle.columns import Handle, RaggedColumn
from tussle.engine import failure
from tussle.engine.births import Newborn
from tussle.engine.group import Binding, Group
from tussle.engine.params import Overrides
from tussle.errors import PluginError
from tussle.mission import Block


@dataclass(frozen=True)
class HandleRow:
    """What `open_one` is told of a row: world, id, team, seed of the world, position [m] (3,), step length [s], and the plugin."""

    world: int
    id: int
    team: int
    seed: int
    pos: np.ndarray
    dt: float
    plugin: Any


class Population:
    """Groups of rows and the body table that they share.

    Args:
        context: Shared by all views.
        overrides: Parameters per world.
        n_worlds: Number of worlds.
        substeps: Motion substeps per step.
        is_sequential: One group per place in the order of ids.
        advise: See `Wiring`.

    Attributes:
        bodies: The body table.
        groups: Groups in the order of their rows.
        changed: Counts repacks and writes; caches key on it.
    """

    def __init__(
        self,
        context: Context,
        overrides: Overrides,
        n_worlds: int,
        substeps: int,
        is_sequential: bool,
        advise: Callable[..., list[str]],
    ) -> None:
        self.context = context
        self.overrides = overrides
        self.substeps = substeps
        self.is_sequential = is_sequential
        self.advise = advise
        self.bodies = Bodies.empty(0, n_worlds)
        self.bodies.scans = is_sequential
        self.groups: list[Group] = []
        self._by_key: dict[Any, Group] = {}
        self.changed = 0
        self.on_new_group: Callable[[], None] = lambda: None
        self.on_failure: Callable[[int, PluginError], None] = lambda world, error: None

    # -- groups -------------------------------------------------------------------------------------------------------------

    def group_of(self, blocks: tuple[Block, ...], number: int, place: int) -> Group:
        """The group of an entity: made when it is the first of its kind."""
        block = blocks[number]
        shape = (tuple(p.structure() for p in block.autonomy), tuple(p.structure() for p in block.controller))
        key = (
            *shape,
            block.motion.structure(),
            tuple(p.structure() for p in block.sensor),
            place if self.is_sequential else 0,
        )
        if key not in self._by_key:
            group = Group(
                block.name,
                block,
                self.context,
                self.bodies,
                self.context.clock.dt,
                self.substeps,
                self.advise,
            )
            self._by_key[key] = group
            group.key = key
            if self.is_sequential:
                group.place = place
                insort(self.groups, group, key=lambda g: g.place)
            else:
                self.groups.append(group)
            self.on_new_group()
        group = self._by_key[key]
        if block.name not in group.names:
            group.names.append(block.name)
            self.on_new_group()
        return group

    def prepare(self) -> None:
        """Make the groups of all blocks, so that wiring errors show before anything runs."""
        if not self.is_sequential:
            for number in range(len(self.overrides.mission.blocks)):
                self.group_of(self.overrides.variant(0), number, 0)

    def _groups_of(self, new: Newborn) -> np.ndarray:
        """Number in `groups` of each newborn, (m,)."""
        found: dict[Any, Group] = {}
        owners = []
        for world, block, entity in zip(new.world, new.block, new.id, strict=True):
            blocks = self.overrides.variant(int(world))
            key = (id(blocks), int(block), int(entity) if self.is_sequential else 0)
            if key not in found:
                found[key] = self.group_of(blocks, int(block), int(entity))
            owners.append(found[key])
        number = {id(g): i for i, g in enumerate(self.groups)}
        return np.array([number[id(g)] for g in owners], np.int64)

    # -- repack -------------------------------------------------------------------------------------------------------------

    def repack(self, gone: np.ndarray | None, new: Newborn | None) -> np.ndarray:
        """Remove rows (gone, (n,), true) and add newborn ones; returns for each new row its old one, -1 for newborn.

        Rows stay ordered by (group, world, id).
        """
        old = self.bodies
        keep = np.ones(old.n, bool) if gone is None else ~gone
        owner = self._groups_of(new) if new is not None and len(new) else None
        self._close_handles(~keep)
        orders, changed = [], set()
        for number, group in enumerate(self.groups):
            rows = np.flatnonzero(keep[group.first : group.last])
            index, fresh = rows, np.zeros(0, np.int64)
            if owner is not None and new is not None:
                fresh = np.flatnonzero(owner == number)
                if len(fresh):
                    world = np.concatenate([old.world[group.first + rows], new.world[fresh]])
                    ids = np.concatenate([old.id[group.first + rows], new.id[fresh]])
                    index = np.concatenate([rows, -1 - fresh])[np.lexsort((ids, world))]
            orders.append(np.where(index >= 0, index + group.first, index))
            if len(index) != group.n or len(fresh):
                group.rearrange(np.where(index >= 0, index, -1))
                changed.add(number)
        source = np.concatenate(orders) if orders else np.zeros(0, np.int64)
        self._fill_bodies(source, new)
        first = 0
        for number, group in enumerate(self.groups):
            if number in changed:
                group.attach(self.bodies, first)
            else:
                group.shift(self.bodies, first)
            first += group.n
        self.changed += 1
        return np.where(source >= 0, source, -1)

    def _fill_bodies(self, source: np.ndarray, new: Newborn | None) -> None:
        old = self.bodies
        floats = np.empty((len(old.floats), len(source)))
        ints = np.empty((len(old.ints), len(source)), np.int64)
        kernels.gather_floats(old.floats, source, floats)
        kernels.gather_ints(old.ints, source, ints)
        self.bodies.replace(floats, ints)
        if new is not None and len(new):
            rows = np.flatnonzero(source < 0)
            who = -1 - source[rows]
            floats[:, rows] = 0.0
            b = self.bodies
            b.pos[:, rows], b.vel[:, rows], b.quat[:, rows] = (
                new.pos[:, who],
                new.vel[:, who],
                new.quat[:, who],
            )
            for name, values in new.values.items():
                getattr(b, name)[rows] = values[who]
            b.id[rows], b.team[rows], b.world[rows] = new.id[who], new.team[who], new.world[who]
            b.block[rows], b.place_in_block[rows] = new.block[who], new.place[who]
            b.born[rows] = self.context.clock.step[new.world[who]]

    def begin_rows(self, source: np.ndarray) -> None:
        """Parameters, beliefs, motion states, handles and `spawn` hooks of the newborn rows, those whose `source` is -1."""
        for group in self.groups:
            rows = np.flatnonzero(source[group.first : group.last] < 0)
            if not len(rows):
                continue
            for binding in group.walk():
                self.fill_params(group, binding, rows)
                self._fill_ragged(group, binding, rows)
            for binding in group.bindings:
                binding.attach(group.table)
            for name, place in group.belief.items():
                group.table.array(place)[..., rows] = getattr(self.bodies, name)[..., group.first + rows]
            for view in group.views:
                view.begin()
            group.moving.caller = group.motion.plugin
            with self._blaming(group, group.motion, rows):
                group.motion.plugin.from_body(group.moving, rows)
            for binding in group.walk():
                opened = self._open_handles(group, binding, rows)
                binding.view.caller = binding.plugin
                with self._blaming(group, binding, rows):
                    binding.plugin.spawn(binding.view, opened)

    @contextmanager
    def _blaming(self, group: Group, binding: Binding, rows: np.ndarray) -> Iterator[None]:
        """An error of a plugin's hook for newborn rows becomes one that names it."""
        try:
            yield
        except Exception as error:
            if isinstance(error, PluginError):  # of `fail`
                raise
            worlds = np.unique(self.bodies.world[group.first + rows])
            step = int(self.context.clock.step[worlds[0]])
            world = int(worlds[0]) if len(worlds) == 1 else None
            raise failure.raised(error, binding.plugin, where=group.name, step=step, world=world) from error

    def fill_params(self, group: Group, binding: Binding, rows: np.ndarray) -> None:
        """Set the parameters of rows of a group from their blocks and what is set per world."""
        block_of = self.bodies.block[group.first + rows]
        world = self.bodies.world[group.first + rows]
        for name, column in type(binding.spec).params().items():
            if not column.is_row_data:
                continue
            array = group.table.array(binding.places[name])
            for number in np.unique(block_of):
                block = self.overrides.mission.blocks[number]
                mine = block_of == number
                base = _find(block, binding.path).values[name]
                array[..., rows[mine]] = self.overrides.fill(
                    block.name, binding.path, name, base, world[mine]
                )

    def _fill_ragged(self, group: Group, binding: Binding, rows: np.ndarray) -> None:
        for name, column in type(binding.spec).params().items():
            if column.ragged:
                lists: list[Any] = [binding.ragged[name][i].T for i in range(group.n)]
                for row in rows:
                    block = self.overrides.mission.blocks[self.bodies.block[group.first + row]]
                    lists[row] = np.array(_find(block, binding.path).values[name], float).reshape(
                        -1, *column.shape
                    )
                binding.ragged[name] = RaggedColumn.from_rows(lists, column)

    # -- handles ------------------------------------------------------------------------------------------------------------

    def handle_row(self, group: Group, binding: Binding, row: int) -> HandleRow:
        b, i = self.bodies, group.first + row
        world = int(b.world[i])
        seed, pos = int(self.context.seeds[world]), b.pos[:, i].copy()
        return HandleRow(world, int(b.id[i]), int(b.team[i]), seed, pos, binding.view.dt, binding.spec)

    def _open_handles(self, group: Group, binding: Binding, rows: np.ndarray) -> np.ndarray:
        """Open what newborn rows hold outside the arrays; returns the rows with which that went well."""
        failed = []
        for name, column in type(binding.spec).columns.items():
            if isinstance(column, Handle):
                for row in rows:
                    about = self.handle_row(group, binding, int(row))
                    try:
                        binding.handles[name][row] = binding.plugin.open_one(about)
                    except Exception as error:
                        failed.append(row)
                        where, step = f"{group.name} {about.id}", int(self.context.clock.step[about.world])
                        self.on_failure(
                            about.world,
                            failure.raised(error, binding.plugin, where=where, step=step, world=about.world),
                        )
        return np.setdiff1d(rows, failed) if failed else rows

    def _close_handles(self, gone: np.ndarray) -> None:
        for group in self.groups:
            for binding in group.walk():
                for objects in binding.handles.values():
                    for i in np.flatnonzero(gone[group.first : group.last]):
                        held, objects[i] = objects[i], None
                        if held is not None:
                            self._close_one(group, binding, held)

    def _close_one(self, group: Group, binding: Binding, held: Any) -> None:
        try:
            binding.plugin.close_one(held)
        except Exception as error:  # the others are to be closed all the same, and no result depends on it
            said = failure.raised(error, binding.plugin, where=group.name, step=0, world=None)
            text = f"{binding.spec.instance_name}, {group.name}: could not be closed: {said.message}"
            warnings.warn(text, RuntimeWarning, stacklevel=2)

    def close_handles(self) -> None:
        """Release all objects outside the arrays."""
        self._close_handles(np.ones(self.bodies.n, bool))


def _find(block: Block, path: tuple[str, ...]) -> Any:
    plugins = block.plugins
    plugin = None
    for name in path:
        plugin = next(p for p in plugins if p.instance_name == name)
        plugins = tuple(c for k in type(plugin).children() for c in plugin.values[k])
    return plugin
