"""Columns of plugins in the trajectory table: their selection, their values, and their description in the file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
import pyarrow as pa

from tussle.api.kinds import row_shape
from tussle.api.plugin import Plugin
from tussle.declare.columns import EntityRef, Numbers, Output, State
from tussle.declare.displays import listing
from tussle.errors import ParameterError, nearest_name
from tussle.mission import Block, Mission, paths

TYPES = {float: pa.float64(), int: pa.int64(), bool: pa.bool_()}
DTYPES = {kind: dtype for dtype, kind in TYPES.items()}
LABELS = (b"column", b"field", b"unit", b"doc")
"""Metadata of a table column that holds a component of a plugin's column."""

Values = tuple[np.ndarray, np.ndarray]
"""Values of rows, (k, n), and which rows have one, (n,)."""


@dataclass(frozen=True)
class PluginColumn:
    """A column of plugins: one table column per component, null for entities without it.

    Attributes:
        name: Plugin and column, "Boids.goal"; with the block in front if blocks have different columns of this name.
        dtype: float, int or bool.
        fields: Names of the components; empty for one number per row.
        units: SI unit of each component.
        doc: One-line description.
    """

    name: str
    dtype: type
    fields: tuple[str, ...] = ()
    units: tuple[str, ...] = ("",)
    doc: str = ""

    @property
    def parts(self) -> list[str]:
        """Names of the table columns, one per component."""
        return [f"{self.name}.{each}" for each in self.fields] or [self.name]

    def schema(self) -> list[pa.Field]:
        """The table columns."""
        return [
            pa.field(part, TYPES[self.dtype], metadata=dict(zip(LABELS, (self.name, each, unit, self.doc), strict=True)))
            for part, each, unit in zip(self.parts, self.fields or ("",), self.units, strict=True)
        ]  # fmt: skip


def plugin_columns(schema: pa.Schema) -> dict[str, PluginColumn]:
    """The columns of plugins in a table, by name."""
    found: dict[str, PluginColumn] = {}
    for part in schema:
        if is_of_plugin(part):
            name, one, unit, doc = (part.metadata[label].decode(errors="replace") for label in LABELS)
            new = PluginColumn(name, DTYPES[part.type], (one,) if one else (), (unit,), doc)
            old = found.get(name)
            found[name] = (
                replace(old, fields=old.fields + new.fields, units=old.units + new.units) if old else new
            )
    return {name: column for name, column in found.items() if set(column.parts) <= set(schema.names)}


def is_of_plugin(part: pa.Field) -> bool:
    """Whether a table column is a component of a plugin's column."""
    return part.type in DTYPES and part.nullable and set(LABELS) <= set(part.metadata or ())


# -- what is recorded ---------------------------------------------------------------------------------------------------------


@dataclass
class Source:
    """Source of the values of a column.

    Attributes:
        column: The column.
        path: Plugin names, outermost first.
        attribute: Name of the column in the plugin.
        blocks: Names of the blocks whose entities it is recorded of; none for a column of a world plugin, which all entities have.
    """

    column: PluginColumn
    path: tuple[str, ...]
    attribute: str
    blocks: set[str] = field(default_factory=set)


def select(mission: Mission, selectors: str) -> list[Source]:
    """The columns that selectors name, and those declared with `recorded=True`, in the order of the mission.

    Args:
        mission: The mission.
        selectors: Columns as "prey.Boids.goal", "Boids.goal" for all blocks, or "BulletCollision.on_ground" of a world plugin, separated
            by commas; `*` stands for any characters.

    Raises:
        ParameterError: A selector matches no column, or only lists.
    """
    wanted = [text.strip() for text in selectors.split(",") if text.strip()]
    known: dict[str, Numbers] = {}
    found: dict[tuple[Any, ...], Source] = {}
    owners: list[tuple[str, tuple[str, ...], Any]] = [
        ("", (p.instance_name,), p) for p in mission.world_plugins
    ]
    for block in mission.blocks:
        owners += [(block.name, path, plugin) for path, plugin in _plugins(block)]
    for block_name, path, plugin in owners:
        for name, column in type(plugin).columns.items():
            if not isinstance(column, (State, EntityRef, Output)):
                continue
            key = bool(block_name), path, name, column.dtype, *_components(plugin, column)
            short = ".".join((*path, name))
            names = (f"{block_name}.{short}", short) if block_name else (short,)
            known |= dict.fromkeys(names, column)
            is_wanted = column.recorded or any(_is_match(text, *names) for text in wanted)
            if is_wanted and not column.ragged:
                made = Source(PluginColumn(short, *key[3:], column.doc), path, name)
                found.setdefault(key, made).blocks.update([block_name] * bool(block_name))
    for text in wanted:
        matches = [column for name, column in known.items() if _is_match(text, name)]
        if not matches:
            raise ParameterError(
                f"columns = {text!r} is no State or Output of a plugin{nearest_name(text, known)}; "
                f"there are: {listing(list(known)) or 'none'}"
            )
        if all(column.ragged for column in matches):
            raise ParameterError(f"columns = {text!r} is a list per entity; lists are not recorded")
    return _with_unique_names(list(found.values()))


