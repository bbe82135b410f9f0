"""Proximal policy optimization (PPO): a policy for all agents of a task, or one for each role, which play in one stack of worlds.

The objective is that of Schulman, Wolski, Dhariwal, Radford and Klimov (2017), equation 7, with the generalized advantage estimates of
Schulman, Moritz, Levine, Jordan and Abbeel (2016), equation 16. Each agent observes, decides and is rewarded by itself; critic and
policy share no layers. With `critic = "central"` the critic sees the state of the world as well (MAPPO: Yu and others 2022).
"""

from __future__ import annotations

import csv
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tussle.errors import MissingExtraError, ParameterError, RecordError, listed
from tussle.notebook_bar import Show, notebook_bar
from tussle.rl.actor_critic import ActorCritic
from tussle.rl.evaluation import interval, play_episodes
from tussle.rl.policy_file import kept_file, write_policy
from tussle.rl.settings import Settings
from tussle.rl.swarm import Swarm
from tussle.rl.task import Task

try:
    import torch
    from torch import nn
except ImportError:
    raise MissingExtraError("training needs PyTorch: pip install 'tussle[train]'") from None

CURVE = ("minutes", "decisions", "episodes", "episode_return", "reward_per_decision")
"""Columns of curve.csv."""
EVALUATIONS = ("minutes", "decisions", "episodes", "episode_return", "low", "high")
"""Columns of evaluations.csv; low and high are the ends of the 95 % confidence interval of the mean."""


@dataclass
class Decisions:
    """Decisions of living agents side by side, (m, ...); `states` are those of the worlds, of which `place` is the row, (m,)."""

    obs: Any
    actions: Any
    log_prob: Any
    advantages: Any
    returns: Any
    place: Any
    mask: Any
    states: Any

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
            self.width, sizes, self.n_actions if not sizes else 0, settings.hidden, n_state
        )
        self.optimizer = torch.optim.Adam(self.model.parameters, lr=settings.learning_rate, eps=1e-5)

    def of(self, array: np.ndarray) -> Any:
        """Values of the agents of this role, (W, A, ...), as (m, ...)."""
        mine = np.ascontiguousarray(array[:, self.agents])
        return torch.from_numpy(mine.reshape(-1, *mine.shape[2:]))

    def obs(self, array: np.ndarray) -> Any:
        return self.of(array)[:, : self.width].float()

    def mask(self, swarm: Swarm) -> Any:
        return None if swarm.masks is None else self.of(swarm.masks)[:, : sum(self.model.sizes)]

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

    def decide(self, t: int) -> np.ndarray:
        """Draw actions, (W, agents, n)."""
        role, swarm, model = self.role, self.swarm, self.role.model
        self.obs[t], self.alive[t], mask = role.obs(swarm.obs), role.of(swarm.alive).float(), None
        check_finite("an observation", self.obs[t])
        if self.mask is not None:
            mask = self.mask[t] = role.mask(swarm)
        if self.states is not None:
            self.states[t] = torch.from_numpy(swarm.central_state.astype(np.float32))
        with torch.no_grad():
            distributions = model.distributions(self.obs[t], mask)
            drawn = [d.sample() for d in distributions]
            self.actions[t] = torch.stack(drawn, -1) if model.sizes else drawn[0]
            self.log_prob[t] = model.log_prob(distributions, self.actions[t])
            self.values[t] = model.critic(role.seen(self.obs[t], swarm.central_state))[:, 0]
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
            self.later[t] = role.model.critic(role.seen(next_obs, states))[:, 0]
        self.later[t] *= (~terminated).float()
        self.goes_on[t] = (~(terminated | torch.from_numpy(over).repeat_interleave(len(role.agents)))).float()

    def decisions(self, discount: float, trace: float) -> Decisions:
        """The decisions of the living, with their advantages."""
        advantages, last = torch.zeros_like(self.rewards), torch.zeros_like(self.rewards[0])
        for t in reversed(range(len(advantages))):
            delta = self.rewards[t] + discount * self.later[t] - self.values[t]
            last = advantages[t] = delta + discount * trace * self.goes_on[t] * last
        there, n_worlds = self.alive.bool(), self.swarm.n_worlds
        time, agent = there.nonzero(as_tuple=True)
        place = time * n_worlds + agent // len(self.role.agents)
        return Decisions(
            self.obs[there], self.actions[there], self.log_prob[there], advantages[there],
            (advantages + self.values)[there], place, None if self.mask is None else self.mask[there],
            None if self.states is None else self.states.flatten(0, 1),
        )  # fmt: skip


