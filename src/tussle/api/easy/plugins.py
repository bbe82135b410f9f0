"""The kinds of plugin of easy mode, which an author derives from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, ClassVar

import numpy as np

from tussle.api.easy.entities import Me
from tussle.api.easy.looks import Look
from tussle.api.easy.values import make_type
from tussle.api.easy.worlds import WorldLook, make_world_types
from tussle.api.group import GroupView
from tussle.api.kinds import Autonomy, Controller, EntityPlugin, Interaction, Metric, Sensor, WorldPlugin
from tussle.api.plugin import Plugin
from tussle.api.world import WorldView
from tussle.columns import Param
from tussle.errors import ParameterError, listed, nearest_name


class EasyPlugin(Plugin):
    """A plugin that is called for one entity or one world at a time; abstract."""

    writes_as: ClassVar[str]
    """What the author writes in place of `self` for a column."""

    def _for_one(self) -> Any:
        """What the author knows as `self`: the plugin without its arrays, which are of all entities and all worlds."""
        author = object.__new__(type(self))
        own = {k: v for k, v in self.__dict__.items() if k not in type(self).columns}
        own |= {k: self.__dict__[k] for k, c in self.columns.items() if isinstance(c, Param) and c.structural}
        author.__dict__.update(own, _values=_OfOne(type(self)), is_for_one=True)
        return author

    def _write_of(self, name: str) -> str:
        return f"{self.writes_as}.{name} = value"

    def __getattr__(self, name: str) -> Any:
        if name in type(self).columns and "is_for_one" in self.__dict__:
            _OfOne(type(self))[name]
        return super().__getattr__(name)


class _OfOne(dict[str, Any]):
    """Stands for the parameters in an author's `self`: each entity has its own."""

    def __init__(self, cls: type[EasyPlugin]) -> None:
        super().__init__()
        self._cls = cls

    def __missing__(self, name: str) -> Any:
        raise AttributeError(
            f"{self._cls.__name__}.{name} has a value of its own for each: read {self._cls.writes_as}.{name}, not self.{name}"
        )


class EasyEntityPlugin(EasyPlugin, EntityPlugin):
    """A plugin of an entity, called for one entity at a time; abstract. Fill in `step_one`, and `spawn_one` where need be."""

    writes_as = "me"
    me_type: ClassVar[type[Me]] = Me

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.me_type = make_type(Me, cls.columns, cls.__name__)

    def spawn_one(self, me: Any) -> None:
        """Set the columns of a new entity where their declared defaults do not do."""

    def step_one(self, me: Any) -> None:
        """One step of one entity: read and write columns as attributes of `me` (see `Me`)."""
        raise TypeError(f"{type(self).__name__} has no step_one")

    def _look_at(self, g: GroupView, hook: str = "") -> Look:
        own = self.__dict__
        look: Look | None = own.get("_look")
        if look is None or look.g is not g or look.bodies is not g.bodies:
            look = own["_look"] = Look(self, g)
        look.begin(hook)
        return look

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        if type(self).spawn_one is not EasyEntityPlugin.spawn_one:
            look = self._look_at(g, "spawn ")
            for row in rows.tolist():
                look.author.spawn_one(look.everyone[row])

    def step(self, g: GroupView) -> None:
        look = self._look_at(g)
        step_one, me = look.author.step_one, None
        try:
            for me in look.everyone:
                step_one(me)
        except Exception:
            g.failing_row = me._row if me is not None else None
            raise


class EasyAutonomy(EasyEntityPlugin, Autonomy):
    """Decides for one entity at a time; abstract. Fill in `step_one`."""


class EasyController(EasyEntityPlugin, Controller):
    """Controls one entity at a time, in every substep; abstract. Fill in `step_one`."""


class EasySensor(EasyEntityPlugin, Sensor):
    """Measures for one entity at a time; abstract. Fill in `step_one`."""


class EasyWorldPlugin(EasyPlugin, WorldPlugin):
    """A plugin of the world, called for one world at a time; abstract. Fill in `start_one`, `step_one` or `result_one`."""

    writes_as = "w"
    world_types: ClassVar[tuple[type, type]]

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.world_types = make_world_types(cls.columns, cls.__name__)
        if cls.step_one is not EasyWorldPlugin.step_one:  # the schedule leaves out who has no step
            cls.step = cls._step_each  # type: ignore[assignment, method-assign]

    def start_one(self, w: Any) -> None:
        """Called once for a world that begins, after its first entities are placed."""

    def step_one(self, w: Any) -> None:
        """One step of one world: read and write columns as attributes of `w` (see `OneWorld`)."""

    def result_one(self, w: Any) -> Mapping[str, Any]:
        """Values to report of one world: name -> a number, or {team: number}."""
        return {}

    def _each(self, w: WorldView, hook: str, worlds: Iterable[int]) -> None:
        look = WorldLook(self, w, "" if hook == "step_one" else f"{hook} ")
        call = getattr(look.author, hook)
        for world in worlds:
            try:
                call(look.world(world))
            except Exception:
                w.failing_world = world
                raise

    def start(self, w: WorldView) -> None:
        if type(self).start_one is not EasyWorldPlugin.start_one:
            self._each(w, "start_one", w.spoken_for())

    def _step_each(self, w: WorldView) -> None:
        self._each(w, "step_one", w.spoken_for())

    def result_of(self, w: WorldView, world: int) -> dict[str, Any]:
        look = WorldLook(self, w, "result_one ")
        found = look.author.result_one(look.world(world))
        return {name: self._reported(name, value, look.teams) for name, value in found.items()}

    def _reported(self, name: str, value: Any, teams: Iterable[int]) -> Any:
        where = f"{type(self).__name__}.result_one: {name!r}"
        if not isinstance(value, Mapping):
            if name == "score" and isinstance(self, Metric):
                raise ParameterError(
                    f"{where} = {value!r} is not allowed; it takes {{team: number}}, one for each team"
                )
            return _number(where, value)
        for team in teams:
            if team not in value:
                raise ParameterError(f"{where} says nothing of team {team}; it takes a number for each team")
        names = [str(team) for team in teams]
        for team in value:
            if str(team) not in names:
                raise ParameterError(
                    f"{where}: there is no team {team!r}{nearest_name(str(team), names)}; {listed(names)}"
                )
        return {team: _number(where, value[team]) for team in teams}


def _number(where: str, value: Any) -> Any:
    number = value.item() if isinstance(value, np.generic) else value
    if not isinstance(number, (bool, int, float)):
        raise ParameterError(f"{where} = {value!r} is not allowed; it takes a number, or {{team: number}}")
    return number


class EasyInteraction(EasyWorldPlugin, Interaction):
    """Acts between the entities of one world at a time; abstract. Fill in `step_one`."""


class EasyMetric(EasyWorldPlugin, Metric):
    """Counts and scores in one world at a time; abstract. A result "score", {team: number}, decides who wins."""
