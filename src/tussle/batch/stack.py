"""Runs played side by side in one simulation, where a finished world's slot takes the next run."""

from __future__ import annotations

import platform
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from tussle.api import Plugin
from tussle.batch.tasks import Beat, Finished, Run
from tussle.columns import Handle
from tussle.engine.result import WorldResult
from tussle.engine.simulation import Simulation
from tussle.errors import PluginError, TussleError
from tussle.mission import Mission

ROWS = 8192
"""Entities that a stack holds, about: more rows cost no less each, and fall out of the cache."""
MOST = 256
BEAT_EVERY = 0.25  # [s]

Take = Callable[[int], Sequence[Run]]
"""Gives up to n further runs of the same group; none when there are no more."""


def stack_size(mission: Mission) -> int:
    """How many worlds of a mission are best played side by side."""
    n = max(1, sum(block.count for block in mission.blocks))
    return max(1, min(MOST, ROWS // n, most_worlds(mission)))


def most_worlds(mission: Mission) -> int:
    """The largest stack that all plugins of a mission take part in."""
    plugins: list[Plugin] = [*mission.world_plugins, *(p for block in mission.blocks for p in block.plugins)]
    return min([MOST, *(Handle.most_worlds(p) or MOST for p in plugins)])


def play(mission: Mission, take: Take, size: int) -> Iterator[Finished | Beat]:
    """Play all runs that `take` gives.

    Where a stack raises, each of its runs that is not finished is played again alone: the error is that of the run that raises alone.

    Args:
        mission: What all of them play, but for their own params and seeds.
        take: Where they come from.
        size: How many are played side by side; fewer where a plugin takes part in fewer worlds.
    """
    size = min(size, most_worlds(mission))
    while runs := list(take(size)):
        stack = _Stack(mission, take, runs)
        lost, told = [], ""
        try:
            yield from stack.play()
        except (Exception, SystemExit) as error:  # noqa: BLE001 - whatever a plugin raises is the error of its run
            lost, told = stack.under_way(), _told(error)
        finally:
            stack.close()
        for run in lost:
            if stack.size == 1:
                yield Finished.failed(run, told, mission.teams)
            else:
                yield from play(mission, _only(run), 1)


def _only(run: Run) -> Take:
    waiting = [run]
    return lambda n: [waiting.pop()] if waiting else []


def _told(error: BaseException) -> str:
    """What failed, without the number of the world, which depends on the stack."""
    if isinstance(error, PluginError):
        return str(PluginError(error.message, where=error.where, step=error.step, plugin=error.plugin))
    return str(error) if isinstance(error, TussleError) else f"{type(error).__name__}: {error}"


class _CpuShare:
    """CPU time of one world of the stack since the beginning, had it always been there.

    Attributes:
        total: [s].
    """

    def __init__(self) -> None:
        self.total = 0.0
        self._seen = time.process_time()

    def spent_by(self, n_worlds: int) -> None:
        """What has passed since the last call was spent by so many worlds; by none: it was for something else."""
        now = time.process_time()
        if n_worlds:
            self.total += (now - self._seen) / n_worlds
        self._seen = now


class _Stack:
    """One simulation and the runs in its slots.

    Args:
        mission: What is played.
        take: Where further runs come from.
        runs: The first ones, a slot each.
    """

    def __init__(self, mission: Mission, take: Take, runs: Sequence[Run]) -> None:
        self.mission, self.take = mission, take
        self.slots: list[Run | None] = list(runs)
        self.sim: Simulation | None = None
        self._host = platform.node()

    @property
    def size(self) -> int:
        """Worlds side by side."""
        return len(self.slots)

    def under_way(self) -> list[Run]:
        """Runs that are not finished."""
        return [run for run in self.slots if run is not None]

    def close(self) -> None:
        """Release what the simulation holds."""
        if self.sim is not None:
            self.sim.close()

    def play(self) -> Iterator[Finished | Beat]:
        """Play runs side by side, and all that follow them."""
        sim, teams = self._begin(self.under_way())
        rows, counts, n_before = sim.state.population.bodies.ints, self._count(), self.size
        n_steps, beat_at = max(1, self.mission.steps), time.monotonic() + BEAT_EVERY
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
                beat_at = time.monotonic() + BEAT_EVERY
                yield Beat(float(sim.steps[sim.state.running].sum()) / n_steps if has_end else 0.0)

    def _begin(self, runs: Sequence[Run]) -> tuple[Simulation, list[int]]:
        """The simulation, before its first step, and its teams."""
        self._cpu = _CpuShare()
        self._cpu_begun = np.zeros(self.size)
        self._alive: list[list[tuple[int, float, int]]] = [[] for _ in runs]
        on_error = "record" if len(runs) == 1 else None  # by default, what raises ends the stack
        self.sim = Simulation(self.mission, [r.seed for r in runs], _by_path(runs), on_error=on_error)
        teams = [int(team) for team in self.sim.state.context.teams]
        self._start = self._count()
        self._note_alive(range(self.size), self._start, teams)
        return self.sim, teams

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

    def _refill(self, teams: Sequence[int]) -> Iterator[Finished | Beat]:
        """Hand on what is over, and begin further runs in the slots of these."""
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
        self.sim.reset(chosen, [r.seed for r in runs], _by_path(runs))
        begun = self._count()
        self._start[chosen] = begun[chosen]
        self._note_alive(chosen, begun, teams)

    def _finished(self, world: int, run: Run, teams: Sequence[int]) -> Finished:
        assert self.sim is not None
        result = self.sim.state.results[world]
        assert result is not None
        alive = self._alive[world]
        if alive and result.t > alive[0][1]:
            alive += [(team, result.t, n) for team, n in result.alive.items()]
        start = {team: int(n) for team, n in zip(teams, self._start[world], strict=True)}
        return Finished(
            run.number, result.end, result.t, result.steps,
            None if result.error else result.winner, result.state_hash, "" if result.error is None else _told(result.error),
            self._cpu.total - float(self._cpu_begun[world]), self._host, _metrics(result, start), alive,
        )  # fmt: skip


def _by_path(runs: Sequence[Run]) -> dict[str, list[Any]]:
    """What differs among runs of a group: path -> value for each run."""
    return {path: [run.params[path] for run in runs] for path in runs[0].params}


def _metrics(result: WorldResult, start: Mapping[int, int]) -> list[tuple[int | None, str, float]]:
    """All that is counted of a run: by team and of the world."""
    out: list[tuple[int | None, str, float]] = []
    for name, counts in (("score", result.scores), ("alive", result.alive), ("start", start)):
        out += [(team, name, float(value)) for team, value in counts.items()]
    for plugin, named in result.metrics.items():
        for name, found in named.items():
            by_team = found if isinstance(found, dict) else {None: found}
            if all(isinstance(value, (bool, int, float)) for value in by_team.values()):
                out += [(team, f"{plugin}.{name}", float(value)) for team, value in by_team.items()]
            else:
                warnings.warn(
                    f"{plugin} reports {name!r} as {found!r}, which is no number, so the batch does not keep it",
                    RuntimeWarning,
                    stacklevel=2,
                )
    return out or [(None, "alive", 0.0)]  # a run without rows would not be there
