"""Result of one world."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from tussle.declare.displays import MAX_TABLE, line, listing, number, page, table


@dataclass
class WorldResult:
    """Result of one world: final, or up to now while it is running.

    Attributes:
        world: Number of the world in the stack.
        seed: Seed of the world.
        end: Why the world ended: "time", "one_team", "all_dead" or "error"; "" while it is running.
        steps: Number of steps.
        t: Simulated time at the end [s].
        alive: Number of living entities, by team.
        born: Number of entities that were born, by the team of their block.
        waited: Number of births that had to wait for a free position.
        metrics: Name of a metric or interaction -> result name -> value, or {team: value}.
        scores: Sum of the scores of all metrics, by team.
        state_hash: Hash of the state at the end.
        error: The error, if `end` is "error".
    """

    world: int
    seed: int
    end: str
    steps: int
    t: float
    alive: dict[int, int]
    metrics: dict[str, dict[str, Any]] = field(default_factory=dict)
    scores: dict[int, float] = field(default_factory=dict)
    state_hash: str = ""
    error: Exception | None = None
    born: dict[int, int] = field(default_factory=dict)
    waited: int = 0

    @property
    def winner(self) -> int | None:
        """Team with a higher score than every other; None on a tie, without scores, and where its own or another's is not a number."""
        for team, score in self.scores.items():
            if not math.isnan(score) and all(
                score > other for rival, other in self.scores.items() if rival != team
            ):
                return team
        return None

    def __repr__(self) -> str:
        return line("WorldResult", "", *self._facts())

    def _facts(self) -> tuple[str, ...]:
        left = listing(
            [f"team {team}: {n:,} of {self.born.get(team, n):,}" for team, n in self.alive.items()]
        )
        scores = listing([f"team {team}: {number(float(score))}" for team, score in self.scores.items()])
        error = f"{type(self.error).__name__}: {self.error}" if self.error is not None else ""
        return (
            f"seed {self.seed}", f"ended by {self.end}" if self.end else "running", f"t = {self.t:.6g} s",
            f"left {left}" if left else "", f"score {scores}" if scores else "", error.partition("\n")[0],
        )  # fmt: skip

    def _repr_html_(self) -> str:
        seed, end, t, _, _, error = self._facts()
        teams = [
            (team, self.born.get(team, n), n, self.scores.get(team, "")) for team, n in self.alive.items()
        ]
        values = (
            (f"{name}.{key}", value) for name, found in self.metrics.items() for key, value in found.items()
        )
        return page(
            f"World {self.world}", [seed, end, t, f"{self.steps:,} steps", error],
            table(("team", "born", "left", "score"), teams, MAX_TABLE // 2), table(("result", "value"), values, MAX_TABLE // 2),
        )  # fmt: skip
