"""What the agents of a policy see, do and get while PPO plays, and the decisions that it learns from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from tussle.errors import MissingExtraError, ParameterError
from tussle.rl.actor_critic import ActorCritic
from tussle.rl.settings import Settings
from tussle.rl.swarm import Swarm

try:
    import torch
except ImportError:
    raise MissingExtraError("training needs PyTorch: pip install 'tussle[train]'") from None


@dataclass
class Decisions:
    """What an update learns from. A row is a decision of a living agent, (m, ...), or with memory all T of an agent, (m, T, ...).

    Attributes:
        states: States of the worlds, of which `place` is the row, (m,) or (m, T).
        there: Whether the agent is alive, (m,) or (m, T).
        start: What it has kept before the first decision of the row, (m, 2, memory).
        begins: Decisions that begin with nothing kept, (m, T) with memory.
    """

    obs: Any
    actions: Any
    log_prob: Any
    advantages: Any
    returns: Any
    place: Any
    mask: Any
    states: Any
    there: Any
    start: Any
    begins: Any

    def seen(self, some: Any) -> Any:
        """What the critic sees of some decisions."""
        return (
            self.obs[some]
            if self.states is None
            else torch.cat([self.obs[some], self.states[self.place[some]]], -1)
        )


def check_finite(what: str, values: Any) -> None:
    """Refuse what would make all weights NaN.

    Raises:
        ParameterError: A number is not finite.
    """
    if not torch.isfinite(values).all():
        raise ParameterError(
            f"{what} is not a finite number of single precision; scale observations and rewards to about 1, or lower learning_rate"
        )


class Role:
    """Policy and critic of some blocks, and what their agents see.

    Args:
        swarm: The worlds.
        blocks: Names of the blocks, which observe and decide in the same form.
        settings: Of PPO.

    Attributes:
        kept: What agents keep from their last decision, for policy and critic, (m, 2, memory), by swarm.
    """

    def __init__(self, swarm: Swarm, blocks: Sequence[str], settings: Settings) -> None:
        task = swarm.task
        numbers = [i for i, block in enumerate(task.blocks) if block.name in blocks]
        self.agents = np.flatnonzero(np.isin(task.agent_block, numbers))
        self.width, decoder = sum(task.widths[blocks[0]]), task.decoders[numbers[0]]
        self.is_central = settings.critic == "central"
        sizes = () if decoder.is_continuous else tuple(int(n) for n in decoder.sizes)
        self.n_actions = len(decoder.free)
        n_state = swarm.central_state.shape[1] if self.is_central else 0
        self.model = ActorCritic(
            self.width, sizes, self.n_actions if not sizes else 0, settings.hidden, n_state, settings.memory
        )
        self.kept: WeakKeyDictionary[Swarm, Any] = WeakKeyDictionary()
        self.optimizer = torch.optim.Adam(self.model.parameters, lr=settings.learning_rate, eps=1e-5)

    def of(self, array: np.ndarray) -> Any:
        """Values of the agents of this role, (W, A, ...), as (m, ...)."""
        mine = np.ascontiguousarray(array[:, self.agents])
        return torch.from_numpy(mine.reshape(-1, *mine.shape[2:]))

    def obs(self, array: np.ndarray) -> Any:
        return self.of(array)[:, : self.width].float()

    def mask(self, swarm: Swarm) -> Any:
        return None if swarm.masks is None else self.of(swarm.masks)[:, : sum(self.model.sizes)]

    def carried(self, swarm: Swarm) -> tuple[Any, Any]:
        """What agents have kept, (m, 2, memory), and who begins with nothing, (m,): in new episodes, and before the birth."""
        begins = self.of((swarm.over | (swarm.lengths == 0))[:, None] | ~swarm.alive)
        kept = self.kept.get(swarm)
        if kept is None:
            kept = torch.zeros(len(begins), 2, self.model.memory)
        return kept.masked_fill(begins[:, None, None], 0.0), begins

    def seen(self, obs: Any, states: np.ndarray) -> Any:
        """What the critic sees, (m, n), with the states of the worlds, (W, n)."""
        if not self.is_central:
            return obs
        return torch.cat(
            [obs, torch.from_numpy(states.astype(np.float32)).repeat_interleave(len(self.agents), 0)], -1
        )


class Rollout:
    """What the agents of a role see, do and get in T decisions, (T, m, ...)."""

    def __init__(self, role: Role, swarm: Swarm, n: int) -> None:
        self.role, self.swarm, m = role, swarm, swarm.n_worlds * len(role.agents)
        self.obs = torch.zeros(n, m, role.width)
        kind = torch.long if role.model.sizes else torch.float32
        self.actions = torch.zeros(n, m, role.n_actions, dtype=kind)
        self.log_prob, self.rewards, self.values, self.later, self.goes_on, self.alive = torch.zeros(6, n, m)
        self.mask = None if swarm.masks is None else torch.ones(n, m, sum(role.model.sizes), dtype=torch.bool)
        self.states = torch.zeros(n, *swarm.central_state.shape) if role.is_central else None
        self.start, _ = role.carried(swarm)
        self.begins = torch.zeros(n, m, dtype=torch.bool)

    def decide(self, t: int) -> np.ndarray:
        """Draw actions, (W, agents, n)."""
        role, swarm, model = self.role, self.swarm, self.role.model
        self.obs[t], self.alive[t], mask = role.obs(swarm.obs), role.of(swarm.alive).float(), None
        check_finite("an observation", self.obs[t])
        if self.mask is not None:
            mask = self.mask[t] = role.mask(swarm)
        if self.states is not None:
            self.states[t] = torch.from_numpy(swarm.central_state.astype(np.float32))
        before, self.begins[t] = role.carried(swarm)
        with torch.no_grad():
            distributions, policy = model.distributions(self.obs[t], mask, before)
            drawn = [d.sample() for d in distributions]
            self.actions[t] = torch.stack(drawn, -1) if model.sizes else drawn[0]
            self.log_prob[t] = model.log_prob(distributions, self.actions[t])
            self.values[t], critic = model.value(role.seen(self.obs[t], swarm.central_state), before)
        role.kept[swarm] = torch.stack([policy, critic], 1)
        return np.asarray(self.actions[t].numpy().reshape(swarm.n_worlds, len(role.agents), -1))

    def note(self, t: int) -> None:
        """Note what followed; a truncated episode would go on."""
        role, swarm = self.role, self.swarm
        over, terminated = swarm.over, role.of(swarm.terminations)
        self.rewards[t] = role.of(swarm.rewards).float()
        next_obs = role.obs(np.where(over[:, None, None], swarm.final_obs, swarm.obs))
        states = (
            np.where(over[:, None], swarm.final_central_state, swarm.central_state)
            if role.is_central
            else over
        )
        with torch.no_grad():
            self.later[t], _ = role.model.value(role.seen(next_obs, states), role.kept[swarm])
        self.later[t] *= (~terminated).float()
        self.goes_on[t] = (~(terminated | torch.from_numpy(over).repeat_interleave(len(role.agents)))).float()

    def decisions(self, discount: float, trace: float) -> Decisions:
        """The decisions of the living, with their advantages."""
        advantages, last = torch.zeros_like(self.rewards), torch.zeros_like(self.rewards[0])
        for t in reversed(range(len(advantages))):
            delta = self.rewards[t] + discount * self.later[t] - self.values[t]
            last = advantages[t] = delta + discount * trace * self.goes_on[t] * last
        there, n_agents = self.alive.bool(), len(self.role.agents)
        time, agent = torch.meshgrid(*map(torch.arange, there.shape), indexing="ij")
        place = time * self.swarm.n_worlds + agent // n_agents
        if self.role.model.memory:
            lived = there.any(0)
            start = self.start[lived]

            def rows(array: Any) -> Any:
                return array.transpose(0, 1)[lived]
        else:
            start = self.start[agent[there]]

            def rows(array: Any) -> Any:
                return array[there]

        return Decisions(
            rows(self.obs), rows(self.actions), rows(self.log_prob), rows(advantages), rows(advantages + self.values), rows(place),
            None if self.mask is None else rows(self.mask), None if self.states is None else self.states.flatten(0, 1),
            rows(there), start, rows(self.begins),
        )  # fmt: skip


__all__ = ["Decisions", "Role", "Rollout", "check_finite"]
