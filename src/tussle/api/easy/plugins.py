"""Base classes of easy-mode plugins."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, ClassVar

import numpy as np

from tussle.api.easy.entities import Me
from tussle.api.easy.shared import Shared
from tussle.api.easy.values import make_type
from tussle.api.easy.worlds import WorldShared, make_world_types
from tussle.api.group import GroupView
from tussle.api.kinds import (
    Autonomy,
    Controller,
    EntityPlugin,
    Interaction,
    Metric,
    Sensor,
    WorldPlugin,
    named,
    number,
)
from tussle.api.plugin import Plugin
from tussle.api.world import WorldView
from tussle.declare.columns import Param
from tussle.errors import ParameterError, listed, nearest_name

NUMBERS = "a number, or {team: number}"
"""What a result of one world may be."""


class EasyPlugin(Plugin):
    """A plugin called for one entity or one world at a time; abstract."""

    called_for: ClassVar[str]
    argument: ClassVar[str]
    """Name of the hook's argument that holds the columns: "me" or "w"."""

    def _author_self(self) -> Any:
        """The `self` of the author's methods: a copy of the plugin without its column arrays."""
        author = object.__new__(type(self))
        own = {k: v for k, v in self.__dict__.items() if k not in type(self).columns}
        own |= {k: self.__dict__[k] for k, c in self.columns.items() if isinstance(c, Param) and c.structural}
        author.__dict__.update(own, _values=_ColumnGuard(type(self)), is_for_one=True)
        return author

    def _write_of(self, name: str) -> str:
        return f"{self.argument}.{name} = value"

    def __getattr__(self, name: str) -> Any:
        if name in type(self).columns and "is_for_one" in self.__dict__:
            _ColumnGuard(type(self))[name]
        return super().__getattr__(name)


class _ColumnGuard(dict[str, Any]):
    """Raise an error when a column is read from the author's `self`: its value differs between entities or worlds."""

    def __init__(self, cls: type[EasyPlugin]) -> None:
        super().__init__()
        self._cls = cls

    def __missing__(self, name: str) -> Any:
        raise AttributeError(
            f"{self._cls.__name__}.{name} differs between {self._cls.called_for}: read {self._cls.argument}.{name}, not self.{name}"
        )


class EasyEntityPlugin(EasyPlugin, EntityPlugin):
    """A plugin of an entity, called for one entity at a time; abstract. Implement `step_one` and, if needed, `spawn_one`."""

    argument, called_for = "me", "entities"
    me_type: ClassVar[type[Me]] = Me

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.me_type = make_type(Me, cls.columns, cls.__name__)

    def spawn_one(self, me: Any) -> None:
        """Initialize columns of a new entity that need other values than their declared defaults."""

    def step_one(self, me: Any) -> None:
        """One step of one entity: read and write columns as attributes of `me` (see `Me`)."""
        raise TypeError(f"{type(self).__name__} has no step_one")

    def _begin(self, g: GroupView, hook: str = "") -> Shared:
        own = self.__dict__
        shared: Shared | None = own.get("_look")
        if shared is None or shared.g is not g or shared.bodies is not g.bodies:
            shared = own["_look"] = Shared(self, g)
        shared.begin(hook)
        return shared

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        if type(self).spawn_one is not EasyEntityPlugin.spawn_one:
            shared = self._begin(g, "spawn ")
            for row in rows.tolist():
                shared.author.spawn_one(shared.entities[row])

    def step(self, g: GroupView) -> None:
        shared = self._begin(g)
        step_one, me = shared.author.step_one, None
        try:
            for me in shared.entities:
                step_one(me)
        except Exception:
            g.failing_row = me._row if me is not None else None
            raise


class EasyAutonomy(EasyEntityPlugin, Autonomy):
    """An autonomy called for one entity at a time; abstract. Implement `step_one`."""


class EasyController(EasyEntityPlugin, Controller):
    """A controller called for one entity at a time, in every substep; abstract. Implement `step_one`."""


class EasySensor(EasyEntityPlugin, Sensor):
    """A sensor called for one entity at a time; abstract. Implement `step_one`."""


class EasyWorldPlugin(EasyPlugin, WorldPlugin):
    """A world plugin called for one world at a time; abstract. Implement `start_one`, `step_one` or `result_one`."""

    argument, called_for = "w", "worlds"
    world_types: ClassVar[tuple[type, type]]

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.world_types = make_world_types(cls.columns, cls.__name__)
        if cls.step_one is not EasyWorldPlugin.step_one:  # the schedule skips plugins without a step
            cls.step = cls._step_each  # type: ignore[assignment, method-assign]

    def start_one(self, w: Any) -> None:
        """Called once when a world starts, after its first entities are placed."""

    def step_one(self, w: Any) -> None:
        """One step of one world: read and write columns as attributes of `w` (see `OneWorld`)."""

    def result_one(self, w: Any) -> Mapping[str, Any]:
        """Results of one world: name -> a number, or {team: number}."""
        return {}

    def _each(self, w: WorldView, hook: str, worlds: Iterable[int]) -> None:
        shared = WorldShared(self, w, "" if hook == "step_one" else f"{hook} ")
        call = getattr(shared.author, hook)
        for world in worlds:
            try:
                call(shared.world(world))
            except Exception:
                w.failing_world = world
                raise

    def start(self, w: WorldView) -> None:
        if type(self).start_one is not EasyWorldPlugin.start_one:
            self._each(w, "start_one", w.active_worlds())

    def _step_each(self, w: WorldView) -> None:
        self._each(w, "step_one", w.active_worlds())

    def result_of(self, w: WorldView, world: int) -> dict[str, Any]:
        shared = WorldShared(self, w, "result_one ")
        found = named(shared.author.result_one(shared.world(world)), f"{type(self).__name__}.result_one")
        return {name: self._reported(name, value, shared.teams) for name, value in found.items()}

    def _reported(self, name: str, value: Any, teams: Iterable[int]) -> Any:
        where = f"{type(self).__name__}.result_one: {name!r}"
        if not isinstance(value, Mapping):
            if name == "score" and isinstance(self, Metric):
                raise ParameterError(
                    f"{where} = {value!r} is not allowed; it takes {{team: number}}, with a number for each team"
                )
            return number(value, where, NUMBERS)
        for team in teams:
            if team not in value:
                raise ParameterError(f"{where} has no value for team {team}; it takes a number for each team")
        names = [str(team) for team in teams]
        for team in value:
            if str(team) not in names:
                raise ParameterError(
                    f"{where}: there is no team {team!r}{nearest_name(str(team), names)}; {listed(names)}"
                )
        return {team: number(value[team], where, NUMBERS) for team in teams}


class EasyInteraction(EasyWorldPlugin, Interaction):
    """An interaction called for one world at a time; abstract. Implement `step_one`."""


class EasyMetric(EasyWorldPlugin, Metric):
    """A metric called for one world at a time; abstract. The result "score", {team: number}, decides the winner."""
