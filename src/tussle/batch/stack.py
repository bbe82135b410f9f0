"""Plays runs side by side in one simulation, where the slot of a finished world takes the next run."""

from __future__ import annotations

import platform
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from tussle.api import Plugin
from tussle.batch.consistency import MAX_NAME, bounded
from tussle.batch.quantities import column_name
from tussle.batch.schemas import PLAYED_BY_CHANCE
from tussle.batch.tasks import BatchRun, Finished, Heartbeat, Watcher
from tussle.declare.columns import Handle
from tussle.engine.result import WorldResult
from tussle.engine.simulation import Simulation
from tussle.errors import PluginError, TussleError
from tussle.mission import Mission
from tussle.mission.spec import ONE_BY_ONE, SHUFFLED

ROWS = 8192
"""Entities of a stack, about: with more rows a row costs no less, and the cache overflows."""
SEQUENTIAL_ROWS = 8 * ROWS
"""The same where entities move one after another: a call has one row per world, and its fixed cost is shared by them."""
MAX_STACK = 512
"""Largest number of worlds of a stack: a sequential game costs 18 % less in a stack of 512 than of 256, but only 5 % less with 1,024."""
HEARTBEAT_PERIOD = 0.25  # [s]

Watch = Callable[[Simulation], Watcher]
Take = Callable[[int], Sequence[BatchRun]]
"""Returns up to n further runs of the same group; none when there are no more."""


