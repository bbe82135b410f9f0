"""Runs played side by side in one simulation, where a finished world's slot takes the next run."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.batch.tasks import Beat, Finished, Run
from tussle.engine.simulation import Simulation

if TYPE_CHECKING:
    from tussle.engine.result import WorldResult
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
    plugins = [*mission.world_plugins, *(p for block in mission.blocks for p in block.plugins)]
    return min([MOST, *(int(type(p).max_worlds) for p in plugins if type(p).max_worlds is not None)])


def play(mission: Mission, take: Take, size: int) -> Iterator[Finished | Beat]:
    """Play all runs that `take` gives.

    A run that fails ends with its error. It is played again alone before that is said, since an error may have come from a neighbour
    in its stack.

    Args:
        mission: What all of them play, but for their own params and seeds.
        take: Where they come from.
        size: How many are played side by side.
    """
    runs = list(take(size))
    while runs:
        stack = _Stack(mission, take, len(runs))
        try:
            yield from stack.play(runs)
        except Exception as error:  # noqa: BLE001 - whatever a plugin raises at a start is the error of its run
            stack.again += stack.under_way()
            if stack.size == 1:
                yield _failed(stack.again.pop(), error)
        finally:
            stack.close()
        for run in stack.again:
            yield from play(mission, _only(run), 1)
        runs = list(take(size))


def _only(run: Run) -> Take:
    """Gives one run, once."""
    waiting = [run]

    def take(n: int) -> Sequence[Run]:
        return [waiting.pop()] if waiting and n else []

    return take


def _failed(run: Run, error: Exception) -> Finished:
    """A run that could not be begun."""
    return Finished(
        run.number,
        "error",
        0.0,
        0,
        None,
        "",
        _told(error),
        0.0,
        platform.node(),
        [(None, "alive", float("nan"))],
        [],
    )


def _told(error: Exception) -> str:
    """What failed, without the number of the world, which depends on the stack."""
    from tussle.errors import PluginError, TussleError

    if isinstance(error, PluginError):
        return str(PluginError(error.message, where=error.where, step=error.step, plugin=error.plugin))
    return str(error) if isinstance(error, TussleError) else f"{type(error).__name__}: {error}"


class _Stack:
    """One simulation and the runs in its slots."""

    def __init__(self, mission: Mission, take: Take, size: int) -> None:
        self.mission, self.take, self.size = mission, take, size
        self.slots: list[Run | None] = [None] * size
        self.again: list[Run] = []
        self.sim: Simulation | None = None
        self._host = platform.node()
        self._alive: list[list[tuple[int, float, int]]] = [[] for _ in range(size)]
        self._cpu_begun = np.zeros(size)
        self._cpu = 0.0  # of one world since the beginning, were it always there [s]

    def under_way(self) -> list[Run]:
        return [run for run in self.slots if run is not None]

    def close(self) -> None:
        if self.sim is not None:
            self.sim.close()

    def play(self, runs: Sequence[Run]) -> Iterator[Finished | Beat]:
        """Play runs, as many as there are slots, and all that follow them."""
        self.slots = list(runs)
        cpu_seen, beat_at = time.process_time(), time.monotonic() + BEAT_EVERY
        params = {path: [r.params[path] for r in runs] for path in runs[0].params}
        sim = self.sim = Simulation(self.mission, [r.seed for r in runs], params, on_error="record")
        teams = [int(team) for team in sim.context.teams]
        counts = self._count()
        self._start = counts.copy()
        self._note_alive(range(self.size), counts, teams)
        steps = max(1, self.mission.steps)
        has_end = "time" in self.mission.end_conditions
        rows, n_before = sim.population.bodies.ints, sim.n_running
        while sim.n_running:
            sim.step()
            now = sim.population.bodies.ints
            if now is not rows:
                rows, left = now, self._count()
                changed = np.flatnonzero((left != counts).any(axis=1) & sim.running)
                self._note_alive(changed, left, teams, counts)
                counts = left
            if sim.n_running < n_before:
                cpu = time.process_time()
                self._cpu, cpu_seen = self._cpu + (cpu - cpu_seen) / n_before, cpu
                over = [w for w, run in enumerate(self.slots) if run is not None and not sim.running[w]]
                for world in over:
                    if sim.failed[world] and self.size > 1:
                        self.again += [r for r in [self.slots[world]] if r is not None]
                    else:
                        yield self._finished(world, teams)
                self._refill(over, counts, teams)
                rows, counts, n_before = sim.population.bodies.ints, self._count(), sim.n_running
                cpu = time.process_time()
                self._cpu, cpu_seen = self._cpu + (cpu - cpu_seen) / max(1, n_before), cpu
            if time.monotonic() >= beat_at:
                beat_at = time.monotonic() + BEAT_EVERY
                yield Beat(float(sim.steps[sim.running].sum()) / steps if has_end else 0.0)

    def _count(self) -> np.ndarray:
        """Entities by world and team, (n_worlds, n_teams)."""
        assert self.sim is not None
        bodies, teams = self.sim.population.bodies, self.sim.context.teams
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

    def _refill(self, worlds: list[int], counts: np.ndarray, teams: Sequence[int]) -> None:
        """Begin further runs in the slots of those that are over."""
        assert self.sim is not None
        for world in worlds:
            self.slots[world] = None
        runs = list(self.take(len(worlds)))
        if not runs:
            return
        chosen = worlds[: len(runs)]
        for world, run in zip(chosen, runs, strict=True):
            self.slots[world] = run
            self._alive[world] = []
            self._cpu_begun[world] = self._cpu
        params = {path: [r.params[path] for r in runs] for path in runs[0].params}
        self.sim.reset(chosen, [r.seed for r in runs], params)
        begun = self._count()
        self._start[chosen] = begun[chosen]
        self._note_alive(chosen, begun, teams)

    def _finished(self, world: int, teams: Sequence[int]) -> Finished:
        assert self.sim is not None
        run, result = self.slots[world], self.sim.results[world]
        assert run is not None
        assert result is not None
        alive = self._alive[world]
        if result.t > alive[0][1]:
            alive += [(team, result.t, n) for team, n in result.alive.items()]
        start = {team: int(n) for team, n in zip(teams, self._start[world], strict=True)}
        return Finished(
            run.number, result.end, result.t, result.steps,
            None if result.error else result.winner, result.state_hash, "" if result.error is None else _told(result.error),
            self._cpu - float(self._cpu_begun[world]), self._host, _metrics(result, start), alive,
        )  # fmt: skip


def _metrics(result: WorldResult, start: dict[int, int]) -> list[tuple[int | None, str, float]]:
    """All that is counted of a run: by team and of the world."""
    out: list[tuple[int | None, str, float]] = []
    for name, values in (("score", result.scores), ("alive", result.alive), ("start", start)):
        out += [(team, name, float(value)) for team, value in values.items()]
    for plugin, named in result.metrics.items():
        for name, value in named.items():
            if isinstance(value, dict):
                out += [(team, f"{plugin}.{name}", float(v)) for team, v in value.items()]
            else:
                out.append((None, f"{plugin}.{name}", float(value)))
    return out
