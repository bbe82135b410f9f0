"""The path language: names joined by dots, as in "run.dt", "prey.count", "prey.Boids.max_speed", "SimpleCapture.capture_range".

A path names an owner (the run, a block, a world plugin), then plugins inside it, then one value of the last owner. The values of an
owner depend on the use: settings of a mission, columns of a simulation, tags of a file.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import fields
from typing import Any, NamedTuple

from tussle.api.plugin import RESERVED, Plugin
from tussle.declare.columns import Param
from tussle.declare.texts import shown
from tussle.errors import ParameterError, TussleError, clipped, listed, nearest_name
from tussle.mission.spec import BLOCK_VALUES, MISSION_VALUES, RUN, Block, Mission


def resolve(
    path: str,
    start: Any,
    inside: Callable[[Any], Mapping[str, Any]],
    values: Callable[[Any], Collection[str] | None],
) -> tuple[list[Any], str]:
    """Resolve a path to its owners, from the outermost to that of the value, and the value's name.

    Args:
        path: The path.
        start: Owner that all paths start from.
        inside: Returns the members of an owner, by name.
        values: Returns the names of an owner's values; None if any name is allowed.

    Raises:
        ParameterError: A name is not found; the message names it, the existing names and the nearest one.
    """
    if not isinstance(path, str):
        raise ParameterError(f"{path!r:.60} is no path; it takes a text such as 'prey.Boids.max_speed'")
    *names, last = path.split(".")
    owners, owner, label = [], start, "the mission"
    for name in names:
        members = inside(owner)
        if name not in members:
            raise _absent(path, label, name, members)
        owner, label = members[name], name
        owners.append(owner)
    allowed, members = values(owner), inside(owner)
    if allowed is not None and last not in allowed:
        if last in members:
            raise ParameterError(
                f"{shown(path)} is not a value; in {last} {listed(values(members[last]) or ())}"
            )
        raise _absent(path, label, last, (*allowed, *members))
    return owners, last


def _absent(path: str, owner: str, name: str, known: Collection[str]) -> ParameterError:
    return ParameterError(
        f"{shown(path)}: {clipped(owner)} has no {clipped(name)!r}{nearest_name(name, known)}; {listed(known)}"
    )


# -- in a mission -----------------------------------------------------------------------------------------------------------


class MissionRoot(NamedTuple):
    """Start of all paths into a mission; the name "run" in it is the mission itself."""

    mission: Mission


def inside(owner: Any) -> dict[str, Any]:
    """Return the members of an owner: run, blocks and world plugins of the root; plugins of a block; plugins inside a plugin."""
    if isinstance(owner, MissionRoot):
        mission = owner.mission
        return {
            RUN: mission,
            **{b.name: b for b in mission.blocks},
            **{p.instance_name: p for p in mission.world_plugins},
        }
    if isinstance(owner, Mission):
        return {}
    plugins = (
        owner.plugins if isinstance(owner, Block) else [p for k in owner.children() for p in owner.values[k]]
    )
    return {p.instance_name: p for p in plugins}


def settable(owner: Any) -> tuple[str, ...]:
    """Return the names that can be set in an owner: attributes of `Mission` and `Block`, parameters of plugins."""
    if isinstance(owner, Plugin):
        return (*owner.params(), *owner.children(), *RESERVED)
    return () if isinstance(owner, MissionRoot) else tuple(f.name for f in fields(owner))


def declared(owner: Any, name: str) -> Param | None:
    """Return the declaration of a value; None if it is neither a number nor a text."""
    if isinstance(owner, Plugin):
        return owner.params().get(name)
    return (MISSION_VALUES if isinstance(owner, Mission) else BLOCK_VALUES).get(name)


def values_of(mission: Mission) -> dict[str, Any]:
    """Every value of a mission by its path, such as "prey.Boids.gain"; of a plugin its class."""
    found: dict[str, Any] = {}

    def walk(path: tuple[str, ...], owner: Any) -> None:
        for name in settable(owner):
            value = owner.values.get(name) if isinstance(owner, Plugin) else getattr(owner, name)
            if not any(
                isinstance(each, Plugin | Block) for each in (value if isinstance(value, tuple) else (value,))
            ):
                found[".".join([*path, name])] = value
        for name, member in inside(owner).items():
            found[".".join([*path, name])] = type(member)
            walk((*path, name), member)

    walk((), MissionRoot(mission))
    return found


def with_value(mission: Mission, path: str, value: Any) -> Mission:
    """Return a copy of a mission with one value changed: a number is SI, a text is read as in a mission file.

    Raises:
        ParameterError: The path does not exist, or the value is not allowed.
        MissionError: The mission is invalid with this value.
    """
    owners, name = resolve(path, MissionRoot(mission), inside, settable)
    try:
        new = owners[-1].replace(**{name: value})
    except TussleError as error:
        raise type(error)(f"{path!r}: {error}") from None
    for outer, old in zip(reversed(owners[:-1]), reversed(owners), strict=False):
        new = _with_member(outer, old, new)
    return new if isinstance(new, Mission) else _with_member(mission, owners[0], new)


def _with_member(outer: Any, old: Any, new: Any) -> Any:
    """Return a copy of a mission, block or plugin with one member replaced."""
    for name, value in (outer.values if isinstance(outer, Plugin) else vars(outer)).items():
        if value is old:
            return outer.replace(**{name: new})
        if isinstance(value, tuple) and any(each is old for each in value):
            return outer.replace(**{name: tuple(new if each is old else each for each in value)})
    raise AssertionError(f"{old!r} is not in {outer!r}")