class Trainer:
    """Trains the policies of a task.

    Args:
        task: The task.
        name: How `Learned` finds the task: its registered id.
        folder: Gets checkpoint.pt, curve.csv, evaluations.csv, and policy.onnx, or NAME.onnx for each policy that the task names.
        seed: Of the worlds, the first weights and the exploration.
        settings: Of PPO.

    Attributes:
        roles: What learns, by the name of the policy.

    Raises:
        ParameterError: Blocks of one policy differ in form.
    """

    def __init__(self, task: Task, name: str, folder: Path, seed: int, settings: Settings) -> None:
        self.task, self.name, self.folder, self.seed, self.settings = task, name, folder, seed, settings
        torch.set_num_threads(1)
        torch.manual_seed(seed)
        self.swarm = Swarm(task, settings.worlds)
        self.roles = {role: Role(self.swarm, blocks, settings) for role, blocks in task.roles.items()}
        self.minutes, self.n_decisions, self.n_episodes = 0.0, 0, 0
        self.curve: list[list[float]] = []
        self.evaluations: list[list[float]] = []
        self.begin(seed)

    @property
    def model(self) -> ActorCritic:
        """The model of the only role.

        Raises:
            ParameterError: There are several.
        """
        if len(self.roles) > 1:
            raise ParameterError(f"{self.name} has several policies; {listed(self.roles)}")
        return next(iter(self.roles.values())).model

    def begin(self, seed: int) -> None:
        """Start episodes, and play world k of W for the share k / W of one, so that an update has decisions from all its phases."""
        swarm = self.swarm
        swarm.reset(seed)
        idle = self._idle(swarm)
        n = self.task.n_steps // self.task.decide_every
        begins = n - n * np.arange(swarm.n_worlds) // swarm.n_worlds
        for t in range(n):
            due = np.flatnonzero(begins == t)
            if len(due):
                swarm.reset(None, due)
            swarm.step(idle)

    @staticmethod
    def _idle(swarm: Swarm) -> np.ndarray:
        shape = swarm.n_worlds, swarm.n_agents, swarm.action_width
        return np.zeros(shape, np.float32 if swarm.is_continuous else np.int64)

    # -- playing -----------------------------------------------------------------------------------------------------------

    def play(self) -> tuple[dict[str, Decisions], float, float]:
        """Play `decisions` decisions. Returns them by role, the mean return of the episodes that ended, and the mean reward."""
        swarm, s = self.swarm, self.settings
        rollouts = {name: Rollout(role, swarm, s.decisions) for name, role in self.roles.items()}
        ended: list[float] = []
        actions = self._idle(swarm)
        for t in range(s.decisions):
            for rollout in rollouts.values():
                actions[:, rollout.role.agents, : rollout.role.n_actions] = rollout.decide(t)
            swarm.step(actions)
            for rollout in rollouts.values():
                rollout.note(t)
            ended += swarm.returns[swarm.over].sum(axis=-1).tolist()
        there = [rollout.alive.bool() for rollout in rollouts.values()]
        self.n_decisions += sum(int(each.sum()) for each in there)
        self.n_episodes += len(ended)
        gained = [r.rewards[each] for r, each in zip(rollouts.values(), there, strict=True)]
        batches = {name: rollout.decisions(s.discount, s.trace) for name, rollout in rollouts.items()}
        return batches, float(np.mean(ended)) if ended else np.nan, float(torch.cat(gained).mean())

    def decide(self, swarm: Swarm) -> np.ndarray:
        """The most likely actions, (W, A, n)."""
        actions = self._idle(swarm)
        for role in self.roles.values():
            with torch.no_grad():
                chosen = role.model.most_likely(role.obs(swarm.obs), role.mask(swarm)).numpy()
            actions[:, role.agents, : role.n_actions] = chosen.reshape(len(actions), len(role.agents), -1)
        return actions

    def evaluate(self) -> np.ndarray:
        """Play episodes with the most likely actions, and return the sum of rewards of each, (evaluate_episodes,)."""
        return play_episodes(self.task, self.decide, self.settings.evaluate_episodes)

    # -- learning ----------------------------------------------------------------------------------------------------------

    def update(self, role: Role, batch: Decisions, share: float) -> None:
        """Improve policy and critic of a role; `share` of the time is over."""
        s, model = self.settings, role.model
        for group in role.optimizer.param_groups:
            group["lr"] = s.learning_rate * (1.0 - 0.9 * share)
        for _ in range(s.epochs):
            for some in torch.randperm(len(batch.log_prob)).split(s.minibatch):
                mask = None if batch.mask is None else batch.mask[some]
                distributions = model.distributions(batch.obs[some], mask)
                ratio = (model.log_prob(distributions, batch.actions[some]) - batch.log_prob[some]).exp()
                gain = batch.advantages[some]
                gain = (gain - gain.mean()) / (gain.std(correction=0) + 1e-8)
                clipped = ratio.clamp(1.0 - s.clip, 1.0 + s.clip)
                value = model.critic(batch.seen(some))[:, 0]
                entropy = sum(d.entropy().mean() for d in distributions)
                loss = -torch.minimum(gain * ratio, gain * clipped).mean() - s.entropy * entropy
                loss = loss + 0.5 * (value - batch.returns[some]).square().mean()
                check_finite("the loss", loss)
                role.optimizer.zero_grad()
                loss.backward()
                check_finite("the gradient of the loss", nn.utils.clip_grad_norm_(model.parameters, 0.5))
                role.optimizer.step()

    def train(self, minutes: float, tell: Callable[[dict[str, float]], bool]) -> None:
        """Train until `minutes` are over, those before a checkpoint included; at least one update. In a notebook, a bar shows the progress.

        Args:
            minutes: Wall time without evaluations [min].
            tell: Called after each update with the new line of the curve, by its columns, and after an evaluation with "low" and "high",
                the ends of the 95 % interval of "evaluated", the mean return; ends the training where it returns true.

        Raises:
            ParameterError: Observations, the loss or its gradient are not finite; files keep what was saved before.
            RecordError: The folder cannot be written.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RecordError(f"{self.folder}: cannot be written: {error.strerror or error}") from error
        with notebook_bar("training") as show:
            self._train(minutes, tell, show)

    def _train(self, minutes: float, tell: Callable[[dict[str, float]], bool], show: Show | None) -> None:
        began, before = time.monotonic(), self.minutes
        is_due, every = True, self.settings.evaluate_every
        while is_due:
            batches, episode_return, reward = self.play()
            for name, batch in batches.items():
                if len(batch.log_prob):
                    self.update(self.roles[name], batch, min(1.0, self.minutes / minutes))
            self.minutes = before + (time.monotonic() - began) / 60.0
            self.curve.append(
                [self.minutes, float(self.n_decisions), float(self.n_episodes), episode_return, reward]
            )
            line = dict(zip(CURVE, self.curve[-1], strict=True))
            if show is not None:
                show(self.minutes, minutes, f"min, return {episode_return:.2f}")
            if every and len(self.curve) % every == 0:
                paused = time.monotonic()
                line |= self._evaluated()
                began += time.monotonic() - paused
            is_due = not tell(line) and self.minutes < minutes
            if not is_due or len(self.curve) % 20 == 0:
                self.save()

    def _evaluated(self) -> dict[str, float]:
        """Evaluate, and note the mean with its interval."""
        returns = self.evaluate()
        mean, low, high = interval(returns)
        self.evaluations.append([*self.curve[-1][:2], float(len(returns)), mean, low, high])
        return {"evaluated": mean, "low": low, "high": high}

    # -- files -------------------------------------------------------------------------------------------------------------

    @property
    def files(self) -> dict[str, Path]:
        """File of each policy, by its name."""
        return {name: self.folder / f"{name or 'policy'}.onnx" for name in self.roles}

    def save(self) -> None:
        """Write checkpoint.pt, curve.csv, evaluations.csv and the policies."""
        roles = {name: [role.model.state(), role.optimizer.state_dict()] for name, role in self.roles.items()}
        state = {"roles": roles, "settings": asdict(self.settings), "task": self.name,
                 "counts": [self.minutes, self.n_decisions, self.n_episodes], "curve": self.curve,
                 "evaluations": self.evaluations, "random": torch.get_rng_state()}  # fmt: skip
        with kept_file(self.folder / "checkpoint.pt") as part:
            torch.save(state, part)
        tables = {"curve": (CURVE, self.curve), "evaluations": (EVALUATIONS, self.evaluations)}
        for table, (columns, lines) in tables.items():
            if lines:
                with (
                    kept_file(self.folder / f"{table}.csv") as part,
                    part.open("w", newline="", encoding="utf-8") as file,
                ):
                    csv.writer(file).writerows([columns, *lines])
        for name, path in self.files.items():
            write_policy(path, self.roles[name].model.layers(), task=self.name)

    def resume(self) -> None:
        """Continue from checkpoint.pt; worlds begin new episodes.

        Raises:
            ParameterError: There is no checkpoint of this task with these settings.
        """
        path = self.folder / "checkpoint.pt"
        try:
            state = torch.load(path, weights_only=True)
            known = state["task"], state["settings"]
        except FileNotFoundError:
            raise ParameterError(f"{path} does not exist; train without --resume first") from None
        except Exception:  # noqa: BLE001 - of zip files, pickles and PyTorch
            raise ParameterError(
                f"{path} is damaged or no checkpoint; remove it, and train without --resume"
            ) from None
        if known != (self.name, asdict(self.settings)):
            raise ParameterError(
                f"{path} is of {state['task']} with {state['settings']}; resume with the same task and settings"
            )
        for name, (model, optimizer) in state["roles"].items():
            self.roles[name].model.load(model)
            self.roles[name].optimizer.load_state_dict(optimizer)
        self.minutes, self.n_decisions, self.n_episodes = state["counts"]
        self.curve, self.evaluations = state["curve"], state["evaluations"]
        torch.set_rng_state(state["random"])
        self.begin(self.seed + self.n_episodes + self.settings.worlds)


__all__ = ["CURVE", "Settings", "Trainer"]
