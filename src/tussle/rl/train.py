"""Proximal policy optimization (PPO): one policy for all agents of a task, which play in one stack of worlds.

The objective is that of Schulman, Wolski, Dhariwal, Radford and Klimov (2017), equation 7, with the generalized advantage estimates of
Schulman, Moritz, Levine, Jordan and Abbeel (2016), equation 16. Each agent observes, decides and is rewarded by itself; critic and
policy share no layers.
"""

from __future__ import annotations

import csv
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tussle.errors import MissingExtraError, ParameterError
from tussle.rl.policy_file import write_policy
from tussle.rl.swarm import Swarm
from tussle.rl.task import Task

try:
    import torch
    from torch import nn
except ImportError:
    raise MissingExtraError("training needs PyTorch: pip install 'tussle[train]'") from None

CURVE = ("minutes", "decisions", "episodes", "episode_return", "reward_per_decision")
"""Columns of curve.csv."""


@dataclass(frozen=True)
class Settings:
    """Settings of PPO.

    Attributes:
        worlds: Number of worlds.
        decisions: Decisions of each agent between two updates.
        epochs: Passes over these in an update.
        minibatch: Decisions per gradient step.
        hidden: Width of both hidden layers.
        learning_rate: Of Adam at the beginning; it falls linearly with time to a tenth.
        discount: Weight of a reward one decision later.
        trace: Weight of an advantage estimate that looks one decision further, lambda.
        clip: Largest change of a decision's probability that pays, as a share.
        entropy: Weight of the policy's entropy.
    """

    worlds: int = 32
    decisions: int = 128
    epochs: int = 4
    minibatch: int = 4096
    hidden: int = 64
    learning_rate: float = 1e-3
    discount: float = 0.99
    trace: float = 0.95
    clip: float = 0.2
    entropy: float = 0.0


