"""When a game was lost: how likely its failure was from each moment on, by branches with other luck."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tussle.batch.statistics import wilson
from tussle.errors import ParameterError
from tussle.numeric.rng import stream_key
from tussle.stress.games import Played, StressGame


@dataclass(frozen=True)
class Chance:
    """How likely a failure was from a moment of a game on.

    Attributes:
        step: The moment: the start of this step.
        n: Branches from there.
        n_failed: Those that failed.
        low: Lower end of Wilson's 95 % interval of the probability of failure.
        high: Its upper end.
    """

    step: int
    n: int
    n_failed: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """Part of the branches that failed."""
        return self.n_failed / self.n


def branches_from(game: StressGame, step: int, n: int) -> list[StressGame]:
    """Branches that repeat a game up to a step, and then have other luck."""
    return [game.branch(step, stream_key("stress", "chance", f"{game.name} {step} {i}")) for i in range(n)]


def chances(
    play: Callable[[Sequence[StressGame]], Sequence[Played]], failed: Played, moments: int, branches: int
) -> list[Chance]:
    """How likely the failure of a game was from moments on, evenly spread from its start to its failure.

    Args:
        play: Plays games.
        failed: A game that failed.
        moments: How many moments.
        branches: Branches from each.

    Raises:
        ParameterError: The game did not fail.
    """
    end = failed.verdict.first_below(0.0)
    if end is None:
        raise ParameterError(
            f"the game with seed {failed.game.seed} did not fail, so nothing is to be explained"
        )
    steps = sorted({round(step) for step in np.linspace(0, end, moments).tolist()})
    games = [branch for step in steps for branch in branches_from(failed.game, step, branches)]
    has_failed = np.array([p.verdict.has_failed for p in play(games)]).reshape(len(steps), branches)
    counts = has_failed.sum(axis=1).tolist()
    return [Chance(step, branches, k, *wilson(k, branches)) for step, k in zip(steps, counts, strict=True)]
