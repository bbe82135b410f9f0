"""A league: rules and policies play each other at a task, and are rated by their results."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import combinations, product
from pathlib import Path
from typing import Any

import numpy as np

from tussle.batch.batch import Batch
from tussle.batch.results import Results
from tussle.batch.statistics import LEVEL, scipy_package
from tussle.documents import several
from tussle.errors import MissingExtraError, ParameterError, nearest_name
from tussle.folders import real_path
from tussle.mission import Mission
from tussle.mission.plugin_files import load_plugin_file
from tussle.rl.flight import Policy, load_flight, registered_task
from tussle.rl.opponents import other_side, with_policy

RULES = "rules"
MAX_PLAYERS = 100
ELO = 400.0 / math.log(10.0)
"""Elo points of one unit of a log-odds: 400 points are odds of ten to one (Elo, The Rating of Chessplayers (1978), 8.4)."""


@dataclass(frozen=True)
class Contestant:
    """Who takes part.

    Attributes:
        name: Its name in the league.
        path: The ONNX file; "" for the autonomies of the mission.
        sides: What it can play: 0 for the learners of the task, 1 for their opponents.
    """

    name: str
    path: str
    sides: tuple[int, ...]


@dataclass(frozen=True)
class Pairing:
    """The games of two players, from the view of the first; an interval is Wilson's, with a draw as half a win.

    Attributes:
        a: Name of the first player.
        b: Name of the second.
        wins: Games that a won.
        draws: Games that nobody won.
        losses: Games that b won.
        share: Wins and half of the draws, as a share.
        low: Lower end of its interval; high: upper end.
        decider: Run that decided: after it, who is behind could not catch up; the last one where both are equal.
        sides: Blocks that a played in it.
        margin: By how much a won it.
    """

    a: str
    b: str
    wins: int
    draws: int
    losses: int
    share: float
    low: float
    high: float
    decider: int
    sides: str
    margin: float


@dataclass(frozen=True)
class Rating:
    """A player's place.

    Attributes:
        name: The player.
        elo: Rating; the mean of all players is 0.
        low: Lower end of its interval; high: upper end.
        wins: Games won; draws, losses: the others.
    """

    name: str
    elo: float
    low: float
    high: float
    wins: int
    draws: int
    losses: int


@dataclass(frozen=True)
class Standings:
    """Result of a league.

    Attributes:
        task: Registered id of the task.
        margin: Quantity that tells who won.
        ratings: All players, best first.
        pairings: All pairs that played.
        n_games: Games that count.
        n_failed: Games that failed, which do not.
    """

    task: str
    margin: str
    ratings: tuple[Rating, ...]
    pairings: tuple[Pairing, ...]
    n_games: int
    n_failed: int

    def as_dict(self) -> dict[str, Any]:
        """All of it, for JSON."""
        return asdict(self)


class League:
    """A round robin: each player plays each that can play the other side.

    Where one policy plays both sides, half of the games of a pair are played with the sides changed. Each game has a seed of its own.

    Args:
        task: Registered id of a task with `opponents`. Games end as its mission says.
        players: Each "rules", an ONNX file, or NAME=FILE. The file's metadata name the task whose agents it plays: this one, or that of
            the opponents.
        games: Games of each pair.
        seed: Of the first game.
        plugin_files: Python files with plugins and tasks.

    Attributes:
        sides: Registered id and task of the learners, and of their opponents.
        is_symmetric: One policy plays both.
        players: Players by name; `pairs`, who play each other.
        batch: The games, as points of a batch: "first" plays the learners, "second" their opponents.
        margin: Quantity by which the learners win.

    Raises:
        ParameterError: The task is unknown or has no other side, or a player cannot play.
    """

    def __init__(
        self,
        task: str,
        players: Sequence[str],
        *,
        games: int = 40,
        seed: int = 1,
        plugin_files: Sequence[str | Path] = (),
    ) -> None:
        for file in several(plugin_files):
            load_plugin_file(file)
        self.name, own = task, registered_task(task, "TASK")
        self.sides = ((task, own), (own.opponents, other_side(task, own)))
        self.is_symmetric = own.is_symmetric
        self.players = self._players(players)
        self.pairs = self._pairs()
        self.margin = own.margin or "-".join(f"score[{t.blocks[0].team}]" for _, t in self.sides)
        self.batch = Batch(
            self.mission,
            points=[self._point(a, b) for pair in self.pairs for a, b in self._orders(pair)],
            runs=math.ceil(games / 2) if self.is_symmetric else games,
            first_seed=seed,
            independent=True,
            plugin_files=plugin_files,
        )

    def _players(self, texts: Sequence[str]) -> dict[str, Contestant]:
        """Players by name."""
        found: dict[str, Contestant] = {}
        for player in (p for text in texts for p in self._named(text.strip())):
            if player.name in found:
                raise ParameterError(
                    f"player {player.name!r} is there twice; each has a name of its own, such as late={player.path or RULES}"
                )
            found[player.name] = player
        if len(found) > MAX_PLAYERS:
            raise ParameterError(
                f"{len(found)} players are not allowed; a league takes at most {MAX_PLAYERS}"
            )
        return found

    def _named(self, text: str) -> list[Contestant]:
        """The player of a text; rules are two where the sides differ."""
        name, equals, file = text.partition("=")
        if (file if equals else text) == RULES:
            if self.is_symmetric:
                return [Contestant(name, "", (0, 1))]
            return [Contestant(f"{name} of {t.learners}", "", (i,)) for i, (_, t) in enumerate(self.sides)]
        path = Path(file if equals else text)
        if not path.is_file():
            raise ParameterError(
                f"player {text!r}{nearest_name(text, [RULES])}: there is no file {path}; "
                "it takes rules, an ONNX file, NAME=rules or NAME=FILE"
            )
        stem = real_path(path).parent.name if path.stem == "policy" else path.stem
        made_for = Policy(str(path)).task or self.name
        tasks = [name for name, _ in self.sides]
        if made_for not in tasks:
            raise ParameterError(
                f"player {text!r} plays {made_for}; this league takes policies of {' and '.join(tasks)}"
            )
        sides = (0, 1) if self.is_symmetric else (tasks.index(made_for),)
        for side in sides:
            for block in self.sides[side][1].blocks:
                load_flight(str(path), tasks[side], block.name)  # it fits
        return [Contestant(name if equals else stem, str(real_path(path)), sides)]

    def _pairs(self) -> list[tuple[str, str]]:
        """Names of those who play each other, of the learners' side first."""
        if self.is_symmetric:
            pairs = list(combinations(self.players, 2))
        else:
            one, two = ([p.name for p in self.players.values() if side in p.sides] for side in (0, 1))
            pairs = list(product(one, two))
        if not pairs:
            sides = " and ".join(t.learners for _, t in self.sides)
            what = "a game has two" if self.is_symmetric else f"{sides} need one each"
            raise ParameterError(f"there is no game with the players {', '.join(self.players)}; {what}")
        return pairs

    def _orders(self, pair: tuple[str, str]) -> list[tuple[str, str]]:
        return [pair, pair[::-1]] if self.is_symmetric else [pair]

    def _point(self, first: str, second: str) -> dict[str, str]:
        """A game as a point of the batch; with hashes of the files, as other files are another game."""
        files = " ".join(_digest(self.players[name].path) for name in (first, second))
        return {"first": first, "second": second, "files": files}

    def mission(self, first: str, second: str, files: str = "") -> Mission:
        """The game of two players.

        Args:
            first: Name of who plays the learners.
            second: Name of who plays their opponents.
            files: Hashes of their files.
        """
        own = self.sides[0][1]
        mission = own.by_rule().given
        if own.time_limit is not None:
            mission = mission.replace(end=mission.start + own.time_limit).ending_by_time()
        for name, (task_name, task) in zip((first, second), self.sides, strict=True):
            if path := self.players[name].path:
                mission = with_policy(mission, task_name, task, path)
        return mission

    # -- results -----------------------------------------------------------------------------------------------------------

    def standings(self, results: Results) -> Standings:
        """Rate the players by the games that are finished.

        Raises:
            ParameterError: Games have no such margin.
            MissingExtraError: statsmodels is not installed.
        """
        runs, points = results.runs["run"].to_numpy(), results.runs["point"].to_numpy()
        margin = results.quantity(self.margin)
        n_orders = 2 if self.is_symmetric else 1
        pairings = []
        for number, pair in enumerate(self.pairs):
            mine = (points // n_orders == number) & np.isfinite(margin)
            changed = points[mine] % n_orders == 1
            pairings.append(
                self._pairing(pair, runs[mine], changed, np.where(changed, -1.0, 1.0) * margin[mine] + 0.0)
            )
        n_good = int(np.isfinite(margin).sum())
        return Standings(
            self.name,
            self.margin,
            ratings_of(list(self.players), pairings),
            tuple(pairings),
            n_good,
            len(margin) - n_good,
        )

    def _pairing(
        self, pair: tuple[str, str], runs: np.ndarray, changed: np.ndarray, margin: np.ndarray
    ) -> Pairing:
        wins, losses = int((margin > 0.0).sum()), int((margin < 0.0).sum())
        n = len(margin)
        points = np.cumsum(0.5 + 0.5 * np.sign(margin))
        score = float(points[-1]) if n else 0.0
        behind = np.minimum(points, np.arange(1, n + 1) - points)
        ahead = np.maximum(points, np.arange(1, n + 1) - points)
        is_over = ahead > behind + (n - np.arange(1, n + 1))  # who is behind may win all that are left
        at = int(is_over.argmax()) if is_over.any() else n - 1
        share = score / n if n else math.nan
        low, high = _wilson(score, n)
        side = self.sides[int(changed[at])][1].learners if n else ""
        return Pairing(
            *pair, wins, n - wins - losses, losses, share, low, high,
            int(runs[at]) if n else -1, side, float(margin[at]) if n else math.nan,
        )  # fmt: skip


def _digest(path: str) -> str:
    return hashlib.blake2b(Path(path).read_bytes(), digest_size=16).hexdigest() if path else RULES


def _statsmodels() -> Any:
    try:
        import statsmodels.api
        import statsmodels.stats.proportion
    except ImportError:
        raise MissingExtraError("a league needs statsmodels: pip install 'tussle[batch]'") from None
    return statsmodels


def _wilson(score: float, n: int) -> tuple[float, float]:
    """Wilson's interval of a share of n games, which need not be a whole number of them."""
    if not n:
        return math.nan, math.nan
    low, high = _statsmodels().stats.proportion.proportion_confint(score, n, 1.0 - LEVEL, method="wilson")
    return float(low), float(high)


def ratings_of(names: Sequence[str], pairings: Sequence[Pairing]) -> tuple[Rating, ...]:
    """Elo ratings, best first: the model of Bradley and Terry (Biometrika 39 (1952), 324-345), a draw being half a win for each.

    Each pairing gets half a win and half a loss more (Haldane, Annals of Human Genetics 20 (1956), 309-311), so that who wins or loses
    all games has a rating, too. Intervals are Wald's, from the inverse of the Fisher information.

    Args:
        names: The players.
        pairings: Their results.
    """
    place = {name: i for i, name in enumerate(names)}
    played = [p for p in pairings if p.wins + p.draws + p.losses]
    design, points = np.zeros((len(played), len(names))), np.zeros((2, len(played)))
    for row, p in enumerate(played):
        design[row, place[p.a]], design[row, place[p.b]] = 1.0, -1.0
        points[:, row] = p.wins + 0.5 * p.draws + 0.5, p.losses + 0.5 * p.draws + 0.5
    centre = np.eye(len(names)) - 1.0 / len(names)
    elo, half = np.zeros(len(names)), np.full(len(names), math.nan)
    if played:
        api = _statsmodels().api
        is_won = np.repeat([1.0, 0.0], len(played))
        rows = np.tile(design[:, 1:], (2, 1))  # the first player has 0
        fit = api.GLM(is_won, rows, family=api.families.Binomial(), freq_weights=points.ravel()).fit()
        turn = centre[:, 1:]
        elo = ELO * (turn @ fit.params)
        variance = np.diag(turn @ fit.cov_params() @ turn.T)
        half = ELO * float(scipy_package().stats.norm.ppf(0.5 + LEVEL / 2.0)) * np.sqrt(variance)
    found = []
    for name, rating, width in zip(names, elo.tolist(), half.tolist(), strict=True):
        mine = [(p.wins, p.draws, p.losses) for p in pairings if p.a == name]
        mine += [(p.losses, p.draws, p.wins) for p in pairings if p.b == name]
        found.append(
            Rating(name, rating, rating - width, rating + width, *(sum(c) for c in zip(*mine, strict=True)))
        )
    return tuple(sorted(found, key=lambda r: -r.elo))


__all__ = ["RULES", "Contestant", "League", "Pairing", "Rating", "Standings", "ratings_of"]
