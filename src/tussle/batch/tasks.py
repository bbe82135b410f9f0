"""The data that a batch sends to its workers and receives from them; all of it pickles."""

from __future__ import annotations

import math
import platform
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from tussle.batch import by_value
from tussle.engine.simulation import Simulation
from tussle.mission import Mission, PluginFile
from tussle.mission.rekeys import Rekeys


@dataclass(frozen=True)
class BatchRun:
    """One game of a batch.

    Attributes:
        number: Index in the design.
        group: Index of the mission in the package.
        seed: Seed.
        params: Values that differ from that mission, by path, SI.
        rekeys: (step, key) pairs, as for `Simulation.reset`; None for those of the mission.
    """

    number: int
    group: int
    seed: int
    params: Mapping[str, Any] = field(default_factory=dict)
    rekeys: Rekeys | None = None


@dataclass(frozen=True)
class Finished:
    """The result of a run.

    Attributes:
        number: The run.
        end: Why it ended; "error" where it failed.
        t: Time at the end [s].
        steps: Number of steps.
        winner: Team with the highest score; None for a tie, without scores, and for a failed run.
        state_hash: Hash of the state at the end.
        error: Error message, "" for none.
        cpu_s: CPU time of its share of the stack [s].
        host: Name of the machine.
        metrics: (team or None, name, value).
        alive: (team, t [s], entities) for each change of the number, from the start to the end.
        watched: What the package's watcher says of the game; None without one, and for a failed run.
        group: That of the run.
        chance: What depends on the seed: 0 nothing, 1 the births, `PLAYED_BY_CHANCE` also the rest of some game of its stack.
    """

    number: int
    end: str
    t: float
    steps: int
    winner: int | None
    state_hash: str
    error: str
    cpu_s: float
    host: str
    metrics: list[tuple[int | None, str, float]]
    alive: list[tuple[int, float, int]]
    watched: Any = None
    group: int = 0
    chance: int = 0

    @staticmethod
    def failed(run: BatchRun, error: str, teams: Iterable[int]) -> Finished:
        """The result of a run that failed without leaving a state."""
        named: list[int | None] = [int(team) for team in teams]
        # The tables have one row per metric, so a run without any would be missing.
        metrics = [(team, "alive", math.nan) for team in named or [None]]
        return Finished(
            run.number, "error", 0.0, 0, None, "", error, 0.0, platform.node(), metrics, [], group=run.group
        )


@dataclass(frozen=True)
class Heartbeat:
    """Sign of life of a process that plays.

    Attributes:
        under_way: Sum over the runs under way of the part of the longest game that each has played, 0 to 1 each.
    """

    under_way: float


class Watcher(Protocol):
    """Sees each step of a stack of games."""

    def restart(self, worlds: np.ndarray) -> None:
        """Worlds have been reset, (m,)."""

    def finish(self, world: int) -> Any:
        """What is to be known of a world that has just ended; it pickles."""


@dataclass(frozen=True)
class Package:
    """The missions of a batch and the plugin files that they need.

    Attributes:
        missions: One per group, pickled, since classes of plugin files exist only once the files are loaded.
        plugin_files: The files.
        run_timeout: Wall time that a run may take [s]; None for no limit.
        watch: Function of a new simulation that makes its watcher, pickled; None for no watcher.
    """

    missions: tuple[bytes, ...]
    plugin_files: tuple[PluginFile, ...] = ()
    run_timeout: float | None = None
    watch: bytes | None = None

    def watcher(self) -> Callable[[Simulation], Watcher] | None:
        """The function that makes watchers; None for no watcher."""
        made: Callable[[Simulation], Watcher] | None = (
            None if self.watch is None else by_value.loads(self.watch)
        )
        return made

    def mission(self, group: int) -> Mission:
        """The mission of a group."""
        for file in self.plugin_files:
            file.load()
        mission: Mission = by_value.loads(self.missions[group])
        return mission


@dataclass
class Progress:
    """The progress of a batch.

    Attributes:
        n_runs: Planned runs.
        n_done: Finished runs, those of earlier calls included.
        n_before: Runs that were finished before this call.
        n_failed: Finished runs that failed.
        under_way: Runs under way, each counted by the part that it has played.
        wins: Runs won, by team; None for ties.
    """

    n_runs: int
    n_done: int = 0
    n_before: int = 0
    n_failed: int = 0
    under_way: float = 0.0
    wins: Counter[int | None] = field(default_factory=Counter)

    def count(self, finished: Finished) -> None:
        """Count a finished run."""
        self.n_done += 1
        if finished.end == "error":
            self.n_failed += 1
        elif any(name == "score" for _, name, _ in finished.metrics):
            self.wins[finished.winner] += 1
