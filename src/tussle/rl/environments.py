"""Gymnasium's interfaces: a stack of worlds as a `VectorEnv`, one world as an `Env`."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from tussle.arguments import check_kind, explained
from tussle.errors import ParameterError, listed, nearest_name
from tussle.rl.action import array_of
from tussle.rl.episodes import checked_seeds, is_whole
from tussle.rl.swarm import Swarm, task_of
from tussle.rl.task import Task

MODES = {
    "next_step": AutoresetMode.NEXT_STEP,
    "same_step": AutoresetMode.SAME_STEP,
    "disabled": AutoresetMode.DISABLED,
}
RENDER_MODES = ("rgb_array", "human")
OPTIONS = ("params",)
VECTOR_OPTIONS = ("params", "reset_mask")


def world_spaces(task: Task) -> tuple[spaces.Space[Any], spaces.Space[Any]]:
    """Observations and actions of all agents of a world; without the axis of agents if there is one agent.

    Raises:
        ParameterError: Blocks have parts of the observation with different names.
    """
    n = len(task.agent_names)
    action = max((task.action_space(a) for a in range(n)), key=spaces.flatdim)
    parts = list(task.parts.values())
    if any(each != parts[0] for each in parts):
        raise ParameterError(
            f"{type(task).__name__}: blocks observe different parts; use the interface of PettingZoo"
        )
    low, high = task.limits if n > 1 else task.limits[:, 0]
    flat = spaces.Box(low, high, dtype=task.dtype)
    if n > 1:
        action = batch_space(action, n)
    if not parts[0]:
        return flat, action
    return spaces.Dict(
        {
            name: spaces.Box(flat.low[..., at], flat.high[..., at], dtype=task.dtype)
            for name, at in parts[0].items()
        }
    ), action


def in_parts(task: Task, seen: np.ndarray, block: int = 0) -> Any:
    """Observations of a block, (..., n), as a dict if its parts have names."""
    parts = task.parts[task.blocks[block].name]
    return {name: seen[..., at] for name, at in parts.items()} if parts else seen


def check_options(options: Any, known: tuple[str, ...] = OPTIONS) -> dict[str, Any]:
    """Options of a reset; warns of those that have no effect."""
    check_kind("options", options, Mapping[str, Any] | None)
    given = dict(options or {})
    for name in given:
        if name not in known:
            warnings.warn(
                f"reset ignores the option {name!r}{nearest_name(name, known)}; {listed(known)}",
                stacklevel=3,
            )
    return given


def reset_one(swarm: Swarm, seed: Any, options: Any) -> None:
    """Reset a swarm of one world, whose seed is one number.

    Raises:
        ParameterError: The seed or a parameter is not allowed.
    """
    if seed is not None and not is_whole(seed):
        raise ParameterError(f"seed = {seed!r} is not allowed; it takes a whole number, or None")
    swarm.reset(seed, None, options.get("params"))


def told_of_one(swarm: Swarm) -> dict[str, Any]:
    """Parameters that were given or drawn for the episode of a swarm of one world, as an info; empty without any."""
    values = {path: value[0] for path, value in swarm.params.items() if not path.startswith("_")}
    return (
        {
            "params": {
                path: value.item() if value.ndim == 0 else value.copy() for path, value in values.items()
            }
        }
        if values
        else {}
    )


def _of_worlds(
    alive: np.ndarray, seeds: np.ndarray, params: dict[str, Any], worlds: np.ndarray
) -> dict[str, Any]:
    """Infos of some worlds, (W,); those of the others are zeros."""
    info: dict[str, Any] = {
        "alive": alive & worlds[:, None],
        "seed": np.where(worlds, seeds, 0),
        "params": {},
    }
    for path, values in params.items():
        if not path.startswith("_"):
            have = params[f"_{path}"] & worlds
            told = values.copy()
            told[~have] = values.dtype.type()
            info["params"] |= {path: told, f"_{path}": have}
    if not info["params"]:
        del info["params"]
    return {**info, **{f"_{name}": worlds.copy() for name in info}}


def _terms_of_worlds(swarm: Swarm, worlds: np.ndarray) -> dict[str, Any]:
    """Sums of each term over the agents of some worlds, (W,), as an info of their own, since a term may have any name."""
    terms: dict[str, Any] = {}
    for name, term in swarm.terms.items():
        terms |= {name: np.where(worlds, term.sum(axis=1), 0), f"_{name}": worlds.copy()}
    return {"terms": terms, "_terms": worlds.copy()}


class Pictures:
    """Shows world 0 of a swarm: as pictures, or in a browser while it plays. Starts at the first use.

    Args:
        swarm: The swarm.
        render_mode: "rgb_array", "human" or None.

    Raises:
        ParameterError: The mode is not known.
    """

    def __init__(self, swarm: Swarm, render_mode: str | None) -> None:
        if render_mode is not None and render_mode not in RENDER_MODES:
            raise ParameterError(f"render_mode = {render_mode!r} is not allowed; {listed(RENDER_MODES)}")
        self._swarm, self._mode = swarm, render_mode
        self._camera: Any = None
        self._page: Any = None

    def picture(self) -> Any:
        """The present state, (height, width, 3), in mode "rgb_array"; otherwise None."""
        if self._mode != "rgb_array":
            return None
        if self._camera is None:
            from tussle.rl.picture import WorldCamera  # needs the packages of tussle[view]

            self._camera = WorldCamera(self._swarm.simulation)
        return self._camera.picture()

    def follow(self) -> None:
        """In mode "human", show the present state in the browser, and wait while the game is paused there."""
        if self._mode != "human":
            return
        if self._page is None:
            from tussle.view import Live  # needs the packages of tussle[view]
            from tussle.view.page.server import Page

            self._page = Page(Live(self._swarm.simulation, is_followed=True))
            sys.stderr.write(f"{self._page.game.name}: {self._page.url}\n")
            self._page.open()
        self._page.game.follow()

    def close(self) -> None:
        """Free the renderer and end the page."""
        if self._camera is not None:
            self._camera.close()
        if self._page is not None:
            self._page.stop()
            self._page.game.stop()
        self._camera = self._page = None


def metadata_of(task: Task) -> dict[str, Any]:
    return {"render_modes": list(RENDER_MODES), "render_fps": 1.0 / (task.given.dt * task.decide_every)}


class TaskVectorEnv(VectorEnv[Any, Any, Any]):
    """The worlds of a task as a Gymnasium `VectorEnv`; see `make_vec`."""

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 10.0}  # noqa: RUF012 - as in the base class

    def __init__(
        self, task: Any, num_envs: int = 1, *, autoreset: Any = "next_step", threads: int = 1,
        render_mode: str | None = None, copy: bool = True,
    ) -> None:  # fmt: skip
        mode = next((name for name, known in MODES.items() if known == autoreset), autoreset)
        self.swarm = Swarm(task, num_envs, autoreset=mode, threads=threads)
        self.task, self.num_envs, self.copy = self.swarm.task, self.swarm.n_worlds, copy
        self.render_mode = render_mode
        self.metadata = {**metadata_of(self.task), "autoreset_mode": MODES[mode]}
        self.single_observation_space, self.single_action_space = world_spaces(self.task)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._pictures = Pictures(self.swarm, render_mode)

    def _seen(self, array: np.ndarray) -> Any:
        shown = array[:, 0] if self.swarm.n_agents == 1 else array
        return in_parts(self.task, shown.copy() if self.copy else shown)

    def _info(self) -> dict[str, Any]:
        swarm, every = self.swarm, np.ones(self.num_envs, bool)
        info = _of_worlds(swarm.alive, swarm.seeds, swarm.params, every)
        if swarm.masks is not None:
            mask = swarm.masks.astype(np.int8)
            info |= {"action_mask": mask[:, 0] if swarm.n_agents == 1 else mask, "_action_mask": every}
        return info

    def _final_info(self, over: np.ndarray) -> dict[str, Any]:
        """Infos at the end of the episodes that are over, as Gymnasium's own vector environments give them."""
        swarm = self.swarm
        info = _of_worlds(swarm.final_alive, swarm.final_seeds, swarm.final_params, over)
        return {**info, **_terms_of_worlds(swarm, over)}

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Start new episodes.

        Args:
            seed: Seed of world 0, world k has seed + k; or one for each world, of which None continues the sequence of its world.
            options: "reset_mask" chooses the worlds, (W,); "params" are parameters by path, as in `Swarm.reset`: one value, or one
                for each chosen world.

        Raises:
            ParameterError: A seed, the mask or a parameter is not allowed. Nothing has changed.
        """
        given = check_options(options, VECTOR_OPTIONS)
        worlds = self._chosen(given.get("reset_mask"))
        seeds = checked_seeds(seed, np.arange(self.num_envs))
        self.swarm.reset([seeds[w] for w in worlds], worlds, given.get("params"))
        if is_whole(seed):
            super().reset(seed=int(seed))
        self._pictures.follow()
        return self._seen(self.swarm.obs), self._info()

    def _chosen(self, mask: Any) -> np.ndarray:
        """Numbers of the worlds of a mask; None stands for all."""
        chosen = np.ones(self.num_envs, bool) if mask is None else np.asarray(mask)
        if chosen.shape != (self.num_envs,) or not np.isin(chosen, (0, 1)).all():
            raise ParameterError(
                f"reset_mask = {chosen.tolist()} is not allowed; it takes {self.num_envs} truth values, one per world"
            )
        return np.flatnonzero(chosen)

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Play one decision in all worlds; rewards are sums over agents."""
        swarm = self.swarm
        given = array_of("actions", actions)
        if swarm.n_agents == 1:
            if given.shape != self.action_space.shape:
                raise ParameterError(
                    f"actions have shape {given.shape}; the shape must be {self.action_space.shape}"
                )
            given = given.reshape(self.num_envs, 1, -1)
        obs, rewards, _, _, _ = swarm.step(given)
        info = {**self._info(), **_terms_of_worlds(swarm, np.ones(self.num_envs, bool))}
        over = swarm.over.copy()
        if over.any() and swarm.autoreset == "same_step":
            info["final_obs"], info["_final_obs"] = self._seen(swarm.final_obs), over
            info["final_info"], info["_final_info"] = self._final_info(over), over.copy()
        late = swarm.late & over
        self._pictures.follow()
        return self._seen(obs), rewards.sum(axis=1, dtype=float), over & ~late, late, info

    def render(self) -> Any:
        """Pictures, (height, width, 3), of world 0 alone, since each costs much: a tuple of one."""
        picture = self._pictures.picture()
        return None if picture is None else (picture,)

    def close_extras(self, **kwargs: Any) -> None:
        self._pictures.close()
        self.swarm.close()


