"""A task: a mission, and what is observed, decided, rewarded, and what ends an episode."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces

from tussle.errors import ParameterError, listed, nearest_name
from tussle.mission import Block, Mission, mission_of
from tussle.rl.action import Act, Decoder, learned
from tussle.rl.draws import variables_of
from tussle.rl.observation import Component
from tussle.rl.reward import Situation, Term

TIMELESS = 1e9
"""End of the mission that is simulated [s]; episodes are ended by the task."""


class Task:
    """A game for learners. Subclasses set the attributes; arguments of the same names set them for one instance.

    Attributes:
        mission: A Mission, or the file or name of one.
        overrides: Values of the mission's file, as of `read_mission`.
        scripted: The mission of `evaluate` without a policy, in which autonomies play the agents' blocks; by default `mission`, also
            where a `mission` was given later than it, by a subclass or as an argument.
        learners: Names of the blocks whose entities are agents, separated by spaces; the others play by their autonomies.
        observation: Components, in order; or one list per block.
        action: What actions set; or one list per block. Blocks with an empty list play by their autonomies.
        reward: Terms by name.
        decide_every: Steps of the mission per decision. Terms are evaluated once per decision, on the last state; events of all its
            steps count.
        time_limit: Length of an episode, after which it is truncated [s]; by default the mission's.
        vary: Parameters that each episode draws anew: texts as in a batch, "prey.Unicycle.vel_max=20:30", or distributions by path,
            {"prey.Unicycle.vel_max": uniform(20, 30)}.
        room: Agents per block, for blocks that gain entities by births of plugins; by default the block's count.
        dtype: Type of observations, rewards and actions.
        opponents: Registered id of the task of the other side, whose learners play against these.
        is_symmetric: The other side observes and acts as these learners do, seen from its place, so one policy plays both sides.
        margin: Quantity of a game, in the words of a batch, by which the learners win where it is positive, and the opponents where it
            is negative; by default their team's score less that of the opponents.

    Raises:
        ParameterError: An attribute is unknown, or a value is not allowed.
    """

    mission: ClassVar[Any] = None
    overrides: ClassVar[Mapping[str, Any]] = {}
    scripted: ClassVar[Any] = None
    learners: str = ""
    observation: ClassVar[Any] = ()
    action: ClassVar[Any] = ()
    reward: ClassVar[Mapping[str, Term]] = {}
    decide_every: int = 1
    time_limit: float | None = None
    vary: ClassVar[Sequence[str] | Mapping[str, Any]] = ()
    room: ClassVar[Mapping[str, int]] = {}
    dtype: Any = np.float32
    opponents: str = ""
    is_symmetric: bool = False
    margin: str = ""
    _stands_alone: ClassVar[bool] = True  # a file of --plugin-path may define tasks only

    def __init__(self, **values: Any) -> None:
        known = [k for k in Task.__annotations__ if not k.startswith("_")]
        for name, value in values.items():
            if name not in known:
                raise ParameterError(
                    f"{type(self).__name__} has no {name!r}{nearest_name(name, known)}; {listed(known)}"
                )
            self.__dict__[name] = value
        self._given = values
        self._check()

    def replace(self, **values: Any) -> Task:
        """A copy with other attributes."""
        return type(self)(**{**self._given, **values})

    def __reduce__(self) -> tuple[Any, ...]:
        return _made, (type(self), self._given)

    def ends(self, now: Situation) -> Any:
        """Worlds, (W,), whose episode terminates, besides those without agents; by default none."""
        return False

    def _check(self) -> None:
        where = type(self).__name__
        if self.decide_every < 1 or int(self.decide_every) != self.decide_every:
            raise ParameterError(
                f"{where}: decide_every = {self.decide_every!r} is not allowed; it takes a whole number >= 1"
            )
        if self.time_limit is not None and not self.time_limit > 0.0:
            raise ParameterError(
                f"{where}: time_limit = {self.time_limit!r} is not allowed; it takes a number of seconds > 0"
            )
        if np.dtype(self.dtype) not in (np.float32, np.float64):
            raise ParameterError(f"{where}: dtype = {self.dtype!r} is not allowed; it is float32 or float64")
        for name, term in self.reward.items():
            if not isinstance(term, Term):
                raise ParameterError(f"{where}: reward {name!r} is {term!r}, not a Term")
            if name.startswith("_"):  # "_NAME" is the mask of NAME in the infos of vector environments
                raise ParameterError(f"{where}: reward {name!r}: the name of a term does not begin with _")
        _ = self.widths

    # -- what follows ------------------------------------------------------------------------------------------------------

    @cached_property
    def given(self) -> Mission:
        """The mission as given."""
        if self.mission is None:
            raise ParameterError(
                f"{type(self).__name__} has no mission; set mission = a Mission, or the name of one"
            )
        is_named = isinstance(self.mission, (str, Path))
        if self.overrides and not is_named and self._age("overrides") <= self._age("mission"):
            raise ParameterError(
                f"{type(self).__name__}: overrides = {self.overrides!r} is not allowed with a mission made in Python; "
                "give mission = ... .replace(...)"
            )
        return mission_of(self.mission, f"{type(self).__name__}.mission", self.overrides)[0]

    def by_rule(self) -> Task:
        """This task without actions, in the mission in which autonomies play the agents' blocks."""
        if self.scripted is None or self._age("scripted") > self._age("mission"):
            return self.replace(action=())
        values = {"mission": self.scripted, "action": ()}
        return self.replace(
            **values if isinstance(self.scripted, (str, Path)) else {**values, "overrides": {}}
        )

    def _age(self, name: str) -> int:
        """How far back an attribute was set: -1 as an argument, else by the class at this place in the order of classes."""
        return (
            -1
            if name in self._given
            else next(i for i, c in enumerate(type(self).__mro__) if name in vars(c))
        )

    @cached_property
    def blocks(self) -> list[Block]:
        """The given blocks of the agents, in order of the mission."""
        names, have = self.learners.split(), [b.name for b in self.given.blocks]
        for name in names:
            if name not in have:
                raise ParameterError(
                    f"{type(self).__name__}: learners: there is no block {name!r}{nearest_name(name, have)}; {listed(have)}"
                )
        if not names:
            raise ParameterError(f"{type(self).__name__}: learners is empty; {listed(have)}")
        return [b for b in self.given.blocks if b.name in names]

    def _of(self, what: str, block: str, kind: type) -> list[Any]:
        """Observation or action of a block."""
        given = getattr(self, what)
        if isinstance(given, Mapping):
            if block not in given:
                raise ParameterError(
                    f"{type(self).__name__}: {what} has nothing for {block!r}; {listed(given)}"
                )
            given = given[block]
        items = list(given) if isinstance(given, Sequence) else [given]
        for item in items:
            if not isinstance(item, kind):
                raise ParameterError(f"{type(self).__name__}: {what}: {item!r} is no {kind.__name__}")
        if not items and kind is Component:
            raise ParameterError(f"{type(self).__name__}: {what} of {block!r} is empty")
        return items

    def components(self, block: str) -> list[Component]:
        return self._of("observation", block, Component)

    def acts(self, block: str) -> list[Act]:
        return self._of("action", block, Act)

    @cached_property
    def columns(self) -> dict[str, list[tuple[Component, int]]]:
        """Components of each block's observation, each with its first column."""
        return {
            name: list(zip(self.components(name), np.cumsum([0, *widths]).tolist(), strict=False))
            for name, widths in self.widths.items()
        }

    @cached_property
    def widths(self) -> dict[str, list[int]]:
        """Numbers of each component, by block."""
        return {b.name: [c.width(self.played, b.name) for c in self.components(b.name)] for b in self.blocks}

    @cached_property
    def played(self) -> Mission:
        """The mission that is simulated: blocks of agents get their actions from the learner, and worlds never end by themselves."""
        names = [b.name for b in self.blocks]
        blocks = [learned(b, self.acts(b.name)) if b.name in names else b for b in self.given.blocks]
        return self.given.replace(blocks=blocks, end=self.given.start + TIMELESS, end_conditions=("none",))

    @cached_property
    def decoders(self) -> list[Decoder]:
        return [Decoder(b.name, self.acts(b.name), self.dtype) for b in self.blocks]

    @cached_property
    def n_steps(self) -> int:
        """Steps of an episode, a whole number of decisions; 0 for no limit."""
        limit = self.time_limit
        if limit is None:
            limit = self.given.end - self.given.start if "time" in self.given.end_conditions else 0.0
        return int(np.ceil(limit / self.given.dt / self.decide_every - 1e-9)) * self.decide_every

    @cached_property
    def variables(self) -> list[Any]:
        return variables_of(self.vary, type(self).__name__)

    @cached_property
    def capacities(self) -> list[int]:
        """Most agents of each block."""
        return [self.room.get(b.name, b.count) for b in self.blocks]

    @cached_property
    def agent_names(self) -> list[str]:
        return [f"{b.name}_{i}" for b, n in zip(self.blocks, self.capacities, strict=True) for i in range(n)]

    @cached_property
    def agent_block(self) -> np.ndarray:
        """Number of the block of each agent, (A,), in `blocks`."""
        return np.repeat(np.arange(len(self.blocks)), self.capacities)

    def observation_space(self, agent: int) -> spaces.Box:
        """Observations of an agent; bounds are infinite where they do not follow from the components."""
        low, high = self._bounds[self.blocks[self.agent_block[agent]].name]
        return spaces.Box(low, high, dtype=self.dtype)

    @cached_property
    def _bounds(self) -> dict[str, np.ndarray]:
        """Bounds of the observations of each block, (2, numbers)."""
        return {
            b.name: np.concatenate(
                [c.bounds(self.played, b.name) for c in self.components(b.name)], axis=1
            ).astype(self.dtype)
            for b in self.blocks
        }

    def action_space(self, agent: int) -> spaces.Space[Any]:
        """Actions of an agent; a space of its own, as each has a random generator."""
        return copy.deepcopy(self.decoders[self.agent_block[agent]].space)


def _made(kind: type[Task], values: dict[str, Any]) -> Task:
    """A task from a pickle."""
    return kind(**values)


__all__ = ["Task"]
