"""PettingZoo's interface: one world whose agents act at the same time, die and are born."""

from __future__ import annotations

from collections.abc import Mapping
from operator import attrgetter
from typing import Any

import numpy as np
from pettingzoo import ParallelEnv

from tussle.declare.displays import listing
from tussle.errors import ParameterError, nearest_name
from tussle.rl.action import array_of
from tussle.rl.environments import Pictures, check_options, in_parts, metadata_of, reset_one, told_of_one
from tussle.rl.swarm import Swarm

DTYPE, SHAPE = attrgetter("dtype"), attrgetter("shape")


class TaskParallelEnv(ParallelEnv[str, Any, Any]):  # type: ignore[misc]  # PettingZoo has no types
    """One world of a task as a PettingZoo `ParallelEnv`; see `parallel_env`."""

    metadata: dict[str, Any] = {}  # noqa: RUF012 - as in the base class

    def __init__(self, task: Any, *, render_mode: str | None = None, threads: int = 1) -> None:
        self.swarm = Swarm(task, 1, autoreset="disabled", threads=threads)
        self.task = self.swarm.task
        self.render_mode = render_mode
        name = type(self.task).__name__
        self.metadata = {**metadata_of(self.task), "name": name, "is_parallelizable": True}
        self.possible_agents = list(self.task.agent_names)
        self.agents: list[str] = []
        self._at: Any = []  # their numbers
        # Decisions of the episode before the first of each agent.
        self._joined = np.zeros(len(self.possible_agents), np.int64)
        self._rows: Any = None  # of the body table, which change when agents die or are born
        self._number = {name: a for a, name in enumerate(self.possible_agents)}
        self.observation_spaces = {name: self.task.observation_space(a) for name, a in self._number.items()}
        self.action_spaces = {name: self.task.action_space(a) for name, a in self._number.items()}
        self.state_space = self.task.state_space
        block = dict(zip(self.possible_agents, self.task.agent_block.tolist(), strict=True))
        self._block, widths = block, [sum(w) for w in self.task.widths.values()]
        self._width = {name: widths[block[name]] for name in self.possible_agents}
        self._n_levels = [sum(map(int, decoder.sizes)) for decoder in self.task.decoders]
        self._has_parts = any(self.task.parts.values())
        self._is_same_width = len(set(self._width.values())) == 1
        swarm = self.swarm
        kind = self.task.dtype if swarm.is_continuous else np.int64
        self._actions = np.zeros((swarm.n_agents, swarm.action_width), kind)
        self._shapes = {space.shape for space in self.action_spaces.values()}
        self._none = dict.fromkeys(self.possible_agents, False)
        self._pictures = Pictures(swarm, render_mode)

    def observation_space(self, agent: str) -> Any:
        return self._of(agent, self.observation_spaces)

    def action_space(self, agent: str) -> Any:
        return self._of(agent, self.action_spaces)

    def _of(self, agent: Any, by_name: Mapping[str, Any]) -> Any:
        """The value of an agent.

        Raises:
            ParameterError: There is no such agent.
        """
        if not isinstance(agent, str) or agent not in by_name:
            near = nearest_name(str(agent), by_name)
            raise ParameterError(
                f"{agent!r:.80} is no agent{near}; there are: {listing(self.possible_agents)}"
            )
        return by_name[agent]

    def _observed(self, agents: list[str], numbers: Any) -> dict[str, np.ndarray]:
        obs = self.swarm.obs[0][numbers]
        if self._has_parts:
            rows = {name: row[: self._width[name]].copy() for name, row in zip(agents, obs, strict=True)}
            return {name: in_parts(self.task, row, self._block[name]) for name, row in rows.items()}
        if self._is_same_width:
            return dict(zip(agents, obs.copy() if isinstance(numbers, slice) else obs, strict=True))
        return {name: row[: self._width[name]].copy() for name, row in zip(agents, obs, strict=True)}

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Start a new episode; `options` may have "params", parameters by path. The infos have the seed and the parameters."""
        reset_one(self.swarm, seed, check_options(options))
        self._actions[:] = self._joined[:] = 0
        self.agents = self._living()
        self._at = self._numbers(self.agents)
        self._pictures.follow()
        info = {"seed": int(self.swarm.seeds[0]), **told_of_one(self.swarm)}
        infos = {name: dict(info) for name in self.agents}
        self._add_masks(infos)
        return self._observed(self.agents, self._at), infos

    def _add_masks(self, infos: dict[str, dict[str, Any]]) -> None:
        """Add the levels that agents may choose to their infos, if the task masks actions."""
        if self.swarm.masks is not None:
            masks = self.swarm.masks[0].astype(np.int8)
            for name, info in infos.items():
                info["action_mask"] = masks[self._number[name], : self._n_levels[self._block[name]]]

    def _living(self) -> list[str]:
        alive = self.swarm.alive[0]
        if alive.all():
            return list(self.possible_agents)
        return [self.possible_agents[a] for a in np.flatnonzero(alive)]

    def step(self, actions: Mapping[str, Any]) -> tuple[dict[str, Any], ...]:
        """Play one decision; with no actions where all agents are dead and others are still to be born.

        The info of an agent whose episode ends has "episode": its return `r` and the number of decisions `l`. What each term of
        the reward gave in this step is in `swarm.terms`.

        Raises:
            ParameterError: An agent's action is missing, is not allowed, or belongs to an agent that is not there.
        """
        if not self.agents and self.swarm.over[0]:
            return {}, {}, {}, {}, {}
        before = self.agents
        self._take(actions)
        swarm = self.swarm
        swarm.step(self._actions[None])
        self._pictures.follow()
        dead = swarm.terminations[0]
        is_same = swarm.now.rows is self._rows and not swarm.over[0]
        if not is_same:
            self.agents = [] if swarm.over[0] else self._living()
        reported, numbers, self._rows = before, self._at, swarm.now.rows
        if not is_same and self.agents != before:
            known, is_dead = set(before), dead.tolist()
            reported = before + [name for name in self.agents if name not in known]
            self.agents = [name for name in self.agents if not is_dead[self._number[name]]]
            numbers, self._at = self._numbers(reported), self._numbers(self.agents)
            self._joined[[self._number[name] for name in reported[len(before) :]]] = swarm.lengths[0]
            self._actions[~swarm.alive[0]] = 0  # of the dead, which `Situation.actions` would still show
        rewards, deaths, ends = (
            self._by_name(reported, values[0, numbers])
            for values in (swarm.rewards, swarm.terminations, swarm.truncations)
        )
        infos: dict[str, dict[str, Any]] = {name: {} for name in reported}
        if len(self.agents) < len(reported):
            for name in set(reported).difference(self.agents):
                number = self._number[name]
                length = int(swarm.lengths[0] - self._joined[number])
                infos[name]["episode"] = {"r": float(swarm.returns[0, number]), "l": length}
        self._add_masks(infos)
        return self._observed(reported, numbers), rewards, deaths, ends, infos

    def _by_name(self, agents: list[str], values: np.ndarray) -> dict[str, Any]:
        if len(agents) == len(self._none) and values.dtype == bool and not values.any():
            return self._none.copy()
        return dict(zip(agents, values.tolist(), strict=True))

    def _numbers(self, agents: list[str]) -> Any:
        """Index of these agents in arrays."""
        return slice(None) if agents == self.possible_agents else [self._number[name] for name in agents]

    def _take(self, actions: Mapping[str, Any]) -> None:
        """Write the actions to one array."""
        if not isinstance(actions, Mapping):
            raise ParameterError(
                f"actions = {actions!r:.80} is not allowed; it takes an action by the name of each agent"
            )
        is_in_order = list(actions) == self.agents
        if not is_in_order and actions.keys() != set(self.agents):
            for name in actions:
                if name not in self.agents:
                    known = name in self._number
                    text = (
                        "is not alive"
                        if known
                        else f"is no agent{nearest_name(str(name), self.possible_agents)}"
                    )
                    raise ParameterError(f"there is an action for {name!r}, which {text}")
            missing = next(name for name in self.agents if name not in actions)
            raise ParameterError(f"the action of {missing!r} is missing")
        many = list(actions.values()) if is_in_order else [actions[name] for name in self.agents]
        if not (many and self._take_rows(many)):
            self._take_each(many)

    def _take_rows(self, many: list[Any]) -> bool:
        """Write actions of the space's type and shape; return False if these differ."""
        if len(self._shapes) > 1:
            return False
        try:
            if set(map(DTYPE, many)) != {self._actions.dtype} or set(map(SHAPE, many)) != self._shapes:
                return False
            rows = np.frombuffer(b"".join(many), self._actions.dtype)  # faster than np.array(many)
        except (AttributeError, BufferError):
            return False
        self._actions[self._at] = rows.reshape(len(many), -1)
        return True

    def _take_each(self, many: list[Any]) -> None:
        """Write actions that differ in shape or type, and say which is wrong."""
        for name, value in zip(self.agents, many, strict=True):
            space, given = self.action_spaces[name], array_of(f"the action of {name!r}", value)
            kinds = "f" if self.swarm.is_continuous else "iu"
            if given.shape != space.shape or given.dtype.kind not in kinds:
                raise ParameterError(
                    f"the action of {name!r} is {given.dtype} of shape {given.shape}; it must be in {space}"
                )
            self._actions[self._number[name], : given.size] = given.reshape(-1)

    def __reduce__(self) -> tuple[Any, ...]:
        return parallel_env_of, (self.task, self.render_mode, self.swarm.simulation.state.context.threads)

    def render(self) -> Any:
        """A picture, (height, width, 3), in mode "rgb_array"."""
        return self._pictures.picture()

    def state(self) -> np.ndarray:
        """What a centralised critic sees, in `state_space`: the task's `state`, or the observations of all agents side by side."""
        return np.array(self.swarm.central_state[0])

    def close(self) -> None:
        self._pictures.close()
        self.swarm.close()


def parallel_env_of(task: Any, render_mode: str | None, threads: int) -> TaskParallelEnv:
    """An environment from a pickle, before its first reset."""
    return TaskParallelEnv(task, render_mode=render_mode, threads=threads)


def parallel_env(task: Any, *, render_mode: str | None = None, threads: int = 1) -> TaskParallelEnv:
    """One world of a task as a PettingZoo `ParallelEnv`; `pettingzoo.utils.parallel_to_aec` makes an AEC environment of it."""
    return TaskParallelEnv(task, render_mode=render_mode, threads=threads)


__all__ = ["TaskParallelEnv", "parallel_env"]
