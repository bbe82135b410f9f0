"""What a batch hands to those who play it, and what they give back; all of it pickles."""

from __future__ import annotations

import math
import pickle
import platform
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from tussle.mission import Mission, PluginFile


@dataclass(frozen=True)
class Run:
    """One game of a batch.

    Attributes:
        number: Its place in the design.
        group: Which of the package's missions it plays.
        seed: Its seed.
        params: What differs from that mission, by path, SI.
        is_alone: It is to be played in a process of its own beside no other, since one that played it has died.
    """

    number: int
    group: int
    seed: int
    params: Mapping[str, Any] = field(default_factory=dict)
    is_alone: bool = False


@dataclass(frozen=True)
class Finished:
    """What came of a run.

    Attributes:
        number: The run.
        end: Why it ended; "error" where something failed.
        t: Time at the end [s].
        steps: Steps made.
        winner: Team with the highest score; None for a tie, without scores, and where it failed.
        state_hash: Hash of the state at the end.
        error: What failed, "" for nothing.
        cpu_s: CPU time of its share of the stack [s].
        host: Machine that played it.
        metrics: (team or None, name, value).
        alive: (team, t [s], entities): how many there are whenever that changes, from the start to the end.
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

    @staticmethod
    def failed(run: Run, error: str, teams: Iterable[int]) -> Finished:
        """A run of which nothing is known but that it failed.

        Args:
            run: The run.
            error: What is known of why.
            teams: Of its mission.
        """
        named: list[int | None] = [int(team) for team in teams]
        # A run without any row would not be there.
        metrics = [(team, "alive", math.nan) for team in named or [None]]
        return Finished(run.number, "error", 0.0, 0, None, "", error, 0.0, platform.node(), metrics, [])


@dataclass(frozen=True)
class Beat:
    """Sign of life of a stack.

    Attributes:
        under_way: Sum over the runs under way of the part of the longest game that each has played, 0 to 1 each.
    """

    under_way: float


@dataclass(frozen=True)
class Package:
    """The missions of a batch and the plugin files that they need.

    Attributes:
        missions: One per group, pickled: classes of plugin files can be found only once these are loaded.
        plugin_files: The files.
        run_timeout: Wall time that a run may take [s]; None sets no limit.
    """

    missions: tuple[bytes, ...]
    plugin_files: tuple[PluginFile, ...] = ()
    run_timeout: float | None = None

    def mission(self, group: int) -> Mission:
        """The mission of a group."""
        for file in self.plugin_files:
            file.load()
        mission: Mission = pickle.loads(self.missions[group])  # noqa: S301 - made by the process that asks for it to be played
        return mission
