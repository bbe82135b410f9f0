"""Plugin calls on a subset of the worlds: for plugins with a rate in stacks whose clocks differ, and for the start of some worlds."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.api.bodies import Bodies
from tussle.api.world import WorldView
from tussle.declare.comms import Inbox, Publisher
from tussle.engine.group import Binding, Group
from tussle.engine.population import Population
from tussle.engine.table import Table
from tussle.engine.world_bindings import WorldBinding


def _sub_bodies(bodies: Bodies, rows: np.ndarray) -> Bodies:
    sub = Bodies(bodies.floats[:, rows].copy(), bodies.ints[:, rows].copy(), bodies.n_worlds)
    sub.scans = bodies.scans
    if bodies.start_pos is not None:
        sub.start_pos = np.take(bodies.start_pos, rows, axis=1)
    return sub


def _sub_table(table: Table, rows: np.ndarray) -> Table:
    sub = copy.copy(table)
    part = table.take(rows)
    sub.arrays, sub.lists, sub.n = part.arrays, part.lists, len(rows)
    return sub


def _sub_plugin(plugin: Any, view: Any) -> Any:
    """Copy a bound plugin; its topics get another view."""
    sub = object.__new__(type(plugin))
    for name, value in plugin.__dict__.items():
        sub.__dict__[name] = Publisher(value.topic, view) if isinstance(value, Publisher) else value
        if isinstance(value, Inbox):
            sub.__dict__[name] = inbox = Inbox(value.topic, view)
            inbox.deliveries = list(value.deliveries)
    return sub


def _sub_binding(binding: Binding, view: Any, rows: np.ndarray) -> Binding:
    plugin = _sub_plugin(binding.plugin, view)
    sub = copy.copy(binding)
    sub.plugin, sub.view = plugin, view
    sub.handles = {k: [objects[i] for i in rows] for k, objects in binding.handles.items()}
    sub.children = [_sub_binding(child, view, rows) for child in binding.children]
    children = iter(sub.children)
    for name in type(plugin).children():
        plugin.__dict__[name] = [next(children).plugin for _ in plugin.__dict__[name]]
    return sub


def _sub_group(group: Group, bodies: Bodies, first: int, rows: np.ndarray) -> Group:
    sub = copy.copy(group)
    sub.table = _sub_table(group.table, rows)
    views: dict[int, Any] = {}
    for name in ("autonomy_view", "controller_view", "sensor_view", "motion_view"):
        view = copy.copy(getattr(group, name))
        view.is_subset = True
        view.own_cache()
        view.services = {}
        views[id(getattr(group, name))] = view
        setattr(sub, name, view)

    def clone(b: Binding) -> Binding:
        return _sub_binding(b, views[id(b.view)], rows)

    sub.motion = clone(group.motion)
    sub.autonomies = [clone(b) for b in group.autonomies]
    sub.controllers = [clone(b) for b in group.controllers]
    sub.sensors = [clone(b) for b in group.sensors]
    for binding in sub.walk():
        for service in type(binding.plugin).services:
            for view in views.values():
                view.services[service] = getattr(binding.plugin, service)
    sub.attach(bodies, first)
    return sub


def call_group(
    population: Population, group: Group, worlds: np.ndarray, action: Callable[[Group], None]
) -> None:
    """Call action(group) on a copy of the rows of the worlds where `worlds`, (n_worlds,), is true, then copy the results back.

    Without any row, as where an entity of these worlds is dead, nothing is called.
    """
    bodies = population.bodies
    rows = np.flatnonzero(worlds[bodies.world])
    mine = rows[(rows >= group.first) & (rows < group.last)]
    if not len(mine):
        return
    first = int(np.searchsorted(rows, group.first))
    sub = _sub_group(group, _sub_bodies(bodies, rows), first, mine - group.first)
    action(sub)
    group.table.put(mine - group.first, sub.table)
    bodies.floats[:, mine] = sub.bodies.floats[:, first : first + len(mine)]
    bodies.touch(group.first, group.last)
    for binding, part in zip(group.walk(), sub.walk(), strict=True):
        for name in part.handles:
            for k, row in enumerate(mine - group.first):
                binding.handles[name][row] = part.plugin.__dict__[name][k]


def call_world_plugin(
    population: Population,
    world_binding: WorldBinding,
    worlds: np.ndarray,
    action: Callable[[WorldBinding, WorldView], None],
) -> None:
    """Call action(binding, view) on a copy of the rows of the worlds where `worlds`, (n_worlds,), is true, then copy the results back."""
    bodies, view = population.bodies, world_binding.view
    rows = np.flatnonzero(worlds[bodies.world])
    sub_bodies = _sub_bodies(bodies, rows)
    sub_view = copy.copy(view)
    sub_view.own_cache()
    sub_view.deaths, sub_view.moved, sub_view.births = [], [], []
    sub_view.only, sub_view.table_rows = worlds, rows
    if view.start_pos.shape[1] == bodies.n:
        sub_view.start_pos = np.take(view.start_pos, rows, axis=1)  # contiguous, for kernels
    sub_view.reset(sub_bodies, 0, len(rows))
    sub = copy.copy(world_binding)
    sub.plugin = _sub_plugin(world_binding.plugin, sub_view)
    sub.tables = {
        per: _sub_table(table, rows if per == "entity" else np.arange(table.n))
        for per, table in world_binding.tables.items()
        if table.places  # a table without columns does not follow the number of rows
    }
    sub.attach()
    action(sub, sub_view)
    for per, part in sub.tables.items():
        table = world_binding.tables[per]
        index = rows if per == "entity" else np.flatnonzero(worlds)
        for dtype, array in part.arrays.items():
            table.arrays[dtype][:, index] = array if per == "entity" else array[:, index]
    bodies.floats[:, rows] = sub_bodies.floats
    bodies.has_loads = True
    bodies.touch(0, bodies.n)
    view.deaths += [(rows[r], why) for r, why in sub_view.deaths]
    view.moved += [rows[r] for r in sub_view.moved]
    view.births += sub_view.births
