"""All entities of all worlds: the body table, the groups, and the operation that adds and removes rows."""

from __future__ import annotations

import warnings
from bisect import insort
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.api.bodies import Bodies
from tussle.api.context import Context
from tussle.api.kinds import EntityPlugin
from tussle.api.mass import MassProperties
from tussle.declare.columns import Param
from tussle.declare.lists import RaggedColumn
from tussle.engine import failure, kernels
from tussle.engine.group import Binding, Group
from tussle.engine.params import Overrides
from tussle.engine.table import span
from tussle.errors import PluginError
from tussle.mission import Block
from tussle.mission.spec import ONE_BY_ONE
from tussle.world.scene import Scene

Params = list[tuple[int, Binding, str, Any]]
"""Block number, plugin, parameter name, and its value."""
Newborn = list[tuple[Group, np.ndarray, np.ndarray]]
"""Rows of newborn entities by group, with their numbers among all newborn, (m,) each."""
NOBODY = Bodies.empty(0, 1)


@dataclass(frozen=True)
class HandleRow:
    """Argument of `open_one` and `load_one`.

    Attributes:
        world: Number of the world.
        id: Id of the entity.
        team: Team of the entity.
        seed: Seed of the world.
        pos: Position [m], (3,).
        dt: Length of a step of the plugin [s].
        plugin: The plugin as data.
        scene: Origin, ground, boundaries and bases.
        shared: shared(key, make) returns the simulation's object with this key; the first call creates it by make(). The object's
            method `end` is called when the simulation is closed, after `close_one` for all handles.
    """

    world: int
    id: int
    team: int
    seed: int
    pos: np.ndarray
    dt: float
    plugin: Any
    scene: Scene
    shared: Callable[[Hashable, Callable[[], Any]], Any]


