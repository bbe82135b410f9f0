"""How far a batch is."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from tussle.batch.tasks import Beat, Finished


@dataclass
class Progress:
    """How far a batch is, and what has come of it so far.

    Attributes:
        n_runs: Runs that are planned.
        n_done: Runs that are finished, those of earlier calls included.
        n_before: Runs that had been finished before this call.
        n_failed: Of them, those that failed.
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
        """A run is finished."""
        self.n_done += 1
        if finished.end == "error":
            self.n_failed += 1
        elif any(name == "score" for _, name, _ in finished.metrics):
            self.wins[finished.winner] += 1

    def beat(self, beat: Beat) -> None:
        """A sign of life."""
        self.under_way = beat.under_way
