"""Actions of agents: the channels and parameters that they set, and the autonomy that holds them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from gymnasium import spaces

from tussle.api import Autonomy, GroupView, Output
from tussle.api.kinds import EntityPlugin
from tussle.arguments import check_fields
from tussle.declare.columns import Param
from tussle.errors import ParameterError, listed, nearest_name
from tussle.mission import Block
from tussle.rl import kernels
from tussle.rl.observation import AgentRows


@dataclass(frozen=True)
class Act:
    """One action: a channel that the first controller or the motion model reads, or a parameter of an autonomy, "Boids.gain".

    Attributes:
        target: Name of the channel, or "Plugin.parameter"; with levels, several channels separated by spaces.
        low: Value for the action -1, in SI units.
        high: Value for the action 1.
        levels: Instead of low and high: the values to choose from; for several channels, rows of values.
        value: Instead of low and high: a constant.
    """

    target: str
    low: float | None = None
    high: float | None = None
    levels: Sequence[Any] | None = None
    value: float | None = None

    @property
    def names(self) -> list[str]:
        return self.target.split()

    @property
    def table(self) -> np.ndarray:
        """Values by level, (levels, channels)."""
        return np.asarray(self.levels, float).reshape(len(self.levels or ()), len(self.names))

    def check(self, block: Block) -> None:
        """Check the declaration.

        Raises:
            ParameterError: The target does not exist, or the values do not fit together.
        """
        check_fields(self)
        is_range = _is_finite(self.low) and _is_finite(self.high)
        given = [is_range and self.low != self.high, self.levels is not None, self.value is not None]
        if sum(given) != 1 or (not is_range and (self.low, self.high) != (None, None)):
            raise ParameterError(
                f"Act({self.target!r}): give finite low and high that differ, or levels, or value"
            )
        if self.levels is None and len(self.names) != 1:
            raise ParameterError(f"Act({self.target!r}): only levels set several channels; give one target")
        if self.levels is not None and (
            len(self.levels) < 2
            or np.size(array_of(f"Act({self.target!r}): levels", self.levels))
            != len(self.levels) * len(self.names)
        ):
            raise ParameterError(
                f"Act({self.target!r}): levels are two or more rows of {len(self.names)} number(s)"
            )
        for value in [self.value] if self.levels is None else np.ravel(self.levels).tolist():
            if value is not None and not _is_finite(value):
                raise ParameterError(
                    f"Act({self.target!r}): {value!r} is not allowed; it takes finite numbers"
                )
        channels = channels_of(block)
        for name in self.names:
            if "." in name:
                _parameter(block, name)
            elif name not in channels:
                raise ParameterError(
                    f"Act: {block.name} has no channel {name!r}{nearest_name(name, channels)}; {listed(channels)}"
                )


def array_of(what: str, given: Any) -> np.ndarray:
    """What a learner or a function of the user gave, as an array.

    Raises:
        ParameterError: Its rows have different lengths.
    """
    try:
        return np.asarray(given)
    except ValueError as error:
        raise ParameterError(f"{what}: no array can be made of it: {error}") from None


def _is_finite(value: Any) -> bool:
    return isinstance(value, (int, float, np.number)) and bool(np.isfinite(value))


def channels_of(block: Block) -> dict[str, str]:
    """Units of the channels that the first controller, or else the motion model, reads."""
    stages = [p for p in (*block.controller, block.motion) if not getattr(type(p), "passthrough", False)]
    return {
        channel: unit
        for column in type(stages[0]).inputs().values()
        if not column.ragged
        for channel, unit in zip(column.channels, column.units, strict=True)
    }


def _parameter(block: Block, path: str) -> EntityPlugin:
    plugin, _, name = path.partition(".")
    plugins = {p.instance_name: p for p in block.autonomy}
    if plugin not in plugins:
        raise ParameterError(f"Act: {path!r}: {block.name} has no autonomy {plugin!r}; {listed(plugins)}")
    found = plugins[plugin]
    params = [k for k, c in type(found).declared(Param).items() if c.is_row_data and not c.fields]
    if name not in params:
        raise ParameterError(
            f"Act: {plugin} has no parameter {name!r}{nearest_name(name, params)}; {listed(params)}"
        )
    return found  # type: ignore[no-any-return]


class Actor(Autonomy):
    """Holds the actions of a learner as outputs; abstract. The values stay until the next action."""

    grade = "portable"
    constants: dict[str, float]

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        for name, value in type(self).constants.items():
            getattr(self, name)[rows] = value

    def step(self, g: GroupView) -> None:
        """Nothing: the learner has set the outputs."""


def learned(block: Block, acts: Sequence[Act]) -> Block:
    """A block whose channels are set by actions. Its autonomies stay without actions, and if one sets a parameter of theirs.

    Raises:
        ParameterError: An action does not fit the block.
    """
    if not acts:
        return block
    for act in acts:
        act.check(block)
    names = [name for act in acts for name in act.names]
    if len(set(names)) < len(names):
        raise ParameterError(f"action of {block.name}: a target is set twice: {', '.join(names)}")
    channels = channels_of(block)
    keeps = any("." in name for name in names)
    if not keeps:
        names = list(channels)
    if all("." in name for name in names):
        return block
    constants = tuple(
        (act.target, act.value) for act in acts if act.value is not None and "." not in act.target
    )
    actor = _actor(tuple((n, channels[n]) for n in names if "." not in n), constants)
    return block.replace(autonomy=(*(block.autonomy if keeps else ()), actor()))


@cache
def _actor(channels: tuple[tuple[str, str], ...], constants: tuple[tuple[str, float], ...]) -> type[Actor]:
    """The autonomy that holds these channels; one class for all tasks with these, so that their missions are equal."""
    outputs = {name: Output(unit=unit) for name, unit in channels}
    return type("Learner", (Actor,), {**outputs, "constants": dict(constants), "__doc__": Actor.__doc__})


class Decoder:
    """Writes the actions of a block to its columns.

    Attributes:
        space: Space of one agent's action: Box of [-1, 1], Discrete or MultiDiscrete.
    """

    def __init__(self, block: str, acts: Sequence[Act], dtype: Any) -> None:
        self.block = block
        self.free = [act for act in acts if act.value is None]
        self.constants = [act for act in acts if act.value is not None and "." in act.target]
        kinds = {act.levels is None for act in self.free} if acts else {True}
        if len(kinds) != 1:
            raise ParameterError(
                f"action of {block}: all are ranges, or all have levels; at least one is free"
            )
        self.is_continuous = kinds.pop()
        sizes = [len(act.levels or ()) for act in self.free]
        self.space: spaces.Space[Any]
        if self.is_continuous:
            self.space = spaces.Box(-1.0, 1.0, (len(self.free),), dtype)
        else:
            self.space = spaces.Discrete(sizes[0]) if len(sizes) == 1 else spaces.MultiDiscrete(sizes)
        self.sizes = np.array(sizes)
        self._sets_params = any("." in name for act in (*self.free, *self.constants) for name in act.names)
        self._tables = [np.ascontiguousarray(act.table.T) for act in self.free if act.levels is not None]

    def write(self, part: AgentRows, actions: np.ndarray) -> int:
        """Set the columns of a part's agents from actions, (agents, numbers). Returns the first agent with a wrong action, or -1."""
        group, at = part.group, part.rows - part.group.first
        key = self.block, part.span
        if key not in part.kept:
            names = {name for act in (*self.constants, *self.free) for name in act.names}
            part.kept[key] = {name: self._place(group, name) for name in names}
        places = part.kept[key]
        for act in self.constants:
            group.table.array(places[act.target])[at] = act.value
        wrong = self.decode(actions, part.agents, at, lambda target: group.table.array(places[target]))
        if wrong >= 0:
            return wrong
        if self._sets_params:
            for view in group.views:  # they keep what follows from parameters
                view.kept.clear()
        return -1

    def decode(
        self, actions: np.ndarray, agents: np.ndarray, at: np.ndarray, column: Callable[[str], np.ndarray]
    ) -> int:
        """Set columns[at] from actions[agents]. Returns the first agent with a wrong action, or -1.

        Args:
            actions: Actions, (agents, numbers).
            agents: Rows of `actions`, (m,).
            at: Places in the columns, (m,).
            column: Returns the column of a target.
        """
        if self.is_continuous:
            for c, act in enumerate(self.free):
                wrong = kernels.act(actions, (at, agents), 0, c, act.low, act.high, column(act.target))
                if wrong >= 0:
                    return int(wrong)
            return -1
        wrong = int(kernels.wrong_level(actions, agents, self.sizes))
        if wrong < 0:
            for c, (act, table) in enumerate(zip(self.free, self._tables, strict=True)):
                for name, values in zip(act.names, table, strict=True):
                    kernels.choose_level(actions, (at, agents), c, values, column(name))
        return wrong

    @staticmethod
    def _place(group: Any, target: str) -> Any:
        """Place of a target in the table of the group."""
        plugin, _, name = target.rpartition(".")
        binding = next(
            b
            for b in group.autonomies
            if (b.spec.instance_name == plugin if plugin else isinstance(b.spec, Actor))
        )
        return binding.places[name]
