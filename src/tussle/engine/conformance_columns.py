"""A rule of the conformance kit: a plugin writes its own columns, and remembers nothing anywhere else."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from tussle.api import Interaction, MotionModel, Plugin
from tussle.api.bodies import FLOATS, STORED_INTS
from tussle.engine.conformance_declarations import MACHINERY, own_classes
from tussle.engine.conformance_game import SEEDS, STEPS, Game
from tussle.engine.conformance_traces import columns_of, first_difference
from tussle.engine.group import Binding, Group
from tussle.engine.referees import Referee
from tussle.engine.simulation import Simulation
from tussle.errors import ConformanceError

WRITES = "own columns"
MEMORY = "memory in columns"
BOUND = frozenset({"_values", "instance_name", "rate", "is_bound", "wired"})
ENTITY_HOOKS = ("spawn", "step", "from_body", "to_body")
WORLD_HOOKS = ("start", "step", "route", "result", "rejects")
BODY_ROWS = [name for name, k in FLOATS.items() for _ in range(k)]

Arrays = dict[str, tuple[np.ndarray, list[str]]]
Allowed = dict[str, np.ndarray]


def check_columns(game: Game) -> None:
    """In a short game, everything is compared before and after each call of the plugin.

    Raises:
        ConformanceError: The plugin has written into what is not its own, or holds what is not declared.
    """
    cls = type(game.plugin)
    with game.play(SEEDS[:1]) as sim:
        held = list(_watch(sim, cls))
        sim.reset([0])
        sim.step(STEPS)
        for plugin, hooks in held:
            extra = sorted(set(plugin.__dict__) - set(cls.columns) - BOUND - hooks)
            if extra:
                raise ConformanceError(
                    cls.__name__,
                    MEMORY,
                    f"{extra[0]} is held by the plugin object, which serves all entities; declare a State",
                )


def check_idle(game: Game) -> None:
    """A world plugin that says `is_idle` has a step that does nothing: the schedule leaves it out.

    Raises:
        ConformanceError: It does something.
    """
    cls = type(game.plugin)
    with game.play(SEEDS[:1]) as sim:
        sim.step(3)
        idle = [r for r in sim.referees if type(r.spec) is cls and getattr(r.plugin, "is_idle", False)]
        for referee in idle:
            view = sim.world_view
            before, asked = columns_of(sim, 0), [len(x) for x in (view.deaths, view.moved, view.births)]
            view.caller = referee.plugin
            referee.plugin.step(view)
            difference = first_difference(before, columns_of(sim, 0))
            if difference or asked != [len(x) for x in (view.deaths, view.moved, view.births)]:
                text = f"it says is_idle, but its step does something: {difference or 'it kills, moves or spawns'}"
                raise ConformanceError(cls.__name__, "idle", text)


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
        raise ConformanceError(
            cls.__name__,
            MEMORY,
            f"{changed[0]} has changed during a game; all simulations share the class, so declare a State",
        )


# -- the watch --------------------------------------------------------------------------------------------------------------------


def _watch(sim: Simulation, cls: type[Plugin]) -> Iterator[tuple[Any, set[str]]]:
    """Put a comparison around each hook of the bound plugins of a class; gives these, and the names of the hooks."""
    for number, group in enumerate(sim.population.groups):
        for binding in group.walk():
            if type(binding.spec) is cls:
                own = partial(_own, number, group, binding)
                yield binding.plugin, _guard(sim, binding.plugin, ENTITY_HOOKS, own)
    for referee in sim.referees:
        if type(referee.spec) is cls:
            yield referee.plugin, _guard(sim, referee.plugin, WORLD_HOOKS, partial(_of_world, sim, referee))


def _guard(
    sim: Simulation, plugin: Any, hooks: tuple[str, ...], allowed: Callable[[str], Allowed]
) -> set[str]:
    guarded = {hook for hook in hooks if hasattr(plugin, hook)}
    for hook in guarded:
        plugin.__dict__[hook] = _compared(sim, type(plugin).__name__, hook, getattr(plugin, hook), allowed)
    return guarded


def _compared(
    sim: Simulation, name: str, hook: str, call: Callable[..., Any], allowed: Callable[[str], Allowed]
) -> Callable[..., Any]:
    def compared(*args: Any) -> Any:
        before = {k: array.copy() for k, (array, _) in _everything(sim).items()}
        out = call(*args)
        own = allowed(hook)
        for key, (array, labels) in _everything(sim).items():
            if before[key].shape != array.shape:
                continue
            changed = (before[key] != array) & ~(np.isnan(before[key]) & np.isnan(array))
            if key in own:
                changed &= ~own[key]
            if changed.any():
                row = tuple(int(i[0]) for i in np.nonzero(changed))
                what = labels[row[0]] if labels else key
                values = f"{before[key][row]!r} became {array[row]!r}"
                raise ConformanceError(
                    name, WRITES, f"{hook} has written into {what}, which is not its own: {values}"
                )
        return out

    return compared


def _everything(sim: Simulation) -> Arrays:
    """All arrays of a simulation: name -> (array, names of its lines)."""
    bodies = sim.population.bodies
    found: Arrays = {"bodies": (bodies.floats, BODY_ROWS), "who is who": (bodies.ints, list(STORED_INTS))}
    for number, group in enumerate(sim.population.groups):
        for dtype, array in group.table.arrays.items():
            found[f"group {number} {dtype.__name__}"] = array, _labels(group, dtype, len(array))
    for number, referee in enumerate(sim.referees):
        for per, table in referee.tables.items():
            for dtype, array in table.arrays.items():
                places = {
                    k: p for k, (where, p) in referee.places.items() if where == per and p.dtype is dtype
                }
                labels = _lines(
                    {f"{referee.spec.instance_name}.{k}": p for k, p in places.items()}, len(array)
                )
                found[f"referee {number} {per} {dtype.__name__}"] = array, labels
    found["clock"] = sim.context.clock.step[None, :], ["the clock"]
    found["seeds"] = sim.context.seeds[None, :], ["the seeds"]
    return found


def _labels(group: Group, dtype: type, n: int) -> list[str]:
    named = {
        f"{group.name}.{'.'.join(b.path)}.{k}": p
        for b in group.walk()
        for k, p in b.places.items()
        if p.dtype is dtype
    }
    return _lines(named, n)


def _lines(places: dict[str, Any], n: int) -> list[str]:
    lines = ["a column of another"] * n
    for name, place in places.items():
        for line in range(place.first, place.first + max(1, place.k)):
            lines[line] = name
    return lines


def _own(number: int, group: Group, binding: Binding, hook: str) -> Allowed:
    """Lines of the arrays that a plugin of an entity may change in a hook; a whole number of lines of its group's table."""
    allowed: Allowed = {}
    for inner in binding.walk():
        for name in inner.writable:
            place = inner.places[name]
            key = f"group {number} {place.dtype.__name__}"
            array = group.table.arrays[place.dtype]
            mask = allowed.setdefault(key, np.zeros(array.shape, bool))
            mask[place.first : place.first + max(1, place.k)] = True
    if isinstance(binding.spec, MotionModel) and hook == "to_body":
        mask = np.zeros(group.bodies.floats.shape, bool)
        for line, name in enumerate(BODY_ROWS):
            mask[line, group.first : group.last] = name in {"pos", "vel", "quat", "omega"}
        allowed["bodies"] = mask
    return allowed


def _of_world(sim: Simulation, referee: Referee, hook: str) -> Allowed:
    """The same for a world plugin: its memory, and for an interaction what it may do to bodies."""
    number = sim.referees.index(referee)
    allowed: Allowed = {}
    for name in type(referee.spec).states() if hook in {"start", "step"} else ():
        per, place = referee.places[name]
        key = f"referee {number} {per} {place.dtype.__name__}"
        mask = allowed.setdefault(key, np.zeros(referee.tables[per].arrays[place.dtype].shape, bool))
        mask[place.first : place.first + max(1, place.k)] = True
    if isinstance(referee.spec, Interaction) and hook in {"start", "step"}:
        mask = np.zeros(sim.population.bodies.floats.shape, bool)
        moved = np.unique(np.concatenate([np.zeros(0, np.int64), *sim.world_view.moved]))
        for line, name in enumerate(BODY_ROWS):
            if name in {"pos", "vel", "quat"}:
                mask[line, moved] = True  # by w.move, which tells the motion models
            else:
                mask[line] = name in {"health", "force", "torque"}
        allowed["bodies"] = mask
    return allowed
