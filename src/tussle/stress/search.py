"""Search for values and seeds with which a game fails, and for failures that differ.

CMA-ES (Hansen, arXiv:1604.00772) searches the ranges of the values as a cube. It begins again elsewhere when a round mostly fails, since it
would find that failure over and over, and when it does not come nearer to one. Luck is searched too: each game has a seed of its own, and
beside the proposed games of a round as many branches are played, as in splitting: each repeats one of the games that came nearest up to
where it did, and then has other luck.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tussle.arguments import explained
from tussle.batch.points import settings_of
from tussle.batch.search.proposals import Proposer, require_optuna
from tussle.batch.search.trials import Trial, value_of
from tussle.batch.variables import Choice, Range, Value, Variable
from tussle.errors import ParameterError, listed, nearest_name
from tussle.numeric.rng import stream_key, uniform
from tussle.stress.games import Played, StressGame

SEARCHERS = ("cmaes", "tpe", "random")
WIDTH = 0.3
"""Standard deviation of a search's first round, as part of each range."""
MAX_IDLE_ROUNDS = 12
"""Rounds without a game nearer to failure, after which the search begins elsewhere."""
MAX_BEST = 32
"""Games that came nearest, of which branches are made."""
APART = 0.2
"""Failures differ if one value, or the time of failure, differs by more than this part of its range."""
MAX_ASKED = 40
"""Failing games that are played again to see who failed, or a few more."""
START = stream_key("stress", "search")

Values = Mapping[str, Value]


@dataclass(frozen=True)
class Tried:
    """A game of a search.

    Attributes:
        number: Its place among the games.
        values: The values that were tried.
        played: How it went.
        other: How the same game of the other mission went, if the study has one.
    """

    number: int
    values: Values
    played: Played
    other: Played | None = None

    @property
    def robustness(self) -> float:
        """How far from a failure; with another mission, also how far that is from failing: the greater of both."""
        own = self.played.verdict.robustness
        return own if self.other is None else max(own, -self.other.verdict.robustness)

    @property
    def has_failed(self) -> bool:
        """The game failed, and that of the other mission did not."""
        return self.played.verdict.has_failed and (self.other is None or not self.other.verdict.has_failed)


@explained
@dataclass
class FailureSearch:
    """What a search found.

    Attributes:
        variables: What varied.
        games: All games, in order.
        failures: Different failures, the worst first.
        refused: Values with which the mission cannot be played, and why.
    """

    variables: Sequence[Variable]
    games: list[Tried]
    failures: list[Tried]
    refused: list[tuple[Values, str]] = field(default_factory=list)

    @property
    def n_failed(self) -> int:
        """Games that failed."""
        return sum(game.has_failed for game in self.games)

    @property
    def first(self) -> int | None:
        """Number of games up to the first failure; None for no failure."""
        return next((game.number + 1 for game in self.games if game.has_failed), None)

    @property
    def nearest(self) -> Tried:
        """The game with the least robustness."""
        return min(self.games, key=lambda game: game.robustness)

    def label(self, game: Tried) -> str:
        """The values of a game on one line."""
        return label(settings_of(game.values, self.variables))


def label(settings: Values) -> str:
    """Settings on one line."""
    return ", ".join(f"{name}={value}" for name, value in settings.items())


