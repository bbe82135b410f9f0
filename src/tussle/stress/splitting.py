"""Adaptive multilevel splitting: probabilities of rare failures from games that branch where they have come near.

Cérou and Guyader (2007, "Adaptive multilevel splitting for rare event analysis"); the form for ties and discrete time whose estimate is
unbiased for any number of games and any score: Bréhier et al. (2016, "Unbiasedness of some generalized adaptive multilevel splitting
algorithms"), section 3. The score of a game at a step is its robustness as known there, or that of a guide, which never rises.

A repetition plays n games. In each round, those that stayed farthest from failure are replaced by branches of others: each is the game of
a random survivor up to the first step at which it was nearer to failure than the level of the round, and then has other luck. A branch is
a game of its own, with a seed and re-keys; its states up to the branch are computed again, bit for bit.

Where starts decide, games are moved too (`Redraws`): at levels that are fixed before, each game is tried with other numbers for the start
of one or a few entities, and stays as it was if it would not come as near as the level. That leaves the law of the games beyond the level
as it is, since the numbers are independent of each other and one is drawn again whatever it was (a Metropolis step; Cérou et al. 2012,
"Sequential Monte Carlo for rare event estimation", section 3). Afterwards each game has other luck from the first step beyond the level
on, as what came later has been looked at. At a fixed level, the mean of the estimate of each function of the games is exact (Bréhier et
al. 2016, theorem 3.2), so it stays exact with the moves. Levels that depended on the games that are moved would have a bias.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from tussle.batch.statistics import LEVEL, scipy_package
from tussle.numeric import exp, log, total
from tussle.numeric.rng import stream_key, uniform
from tussle.stress.games import Played, StressGame

CHOICE, MOVED = stream_key("stress", "survivor"), stream_key("stress", "moved")

MIN_PROBABILITY = 1e-15
"""Below it a repetition ends as if no game had come nearer: where branches do not differ, levels creep on without end."""

BEFORE = 2**16 - 1
"""Number of the repetition that finds the levels of moves."""
MAX_MOVED = 8
"""Entities that one move lets start elsewhere."""
PASSING = 0.1
"""Part of the games beyond one level of moves that reaches the next."""

Play = Callable[[Sequence[StressGame]], Sequence[Played]]


@dataclass
class Repetition:
    """One run of the algorithm, independent of the others.

    Attributes:
        number: Its number.
        probability: Its estimate.
        levels: Score at which games were replaced, of each round.
        shares: Part of the games that was replaced, of each round.
        n_games: Games that it played.
        n_ancestors: Games of the start from which those at the end descend.
        failures: Games at the end that failed.
    """

    number: int
    probability: float = 1.0
    levels: list[float] = field(default_factory=list)
    shares: list[float] = field(default_factory=list)
    n_games: int = 0
    n_ancestors: int = 0
    failures: list[Played] = field(default_factory=list)

    @property
    def is_extinct(self) -> bool:
        """At some level no game came nearer to failure, so that none was left."""
        return self.probability == 0.0


@dataclass(frozen=True)
class Redraws:
    """Moves of games to other starts.

    Attributes:
        levels: Scores at which they are made, descending; fixed, whatever the games that are moved.
        starts: Block and number of each entity that may start elsewhere.
        n: How often each game is moved at a level.
    """

    levels: Sequence[float]
    starts: Sequence[tuple[str, int]]
    n: int

    def proposal(self, game: StressGame, name: str) -> StressGame:
        """The same game with other starts of some entities: mostly of one or few."""
        key = stream_key("stress", "start", name)
        number, *places = uniform(key, MOVED, np.arange(MAX_MOVED + 1), np.zeros(MAX_MOVED + 1, np.int64))[
            0
        ].tolist()
        most = min(MAX_MOVED, max(1, len(self.starts) // 4))
        for i, place in enumerate(places[: int((most + 1) ** number)]):
            game = game.reborn((key + i) % 2**64, *self.starts[int(place * len(self.starts))])
        return game

    @classmethod
    def of(cls, pilot: Repetition, starts: Sequence[tuple[str, int]], n: int) -> Redraws:
        """Return moves at levels that are taken from a repetition without moves: of its games, `PASSING` came from each to the next."""
        levels, passing = list[float](), PASSING
        reached = np.cumprod(1.0 - np.array(pilot.shares))
        for level, part in zip(pilot.levels, reached.tolist(), strict=True):
            if part <= passing:
                levels.append(level)
                passing = part * PASSING
        return cls(levels, starts, n)


NO_REDRAWS = Redraws((), (), 0)


def repetition(
    number: int,
    n: int,
    n_replaced: int,
    first_seed: int,
    result: Repetition,
    redraws: Redraws = NO_REDRAWS,
) -> Generator[list[StressGame], Sequence[Played], None]:
    """One run of the algorithm: yields games, and is sent how they went.

    Args:
        number: Its number: of the seeds, and of its draws.
        n: Games at a time.
        n_replaced: Games that are replaced in a round, or more where there are ties.
        first_seed: Seed of the first game of repetition 0.
        result: Receives what comes of it.
        redraws: How games are moved to other starts.
    """
    games = [StressGame((first_seed + number * n + i) % 2**64) for i in range(n)]
    played = list((yield games))
    score = np.array([p.verdict.score for p in played])
    result.n_games = n
    round_, fixed = 0, list(redraws.levels)
    while True:
        level = float(np.sort(score)[n - n_replaced])
        is_fixed = bool(fixed) and level <= fixed[0]
        if is_fixed:
            level = fixed.pop(0)
        if level < 0.0:
            break
        is_lost = score >= level
        survivors, lost = np.flatnonzero(~is_lost), np.flatnonzero(is_lost)
        result.levels.append(level)
        result.shares.append(len(lost) / n)
        result.probability *= len(survivors) / n
        if result.probability < MIN_PROBABILITY:
            result.probability = 0.0
            return
        draws = uniform(first_seed % 2**64, CHOICE, lost, np.full(len(lost), round_), number)[0]
        parents = survivors[np.minimum((draws * len(survivors)).astype(np.int64), len(survivors) - 1)]
        name = f"{first_seed} {number} {round_}"
        branches = yield [
            _beyond(played[i], level, f"{name} {place}")
            for place, i in zip(lost.tolist(), parents.tolist(), strict=True)
        ]
        for place, branch in zip(lost.tolist(), branches, strict=True):
            played[place] = branch
        score[lost] = [branch.verdict.score for branch in branches]
        result.n_games += len(lost)
        if is_fixed:
            for move in range(redraws.n):
                tried = yield [redraws.proposal(p.game, f"{name} {i} {move}") for i, p in enumerate(played)]
                played = [
                    new if new.verdict.score < level else old for old, new in zip(played, tried, strict=True)
                ]
            played = list((yield [_beyond(p, level, f"{name} {i} moved") for i, p in enumerate(played)]))
            result.n_games += (redraws.n + 1) * n
            score = np.array([p.verdict.score for p in played])
        round_ += 1
    result.failures = [p for p in played if p.verdict.has_failed]
    result.n_ancestors = len({p.game.seed for p in played})
    result.probability *= len(result.failures) / n


def _beyond(played: Played, level: float, name: str) -> StressGame:
    """The same game up to the first step beyond a level, and then with other luck."""
    step = played.verdict.first_below(level)
    assert step is not None
    return played.game.branch(step, stream_key("stress", "branch", name))


def split(
    play: Play,
    n: int,
    n_replaced: int,
    numbers: Sequence[int],
    first_seed: int,
    redraws: Redraws = NO_REDRAWS,
) -> list[Repetition]:
    """Run the algorithm several times; the games of a round of all of them are played together.

    Args:
        play: Plays games.
        n: Games at a time, of each repetition.
        n_replaced: Games that are replaced in a round.
        numbers: Numbers of the repetitions.
        first_seed: Seed of the first game of repetition 0.
        redraws: How games are moved to other starts.
    """
    results = [Repetition(number) for number in numbers]
    under_way = {r.number: repetition(r.number, n, n_replaced, first_seed, r, redraws) for r in results}
    asked = {number: next(one) for number, one in under_way.items()}
    while asked:
        played = list(play([game for games in asked.values() for game in games]))
        first, following = 0, {}
        for number, games in asked.items():
            with suppress(StopIteration):
                following[number] = under_way[number].send(played[first : first + len(games)])
            first += len(games)
        asked = following
    return results


def interval(estimates: Sequence[float]) -> tuple[float, float, float]:
    """Mean of independent estimates of a probability, and its 95 % interval.

    Student's interval for the logarithm of the mean, with the mean's relative standard error: estimates of splitting are skewed to the
    right, by the same factor whatever the probability. (0, 0, 1) if all are zero: see `Probability`.
    """
    values = np.asarray(estimates, dtype=np.float64)
    n, mean = len(values), float(total(values)) / len(values)
    if mean == 0.0:
        return 0.0, 0.0, 1.0
    if n < 2:
        return mean, 0.0, 1.0
    deviation = math.sqrt(float(total((values - mean) ** 2)) / (n - 1))
    half = float(scipy_package().special.stdtrit(n - 1, 0.5 + LEVEL / 2.0)) * deviation / math.sqrt(n) / mean
    low, high = (float(exp(log(mean) + sign * half)) for sign in (-1.0, 1.0))
    return mean, low, min(high, 1.0)