def stack_size(mission: Mission) -> int:
    """Best number of worlds of a mission in a stack."""
    n = max(1, sum(block.count for block in mission.blocks))
    rows = SEQUENTIAL_ROWS if mission.update in ONE_BY_ONE else ROWS
    return max(1, min(MAX_STACK, rows // n, most_worlds(mission)))


def most_worlds(mission: Mission) -> int:
    """The largest stack that all plugins of a mission allow."""
    plugins: list[Plugin] = [*mission.world_plugins, *(p for block in mission.blocks for p in block.plugins)]
    one = [1] if mission.update in SHUFFLED else []
    return min([MAX_STACK, *one, *(Handle.most_worlds(p) or MAX_STACK for p in plugins)])


def play(
    mission: Mission, take: Take, size: int, watch: Watch | None = None
) -> Iterator[Finished | Heartbeat]:
    """Play all runs that `take` returns.

    Where a stack raises, each of its unfinished runs is played again alone, and one that raises alone gets the error.

    Args:
        mission: The mission of all runs, which have their own params and seeds.
        take: Returns the runs.
        size: Worlds side by side; fewer where a plugin allows fewer.
        watch: Makes the watcher of a simulation.
    """
    size = min(size, most_worlds(mission))
    while runs := list(take(size)):
        stack = _Stack(mission, take, runs, watch)
        lost, reported = [], ""
        try:
            yield from stack.play()
        except (Exception, SystemExit) as error:  # noqa: BLE001 - all that a plugin raises is the error of its run
            lost, reported = stack.under_way(), _reported(error)
        finally:
            stack.close()
        for run in lost:
            if stack.size == 1:
                yield Finished.failed(run, reported, mission.teams)
            else:
                yield from play(mission, _only(run), 1, watch)


def _only(run: BatchRun) -> Take:
    waiting = [run]
    return lambda n: [waiting.pop()] if waiting else []


def _reported(error: BaseException) -> str:
    """The text of an error, without the number of the world, which depends on the stack."""
    if isinstance(error, PluginError):
        return str(PluginError(error.message, where=error.where, step=error.step, plugin=error.plugin))
    return str(error) if isinstance(error, TussleError) else f"{type(error).__name__}: {error}"


class _CpuShare:
    """CPU time of one world of the stack.

    Attributes:
        total: CPU time since the stack began, each part divided by the worlds of that time [s].
    """

    def __init__(self) -> None:
        self.total = 0.0
        self._seen = time.process_time()

    def spent_by(self, n_worlds: int) -> None:
        """Divide the time since the last call by so many worlds; with 0 worlds it is dropped."""
        now = time.process_time()
        if n_worlds:
            self.total += (now - self._seen) / n_worlds
        self._seen = now


class _Stack:
    """One simulation and the runs in its slots.

    Args:
        mission: The mission.
        take: Returns further runs.
        runs: The first runs, one per slot.
        watch: Makes the watcher of the simulation.
    """

    def __init__(
        self, mission: Mission, take: Take, runs: Sequence[BatchRun], watch: Watch | None = None
    ) -> None:
        self.mission, self.take, self.watch = mission, take, watch
        self.watcher: Watcher | None = None
        self.slots: list[BatchRun | None] = list(runs)
        self.sim: Simulation | None = None
        self._host = platform.node()

    @property
    def size(self) -> int:
        """Worlds side by side."""
        return len(self.slots)

    def under_way(self) -> list[BatchRun]:
        """Unfinished runs."""
        return [run for run in self.slots if run is not None]

    def close(self) -> None:
        """Close the simulation."""
        if self.sim is not None:
            self.sim.close()

    def play(self) -> Iterator[Finished | Heartbeat]:
        """Play the runs and all that follow them."""
        sim, teams = self._begin(self.under_way())
        rows, counts, n_before = sim.state.population.bodies.ints, self._count(), self.size
        n_steps, beat_at = max(1, self.mission.steps), time.monotonic() + HEARTBEAT_PERIOD
        has_end = "time" in self.mission.end_conditions
        while True:
            while (
                sim.state.n_running < n_before
            ):  # again after a refill: a run may fail before its first step
                self._cpu.spent_by(n_before)
                yield from self._refill(teams)
                rows, counts, n_before = (
                    sim.state.population.bodies.ints,
                    self._count(),
                    len(self.under_way()),
                )
            if not n_before:
                return
            sim.step()
            now = sim.state.population.bodies.ints
            if now is not rows:
                rows, left = now, self._count()
                changed = np.flatnonzero((left != counts).any(axis=1) & sim.state.running)
                self._note_alive(changed, left, teams, counts)
                counts = left
            if time.monotonic() >= beat_at:
                beat_at = time.monotonic() + HEARTBEAT_PERIOD
                yield Heartbeat(float(sim.steps[sim.state.running].sum()) / n_steps if has_end else 0.0)

    def _begin(self, runs: Sequence[BatchRun]) -> tuple[Simulation, list[int]]:
        """Make the simulation; returns it and its teams."""
        self._cpu = _CpuShare()
        self._cpu_begun = np.zeros(self.size)
        self._alive: list[list[tuple[int, float, int]]] = [[] for _ in runs]
        on_error = "record" if len(runs) == 1 else None  # by default, what raises ends the stack
        self.sim = Simulation(self.mission, [r.seed for r in runs], _by_path(runs), on_error=on_error)
        if any(run.rekeys is not None for run in runs):
            self._restart(range(self.size), runs)
        if self.watch is not None:
            self.watcher = self.watch(self.sim)
        teams = [int(team) for team in self.sim.state.context.teams]
        self._note_alive(range(self.size), self._count(), teams)
        return self.sim, teams

    def _restart(self, worlds: Iterable[int], runs: Sequence[BatchRun]) -> None:
        assert self.sim is not None
        own = self.mission.rekeys
        rekeys = [own if run.rekeys is None else run.rekeys for run in runs]
        self.sim.reset(worlds, [r.seed for r in runs], _by_path(runs), rekeys)

    def _count(self) -> np.ndarray:
        """Entities by world and team, (n_worlds, n_teams)."""
        assert self.sim is not None
        bodies, teams = self.sim.state.population.bodies, self.sim.state.context.teams
        cell = bodies.world * len(teams) + np.searchsorted(teams, bodies.team)
        return np.bincount(cell, minlength=self.size * len(teams)).reshape(self.size, len(teams))

    def _note_alive(
        self, worlds: Any, counts: np.ndarray, teams: Sequence[int], before: np.ndarray | None = None
    ) -> None:
        assert self.sim is not None
        t = self.sim.t
        for world in worlds:
            for k, team in enumerate(teams):
                if before is None or counts[world, k] != before[world, k]:
                    self._alive[world].append((team, float(t[world]), int(counts[world, k])))

    def _refill(self, teams: Sequence[int]) -> Iterator[Finished | Heartbeat]:
        """Yield the results of finished worlds, and start further runs in their slots."""
        assert self.sim is not None
        free = []
        for world, run in enumerate(self.slots):
            if run is None or self.sim.state.running[world]:
                continue
            finished = self._finished(world, run, teams)
            self.slots[world] = None
            yield finished
            free.append(world)
        runs = self.take(len(free))
        self._cpu.spent_by(0)
        if not runs:
            return
        chosen = np.array(free[: len(runs)])
        for world, run in zip(chosen, runs, strict=True):
            self.slots[world] = run
            self._alive[world] = []
        self._cpu_begun[chosen] = self._cpu.total
        self._restart(chosen, runs)
        if self.watcher is not None:
            self.watcher.restart(chosen)
        begun = self._count()
        self._note_alive(chosen, begun, teams)

    def _finished(self, world: int, run: BatchRun, teams: Sequence[int]) -> Finished:
        assert self.sim is not None
        result = self.sim.state.results[world]
        assert result is not None
        alive = self._alive[world]
        seen = None if self.watcher is None or result.error else self.watcher.finish(world)
        if alive and result.t > alive[0][1]:
            alive += [(team, result.t, n) for team, n in result.alive.items()]
        return Finished(
            run.number, result.end, result.t, result.steps,
            None if result.error else result.winner, result.state_hash, "" if result.error is None else _reported(result.error),
            self._cpu.total - float(self._cpu_begun[world]), self._host, metrics_of(result), alive, seen, run.group, self._chance_of(world),
        )  # fmt: skip

    def _chance_of(self, world: int) -> int:
        """What of a game depends on its seed, as in `Finished`."""
        assert self.sim is not None
        state = self.sim.state
        return PLAYED_BY_CHANCE if state.context.has_chance else int(state.births.are_drawn(world))


def _by_path(runs: Sequence[BatchRun]) -> dict[str, list[Any]]:
    """Params of runs of one group: path -> value for each run."""
    return {path: [run.params[path] for run in runs] for path in runs[0].params}


def metrics_of(result: WorldResult) -> list[tuple[int | None, str, float]]:
    """All metrics of a run, of teams and of the world."""
    out: list[tuple[int | None, str, float]] = []
    for name, counts in (("score", result.scores), ("alive", result.alive), ("start", result.born)):
        out += [(team, name, bounded(value)) for team, value in counts.items()]
    for plugin, named in result.metrics.items():
        for name, found in named.items():
            by_team = found if isinstance(found, dict) else {None: found}
            metric = f"{plugin}.{name}"
            if (length := len(column_name(metric, None))) > MAX_NAME:
                why = f"whose name has {length} characters, so the batch does not keep it; at most {MAX_NAME}"
                warnings.warn(f"{plugin} reports {name[:40]!r}..., {why}", RuntimeWarning, stacklevel=2)
            else:
                out += [(team, metric, bounded(value)) for team, value in by_team.items()]
    return out or [
        (None, "alive", 0.0)
    ]  # the tables have one row per metric, so a run without any would be missing