class CubeSearcher:
    """CMA-ES over the cube of the ranges; or, if it is random, evenly drawn values.

    Args:
        variables: What varies.
        seed: Of what it draws.
        per_round: Games of a round.
        is_random: Draw evenly.
    """

    def __init__(self, variables: Sequence[Variable], seed: int, per_round: int, is_random: bool) -> None:
        self._variables, self._seed, self._n, self._is_random = variables, seed, per_round, is_random
        self._round = self._idle = self._start = 0
        self._best = math.inf
        self._points: list[np.ndarray] = []
        self._cma: Any = None

    def propose(self) -> list[Values]:
        """The values of the next round."""
        n, size = self._n, max(len(self._variables), 1)
        if self._is_random:
            draws = uniform(self._seed, START, np.arange(n * size), np.full(n * size, self._round), 1)[0]
            self._points = list(draws.reshape(n, size))
        else:
            if self._cma is None:
                self._cma = self._begun()
            self._points = [self._cma.ask() for _ in range(n)]
        self._round += 1
        return [
            {v.name: _value(v, float(u)) for v, u in zip(self._variables, point, strict=False)}
            for point in self._points
        ]

    def learn(self, robustness: Sequence[float]) -> None:
        """Take the robustness of the games of the round; NaN where the mission cannot be played."""
        if self._is_random:
            return
        found = np.nan_to_num(np.asarray(robustness), nan=np.inf, posinf=np.inf, neginf=-np.inf)
        self._cma.tell(list(zip(self._points, found.tolist(), strict=True)))
        self._idle = 0 if found.min() < self._best else self._idle + 1
        self._best = min(self._best, float(found.min()))
        if np.mean(found < 0.0) > 0.5 or self._idle >= MAX_IDLE_ROUNDS or self._cma.should_stop():
            self._cma, self._best, self._idle = None, math.inf, 0

    def _begun(self) -> Any:
        """A search from the middle, later from a random place."""
        from cmaes import CMA  # type: ignore[import-untyped]

        size = max(len(self._variables), 2)  # of one dimension there is no CMA-ES: the second has no effect
        middle = np.full(size, 0.5)
        if self._start:
            middle = uniform(self._seed, START, np.arange(size), np.full(size, self._start), 0)[0]
        self._start += 1
        (seed,) = np.random.SeedSequence((self._seed, self._start)).generate_state(1).tolist()
        bounds = np.tile([0.0, 1.0], (size, 1))
        return CMA(middle, WIDTH, bounds, seed=seed, population_size=self._n)


class TreeSearcher:
    """Optuna's tree-structured Parzen estimators, for choices that ranges depend on.

    Args:
        variables: What varies.
        seed: Of what it draws.
        per_round: Games of a round.
    """

    def __init__(self, variables: Sequence[Variable], seed: int, per_round: int) -> None:
        self._proposer = Proposer(variables, "tpe", seed, per_round, is_minimized=True)
        self._points: list[Values] = []
        self._n = 0

    def propose(self) -> list[Values]:
        """The values of the next round."""
        self._points = list(self._proposer.propose())
        return self._points

    def learn(self, robustness: Sequence[float]) -> None:
        """Take the robustness of the games of the round; NaN where the mission cannot be played."""
        trials = [
            Trial(self._n + i, 0, point, r, math.nan, math.nan, 0, "refused" if math.isnan(r) else "", (r,))
            for i, (point, r) in enumerate(zip(self._points, robustness, strict=False))
        ]
        self._n += len(trials)
        self._proposer.learn(trials)


def searcher(
    name: str, variables: Sequence[Variable], seed: int, per_round: int
) -> CubeSearcher | TreeSearcher:
    """The searcher of a name.

    Raises:
        ParameterError: There is none.
        MissingExtraError: Optuna or cmaes is not installed.
    """
    if name not in SEARCHERS:
        raise ParameterError(
            f"sampler = {name!r} is not allowed{nearest_name(str(name), SEARCHERS)}; {listed(SEARCHERS)}"
        )
    if not variables:
        name = "random"
    if name == "tpe":
        return TreeSearcher(variables, seed, per_round)
    if name == "cmaes":
        require_optuna(with_cmaes=True)
    return CubeSearcher(variables, seed, per_round, name == "random")


