"""The progress of a batch."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from tussle.batch.tasks import Finished


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
