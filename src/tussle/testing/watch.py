"""Rules of the conformance kit for single calls: a plugin writes only its own columns, stores nothing elsewhere, and repeats no draw."""

from __future__ import annotations

import inspect
import pickle
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np

from tussle.api import GroupView, Interaction, MotionModel, Plugin, WorldView
from tussle.api.pairs import Pairs
from tussle.declare.columns import Column
from tussle.engine.group import Binding, Group
from tussle.engine.simulation import Simulation
from tussle.engine.world_bindings import WorldBinding
from tussle.errors import ConformanceError
from tussle.testing.declarations import MACHINERY, own_classes
from tussle.testing.game import SEEDS, STEPS, ConformanceGame
from tussle.testing.lines import BODY_ROWS, Key, keys_of, lines_of

MEMORY = "memory in columns"
BOUND = frozenset(
    {
        "link_counts",
        "_values",
        "_stated",
        "instance_name",
        "rate",
        "active_in",
        "is_bound",
        "is_for_one",
        "wired",
        "_look",
        "_rows",
    }
)
HOOKS = ("spawn", "step", "from_body", "to_body", "start", "transmit", "result_of", "rejects")
DRAWS = ("uniform", "normal", "normal_pairs", "uniform_pairs", "uniform_by", "normal_by")

Own = dict[Key, Any]
"""Lines that a hook may write -> their rows that it may write."""


def check_calls(game: ConformanceGame) -> None:
    """Play a short game; compare all data before and after each call of the plugin, and record its draws.

    Raises:
        ConformanceError: The plugin wrote into a column of others, stores an undeclared attribute, or repeated a draw.
    """
    cls = type(game.plugin)
    with game.play(SEEDS[:1]) as sim:
        watches = [Watch(sim, *found) for found in _bound(sim, cls)]
        sim.reset([0])
        sim.step(STEPS)
        for watch in watches:
            own = watch.plugin.__dict__
            if "_look" in own:  # easy mode: the author's `self`
                own = own | own["_look"].author.__dict__
            extra = sorted(set(own) - set(cls.columns) - BOUND - set(HOOKS))
            if extra:
                text = f"{extra[0]} is stored on the plugin object, which all entities share; declare a State"
                raise ConformanceError(cls.__name__, MEMORY, text)


def class_values(cls: type[Plugin]) -> dict[str, tuple[Any, bytes]]:
    """Attributes of the class and its own bases, each with its contents."""
    return {
        f"{base.__name__}.{k}": (v, _contents(v))
        for base in own_classes(cls)
        for k, v in vars(base).items()
        if k not in MACHINERY and not k.startswith("__")
    }


def _contents(value: Any) -> bytes:
    """What an attribute holds, such as the items of a queue or the attributes of an object; empty where that cannot be told."""
    for held in (value, getattr(value, "__dict__", None)):
        if not isinstance(held, type | Column):
            with suppress(Exception):  # what cannot be pickled raises anything
                return pickle.dumps((held, getattr(held, "__dict__", None)))
    return b""


def check_class_values(cls: type[Plugin], before: dict[str, tuple[Any, bytes]]) -> None:
    """No attribute of the class changed during a game, nor what it holds.

    Raises:
        ConformanceError: An attribute changed.
    """
    after = class_values(cls)
    changed = [
        k
        for k, (value, held) in after.items()
        if k not in before or value is not before[k][0] or held != before[k][1]
    ]
    if changed:
        text = f"{changed[0]} changed during a game; all simulations share the class, so declare a State"
        raise ConformanceError(cls.__name__, MEMORY, text)


def _bound(sim: Simulation, cls: type[Plugin]) -> Iterator[tuple[Any, Callable[[str], Own]]]:
    """The bound plugins of a class, each with a function that returns what a hook may write."""
    for group in sim.state.population.groups:
        for binding in group.walk():
            if type(binding.spec) is cls:
                yield binding.plugin, partial(_own, group, binding)
    for world_binding in sim.state.world_bindings:
        if type(world_binding.spec) is cls:
            yield world_binding.plugin, partial(_own_of_world, sim, world_binding)


class Watch:
    """Wraps each hook of a bound plugin with checks.

    Args:
        sim: The simulation.
        plugin: The plugin.
        own: Returns what a hook may write.
    """

    def __init__(self, sim: Simulation, plugin: Any, own: Callable[[str], Own]) -> None:
        self.sim, self.plugin, self.own = sim, plugin, own
        self.drawn: dict[Key, tuple[str, int]] = {}
        self.calls = 0
        for hook in HOOKS:
            if callable(getattr(plugin, hook, None)):  # else a column of this name
                plugin.__dict__[hook] = self._watched(hook, getattr(plugin, hook))

    def _error(self, rule: str, text: str) -> ConformanceError:
        return ConformanceError(type(self.plugin).__name__, rule, text)

    def _watched(self, hook: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def watched(view: GroupView, *args: Any) -> Any:
            self.calls += 1
            for law in DRAWS:
                if hasattr(view, law):
                    view.__dict__[law] = self._recorded(view, hook, getattr(type(view), law))
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
                    text = f"{hook} wrote into {line.name}, which is not its own: {old[row]!r} became {new[row]!r}"
                    raise self._error("own columns", text)
            return out

        return watched

    def _recorded(self, view: GroupView, hook: str, law: Callable[..., Any]) -> Callable[..., Any]:
        """A draw function that refuses to repeat the numbers that it, or another one, gave in the same step."""

        def draw(*args: Any, **kwargs: Any) -> Any:
            given = inspect.signature(law).bind(view, *args, **kwargs).arguments
            label, step = given["label"], self.sim.state.context.clock.step.tobytes()
            keys = [v for k, v in given.items() if k not in {"self", "label", "law", "k"}]
            of = [v.other.tobytes() if isinstance(v, Pairs) else np.asarray(v).tobytes() for v in keys]
            key = label, getattr(view._caller, "instance_name", ""), step, view.substep, *of
            now = hook, self.calls
            first = self.drawn.setdefault(key, now)
            # A hook may be called several times in a step, for different rows.
            if first is not now and (first == now or first[0] != hook):
                text = (
                    f"{hook} draws {label!r} again in a step, which gives the same numbers; use another label"
                )
                raise self._error("draws", text)
            return law(view, *args, **kwargs)

        return draw


def _own(group: Group, binding: Binding, hook: str) -> Own:
    """The arrays that an entity's plugin may write."""
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


def _own_of_world(sim: Simulation, world_binding: WorldBinding, hook: str) -> Own:
    """The arrays that a world plugin may write: its states; an interaction also health, forces, and bodies moved by `w.move`."""
    if hook not in {"start", "step", "transmit"}:
        return {}
    places = [world_binding.places[name] for name in type(world_binding.spec).states()]
    own: Own = {
        key: slice(None) for per, place in places for key in keys_of(world_binding.tables[per], place)
    }
    if isinstance(world_binding.spec, Interaction):
        view: WorldView = sim.state.world_view
        moved = np.unique(np.concatenate([np.zeros(0, np.int64), *view.moved]))
        own |= {("body", i): moved for i, k in enumerate(BODY_ROWS) if k in {"pos", "vel", "quat"}}
        own |= {
            ("body", i): slice(None) for i, k in enumerate(BODY_ROWS) if k in {"health", "force", "torque"}
        }
    return own