def search(
    play: Callable[[Sequence[StressGame]], Sequence[Played]],
    refusal: Callable[[Values], str],
    variables: Sequence[Variable],
    by: CubeSearcher | TreeSearcher,
    games: int,
    failures: float,
    first_seed: int,
    length: int,
    is_differential: bool,
    blame: Callable[[Played], Any],
) -> FailureSearch:
    """Search until a number of games has been played.

    Args:
        play: Plays games.
        refusal: Returns why the mission cannot be played with some settings, "" if it can.
        variables: What varies.
        by: Proposes the values.
        games: How many.
        failures: Failing games after whose round it ends.
        first_seed: Seed of the first game.
        length: Of the longest game, in steps.
        is_differential: Each game is played of two missions.
        blame: Returns what and who failed in a game.

    Raises:
        ParameterError: The mission cannot be played with any values of the first rounds.
    """
    result = FailureSearch(variables, [], [])
    sides, has_luck = 1 + is_differential, True
    while len(result.games) < games and len(result.refused) <= games and result.n_failed < failures:
        points, first = by.propose(), len(result.games)
        playable: list[int] = []
        for k, point in enumerate(points):
            if error := refusal(settings_of(point, variables)):
                result.refused.append((point, error))
            elif first + len(playable) < games:
                playable.append(k)
        if not playable and not first:
            text = label(settings_of(points[0], variables))
            raise ParameterError(
                f"the mission cannot be played with any values of a round; with {text}: {result.refused[0][1]}"
            )
        asked = [
            (
                points[k],
                StressGame(
                    (first_seed + first + i) % 2**64, (), tuple(settings_of(points[k], variables).items())
                ),
            )
            for i, k in enumerate(playable)
        ]
        parents = _parents(result.games, len(points), first_seed) if has_luck else []
        for parent, step in parents[: games - first - len(asked)]:
            key = stream_key("stress", "search", f"{first_seed} {first + len(asked)}")
            asked.append((parent.values, parent.played.game.branch(step, key)))
        played = play([replace(game, mission=side) for _, game in asked for side in range(sides)])
        robustness = [math.nan] * len(points)
        for i, (values, _) in enumerate(asked):
            other = played[i * sides + 1] if is_differential else None
            result.games.append(Tried(first + i, values, played[i * sides], other))
            if i < len(playable):
                robustness[playable[i]] = result.games[-1].robustness
        branches = result.games[first + len(playable) :]
        if branches:
            has_luck = any(
                b.played.state_hash != p.played.state_hash
                for b, (p, _) in zip(branches, parents, strict=False)
            )
        by.learn(robustness)
    failed = sorted((g for g in result.games if g.has_failed), key=lambda g: g.robustness)
    result.failures = different(failed, variables, length, blame)
    return result


def _parents(games: Sequence[Tried], n: int, seed: int) -> list[tuple[Tried, int]]:
    """Games to branch, and the step: good ones, at the first step at which they were nearer to failure than the others of the best."""
    best = sorted((g for g in games if not g.has_failed), key=lambda g: g.robustness)[:MAX_BEST]
    level = best[-1].robustness if best else 0.0
    steps = [g.played.verdict.first_below(level) for g in best]
    near = [(g, step) for g, step in zip(best, steps, strict=True) if step is not None]
    draws = uniform(seed, START, np.arange(n), np.full(n, len(games)), 2)[0]
    return [near[int(draw * len(near))] for draw in draws.tolist()] if near else []


def different(
    failed: Sequence[Tried],
    variables: Sequence[Variable],
    length: int,
    blame: Callable[[Played], Any] = lambda _: None,
) -> list[Tried]:
    """Those games that differ from all before: in a choice, by more than `APART` in a value or the time of failure, or in what fails.

    Args:
        failed: Games that failed.
        variables: What varied.
        length: Of the longest game, in steps.
        blame: Returns what and who failed in a game; it is asked where nothing else differs, of `MAX_ASKED` games at most.
    """
    kept: list[tuple[Tried, tuple[Value, ...], np.ndarray]] = []
    known: dict[int, Any] = {}
    for game in failed:
        choices = tuple(game.values[v.name] for v in variables if isinstance(v, Choice))
        place = np.array(
            [_place(v, game.values[v.name]) for v in variables if isinstance(v, Range)]
            + [(game.played.verdict.first_below(0.0) or 0) / max(length, 1)]
        )
        alike = [g for g, c, p in kept if choices == c and np.abs(place - p).max() <= APART]
        for each in [game, *alike] if alike and len(known) < MAX_ASKED else ():
            if each.number not in known:
                known[each.number] = blame(each.played)
        if not alike or (game.number in known and all(known[g.number] != known[game.number] for g in alike)):
            kept.append((game, choices, place))
    return [game for game, _, _ in kept]


def _value(variable: Variable, share: float) -> Value:
    """The value at a share of a range, rounded to digits that can be typed; or a choice."""
    value = variable.value_at(min(max(share, 0.0), 1.0))
    is_real = isinstance(variable, Range) and variable.levels is None and not variable.is_int
    return value_of(variable, value) if is_real else value


def _place(variable: Range, value: Any) -> float:
    """Part of the range below a value, from 0 to 1."""
    low, high, x = variable.low, variable.high, float(value)
    if variable.is_log:
        low, high, x = math.log(low), math.log(high), math.log(x)
    return (x - low) / (high - low) if high > low else 0.0
