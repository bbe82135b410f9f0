"""All numbers of a simulation, by line of its arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.api.bodies import FLOATS, STORED_INTS
from tussle.declare.columns import Column, Output, State
from tussle.engine.simulation import Simulation
from tussle.engine.table import ColumnPlace, Table

BODY_ROWS = [name for name, k in FLOATS.items() for _ in range(k)]

Key = tuple[Any, ...]
"""("body", number or name), or (id of its table, dtype, number of the line)."""


@dataclass(frozen=True)
class Line:
    """One line of an array.

    Attributes:
        name: Owner and column, for messages.
        values: The line itself, (n,).
        world: World of each value, (n,).
        is_made: Whether it is computed, starts with a finite number and has to stay finite.
    """

    name: str
    values: np.ndarray
    world: np.ndarray
    is_made: bool


def keys_of(table: Table, place: ColumnPlace) -> list[Key]:
    """The lines of a column."""
    return [(id(table), place.dtype, place.first + i) for i in range(max(1, place.k))]


def lines_of(sim: Simulation) -> dict[Key, Line]:
    """All lines; the line of a channel is named after its writer."""
    bodies, worlds = sim.state.population.bodies, np.arange(len(sim.state.running))
    found: dict[Key, Line] = {
        ("body", i): Line(k, bodies.floats[i], bodies.world, True) for i, k in enumerate(BODY_ROWS)
    }
    found |= {("body", k): Line(k, bodies.ints[i], bodies.world, False) for i, k in enumerate(STORED_INTS)}
    found["clock",] = Line("the clock", sim.state.context.clock.step, worlds, False)
    found["seeds",] = Line("the seeds", sim.state.context.seeds, worlds, False)

    def add(table: Table, place: ColumnPlace, column: Column | None, name: str, world: np.ndarray) -> None:
        is_made = isinstance(column, (State, Output)) and bool(np.isfinite(column.default).all())
        is_made = is_made and getattr(column, "finite", True)
        for key in keys_of(table, place):
            if key not in found or isinstance(column, Output):
                found[key] = Line(name, table.arrays[place.dtype][key[2]], world, is_made)

    for group in sim.state.population.groups:
        for binding in group.walk():
            for name, place in binding.places.items():
                label = f"{group.name}.{'.'.join(binding.path)}.{name}"
                world = bodies.world[group.first : group.last]
                add(group.table, place, type(binding.spec).columns[name], label, world)
    for world_binding in sim.state.world_bindings:
        for name, (per, place) in world_binding.places.items():
            label = f"{world_binding.spec.instance_name}.{name}"
            world = bodies.world if per == "entity" else worlds
            add(world_binding.tables[per], place, type(world_binding.spec).columns.get(name), label, world)
    return found
