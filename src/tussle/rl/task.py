"""A task: a mission, and what is observed, decided, rewarded, and what ends an episode."""

from __future__ import annotations

import copy
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import is_dataclass
from functools import cached_property
from inspect import isfunction
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces

from tussle.arguments import check_fields, check_kind, kinds_of
from tussle.documents import Whole, check_argument
from tussle.errors import DeclarationError, ParameterError, listed, nearest_name, slip_of
from tussle.mission import Block, Mission, mission_of
from tussle.rl.action import Act, Decoder, learned
from tussle.rl.computed import Computed
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
        learners: Names of the blocks whose entities are agents, separated by spaces; the others play by their autonomies. A name that
            has spaces is in quotes: "'blue team' red".
        observation: Components, in order; or lists of components by name, which environments give as a dict of arrays; or one of these
            per block.
        action: What actions set; or one list per block. Blocks with an empty list play by their autonomies.
        reward: Terms by name.
        policies: Name of the policy that plays each block, for `tussle train`; by default one policy plays all blocks of the same form.
        state: What a centralised critic sees: a `Computed` whose function returns (W, n); by default the observations of all agents.
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
        DeclarationError: A subclass has a name that differs by a letter from one of these, of `ends` or of `action_mask`, and that its
            methods do not use.
    """

    mission: ClassVar[Any] = None
    overrides: ClassVar[Mapping[str, Any]] = {}
    scripted: ClassVar[Any] = None
    learners: str = ""
    observation: ClassVar[Any] = ()
    action: ClassVar[Any] = ()
    reward: ClassVar[Mapping[str, Term]] = {}
    policies: ClassVar[Mapping[str, str]] = {}
    state: ClassVar[Computed | None] = None
    decide_every: int = 1
    time_limit: float | None = None
    vary: ClassVar[Sequence[str] | Mapping[str, Any]] = ()
    room: ClassVar[Mapping[str, int]] = {}
    dtype: Any = np.float32
    opponents: str = ""
    is_symmetric: bool = False
    margin: str = ""
    _stands_alone: ClassVar[bool] = True  # a file of --plugin-path may define tasks only

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        used = {k for each in vars(cls).values() if isfunction(each) for k in each.__code__.co_names}
        for name in vars(cls).keys() - used:
            if meant := slip_of(name, (*_attributes(), "ends", "action_mask")):
                raise DeclarationError(
                    f"{cls.__name__}.{name} is nothing that a task has, and is never used (did you mean {meant!r}?)"
                )

    def __init__(self, **values: Any) -> None:
        known = _attributes()
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

    def action_mask(self, now: Situation) -> Any:
        """Levels that agents may choose, (W, A, n) or a shape that broadcasts to it; by default there is no mask.

        Those of all actions of an agent are side by side. Environments tell the mask; a level that it excludes is not refused.
        """
        return None

    @property
    def has_mask(self) -> bool:
        """Whether the task masks actions."""
        return type(self).action_mask is not Task.action_mask and any(d.free for d in self.decoders)

    def _check(self) -> None:
        where = type(self).__name__
        for name, kind in kinds_of(Task).items():
            check_kind(f"{where}: {name}", getattr(self, name), kind)
        check_argument(f"{where}: decide_every", self.decide_every, Whole(1))
        if self.time_limit is not None and not 0.0 < self.time_limit < np.inf:
            raise ParameterError(
                f"{where}: time_limit = {self.time_limit!r} is not allowed; it takes a finite number of seconds > 0, or None"
            )
        if self.dtype is None or self.dtype not in (np.dtype(np.float32), np.dtype(np.float64)):
            raise ParameterError(f"{where}: dtype = {self.dtype!r} is not allowed; it is float32 or float64")
        for name in self.reward:
            if name.startswith("_"):  # "_NAME" is the mask of NAME in the infos of vector environments
                raise ParameterError(f"{where}: reward {name!r}: the name of a term does not begin with _")
        if not any(map(sum, self.widths.values())):
            raise ParameterError(
                f"{where}: the observation has no numbers: the blocks that it observes have no entities"
            )
        known = [b.name for b in self.blocks]
        for attribute, rule in (("policies", str), ("room", Whole())):
            for name, value in getattr(self, attribute).items():
                if name not in known:
                    raise ParameterError(
                        f"{where}: {attribute}: there is no block {name!r}{nearest_name(str(name), known)}; {listed(known)}"
                    )
                check_argument(f"{where}: {attribute} of {name!r}", value, rule)
        if not self.agent_names:
            raise ParameterError(
                f"{where}: {self.learners!r} has no agents; give the blocks a count, or room"
            )
        if self.state is not None:
            self.state.check()
        if self.has_mask and any(d.is_continuous for d in self.decoders):
            raise ParameterError(f"{where}: action_mask needs actions with levels")

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
        have = [b.name for b in self.given.blocks]
        names = _names_in(self.learners, have)
        quoted = "; a name with spaces is in quotes" if any(" " in name for name in have) else ""
        for name in names:
            if name not in have:
                raise ParameterError(
                    f"{type(self).__name__}: learners: there is no block {name!r}{nearest_name(name, have)}; {listed(have)}{quoted}"
                )
        if not names:
            raise ParameterError(f"{type(self).__name__}: learners is empty; {listed(have)}")
        return [b for b in self.given.blocks if b.name in names]

    def _of(self, what: str, block: str, kind: type) -> list[Any] | dict[str, list[Any]]:
        """Observation or action of a block, by the names of its parts if they have names."""
        where, given = type(self).__name__, getattr(self, what)
        if isinstance(given, Mapping) and not (kind is Component and self._are_parts(given)):
            if block not in given:
                raise ParameterError(f"{where}: {what} has nothing for {block!r}; {listed(given)}")
            given = given[block]
        parts = dict(given) if kind is Component and isinstance(given, Mapping) else {"": given}
        found = {name: list(part) if isinstance(part, Sequence) else [part] for name, part in parts.items()}
        for item in [item for items in found.values() for item in items]:
            if not isinstance(item, kind):
                raise ParameterError(f"{where}: {what}: {item!r} is no {kind.__name__}")
            if is_dataclass(item):
                check_fields(item)
        if kind is Component and not all([found, *found.values()]):
            raise ParameterError(f"{where}: {what} of {block!r} is empty")
        return found.get("", found)

    def _are_parts(self, given: Mapping[str, Any]) -> bool:
        """Whether the keys of a mapping name parts of an observation, and not blocks."""
        return not {block.name for block in self.given.blocks} & set(given)

    def components(self, block: str) -> list[Component]:
        """Components of a block's observation, in order."""
        found = self._of("observation", block, Component)
        return [item for items in found.values() for item in items] if isinstance(found, dict) else found

    @cached_property
    def parts(self) -> dict[str, dict[str, slice]]:
        """Columns of each named part of the observation, by block; empty without names."""
        found: dict[str, dict[str, slice]] = {}
        for name, widths in self.widths.items():
            given, first, n = self._of("observation", name, Component), 0, 0
            found[name] = {}
            for part, items in given.items() if isinstance(given, dict) else ():
                end = first + sum(widths[n : n + len(items)])
                found[name][part], first, n = slice(first, end), end, n + len(items)
        return found

    @cached_property
    def roles(self) -> dict[str, list[str]]:
        """Blocks of each policy, by its name; one policy "" for all blocks that observe and decide in the same form.

        Raises:
            ParameterError: Blocks of a policy differ in form.
        """
        forms = {d.block: (self.widths[d.block], str(d.space)) for d in self.decoders}
        is_one = len({(sum(widths), space) for widths, space in forms.values()}) == 1
        found: dict[str, list[str]] = {}
        for name in forms:
            found.setdefault(
                self.policies.get(name, "" if is_one and not self.policies else name), []
            ).append(name)
        for policy, names in found.items():
            if len({(sum(forms[name][0]), forms[name][1]) for name in names}) > 1:
                raise ParameterError(
                    f"{type(self).__name__}: policies: the blocks {' '.join(names)} of {policy!r} observe or decide differently; one "
                    "policy needs the same form"
                )
        return found

    def policy_of(self, agent: str) -> str:
        """Name of the policy of an agent, such as "prey_3": a mapping as learning libraries take it."""
        if agent not in self.agent_names:
            raise ParameterError(f"there is no agent {agent!r}{nearest_name(agent, self.agent_names)}")
        block = self.blocks[self.agent_block[self.agent_names.index(agent)]].name
        return next(policy for policy, names in self.roles.items() if block in names)

    def acts(self, block: str) -> list[Act]:
        """Actions of a block, in order."""
        return self._of("action", block, Act)  # type: ignore[return-value]

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

    def _block_of(self, agent: int) -> int:
        """Number of the block of an agent in `blocks`."""
        check_argument("agent", agent, Whole(0, len(self.agent_names) - 1))
        return int(self.agent_block[agent])

    def observation_space(self, agent: int) -> spaces.Space[Any]:
        """Observations of an agent by its number, a Dict if its parts have names; bounds are infinite where they are not known."""
        block = self.blocks[self._block_of(agent)].name
        low, high = self._bounds[block]
        parts = self.parts[block]
        if not parts:
            return spaces.Box(low, high, dtype=self.dtype)
        return spaces.Dict(
            {name: spaces.Box(low[at], high[at], dtype=self.dtype) for name, at in parts.items()}
        )

    @property
    def state_space(self) -> spaces.Box:
        """What a centralised critic sees."""
        low, high = self.limits if self.state is None else self.state.bounds(self.played, "")
        return spaces.Box(
            low.reshape(-1).astype(self.dtype), high.reshape(-1).astype(self.dtype), dtype=self.dtype
        )

    @cached_property
    def limits(self) -> np.ndarray:
        """Bounds of the observations of all agents, side by side, (2, A, numbers), 0 where a block has fewer."""
        out = np.zeros((2, len(self.agent_names), max(sum(w) for w in self.widths.values())), self.dtype)
        for a, block in enumerate(self.agent_block):
            bounds = self._bounds[self.blocks[block].name]
            out[:, a, : bounds.shape[1]] = bounds
        return out

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
        """Actions of an agent, by its number; a space of its own, as each has a random generator."""
        return copy.deepcopy(self.decoders[self._block_of(agent)].space)


def _attributes() -> list[str]:
    """Names of the attributes of a task."""
    return [name for name in Task.__annotations__ if not name.startswith("_")]


def _names_in(text: str, known: Sequence[str]) -> list[str]:
    """Names separated by spaces; those that have spaces themselves are in quotes, but for one alone."""
    for names in ([text], text.split()):
        if all(name in known for name in names):
            return names
    try:
        return shlex.split(text)
    except ValueError:  # a quote that is not closed
        return text.split()


def _made(kind: type[Task], values: dict[str, Any]) -> Task:
    """A task from a pickle."""
    return kind(**values)


__all__ = ["Task"]
