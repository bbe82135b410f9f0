"""What plain games and splitting say about the probability of a failure."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tussle.numeric import total
from tussle.stress.games import Played
from tussle.stress.splitting import Repetition


@dataclass
class Sample:
    """Plain games of a mission.

    Attributes:
        games: How they went.
        low: Lower end of Wilson's 95 % interval of the probability of failure.
        high: Its upper end.
    """

    games: list[Played]
    low: float
    high: float

    @property
    def failures(self) -> list[Played]:
        """Games that failed, the worst first."""
        return worst_first(p for p in self.games if p.verdict.has_failed)

    @property
    def value(self) -> float:
        """Part of the games that failed."""
        return len(self.failures) / len(self.games)

    @property
    def robustness(self) -> np.ndarray:
        """Robustness of each game, (n,)."""
        return np.array([p.verdict.robustness for p in self.games])


@dataclass
class Probability:
    """The probability that a game fails, by adaptive multilevel splitting.

    Attributes:
        value: The estimate, whose mean is the probability.
        low: Lower end of its 95 % interval, from independent repetitions.
        high: Its upper end.
        repetitions: The repetitions.
        n: Games at a time, of each repetition.
        game_s: Length of all games that were played [s].
        cpu_s: Their CPU time [s].
        failures: Different failing games, the worst first.
        before: The repetition before them that found the levels at which games are moved, if they are.
        notes: What to know about the result.
    """

    value: float
    low: float
    high: float
    repetitions: list[Repetition]
    n: int
    game_s: float
    cpu_s: float
    failures: list[Played]
    before: list[Repetition] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def n_games(self) -> int:
        """Games of all repetitions, branches included."""
        return int(np.sum([r.n_games for r in [*self.before, *self.repetitions]]))

    @property
    def n_plain(self) -> float:
        """Games that an estimate without splitting needs for the same relative standard error; NaN where that is not known."""
        estimates = np.array([r.probability for r in self.repetitions])
        variance = float(total((estimates - self.value) ** 2)) / max(len(estimates) - 1, 1) / len(estimates)
        return self.value * (1.0 - self.value) / variance if variance > 0.0 else float("nan")


def worst_first(games: Any) -> list[Played]:
    """Different games, the worst first: of those that branched from one game only the worst."""
    best: dict[tuple[Any, int], Played] = {}
    for played in games:
        key = played.game.values, played.game.seed
        if key not in best or played.verdict.robustness < best[key].verdict.robustness:
            best[key] = played
    return sorted(best.values(), key=lambda p: p.verdict.robustness)