class TaskEnv(gymnasium.Env[Any, Any]):
    """One world of a task as a Gymnasium `Env`; see `make`."""

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 10.0}  # noqa: RUF012 - as in the base class

    def __init__(self, task: Any, *, render_mode: str | None = None, threads: int = 1) -> None:
        self.swarm = Swarm(task, 1, autoreset="disabled", threads=threads)
        self.task = self.swarm.task
        self.render_mode = render_mode
        self.metadata = metadata_of(self.task)
        self.observation_space, self.action_space = world_spaces(self.task)
        self._pictures = Pictures(self.swarm, render_mode)

    def _seen(self, array: np.ndarray) -> Any:
        return in_parts(self.task, np.array(array[0, 0] if self.swarm.n_agents == 1 else array[0]))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start a new episode; `options` may have "params", parameters by path."""
        reset_one(self.swarm, seed, check_options(options))
        super().reset(seed=None if seed is None else int(seed))
        self._pictures.follow()
        return self._seen(self.swarm.obs), self._info()

    def _info(self) -> dict[str, Any]:
        swarm, info = self.swarm, {}
        if swarm.masks is not None:
            info["action_mask"] = (swarm.masks[0, 0] if swarm.n_agents == 1 else swarm.masks[0]).astype(
                np.int8
            )
        return {"alive": swarm.alive[0].copy(), "seed": int(swarm.seeds[0]), **info, **told_of_one(swarm)}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Play one decision; the reward is the sum over agents."""
        given = array_of("the action", action)
        if given.shape != self.action_space.shape:
            raise ParameterError(
                f"the action has shape {given.shape}; the shape must be {self.action_space.shape}"
            )
        swarm = self.swarm
        obs, rewards, _, _, _ = swarm.step(given.reshape(1, swarm.n_agents, -1))
        info = {**self._info(), "terms": {name: float(term.sum()) for name, term in swarm.terms.items()}}
        over, late = bool(swarm.over[0]), bool(swarm.late[0])
        self._pictures.follow()
        return self._seen(obs), float(rewards.sum(dtype=float)), over and not late, over and late, info

    def render(self) -> Any:
        """A picture, (height, width, 3), in mode "rgb_array"."""
        return self._pictures.picture()

    def state(self) -> dict[str, Any]:
        """A copy of everything, for `restore`."""
        return self.swarm.state()

    def restore(self, state: dict[str, Any]) -> None:
        """Return to a state."""
        self.swarm.restore(state)

    def close(self) -> None:
        self._pictures.close()
        self.swarm.close()


