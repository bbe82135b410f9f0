"""What one world's game came to."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass
class WorldResult:
    """The end of one world.

    Attributes:
        world: Number in the stack.
        seed: Its seed.
        end: Why it ended: "time", "one_team", "all_dead", "error", or "" while it goes on.
        steps: Steps made.
        t: Time at the end [s].
        alive: Entities left, by team.
        metrics: Metric or interaction -> name -> value, or -> {team: value}.
        scores: Sum of the metrics' scores, by team.
        state_hash: Hash of the state at the end.
        error: What went wrong, for end "error".
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

    @property
    def winner(self) -> int | None:
        """Team with the highest score; None for a tie or without scores."""
        if not self.scores:
            return None
        best = max(self.scores.values())
        leaders = [team for team, score in self.scores.items() if score == best]
        return leaders[0] if len(leaders) == 1 else None
