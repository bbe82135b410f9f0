"""Proximal policy optimization (PPO): a policy for all agents of a task, or one for each role, which play in one stack of worlds.

The objective is that of Schulman, Wolski, Dhariwal, Radford and Klimov (2017), equation 7, with the generalized advantage estimates of
Schulman, Moritz, Levine, Jordan and Abbeel (2016), equation 16. Each agent observes, decides and is rewarded by itself; critic and
policy share no layers. With `critic = "central"` the critic sees the state of the world as well (MAPPO: Yu and others 2022). With
`memory` both have a gated recurrent unit (Cho and others 2014), and minibatches consist of the whole sequences of some agents.
"""

from __future__ import annotations

import csv
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np

from tussle.errors import MissingExtraError, ParameterError, RecordError, listed
from tussle.notebook_bar import Show, notebook_bar
from tussle.rl.actor_critic import ActorCritic
from tussle.rl.evaluation import interval, play_episodes
from tussle.rl.policy_file import kept_file, write_policy
from tussle.rl.rollout import Decisions, Role, Rollout, check_finite
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
        for role in self.roles.values():
            role.kept.clear()
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
            before, _ = role.carried(swarm)
            with torch.no_grad():
                chosen, role.kept[swarm] = role.model.most_likely(
                    role.obs(swarm.obs), before, role.mask(swarm)
                )
            chosen = chosen.numpy().reshape(len(actions), len(role.agents), -1)
            actions[:, role.agents, : role.n_actions] = chosen
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
            for some in torch.randperm(len(batch.log_prob)).split(
                max(1, s.minibatch // batch.log_prob[0].numel())
            ):
                mask = None if batch.mask is None else batch.mask[some]
                there, memory = batch.there[some], (batch.start[some], batch.begins[some])
                distributions, _ = model.distributions(batch.obs[some], mask, *memory)
                log_prob = model.log_prob(distributions, batch.actions[some])
                ratio = (log_prob - batch.log_prob[some])[there].exp()
                gain = batch.advantages[some][there]
                gain = (gain - gain.mean()) / (gain.std(correction=0) + 1e-8)
                clipped = ratio.clamp(1.0 - s.clip, 1.0 + s.clip)
                value = model.value(batch.seen(some), *memory)[0][there]
                entropy = sum(d.entropy()[there].mean() for d in distributions)
                loss = -torch.minimum(gain * ratio, gain * clipped).mean() - s.entropy * entropy
                loss = loss + 0.5 * (value - batch.returns[some][there]).square().mean()
                check_finite("the loss", loss)
                role.optimizer.zero_grad()
                loss.backward()
                check_finite("the gradient of the loss", nn.utils.clip_grad_norm_(model.parameters, 0.5))
                role.optimizer.step()
                sizes = [each.detach().abs().sum() for each in (*model.parameters, model.log_std.exp().log())]
                check_finite("a weight", torch.stack(sizes))

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
            known = state["task"], {**asdict(Settings()), **state["settings"]}  # of a former version
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