def _is_match(text: str, *names: str) -> bool:
    return any(text == name or fnmatchcase(name, text) for name in names)


def _plugins(owner: Block | Plugin, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Paths and plugins of a block, each before those inside it."""
    for name, plugin in paths.inside(owner).items():
        yield (*path, name), plugin
        yield from _plugins(plugin, (*path, name))


def _components(plugin: Any, column: Numbers) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and units of the components of a column; those without a name are counted."""
    n = sum(row_shape(plugin, column))
    fields = column.fields + tuple(str(i) for i in range(len(column.fields), n))
    return fields, column.units + ("",) * (len(fields) - len(column.fields))


def _with_unique_names(sources: list[Source]) -> list[Source]:
    names = [source.column.name for source in sources]
    for source in sources:
        if names.count(source.column.name) > 1:
            name = f"{'+'.join(sorted(source.blocks)) or 'world'}.{source.column.name}"
            source.column = replace(source.column, name=name)
    return sources


class ColumnReader:
    """Reads the selected columns of all rows of a simulation.

    Args:
        sim: The simulation, see `recorder.Recorded`.
        sources: The columns.
    """

    def __init__(self, sim: Any, sources: Sequence[Source]) -> None:
        self._state, self.sources = sim.state, sources
        self._bindings: dict[Any, list[Any]] = {}
        self._world_plugins = {binding.spec.instance_name: binding for binding in sim.state.world_bindings}

    def read(self, parked: Any = None) -> list[Values]:
        """Values of each column for the rows of the body table, or for those of a world that has ended."""
        state = self._state
        groups = state.population.groups
        if parked is None:
            bodies = state.population.bodies
            tables = [(g, slice(g.first, g.last), g.table.arrays) for g in groups if g.n]
        else:
            bodies, by_key = parked.bodies, {g.key: g for g in groups}
            tables = [(by_key[key], rows, held.arrays) for key, (rows, held) in parked.tables.items()]
        found: list[Values] = []
        for number, source in enumerate(self.sources):
            column = source.column
            if not source.blocks:
                found.append((self._of_world(source, bodies, parked), np.ones(bodies.n, bool)))
                continue
            values = np.zeros((len(column.parts), bodies.n), column.dtype)
            has_value = np.zeros(bodies.n, bool)
            for group, rows, arrays in tables:
                binding = self._bindings_of(group)[number]
                if binding is None or source.attribute in binding.asked.skipped:
                    continue
                places = list(group.rows_of(binding, source.attribute))[: len(values)]
                values[: len(places), rows] = arrays[column.dtype][places]
                has_value[rows] = self._is_of(source, group, bodies.block[rows])
            found.append((values, has_value))
        return found

    def _of_world(self, source: Source, bodies: Any, parked: Any) -> np.ndarray[Any, Any]:
        """Values of a column of a world plugin, (k, n): of each entity, of its team, or of its world."""
        binding = self._world_plugins[source.path[0]]
        per, place = binding.places[source.attribute]
        own = parked.of_world[source.path[0]] if parked else binding.tables
        data: np.ndarray = own[per].arrays[place.dtype][place.first : place.first + max(1, place.k)]
        if per == "entity":
            return data
        world = np.zeros(bodies.n, int) if parked else bodies.world
        if type(binding.spec).columns[source.attribute].per == "team":
            data = data[np.searchsorted(self._state.context.teams, bodies.team), world]
            return data[None]
        return np.take(data, world, axis=1)

    def _is_of(self, source: Source, group: Any, block: np.ndarray) -> Any:
        """Whether the column is recorded of the entities of a group, whose block numbers are given."""
        if source.blocks.issuperset(group.names):
            return True
        names = self._state.context.block_names
        return np.isin(block, [names.index(name) for name in source.blocks])

    def _bindings_of(self, group: Any) -> list[Any]:
        """The plugin of each column in a group; None if the group does not have it."""
        if group not in self._bindings:
            by_path = {binding.path: binding for binding in group.walk()}
            self._bindings[group] = [by_path.get(source.path) for source in self.sources]
        return self._bindings[group]

    def left_out(self) -> list[str]:
        """A text about the columns that plugins leave out; none if there are none."""
        names = dict.fromkeys(
            f"{source.column.name} of {group.name}"
            for group, bindings in self._bindings.items()
            for source, binding in zip(self.sources, bindings, strict=True)
            if binding is not None and source.attribute in binding.asked.skipped
        )
        why = "not recorded, since no plugin of the entity reads them, so that they are not computed"
        return [f"{why}: {', '.join(names)}"] if names else []
