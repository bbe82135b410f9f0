"""Agents of many worlds as arrays: the engine under all interfaces of `tussle.rl`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from tussle.arguments import explained
from tussle.batch.variables import Choice, Range
from tussle.documents import Whole, check_argument
from tussle.engine.simulation import Simulation
from tussle.errors import ParameterError, SnapshotError, WiringError, listed
from tussle.rl.action import array_of
from tussle.rl.episodes import Episodes, checked_params, checked_seeds, checked_value, checked_worlds
from tussle.rl.observation import AgentRows, Each
from tussle.rl.reward import COUNTED, NOBODY, Situation
from tussle.rl.searches import SharedSearches
from tussle.rl.task import Task

AUTORESET = ("next_step", "same_step", "disabled")


def task_of(task: Any) -> Task:
    """A task, from an instance or a class.

    Raises:
        ParameterError: It is neither.
    """
    made = task() if isinstance(task, type) and issubclass(task, Task) else task
    if not isinstance(made, Task):
        raise ParameterError(f"{task!r} is not a Task")
    return made


@explained
class Swarm:
    """The agents of a task in W worlds, A in each, as arrays (W, A, ...), which the next `step` or `reset` overwrites.

    Dead and unborn agents have zeros, and their actions are ignored. World k is bit for bit the same for any number of worlds and
    threads. All arrays are NumPy's, with `__dlpack__`: `torch.from_dlpack(obs)` shares their memory.

    Args:
        task: A Task, or a class of one.
        num_envs: Number of worlds.
        autoreset: When a world starts its next episode: "same_step", in the step that ended the last one (whose last observation is in
            `final_obs`); "next_step", in the step after, which ignores its actions; "disabled", by `reset` only.
        threads: Number of threads a step may use; results do not depend on it.

    Attributes:
        obs: Observations, (W, A, n), as returned.
        final_obs: Observations at the end of the last episode, (W, A, n), with "same_step"; `final_alive`, `final_seeds` and
            `final_params` are the others at that time.
        alive: Living agents, (W, A).
        over: Worlds whose episode ended in the last step, (W,); `late` those by the time limit.
        masks: Levels that each agent may choose, (W, A, n), if the task masks actions; all of the dead.
        terms: Terms of the last reward, weighted, by name, (W, A) each.
        returns: Sum of rewards of the present episode, (W, A); of the ended one in worlds that are `over`, until the next step.
        lengths: Decisions of that episode, (W,).
        seeds: Seed of each world's episode, (W,): `Simulation(task.played, seed)` begins it.

    Raises:
        ParameterError: A value is not allowed.
    """

    def __init__(
        self, task: Any, num_envs: int = 1, *, autoreset: str = "same_step", threads: int = 1
    ) -> None:
        self.task = task = task_of(task)
        if autoreset not in AUTORESET:
            raise ParameterError(f"autoreset = {autoreset!r} is not allowed; {listed(AUTORESET)}")
        check_argument("num_envs", num_envs, Whole(1))
        self.autoreset, self.n_worlds, self.n_agents = autoreset, int(num_envs), len(task.agent_names)
        worlds, shape, dtype = self.n_worlds, (self.n_worlds, self.n_agents), task.dtype
        width = max(sum(widths) for widths in task.widths.values())
        self.obs, self.final_obs = np.zeros((*shape, width), dtype), np.zeros((*shape, width), dtype)
        self.final_alive, self.final_seeds = np.zeros(shape, bool), np.zeros(worlds, np.uint64)
        self.final_params: dict[str, Any] = {}
        self.rewards, self.returns = np.zeros(shape, dtype), np.zeros(shape)
        self.terms = {name: np.zeros(shape, dtype) for name in task.reward}
        self.masks = (
            np.ones((*shape, max(sum(map(int, d.sizes)) for d in task.decoders)), bool)
            if task.has_mask
            else None
        )
        self._states = np.zeros((2, worlds, task.state.n), dtype) if task.state is not None else None
        self.terminations, self.truncations, self.alive = np.zeros((3, *shape), bool)
        self.lengths, (self.over, self.late) = np.zeros(worlds, np.int64), np.zeros((2, worlds), bool)
        self.episodes = Episodes(task, worlds)
        self.seeds = self.episodes.seeds
        self.simulation = Simulation(task.played, self.seeds.tolist(), threads=threads, on_error="raise")
        for variable in task.variables:
            checked_value(variable.name, variable, self.simulation.state.overrides)
        self.is_fresh = True
        team = np.array([b.team for b in task.blocks])[task.agent_block]
        self.now = Situation(self.simulation, team, self.alive)
        self.simulation.events.listen(self.now.listen, COUNTED)
        first = np.cumsum([0, *task.capacities])
        names = [b.name for b in task.given.blocks]
        self._blocks = {
            names.index(b.name): (b.name, int(first[i]), task.capacities[i])
            for i, b in enumerate(task.blocks)
        }
        self._decoders = {d.block: d for d in task.decoders}
        self.is_continuous = task.decoders[0].is_continuous
        if any(d.is_continuous != self.is_continuous for d in task.decoders):
            raise ParameterError(f"{type(task).__name__}: action: all blocks have ranges, or all have levels")
        places = [np.flatnonzero(task.agent_block == i) for i in range(len(task.blocks))]
        self._choosers = list(zip(task.decoders, places, strict=True))
        self.action_width = max(len(d.free) for d in task.decoders)
        self._ints: np.ndarray | None = None
        self._searches = SharedSearches(self.n_worlds * self.n_agents)
        self._parts: list[AgentRows] = []
        self._watching: list[AgentRows] = []
        seen = [task.components(b.name) for b in task.blocks]
        self._is_alike = all(each == seen[0] for each in seen) and not any(
            isinstance(c, Each) for c in seen[0]
        )
        self._columns, self._never_ends = task.columns, type(task).ends is Task.ends
        self._check_ends = True
        self._told: dict[str, Any] | None = None

    # -- episodes ----------------------------------------------------------------------------------------------------------

    def reset(
        self,
        seed: int | Iterable[int | None] | None = None,
        worlds: Any = None,
        params: Mapping[str, Any] | None = None,
    ) -> np.ndarray:
        """Start new episodes. If something is not allowed, nothing changes.

        Args:
            seed: Seed of world 0, world k has seed + k; or one for each of `worlds`; None continues the sequence of each world, or in
                a list that of one world.
            worlds: Numbers of the worlds, or a mask (W,); by default all.
            params: Parameters by path, as for `Simulation`: one value, or one for each of `worlds`; a distribution such as
                `uniform(10, 20)` gives each episode its own value, by the seed. A world keeps them in later episodes, besides those it
                was given before. {} returns to the mission's own values, None keeps the present ones.

        Returns:
            Observations, (W, A, n).

        Raises:
            ParameterError: A world, a seed or a parameter is not allowed.
        """
        chosen = checked_worlds(worlds, self.n_worlds)
        seeds = checked_seeds(seed, chosen)
        values = checked_params(params, self.simulation.state.overrides, len(chosen))
        with self._undone_if_refused(values is not None):
            self.episodes.begin(chosen, seeds, self.is_fresh)
            if values is not None:
                self.episodes.set_params(chosen, values)
                if not values:
                    self.simulation.state.overrides.clear(chosen)
                for path, items in values.items():
                    fixed = [i for i, item in enumerate(items) if not isinstance(item, Range | Choice)]
                    own = {path: [items[i] for i in fixed]}
                    self.simulation.state.overrides.set(own, chosen[fixed])
            self._begin(np.arange(self.n_worlds) if self.is_fresh else chosen)
            self.over[chosen] = False
            self._observe(None if self.is_fresh else chosen)
            self._look_ahead()
        self.is_fresh = False
        return self.obs

    @contextmanager
    def _undone_if_refused(self, has_params: bool) -> Iterator[None]:
        """Undo a reset if worlds cannot begin with their new parameters, which can each be allowed and leave no room together."""
        if not has_params:
            yield
            return
        episodes, overrides, is_fresh = self.episodes.state(), self.simulation.state.overrides, self.is_fresh
        params = overrides.save()
        try:
            saved = self.state()
        except SnapshotError:  # a plugin's objects cannot be copied
            saved = None
        try:
            yield
        except Exception:
            if saved is not None:
                self.restore(saved)
                self.is_fresh = is_fresh
            else:
                self.episodes.restore(episodes)
                overrides.restore(params)
                self._told = None
                self.is_fresh = True  # another reset has to come first
            raise

    def _begin(self, worlds: np.ndarray) -> None:
        """Restart worlds with their seeds and parameters."""
        overrides, self._told = self.simulation.state.overrides, None
        for some, drawn in self.episodes.drawn(worlds, overrides):
            overrides.set(drawn, some)
        self.simulation.reset(worlds, self.seeds[worlds].tolist())
        self.returns[worlds], self.lengths[worlds] = 0.0, 0
        self._look(worlds)
        self.now.begin(worlds)

    def _look(self, begun: np.ndarray | None = None) -> None:
        """Find the agents' rows, if entities were born or removed; in worlds that have begun, forget earlier agents."""
        bodies = self.simulation.state.population.bodies
        self.now.forget()
        if bodies.ints is self._ints:
            return
        self._ints, self._parts = bodies.ints, []
        alive, ids = self.alive.reshape(-1), self.now.id.reshape(-1)
        alive[:], kept = False, {}  # type: ignore[var-annotated]
        if begun is not None:
            self.now.id[begun] = NOBODY
        for group in self.simulation.state.population.groups:
            block = bodies.block[group.first : group.last]
            for number, (name, first, room) in self._blocks.items():
                rows = group.first + np.flatnonzero(block == number)
                if not len(rows):
                    continue
                place = bodies.block_index[rows]
                if place.max() >= room:
                    raise ParameterError(
                        f"{name} has more than {room} entities; set room = {{{name!r}: ...}} in the task"
                    )
                agents = bodies.world[rows] * self.n_agents + (first + place)
                alive[agents], ids[agents] = True, bodies.id[rows]
                team, span = bodies.team[rows].astype(float), (int(rows[0]), int(rows[-1]) + 1)
                self._parts.append(AgentRows(name, group, rows, agents, team, kept, span, self._searches))
        joined = self._joined(self._parts)
        self._watching = joined if self._is_alike else self._parts
        self.now.look(joined)
        self._check_ends = True

    def _joined(self, parts: list[AgentRows]) -> list[AgentRows]:
        """The parts of each group as one, so that a search has all agents of a world at once."""
        found = []
        for group in dict.fromkeys(part.group for part in parts):
            mine = [part for part in parts if part.group is group]
            if len(mine) > 1:
                rows = np.concatenate([p.rows for p in mine])
                order = np.argsort(rows)
                rows, agents, team = (
                    rows[order],
                    *(np.concatenate([getattr(p, name) for p in mine])[order] for name in ("agents", "team")),
                )
                span = int(rows[0]), int(rows[-1]) + 1
                mine = [replace(mine[0], rows=rows, agents=agents, team=team, span=span)]
            found += mine
        return found

    def _observe(self, worlds: np.ndarray | None = None) -> None:
        """Compute the observations of all worlds, or of some."""
        out = self.obs.reshape(-1, self.obs.shape[-1])
        if worlds is None:
            if len(self.now.agents) < len(out):
                self.obs[~self.alive] = 0.0
        else:
            self.obs[worlds] = 0.0
        for part in self._watching:
            some = part
            if worlds is not None and len(worlds) < self.n_worlds:
                mask = np.zeros(self.n_worlds, bool)
                mask[worlds] = True
                kept = mask[part.agents // self.n_agents]
                some = replace(part, rows=part.rows[kept], agents=part.agents[kept], team=part.team[kept])
            if len(some.rows):
                for component, column in self._columns[part.block]:
                    component.write(self.simulation, some, column, out)

    # -- steps -------------------------------------------------------------------------------------------------------------

    def step(self, actions: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Play one decision in all worlds.

        Args:
            actions: (W, A, n) of floats for ranges, clamped to [-1, 1]; of whole numbers for levels, or (W, A) for one.

        Returns:
            Observations (W, A, n), rewards (W, A), terminations (W, A), truncations (W, A), and a dict with `alive`, `over`, `terms`,
            and with "same_step" `final_obs`.

        Raises:
            ParameterError: The actions have a wrong shape or type, or a living agent's action is not allowed.
        """
        if self.is_fresh:
            raise ParameterError("step was called before reset")
        self._act(actions)
        simulation, now = self.simulation, self.now
        due = self.over.copy() if self.autoreset == "next_step" else None
        np.copyto(now.was_alive, self.alive)
        now.clear_events()
        simulation.step(self.task.decide_every)
        self._look()
        np.greater(now.was_alive, self.alive, out=now.died)
        self._reward()
        self._end(due)
        if due is not None and due.any():
            self._restart(np.flatnonzero(due))
            self._clear(due)
        self._observe()
        if self.autoreset == "same_step" and self.over.any():
            ended = np.flatnonzero(self.over)
            self.final_obs[ended] = self.obs[ended]
            self.final_alive[ended], self.final_seeds[ended] = self.alive[ended], self.seeds[ended]
            self.final_params = self.params
            if self._states is not None:
                self._states[1] = self._of_worlds()
            returns, lengths = self.returns[ended], self.lengths[ended]
            self._restart(ended)
            self._observe(ended)
            self.returns[ended], self.lengths[ended] = returns, lengths
        self._look_ahead()
        info = {"alive": self.alive, "over": self.over, "terms": self.terms}
        if self.masks is not None:
            info["action_mask"] = self.masks
        if self.autoreset == "same_step":
            info["final_obs"] = self.final_obs
        return self.obs, self.rewards, self.terminations, self.truncations, info

    def _of_worlds(self) -> np.ndarray:
        assert self.task.state is not None
        return self.task.state.of_worlds(self.simulation)

    def _look_ahead(self) -> None:
        """Compute what belongs to the next decision besides observations: the state of each world, and masks."""
        if self._states is not None:
            self._states[0] = self._of_worlds()
        if self.masks is None:
            return
        where = f"{type(self.task).__name__}.action_mask"
        given = array_of(where, self.task.action_mask(self.now))
        shape = self.masks.shape
        try:
            allowed = np.broadcast_to(given, shape)
        except ValueError:
            allowed = None
        if allowed is None or given.dtype != bool:
            raise ParameterError(
                f"{where} returns {given.dtype} of shape {given.shape}; it returns truth values, {shape}"
            )
        self.masks[:] = allowed
        self.masks[~self.alive] = True
        for decoder, agents in self._choosers:
            for first, n in zip(np.cumsum([0, *decoder.sizes]), decoder.sizes, strict=False):
                is_free = self.masks[:, agents, first : first + n].any(axis=-1)
                if not is_free.all():
                    world, agent = np.argwhere(~is_free)[0]
                    raise ParameterError(
                        f"{where} leaves {self.task.agent_names[agents[agent]]} in world {world} no level"
                    )

    @property
    def central_state(self) -> np.ndarray:
        """What a centralised critic sees of each world, (W, n): the task's `state`, or the observations of all agents."""
        return self.obs.reshape(self.n_worlds, -1) if self._states is None else self._states[0]

    @property
    def final_central_state(self) -> np.ndarray:
        """Like `central_state`, at the end of the last episode, with "same_step"."""
        return self.final_obs.reshape(self.n_worlds, -1) if self._states is None else self._states[1]

    @property
    def params(self) -> dict[str, Any]:
        """Parameters that were given or drawn for the present episodes, by path, (W,) or (W, k); "_PATH" has the worlds of each."""
        if self._told is None:
            self._told = self.episodes.told()
        return self._told

    def _restart(self, worlds: np.ndarray) -> None:
        self.episodes.follow(worlds)
        self._begin(worlds)

    def _clear(self, worlds: np.ndarray) -> None:
        """Nothing has happened in worlds whose episode has just begun."""
        for array in (self.rewards, self.terminations, self.truncations, *self.terms.values()):
            array[worlds] = 0
        self.over[worlds] = self.late[worlds] = False

    def _act(self, actions: Any) -> None:
        given = array_of("actions", actions)
        shape = (self.n_worlds, self.n_agents, self.action_width)
        if given.shape == shape[:2] and self.action_width == 1:
            given = given[..., None]
        if given.shape != shape:
            raise ParameterError(f"actions have shape {given.shape}; the shape must be {shape}")
        if given.dtype.kind not in ("f" if self.is_continuous else "iu"):
            kind = "floating-point" if self.is_continuous else "whole"
            raise ParameterError(f"actions are {given.dtype}; they must be {kind} numbers")
        if self._ints is not self.simulation.state.population.bodies.ints:
            self._look()
        self.now.actions = given
        flat = np.ascontiguousarray(
            given.reshape(self.n_worlds * self.n_agents, self.action_width),
            float if self.is_continuous else np.int64,
        )
        for part in self._parts:
            wrong = self._decoders[part.block].write(part, flat)
            if wrong >= 0:
                world, agent = divmod(wrong, self.n_agents)
                raise ParameterError(
                    f"action of {self.task.agent_names[agent]} in world {world} is {given[world, agent].tolist()}; it must be in "
                    f"{self._decoders[part.block].space}"
                )

    def _reward(self) -> None:
        self.rewards[:] = 0.0
        for name, term in self.task.reward.items():
            try:
                term.write(self.now, self.terms[name])
            except ParameterError as error:
                raise ParameterError(f"{type(self.task).__name__}: reward {name!r} {error}") from None
            self.rewards += self.terms[name]
        if self.autoreset != "disabled" and self.over.any():  # these belong to the last episode
            self.returns[self.over], self.lengths[self.over] = 0.0, 0
        self.returns += self.rewards
        self.lengths += 1

    def _end(self, due: np.ndarray | None) -> None:
        """Find the agents and worlds whose episode ends."""
        task, now = self.task, self.now
        np.copyto(self.terminations, now.died)
        over = self._are_decided() if self._check_ends else np.zeros(self.n_worlds, bool)
        if not self._never_ends:
            ends = array_of(f"{type(task).__name__}.ends", task.ends(now))
            if ends.shape not in ((), over.shape) or ends.dtype != bool:
                raise ParameterError(
                    f"{type(task).__name__}.ends returns {ends.dtype} of shape {ends.shape}; "
                    f"it returns truth values, {over.shape}, one per world"
                )
            over |= ends
        if over.any():
            self.terminations |= over[:, None] & self.alive
        self.truncations.fill(False)
        self.late.fill(False)
        step = self.simulation.state.context.clock.step
        if task.n_steps and step.max() >= task.n_steps:
            np.greater(step >= task.n_steps, over, out=self.late)
            self.truncations |= self.late[:, None] & self.alive
            over |= self.late
        np.copyto(self.over, over)

    def _are_decided(self) -> np.ndarray:
        """Worlds without agents, or in which one team is left and the mission ends then."""
        state = self.simulation.state
        over = np.logical_not(self.alive.any(axis=1))
        if "one_team" in self.task.given.end_conditions:
            bodies, teams = state.population.bodies, state.context.teams
            there = np.zeros((self.n_worlds, len(teams)), bool)
            there[bodies.world, np.searchsorted(teams, bodies.team)] = True
            over |= (there.sum(axis=1) <= 1) & (len(teams) > 1)
        for world in np.flatnonzero(over):
            over[world] = state.births.is_over(int(world))
        self._check_ends = bool(over.any()) or state.births.has_rates
        return over

    # -- snapshots ---------------------------------------------------------------------------------------------------------

    KEPT = (
        "obs",
        "alive",
        "over",
        "late",
        "returns",
        "lengths",
        "rewards",
        "terminations",
        "truncations",
    )

    def state(self) -> dict[str, Any]:
        """A copy of everything; after `restore`, the same actions give the same bits."""
        saved = {name: getattr(self, name).copy() for name in self.KEPT}
        saved |= {"ids": self.now.id.copy(), "episodes": self.episodes.state()}
        return {"simulation": self.simulation.snapshot(), **saved}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Return to a state of this swarm, or of another one with the same task and number of worlds."""
        saved: Any = state.get("simulation")
        self.simulation.restore(saved)
        self.episodes.restore(state["episodes"])
        self._ints = self._told = None
        self._look()
        self.now.id[...] = state["ids"]
        for name in self.KEPT:
            getattr(self, name)[...] = state[name]
        self._look_ahead()
        self.is_fresh = False

    def __reduce__(self) -> tuple[Any, ...]:
        """A pickle makes a new swarm, before its first reset."""
        return make_swarm_of, (
            self.task,
            self.n_worlds,
            self.autoreset,
            self.simulation.state.context.threads,
        )

    def close(self) -> None:
        """Free everything that lies outside the arrays."""
        self.simulation.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def make_swarm_of(task: Task, num_envs: int, autoreset: str, threads: int) -> Swarm:
    """A swarm from a pickle."""
    return Swarm(task, num_envs, autoreset=autoreset, threads=threads)


def make_swarm(task: Any, num_envs: int = 1, *, autoreset: str = "same_step", threads: int = 1) -> Swarm:
    """The agents of a task in many worlds as arrays; see `Swarm`."""
    return Swarm(task, num_envs, autoreset=autoreset, threads=threads)


@explained
def record_episode(
    task: Any, policy: Callable[[np.ndarray], Any], directory: str | Path, *, seed: int = 1
) -> dict[str, float]:
    """Play one episode and record it as a run directory, which the viewer, plots and tables open like any other.

    Args:
        task: A Task, or a class of one.
        policy: Function of observations (1, A, n) that returns actions, as for `Swarm.step`.
        directory: Run directory; it must not hold a run.
        seed: Seed of the episode; `Swarm.seeds` has those of episodes that were played.

    Returns:
        Sum of each term over agents and decisions.

    Raises:
        RecordError: The directory holds a run, or cannot be written.
    """
    from tussle.record import Recorder  # Arrow takes long to import

    with Swarm(task, 1, autoreset="disabled") as swarm:
        obs = swarm.reset(seed=seed)
        sums = dict.fromkeys(swarm.terms, 0.0)
        with Recorder(swarm.simulation, directory):
            while not swarm.over[0]:
                obs, *_ = swarm.step(policy(obs))
                for name, term in swarm.terms.items():
                    sums[name] += float(term.sum(dtype=float))
    return sums


@explained
def evaluate(
    task: Any, policy: Callable[[np.ndarray], Any] | None = None, n_episodes: int = 100, *, seed: int = 1, threads: int = 1
) -> dict[str, np.ndarray]:  # fmt: skip
    """Play episodes with a policy, or with the mission's own autonomies, and return what they earned.

    Args:
        task: A Task, or a class of one.
        policy: Function of observations (n_episodes, A, n) that returns actions, as for `Swarm.step`; None plays `Task.scripted`.
        n_episodes: Number of episodes.
        seed: Seed of the first episode; the others have those that follow.
        threads: Number of threads a step may use.

    Returns:
        Sum of each term over agents and decisions, by name, and of all terms as "return"; (n_episodes,) each.

    Raises:
        ParameterError: No autonomies play the agents' blocks.
    """
    task = task_of(task)
    check_argument("n_episodes", n_episodes, Whole(1))
    if policy is None:
        task = task.by_rule()
        idle = np.zeros((n_episodes, len(task.agent_names), 0), task.dtype)
        policy = lambda _: idle  # noqa: E731
    try:
        made = Swarm(task, n_episodes, autoreset="disabled", threads=threads)
    except WiringError as error:
        if task.action:
            raise
        raise ParameterError(
            f"{type(task).__name__}: no autonomies play {task.learners!r} by rule: {error}; "
            "give scripted = a mission in which they do, or a policy"
        ) from None
    with made as swarm:
        obs = swarm.reset(seed=seed)
        sums = {name: np.zeros(n_episodes) for name in swarm.terms}
        is_over = np.zeros(n_episodes, bool)
        while not is_over.all():
            obs, *_ = swarm.step(policy(obs))
            for name, term in swarm.terms.items():
                sums[name] += np.where(is_over, 0.0, term.sum(axis=1, dtype=float))
            is_over |= swarm.over
    return {**sums, "return": np.sum([*sums.values()], axis=0)}


__all__ = ["Swarm", "evaluate", "make_swarm", "record_episode", "task_of"]