class ActorCritic:
    """The policy, a multilayer perceptron, and the critic, another one.

    Args:
        width: Numbers of an observation.
        sizes: Number of levels of each action; () for actions in ranges.
        n_actions: Number of actions in ranges.
        hidden: Width of the hidden layers.
    """

    def __init__(self, width: int, sizes: tuple[int, ...], n_actions: int, hidden: int) -> None:
        self.sizes = sizes
        self.policy = perceptron(width, hidden, sum(sizes) or n_actions, 0.01)
        self.critic = perceptron(width, hidden, 1, 1.0)
        self.log_std = nn.Parameter(torch.full((n_actions,), -1.0))
        self.parameters = [*self.policy.parameters(), *self.critic.parameters(), self.log_std]

    def distributions(self, obs: Any) -> list[Any]:
        """Distributions of the actions, independent of each other."""
        out = self.policy(obs)
        if self.sizes:
            return [torch.distributions.Categorical(logits=part) for part in out.split(self.sizes, -1)]
        return [torch.distributions.Normal(out, self.log_std.exp())]

    def log_prob(self, distributions: list[Any], actions: Any) -> Any:
        """Logarithm of the density of actions, (m, n), as (m,)."""
        if not self.sizes:
            return distributions[0].log_prob(actions).sum(-1)
        return sum(d.log_prob(actions[:, i]) for i, d in enumerate(distributions))

    def state(self) -> dict[str, Any]:
        return {
            "policy": self.policy.state_dict(),
            "critic": self.critic.state_dict(),
            "log_std": self.log_std.data,
        }

    def load(self, state: dict[str, Any]) -> None:
        self.policy.load_state_dict(state["policy"])
        self.critic.load_state_dict(state["critic"])
        self.log_std.data.copy_(state["log_std"])

    def layers(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Weights (outputs, inputs) and biases of the policy's layers."""
        linear = [layer for layer in self.policy if isinstance(layer, nn.Linear)]
        return [(layer.weight.detach().numpy(), layer.bias.detach().numpy()) for layer in linear]


def perceptron(width: int, hidden: int, n_out: int, last: float) -> Any:
    """Two hidden layers of tanh with orthogonal weights; `last` scales those of the output."""
    layers: list[Any] = []
    for n_in, n, gain in ((width, hidden, 2**0.5), (hidden, hidden, 2**0.5), (hidden, n_out, last)):
        linear = nn.Linear(n_in, n)
        nn.init.orthogonal_(linear.weight, gain)
        nn.init.zeros_(linear.bias)
        layers += [linear, nn.Tanh()]
    return nn.Sequential(*layers[:-1])


@dataclass
class Decisions:
    """Decisions of living agents side by side, (m, ...)."""

    obs: Any
    actions: Any
    log_prob: Any
    advantages: Any
    returns: Any


class Trainer:
    """Trains a policy for a task.

    Args:
        task: The task; all its blocks share the policy, so their observations and actions have the same form.
        name: How `Learned` finds the task: its registered id.
        folder: Gets checkpoint.pt, curve.csv and policy.onnx.
        seed: Of the worlds, the first weights and the exploration.
        settings: Of PPO.

    Raises:
        ParameterError: The blocks differ in form.
    """

    def __init__(self, task: Task, name: str, folder: Path, seed: int, settings: Settings) -> None:
        if (
            len({(sum(w), str(d.space)) for w, d in zip(task.widths.values(), task.decoders, strict=True)})
            > 1
        ):
            raise ParameterError(
                f"{name}: the blocks {task.learners} observe or decide differently; one policy needs the same form"
            )
        self.task, self.name, self.folder, self.seed, self.settings = task, name, folder, seed, settings
        torch.set_num_threads(1)
        torch.manual_seed(seed)
        self.swarm = Swarm(task, settings.worlds)
        decoder = task.decoders[0]
        sizes = () if decoder.is_continuous else tuple(int(n) for n in decoder.sizes)
        n_actions = len(decoder.free) if decoder.is_continuous else 0
        self.model = ActorCritic(self.swarm.obs.shape[-1], sizes, n_actions, settings.hidden)
        self.optimizer = torch.optim.Adam(self.model.parameters, lr=settings.learning_rate, eps=1e-5)
        self.minutes, self.n_decisions, self.n_episodes = 0.0, 0, 0
        self.curve: list[list[float]] = []
        self.begin(seed)

    def begin(self, seed: int) -> None:
        """Start episodes, and play world k of W for the share k / W of one, so that an update has decisions from all its phases."""
        swarm = self.swarm
        swarm.reset(seed)
        shape = swarm.n_worlds, swarm.n_agents, swarm.action_width
        idle = np.zeros(shape, np.float32 if swarm.is_continuous else np.int64)
        n = self.task.n_steps // self.task.decide_every
        begins = n - n * np.arange(swarm.n_worlds) // swarm.n_worlds
        for t in range(n):
            due = np.flatnonzero(begins == t)
            if len(due):
                swarm.reset(None, due)
            swarm.step(idle)

    # -- playing -----------------------------------------------------------------------------------------------------------

    def play(self) -> tuple[Decisions, float, float]:
        """Play `decisions` decisions. Returns them, the mean return of the episodes that ended, and the mean reward."""
        swarm, s = self.swarm, self.settings
        shape = s.decisions, swarm.n_worlds * swarm.n_agents
        obs = torch.zeros(*shape, swarm.obs.shape[-1])
        actions = torch.zeros(
            *shape, swarm.action_width, dtype=torch.long if self.model.sizes else torch.float32
        )
        log_prob, rewards, values, later, goes_on, alive = torch.zeros(6, *shape)
        ended: list[float] = []
        for t in range(s.decisions):
            obs[t] = torch.from_numpy(swarm.obs.reshape(shape[1], -1).astype(np.float32))
            alive[t] = torch.from_numpy(swarm.alive.reshape(-1).astype(np.float32))
            with torch.no_grad():
                distributions = self.model.distributions(obs[t])
                drawn = [d.sample() for d in distributions]
                actions[t] = torch.stack(drawn, -1) if self.model.sizes else drawn[0]
                log_prob[t] = self.model.log_prob(distributions, actions[t])
                values[t] = self.model.critic(obs[t])[:, 0]
            chosen = actions[t].numpy().reshape(swarm.n_worlds, swarm.n_agents, -1)
            _, reward, terminated, _, _ = swarm.step(chosen)
            rewards[t] = torch.from_numpy(reward.reshape(-1).astype(np.float32))
            next_obs = np.where(swarm.over[:, None, None], swarm.final_obs, swarm.obs).reshape(shape[1], -1)
            with torch.no_grad():  # of what follows; a truncated episode would go on
                later[t] = self.model.critic(torch.from_numpy(next_obs.astype(np.float32)))[:, 0]
            later[t] *= torch.from_numpy(~terminated.reshape(-1)).float()
            goes_on[t] = torch.from_numpy(~(terminated | swarm.over[:, None]).reshape(-1)).float()
            ended += swarm.returns[swarm.over].sum(axis=-1).tolist()
        self.n_decisions += int(alive.sum())
        self.n_episodes += len(ended)
        advantages, last = torch.zeros(shape), torch.zeros(shape[1])
        for t in reversed(range(s.decisions)):
            delta = rewards[t] + s.discount * later[t] - values[t]
            last = advantages[t] = delta + s.discount * s.trace * goes_on[t] * last
        there = alive.bool()
        parts = [x[there] for x in (obs, actions, log_prob, advantages, advantages + values)]
        return Decisions(*parts), float(np.mean(ended)) if ended else np.nan, float(rewards[there].mean())

    # -- learning ----------------------------------------------------------------------------------------------------------

    def update(self, batch: Decisions, share: float) -> None:
        """Improve policy and critic; `share` of the time is over."""
        s = self.settings
        for group in self.optimizer.param_groups:
            group["lr"] = s.learning_rate * (1.0 - 0.9 * share)
        for _ in range(s.epochs):
            for some in torch.randperm(len(batch.log_prob)).split(s.minibatch):
                distributions = self.model.distributions(batch.obs[some])
                ratio = (self.model.log_prob(distributions, batch.actions[some]) - batch.log_prob[some]).exp()
                gain = batch.advantages[some]
                gain = (gain - gain.mean()) / (gain.std(correction=0) + 1e-8)
                clipped = ratio.clamp(1.0 - s.clip, 1.0 + s.clip)
                value = self.model.critic(batch.obs[some])[:, 0]
                entropy = sum(d.entropy().mean() for d in distributions)
                loss = -torch.minimum(gain * ratio, gain * clipped).mean() - s.entropy * entropy
                loss = loss + 0.5 * (value - batch.returns[some]).square().mean()
                self.optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(self.model.parameters, 0.5)
                self.optimizer.step()

    def train(self, minutes: float, tell: Callable[[dict[str, float]], bool]) -> None:
        """Train until `minutes` are over, those before a checkpoint included; at least one update.

        Args:
            minutes: Wall time [min].
            tell: Called after each update with the new line of the curve, by its columns; ends the training where it returns true.
        """
        began, before = time.monotonic(), self.minutes
        is_due = True
        while is_due:
            batch, episode_return, reward = self.play()
            self.update(batch, min(1.0, self.minutes / minutes))
            self.minutes = before + (time.monotonic() - began) / 60.0
            self.curve.append(
                [self.minutes, float(self.n_decisions), float(self.n_episodes), episode_return, reward]
            )
            is_stopped = tell(dict(zip(CURVE, self.curve[-1], strict=True)))
            is_due = self.minutes < minutes and not is_stopped
            if not is_due or len(self.curve) % 20 == 0:
                self.save()

    # -- files -------------------------------------------------------------------------------------------------------------

    def save(self) -> None:
        """Write checkpoint.pt, curve.csv and policy.onnx."""
        self.folder.mkdir(parents=True, exist_ok=True)
        state = {"model": self.model.state(), "optimizer": self.optimizer.state_dict(), "settings": asdict(self.settings),
                 "task": self.name, "counts": [self.minutes, self.n_decisions, self.n_episodes], "curve": self.curve,
                 "random": torch.get_rng_state()}  # fmt: skip
        torch.save(state, self.folder / "checkpoint.new")
        (self.folder / "checkpoint.new").replace(self.folder / "checkpoint.pt")
        with (self.folder / "curve.csv").open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([CURVE, *self.curve])
        write_policy(self.folder / "policy.onnx", self.model.layers(), task=self.name)

    def resume(self) -> None:
        """Continue from checkpoint.pt; worlds begin new episodes.

        Raises:
            ParameterError: There is no checkpoint of this task with these settings.
        """
        path = self.folder / "checkpoint.pt"
        try:
            state = torch.load(path, weights_only=True)
        except FileNotFoundError:
            raise ParameterError(f"{path} does not exist; train without --resume first") from None
        if (state["task"], state["settings"]) != (self.name, asdict(self.settings)):
            raise ParameterError(
                f"{path} is of {state['task']} with {state['settings']}; resume with the same task and settings"
            )
        self.model.load(state["model"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.minutes, self.n_decisions, self.n_episodes = state["counts"]
        self.curve = state["curve"]
        torch.set_rng_state(state["random"])
        self.begin(self.seed + self.n_episodes + self.settings.worlds)


__all__ = ["CURVE", "Settings", "Trainer"]
