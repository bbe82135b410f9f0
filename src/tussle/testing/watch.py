"""Rules of the conformance kit about single calls: a plugin writes its own columns, remembers nothing elsewhere, draws no number twice."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from tussle.api import GroupView, Interaction, MotionModel, Plugin, WorldView
from tussle.api.pairs import Pairs
from tussle.engine.group import Binding, Group
from tussle.engine.referees import Referee
from tussle.engine.simulation import Simulation
from tussle.errors import ConformanceError
from tussle.testing.declarations import MACHINERY, own_classes
from tussle.testing.game import SEEDS, STEPS, Game
from tussle.testing.lines import BODY_ROWS, Key, keys_of, lines_of

MEMORY = "memory in columns"
BOUND = frozenset({"_values", "instance_name", "rate", "is_bound", "is_for_one", "wired", "_look"})
HOOKS = ("spawn", "step", "from_body", "to_body", "start", "route", "result_of", "rejects")
DRAWS = ("uniform", "normal", "normal_pairs", "uniform_pairs", "uniform_by")

Own = dict[Key, Any]
"""Lines that a hook may write -> which rows of them."""


def check_calls(game: Game) -> None:
    """In a short game, everything is compared before and after each call of the plugin, and its draws are noted.

    Raises:
        ConformanceError: The plugin has written into what is not its own, holds what is not declared, or has drawn a number twice.
    """
    cls = type(game.plugin)
    with game.play(SEEDS[:1]) as sim:
        watches = [Watch(sim, *found) for found in _bound(sim, cls)]
        sim.reset([0])
        sim.step(STEPS)
        for watch in watches:
            own = watch.plugin.__dict__
            own = (
                {**own, **own["_look"].author.__dict__} if "_look" in own else own
            )  # easy mode: what its author knows as self
            extra = sorted(set(own) - set(cls.columns) - BOUND - set(HOOKS))
            if extra:
                text = f"{extra[0]} is held by the plugin object, which serves all entities; declare a State"
                raise ConformanceError(cls.__name__, MEMORY, text)


def class_values(cls: type[Plugin]) -> dict[str, Any]:
    """What stands on the class and its own bases now."""
    return {
        f"{base.__name__}.{k}": v
        for base in own_classes(cls)
        for k, v in vars(base).items()
        if k not in MACHINERY and not k.startswith("__")
    }


def check_class_values(cls: type[Plugin], before: dict[str, Any]) -> None:
    """Nothing on the class has changed while it was played.

    Raises:
        ConformanceError: Something has.
    """
    after = class_values(cls)
    changed = [k for k in after if k not in before or after[k] is not before[k]]
    if changed:
        text = f"{changed[0]} has changed during a game; all simulations share the class, so declare a State"
        raise ConformanceError(cls.__name__, MEMORY, text)


def _bound(sim: Simulation, cls: type[Plugin]) -> Iterator[tuple[Any, Callable[[str], Own]]]:
    """The bound plugins of a class, each with what its hooks may write."""
    for group in sim.state.population.groups:
        for binding in group.walk():
            if type(binding.spec) is cls:
                yield binding.plugin, partial(_own, group, binding)
    for referee in sim.state.referees:
        if type(referee.spec) is cls:
            yield referee.plugin, partial(_own_of_world, sim, referee)


class Watch:
    """Stands around each hook of a bound plugin.

    Args:
        sim: Its simulation.
        plugin: The plugin.
        own: What a hook may write.
    """

    def __init__(self, sim: Simulation, plugin: Any, own: Callable[[str], Own]) -> None:
        self.sim, self.plugin, self.own = sim, plugin, own
        self.drawn: dict[Key, tuple[str, int]] = {}
        self.calls = 0
        for hook in HOOKS:
            if hasattr(plugin, hook):
                plugin.__dict__[hook] = self._watched(hook, getattr(plugin, hook))

    def _error(self, rule: str, text: str) -> ConformanceError:
        return ConformanceError(type(self.plugin).__name__, rule, text)

    def _watched(self, hook: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def watched(view: GroupView, *args: Any) -> Any:
            self.calls += 1
            for law in DRAWS:
                if hasattr(view, law):
                    view.__dict__[law] = self._noted(view, hook, getattr(type(view), law))
            lines = lines_of(self.sim)
            before = {key: line.values.copy() for key, line in lines.items()}
            try:
                out = call(view, *args)
            finally:
                for law in DRAWS:
                    view.__dict__.pop(law, None)
            own = self.own(hook)
            for key, line in lines.items():
                old, new = before[key], line.values
                changed = (old != new) & ~(np.isnan(old) & np.isnan(new))
                changed[own.get(key, slice(0))] = False
                if changed.any():
                    row = int(np.flatnonzero(changed)[0])
                    text = f"{hook} has written into {line.name}, which is not its own: {old[row]!r} became {new[row]!r}"
                    raise self._error("own columns", text)
            return out

        return watched

    def _noted(self, view: GroupView, hook: str, law: Callable[..., Any]) -> Callable[..., Any]:
        """A law of chance that refuses to give the numbers again which it, or the other law, has given in the same step."""

        def draw(*args: Any, **kwargs: Any) -> Any:
            given = inspect.signature(law).bind(view, *args, **kwargs).arguments
            label, step = given["label"], self.sim.state.context.clock.step.tobytes()
            keys = [v for k, v in given.items() if k not in {"self", "label", "law", "k"}]
            of = [v.other.tobytes() if isinstance(v, Pairs) else np.asarray(v).tobytes() for v in keys]
            key, now = (
                (label, getattr(view._caller, "instance_name", ""), step, view.substep, *of),
                (hook, self.calls),
            )
            first = self.drawn.setdefault(key, now)
            # A hook may be called for some rows now and for others later in a step.
            if first is not now and (first == now or first[0] != hook):
                raise self._error(
                    "draws",
                    f"{hook} draws {label!r} again in a step, which gives the same numbers; use another label",
                )
            return law(view, *args, **kwargs)

        return draw


def _own(group: Group, binding: Binding, hook: str) -> Own:
    """What a plugin of an entity may write."""
    own: Own = {
        key: slice(None)
        for b in binding.walk()
        for k in b.writable.intersection(b.places)
        for key in keys_of(group.table, b.places[k])
    }
    if isinstance(binding.spec, MotionModel) and hook == "to_body":
        rows = slice(group.first, group.last)
        own |= {("body", i): rows for i, k in enumerate(BODY_ROWS) if k in {"pos", "vel", "quat", "omega"}}
    return own


def _own_of_world(sim: Simulation, referee: Referee, hook: str) -> Own:
    """What a world plugin may write: its memory, and as an interaction health and forces, and places by `w.move`."""
    if hook not in {"start", "step"}:
        return {}
    places = [referee.places[name] for name in type(referee.spec).states()]
    own: Own = {key: slice(None) for per, place in places for key in keys_of(referee.tables[per], place)}
    if isinstance(referee.spec, Interaction):
        view: WorldView = sim.state.world_view
        moved = np.unique(np.concatenate([np.zeros(0, np.int64), *view.moved]))
        own |= {("body", i): moved for i, k in enumerate(BODY_ROWS) if k in {"pos", "vel", "quat"}}
        own |= {
            ("body", i): slice(None) for i, k in enumerate(BODY_ROWS) if k in {"health", "force", "torque"}
        }
    return own