def make_vec(
    task: Any, num_envs: int = 1, *, autoreset: Any = "next_step", threads: int = 1, render_mode: str | None = None,
    copy: bool = True,
) -> TaskVectorEnv:  # fmt: skip
    """The worlds of a task as a Gymnasium `VectorEnv`; of several agents, observations and actions have an axis more.

    Args:
        task: A Task, or a class of one.
        num_envs: Number of worlds.
        autoreset: "next_step", "same_step", "disabled", or Gymnasium's `AutoresetMode`.
        threads: Number of threads a step may use.
        render_mode: "rgb_array"; "human", which shows world 0 in a browser while it plays; or None.
        copy: Return copies of the observations; otherwise the next step overwrites them.
    """
    return TaskVectorEnv(
        task, num_envs, autoreset=autoreset, threads=threads, render_mode=render_mode, copy=copy
    )


def make(task: Any, *, render_mode: str | None = None, threads: int = 1) -> TaskEnv:
    """One world of a task as a Gymnasium `Env`, for one agent or for a team with one learner."""
    return TaskEnv(task, render_mode=render_mode, threads=threads)


@explained
def register(name: str, task: Any) -> None:
    """Register a task with Gymnasium, for `gymnasium.make(name)` and `gymnasium.make_vec(name)`.

    Raises:
        ParameterError: It is no task.
    """
    if not (isinstance(task, type) and issubclass(task, Task)):
        task_of(task)
    gymnasium.register(
        id=name,
        entry_point="tussle.rl.environments:TaskEnv",
        vector_entry_point="tussle.rl.environments:TaskVectorEnv",
        kwargs={"task": task},
    )


__all__ = ["TaskEnv", "TaskVectorEnv", "make", "make_vec", "register", "task_of"]
