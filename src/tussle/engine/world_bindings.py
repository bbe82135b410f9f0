"""World plugins bound to a stack: parameters per world, and states per world, team or entity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tussle.api.bodies import read_only
from tussle.api.world import WorldView
from tussle.declare.columns import Handle, Input, Output, Param, Publish, State, Subscribe
from tussle.declare.comms import Publisher
from tussle.declare.lists import RaggedColumn
from tussle.engine.params import Overrides
from tussle.engine.table import ColumnPlace, Stored, Table
from tussle.errors import DeclarationError, TussleError, WiringError


def offer(
    services: dict[str, Callable[..., Any]], name: str, plugin: str, function: Callable[..., Any]
) -> None:
    """Add a service of a world plugin by "plugin.service", and by its own name unless several plugins offer it.

    Calling a name that several plugins offer raises an error that lists them.
    """
    several = name in services
    services[f"{plugin}.{name}"] = function
    if not several:
        services[name] = function
        return
    offered = [key for key in services if key.endswith(f".{name}")]

    def refuse(*args: Any, **kwargs: Any) -> Any:
        raise TussleError(f"several plugins offer the service {name!r}; call one of {', '.join(offered)}")

    services[name] = refuse


@dataclass
class WorldBinding:
    """One world plugin.

    Attributes:
        plugin: The bound copy.
        spec: The plugin as data.
        view: View that is passed to its `step`.
        tables: "world", "team" and "entity" -> its columns.
        places: Attribute -> (table, location of its column).
        memory: Location and default of each state that a reset restores.
    """

    plugin: Any
    spec: Any
    view: WorldView
    tables: dict[str, Table] = field(
        default_factory=lambda: {"world": Table(), "team": Table(), "entity": Table()}
    )
    places: dict[str, tuple[str, ColumnPlace]] = field(default_factory=dict)
    memory: list[tuple[ColumnPlace, Any]] = field(default_factory=list)

    @classmethod
    def bind(cls, spec: Any, view: WorldView, overrides: Overrides) -> WorldBinding:
        """Bind a plugin of the mission to all worlds.

        Raises:
            DeclarationError: It declares a column that only entity plugins can have.
            WiringError: A topic belongs to a network that does not exist.
        """
        world_binding = cls(spec.bound(), spec, view)
        n_worlds, n_teams = view.n_worlds, len(view.teams)
        for name, column in type(spec).columns.items():
            is_list = isinstance(column, State) and column.ragged
            if isinstance(column, (Input, Output, Handle)) or is_list:
                raise DeclarationError(
                    f"{type(spec).__name__}.{name}: a world plugin has no {'ragged ' * is_list}{type(column).__name__} columns"
                )
            if isinstance(column, Param) and column.ragged:
                own = [np.transpose(spec.values[name])] * n_worlds
                world_binding.plugin.__dict__[name] = RaggedColumn.from_rows(own, column).read_only()
            elif isinstance(column, Param) and column.structural:
                world_binding.plugin.__dict__[name] = spec.values[name]
            elif isinstance(column, Param) and column.is_row_data:
                world_binding._add("world", name, column.dtype, len(column.fields), column.default)
            elif isinstance(column, State):
                k = n_teams if column.per == "team" else len(column.fields)
                per = "world" if column.per == "team" else column.per
                world_binding._add(per, name, column.dtype, k, column.default)
                if per == "world":
                    world_binding.memory.append((world_binding.places[name][1], column.default))
            elif isinstance(column, Publish):
                topic = view.context.topic(column.network, column.topic, column.message, spec.instance_name)
                world_binding.plugin.__dict__[name] = Publisher(topic, view)
            elif isinstance(column, Subscribe):
                raise WiringError(
                    f"{spec.instance_name}.{name}: a world plugin reads w.inbox({column.message.__name__}) instead of a Subscribe"
                )
        if losses := getattr(type(spec), "losses", ()):  # not hashed: counting does not change a game
            world_binding._add("world", "link_counts", int, 1 + len(losses), 0)
            world_binding.memory.append((world_binding.places["link_counts"][1], 0))
        world_binding.tables["world"].allocate(n_worlds)
        world_binding.tables["entity"].allocate(view.n)
        world_binding.fill_params(overrides, np.arange(n_worlds))
        view.context.regions += spec.regions()
        view.context.scene = view.context.scene.with_parts(spec.walls(), spec.terrain())
        for service in type(spec).services:
            offer(view.context.services, service, spec.instance_name, getattr(world_binding.plugin, service))
        world_binding.attach()
        return world_binding

    def _add(self, per: str, name: str, dtype: type, k: int, default: Any) -> None:
        self.places[name] = (per, self.tables[per].add(name, dtype, k, default))

    def fill_params(self, overrides: Overrides, worlds: np.ndarray) -> None:
        """Set the parameters of some worlds."""
        name = self.spec.instance_name
        for key, column in type(self.spec).params().items():
            if column.is_row_data:
                array = self.tables["world"].array(self.places[key][1])
                array[..., worlds] = overrides.fill(name, (name,), key, self.spec.values[key], worlds)

    def reset(self, worlds: np.ndarray) -> None:
        """Reset the states of some worlds to the declared defaults."""
        for place, default in self.memory:
            several = np.reshape(default, (-1, 1)) if isinstance(default, tuple) else default
            self.tables["world"].array(place)[..., worlds] = several

    def rearrange(self, index: np.ndarray) -> None:
        """Reorder the states per entity, after the body table has been repacked."""
        if self.tables["entity"].places:
            self.tables["entity"].rearrange(index)
            self.attach()

    def attach(self) -> None:
        """Set the plugin's attributes to the current arrays."""
        declared = type(self.spec).columns
        for name, (per, place) in self.places.items():
            array = self.tables[per].array(place)
            is_param = isinstance(declared.get(name), Param)
            self.plugin.__dict__[name] = read_only(array) if is_param else array

    def take(self, rows: np.ndarray, world: int) -> dict[str, Stored]:
        """Copy the values of rows of the body table and of a world."""
        chosen = {"world": np.array([world]), "entity": rows}
        return {per: table.take(chosen[per]) for per, table in self.tables.items() if table.places}

    def copy(self) -> dict[str, Stored]:
        return {per: table.copy() for per, table in self.tables.items()}

    def restore(self, saved: dict[str, Stored]) -> None:
        for per, table in self.tables.items():
            table.restore(saved[per])
        self.attach()