class Population:
    """Groups of rows and the body table that they share.

    Args:
        context: Shared by all views.
        overrides: Parameters per world.
        advise: See `Wiring`.

    Attributes:
        bodies: The body table.
        groups: Groups in the order of their rows.
        is_sequential: Each entity has a group of its own, in the order of ids.
        on_new_group: Called when a group is added, or a block joins a group.
    """

    def __init__(self, context: Context, overrides: Overrides, advise: Callable[..., list[str]]) -> None:
        self.context = context
        self.overrides = overrides
        self.advise = advise
        self.is_sequential = overrides.mission.update in ONE_BY_ONE
        self.bodies = Bodies.empty(0, overrides.n_worlds)
        self.bodies.scans = self.is_sequential
        self.groups: list[Group] = []
        self._by_key: dict[Any, Group] = {}
        self._asking: list[Binding] = []
        self._groups: dict[tuple[int, int, int], Group] = {}
        self._specs: dict[tuple[int, tuple[str, ...]], Any] = {}
        self._params: dict[Group, tuple[Params, Params]] = {}
        self._of_block = np.zeros(0, np.int64)  # number in `groups` of each block, if its entities share one
        self.on_new_group: Callable[[], None] = lambda: None

    def mass_properties(self) -> MassProperties:
        """Mass, inertia and weight of all rows, from their motion models."""
        n = self.bodies.n
        every = MassProperties(np.zeros(n), np.zeros((9, n)), np.zeros(n))
        for group in self.groups:
            if group.n:
                found = group.motion.plugin.mass_properties(group.motion_view)
                for column, own in zip(every, found, strict=True):
                    column[..., group.first : group.last] = own
        return every

    # -- groups -------------------------------------------------------------------------------------------------------------

    def group_of(self, blocks: tuple[Block, ...], number: int, place: int) -> Group:
        """Return the group of an entity; it is created for the first entity of its kind."""
        key = (id(blocks), number, place if self.is_sequential else 0)
        if key not in self._groups:
            self._groups[key] = self._group_of(blocks[number], place)
        return self._groups[key]

    def _group_of(self, block: Block, place: int) -> Group:
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
                self.overrides.mission.motion_multiplier,
                self.advise,
            )
            self._by_key[key] = group
            self._asking += group.walk()
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
            self._params.pop(group, None)
            self.on_new_group()
        return group

    def prepare(self) -> None:
        """Create the groups of all blocks, so that wiring errors are raised before the first step."""
        if not self.is_sequential:
            for number in range(len(self.overrides.mission.blocks)):
                self.group_of(self.overrides.variant(0), number, 0)

    def _groups_of(self, new: Bodies) -> np.ndarray:
        """Number in `groups` of each newborn, (m,)."""
        if not (self.is_sequential or self.overrides.structural):
            blocks = self.overrides.variant(0)
            if len(self._of_block) < len(blocks):
                owners = [self.group_of(blocks, k, 0) for k in range(len(blocks))]
                self._of_block = np.array([self.groups.index(g) for g in owners], np.int64)
            return np.take(self._of_block, new.block)
        alike = new.block  # entities with equal numbers belong to the same group
        if self.is_sequential:
            alike = alike << 32 | new.id
        if self.overrides.structural:
            _, alike = np.unique([alike, new.world], axis=1, return_inverse=True)
        _, first, which = np.unique(alike, return_index=True, return_inverse=True)
        found: list[Any] = [None] * len(first)
        for k in np.argsort(first):
            i = first[k]
            found[k] = self.group_of(
                self.overrides.variant(int(new.world[i])), int(new.block[i]), int(new.id[i])
            )
        number = {id(g): i for i, g in enumerate(self.groups)}
        return np.array([number[id(g)] for g in found], np.int64)[which]

    def settle(self) -> None:
        """Let plugins that have been called ask plain sets which of their outputs are read."""
        self._asking = [binding for binding in self._asking if not binding.settle()]

    # -- repack -------------------------------------------------------------------------------------------------------------

    def repack(self, gone: np.ndarray | None, new: Bodies | None) -> tuple[np.ndarray, Newborn]:
        """Remove rows (where gone, (n,), is true) and add newborn rows. Returns the old row of each new row, and the newborn.

        Rows are ordered by (group, world, id).
        """
        old = self.bodies
        new = NOBODY if new is None else new
        gone = np.zeros(old.n, bool) if gone is None else gone
        owner = self._groups_of(new)
        self._close_handles(gone)
        source = np.empty(old.n + new.n, np.int64)
        moved, newborn, first = set(), [], 0
        for number, group in enumerate(self.groups):
            fresh = np.flatnonzero(owner == number)
            out = rows, places = source[first:], np.empty(len(fresh), np.int64)
            columns = (old.world, old.id), (new.world, new.id)
            n, stays = kernels.merge(gone, group.first, group.last, *columns, fresh, out)
            if not stays:
                moved.add(number)
                group.rearrange(rows[:n])
            elif len(fresh):
                group.renew(places)
            if len(fresh):
                newborn.append((group, places, fresh))
            first += n
        source, first = source[:first], 0
        new.born[:] = self.context.clock.step[new.world]
        is_same = not moved and self._fill_bodies(newborn, new)
        if moved:
            self._move_bodies(source, new)
        for number, group in enumerate(self.groups):
            if number in moved:
                group.attach(old, first)
            elif not is_same:
                group.shift(old, first)
            first += group.n
        return source, newborn

    def _fill_bodies(self, newborn: Newborn, new: Bodies) -> bool:
        """Write newborn rows over the rows that they replace. Returns whether the integer columns are unchanged."""
        bodies = self.bodies
        ints = bodies.ints
        for group, places, fresh in newborn:
            rows, mine = span(group.first + places), span(fresh)
            bodies.floats[:, rows] = new.floats[:, mine]
            if (ints[:, rows] != new.ints[:, mine]).any():
                if ints is bodies.ints:
                    ints = (
                        ints.copy()
                    )  # recorders compare arrays by identity to detect that entities have changed
                ints[:, rows] = new.ints[:, mine]
        if ints is bodies.ints:
            bodies.touch(0, bodies.n)
            return True
        bodies.replace(bodies.floats, ints)
        return False

    def _move_bodies(self, source: np.ndarray, new: Bodies) -> None:
        old, n = self.bodies, len(source)
        floats, ints = np.empty((len(old.floats), n)), np.empty((len(old.ints), n), np.int64)
        kernels.gather_floats(old.floats, 0, new.floats, source, floats)
        kernels.gather_ints(old.ints, 0, new.ints, source, ints)
        old.replace(floats, ints)

    def begin_rows(self, newborn: Newborn) -> None:
        """Set parameters, beliefs, motion states and handles of newborn rows, and call their `spawn` hooks."""
        for group, rows, _ in newborn:
            self._fill_params(group, rows)
            for binding in group.walk():
                if binding.ragged:
                    self._fill_ragged(group, binding, rows)
            for name, place in group.belief.items():
                group.table.array(place)[..., rows] = getattr(self.bodies, name)[..., group.first + rows]
            self._call(group, group.motion, rows, group.from_body, rows)
            for binding in group.walk():
                opened = self._open_handles(group, binding, rows) if binding.handles else rows
                if len(opened) and type(binding.plugin).spawn is not EntityPlugin.spawn:
                    self._call(group, binding, rows, binding.plugin.spawn, binding.view, opened)

    def _call(
        self, group: Group, binding: Binding, rows: np.ndarray, hook: Callable[..., Any], *args: Any
    ) -> None:
        """Call a plugin's hook for newborn rows; errors are raised as `PluginError` with the plugin's name."""
        binding.view.begin(binding.plugin)
        try:
            hook(*args)
        except Exception as error:
            if isinstance(error, PluginError):  # raised by `fail`
                raise
            worlds = np.unique(self.bodies.world[group.first + rows])
            step = int(self.context.clock.step[worlds[0]])
            world = int(worlds[0]) if len(worlds) == 1 else None
            raise failure.raised(error, binding.plugin, where=group.name, step=step, world=world) from error

    def _fill_params(self, group: Group, rows: np.ndarray) -> None:
        """Set the parameters that differ from the defaults of the group's table, which are those of its first block."""
        columns, names = self.overrides.columns, self.context.block_names
        own, common = self._params_of(group)
        given = [p for p in common if (names[p[0]], p[1].path, p[2]) in columns] if columns else []
        for number, binding, name, value in own + given:
            some = rows[self.bodies.block[group.first + rows] == number]
            world = self.bodies.world[group.first + some]
            filled = self.overrides.fill(names[number], binding.path, name, value, world)
            group.table.array(binding.places[name])[..., some] = filled

    def _params_of(self, group: Group) -> tuple[Params, Params]:
        """Parameters of a group's blocks: those that differ from the first block, and the others."""
        if group not in self._params:
            own, common = self._params[group] = [], []
            for number in map(self.context.block_names.index, group.names):
                for binding in group.walk():
                    values, first = self._spec(number, binding.path).values, binding.spec.values
                    for name in binding.params:
                        some = own if values[name] != first[name] else common
                        some.append((number, binding, name, values[name]))
        return self._params[group]

    def _fill_ragged(self, group: Group, binding: Binding, rows: np.ndarray) -> None:
        for name, number in binding.ragged.items():
            column = type(binding.spec).columns[name]
            if isinstance(column, Param):
                blocks = self.bodies.block[group.first + rows]
                lists = [np.transpose(self._spec(int(block), binding.path).values[name]) for block in blocks]
                group.table.lists[number].put(rows, RaggedColumn.from_rows(lists, column))

    def _spec(self, number: int, path: tuple[str, ...]) -> Any:
        """Return a plugin of a block by its path, as data."""
        if (number, path) not in self._specs:
            plugins, plugin = self.overrides.mission.blocks[number].plugins, None
            for name in path:
                plugin = next(p for p in plugins if p.instance_name == name)
                plugins = tuple(c for k in type(plugin).children() for c in plugin.values[k])
            self._specs[number, path] = plugin
        return self._specs[number, path]

    # -- handles ------------------------------------------------------------------------------------------------------------

    def handle_row(self, group: Group, binding: Binding, row: int) -> HandleRow:
        b, i = self.bodies, group.first + row
        world = int(b.world[i])
        seed, pos = int(self.context.seeds[world]), b.pos[:, i].copy()
        c, spec = self.context, binding.spec
        return HandleRow(
            world, int(b.id[i]), int(b.team[i]), seed, pos, binding.view.dt, spec, c.scene, c.share
        )

    def _open_handles(self, group: Group, binding: Binding, rows: np.ndarray) -> np.ndarray:
        """Open the handles of newborn rows. Returns the rows without errors."""
        binding.view.begin(binding.plugin)
        failed = []
        for name in type(binding.spec).handles() if hasattr(type(binding.spec), "open_one") else ():
            for row in rows:
                about = self.handle_row(group, binding, int(row))
                try:
                    binding.handles[name][row] = binding.plugin.open_one(about)
                except Exception as error:
                    failed.append(row)
                    where, step = f"{group.name} {about.id}", int(self.context.clock.step[about.world])
                    self.context.fail(
                        about.world,
                        failure.raised(error, binding.plugin, where=where, step=step, world=about.world),
                    )
        return np.setdiff1d(rows, failed) if failed else rows

    def _close_handles(self, gone: np.ndarray) -> None:
        for group in self.groups:
            for binding in group.walk() if group.holds_handles else ():
                for objects in binding.handles.values():
                    for i in np.flatnonzero(gone[group.first : group.last]):
                        held, objects[i] = objects[i], None
                        if held is not None and hasattr(type(binding.spec), "close_one"):
                            self._close_one(group, binding, held)

    def _close_one(self, group: Group, binding: Binding, held: Any) -> None:
        try:
            binding.plugin.close_one(held)
        except Exception as error:  # the other handles must be closed too, and no result depends on this one
            raised = failure.raised(error, binding.plugin, where=group.name, step=0, world=None)
            text = (
                f"{binding.spec.instance_name}, {group.name}: a handle could not be closed: {raised.message}"
            )
            warnings.warn(text, RuntimeWarning, stacklevel=2)

    def close_handles(self) -> None:
        """Close all handles."""
        self._close_handles(np.ones(self.bodies.n, bool))
