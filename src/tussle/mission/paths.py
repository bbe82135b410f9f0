"""The path language: names with dots between them, as in "run.dt", "prey.count", "prey.Boids.max_speed", "SimpleCapture.capture_range".

A path names an owner (the run, a block, a plugin of the world), then plugins within it, then one value of the last. What values an
owner has depends on what is asked for: what can be set in a mission, the columns of a simulation, the tags of a file.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import fields
from typing import Any, NamedTuple

from tussle.api.plugin import RESERVED, Plugin
from tussle.columns import Param
from tussle.errors import ParameterError, TussleError, listed, nearest_name
from tussle.mission.spec import BLOCK_VALUES, MISSION_VALUES, RUN, Block, Mission
from tussle.texts import shown


def follow(
    path: str,
    start: Any,
    inside: Callable[[Any], Mapping[str, Any]],
    values: Callable[[Any], Collection[str] | None],
) -> tuple[list[Any], str]:
    """The owners along a path, from the outermost to that of the value, and the value's name.

    Args:
        path: As written.
        start: What all paths begin in.
        inside: What is in an owner, by name.
        values: Names of an owner's values; None where any may be meant.

    Raises:
        ParameterError: A name is not found; the message says which, what there is, and what may have been meant.
    """
    *names, last = path.split(".")
    owners, owner, said = [], start, "the mission"
    for name in names:
        there = inside(owner)
        if name not in there:
            raise _absent(path, said, name, there)
        owner, said = there[name], name
        owners.append(owner)
    allowed, there = values(owner), inside(owner)
    if allowed is not None and last not in allowed:
        if last in there:
            raise ParameterError(
                f"{shown(path)} names no value of {last}; {listed(values(there[last]) or ())}"
            )
        raise _absent(path, said, last, (*allowed, *there))
    return owners, last


def _absent(path: str, owner: str, name: str, there: Collection[str]) -> ParameterError:
    return ParameterError(
        f"{shown(path)}: {owner[:80]} has no {name[:80]!r}{nearest_name(name[:80], there)}; {listed(there)}"
    )


# -- in a mission -----------------------------------------------------------------------------------------------------------


class Whole(NamedTuple):
    """What paths into a mission begin in; the mission itself is what "run" names."""

    mission: Mission


def inside(owner: Any) -> dict[str, Any]:
    """Blocks, plugins of the world and the run in all; plugins in a block; plugins in a plugin."""
    if isinstance(owner, Whole):
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
    """What can be set in an owner: attributes of `Mission` and `Block`, parameters of plugins."""
    if isinstance(owner, Plugin):
        return (*owner.params(), *owner.children(), *RESERVED)
    return () if isinstance(owner, Whole) else tuple(f.name for f in fields(owner))


def declared(owner: Any, name: str) -> Param | None:
    """The declaration of a value; None of what is no number or text."""
    if isinstance(owner, Plugin):
        return owner.params().get(name)
    return (MISSION_VALUES if isinstance(owner, Mission) else BLOCK_VALUES).get(name)


def with_value(mission: Mission, path: str, value: Any) -> Mission:
    """A mission with one value changed: a number is SI, a text is read as in a mission file.

    Raises:
        ParameterError: The path leads nowhere, or the value is not allowed.
        MissionError: The mission cannot be with it.
    """
    owners, name = follow(path, Whole(mission), inside, settable)
    try:
        new = owners[-1].replace(**{name: value})
    except TussleError as error:
        raise type(error)(f"{path!r}: {error}") from None
    for outer, old in zip(reversed(owners[:-1]), reversed(owners), strict=False):
        new = _with_member(outer, old, new)
    return new if isinstance(new, Mission) else _with_member(mission, owners[0], new)


def _with_member(outer: Any, old: Any, new: Any) -> Any:
    """A mission, a block or a plugin with another of what is in it."""
    for name, value in (outer.values if isinstance(outer, Plugin) else vars(outer)).items():
        if value is old:
            return outer.replace(**{name: new})
        if isinstance(value, tuple) and any(each is old for each in value):
            return outer.replace(**{name: tuple(new if each is old else each for each in value)})
    raise AssertionError(f"{old!r} is not in {outer!r}")
