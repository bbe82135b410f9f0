"""Importance sampling by the cross-entropy method: probabilities of rare failures that start states and parameters decide.

Rubinstein (1999, "The cross-entropy method for combinatorial and continuous optimization"); de Boer et al. (2005, "A tutorial on the
cross-entropy method"), section 3. Values are those of standard normal numbers, so that the nominal distribution is N(0, 1) in each. Rounds
of games fit Gaussians to those that came nearest to failure, weighted by what the nominal distribution gives them. From the last one a
fresh sample is drawn. Both have a share of the nominal distribution (Hesterberg 1995, "Weighted average importance sampling and defensive
mixture distributions"), which bounds the weights, and a share of a wider Gaussian.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tussle.batch.statistics import LEVEL, scipy_package
from tussle.errors import ParameterError
from tussle.numeric import exp, log, total
from tussle.numeric.rng import normal, stream_key
from tussle.stress.games import Played

DRAW = stream_key("stress", "importance")
ELITE = 0.1
"""Part of the games of a round to which the next proposal is fitted."""
FAILING, ROUNDS_REACHED = 0.05, 3
"""Part of the games of a round that fail, from which on proposals are fitted to failing games, and rounds from there to the last fit."""
SHARES, SCALES = (0.1, 0.6, 0.3), (1.3, 4.0)
"""Parts of the nominal distribution, of fitted Gaussians and of wider ones; by what the covariances of the latter two are multiplied."""
MIN_VARIANCE = 0.01
CUT = 10.0
"""Weights above so many times their median are cut in a fit."""
SEARCHES = 2
"""Searches for proposals, independent of each other, whose Gaussians are mixed: one alone may forget one of several ways to fail."""
MAX_GAUSSIANS, POINTS, MIN_OWN, STEPS = 4, 4, 0.02, 15
"""Gaussians that are fitted, effective points per dimension and more that each needs, least weight of one that is kept, and steps of EM."""
MAX_ROUNDS, MAX_IDLE = 60, 6
"""Rounds, and rounds that do not come nearer to failure, after which the search gives up."""
NOTHING = "no game of the last sample failed"
MIN_EFFECTIVE, MAX_SHARE = 50.0, 0.1
"""Effective failing games below which, and part of the greatest weight above which, a note says that the estimate cannot be trusted."""

Robustness = Callable[[np.ndarray, int], np.ndarray]
"""Plays games: standard normal numbers (n, d) and the number of games before -> robustness (n,)."""


@dataclass
class ImportanceEstimate:
    """The probability that a game fails, by importance sampling.

    Attributes:
        value: The estimate, whose mean is the probability.
        low: Lower end of its 95 % interval.
        high: Its upper end.
        n: Games of the last sample, from which it follows.
        n_games: Games of all rounds and the last sample.
        n_failed: Failing games of the last sample.
        levels: Robustness to which each round was fitted; negative ones count as 0.
        effective: Effective number of failing games: (sum of weights)^2 / sum of squares.
        greatest: Part of the greatest weight in the estimate.
        means: Middles of the Gaussians of the last proposal, as standard normal numbers, (k, d).
        error: Standard error of the estimate.
        failures: Failing games of the last sample, the worst first.
        notes: What to know about the result.
        game_s: Length of all games [s].
        cpu_s: Their CPU time [s].
    """

    value: float
    low: float
    high: float
    n: int
    n_games: int
    n_failed: int
    levels: list[float]
    effective: float
    greatest: float
    means: np.ndarray
    error: float
    failures: list[Played] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    game_s: float = 0.0
    cpu_s: float = 0.0

    @property
    def n_plain(self) -> float:
        """Plain games that would be needed for the same standard error; NaN where that is not known."""
        return self.value * (1.0 - self.value) / self.error**2 if self.error > 0.0 else math.nan


class Proposal:
    """A mixture of the standard normal distribution and of Gaussians, each with a wider one around it; at first the former alone.

    Args:
        d: Dimensions.
    """

    def __init__(self, d: int) -> None:
        self.means = np.zeros((1, d))
        self._roots: list[list[np.ndarray]] = [[np.eye(d)] * 2]

    def fit(self, u: np.ndarray, weights: np.ndarray) -> None:
        """Fit the Gaussians to weighted points, (k, d) and (k,): several, since games may fail in several ways."""
        share = weights / float(total(weights))
        effective = 1.0 / float(total(share * share))
        n = int(min(MAX_GAUSSIANS, max(1.0, effective / (POINTS * (u.shape[1] + 1)))))
        means: np.ndarray = _far_apart(u, share, n)
        covariances: list[np.ndarray] = [_covariance(u, share)] * n
        for _ in range(STEPS if n > 1 else 1):
            densities = np.array(
                [_log_density(u, m, _root(c)) for m, c in zip(means, covariances, strict=True)]
            )
            belongs = exp(np.maximum(densities - densities.max(axis=0), -700.0))
            belongs *= share / belongs.sum(axis=0)
            own = belongs.sum(axis=1)
            belongs, n = belongs[own > MIN_OWN], int((own > MIN_OWN).sum())
            belongs /= belongs.sum(axis=1)[:, None]
            means, covariances = belongs @ u, [_covariance(u, each) for each in belongs]
        self.means = means
        self._roots = [[_root(scale * c) for scale in SCALES] for c in covariances]

    def join(self, others: Sequence[Proposal]) -> None:
        """Take the Gaussians of others."""
        self.means = np.concatenate([each.means for each in others])
        self._roots = [roots for each in others for roots in each._roots]

    def draw(self, z: np.ndarray) -> np.ndarray:
        """Points from standard normal numbers, (n, d): the first ones from the nominal distribution, the others from the Gaussians."""
        shares = [SHARES[0], *(share for _, _, share in self._parts())]
        edges = np.rint(np.cumsum(shares) * len(z)).astype(int)
        parts = [z[: edges[0]]]
        for first, last, (mean, root, _) in zip(edges, edges[1:], self._parts(), strict=False):
            parts.append(mean + z[first:last] @ root.T)
        return np.concatenate(parts)

    def weights(self, u: np.ndarray) -> np.ndarray:
        """Density of the nominal distribution by that of the mixture, (n,), at most 1 / `SHARES[0]`."""
        nominal = -0.5 * (u * u).sum(axis=1)
        ratio = np.full(len(u), SHARES[0])
        for mean, root, share in self._parts():
            ratio += share * exp(np.minimum(_log_density(u, mean, root) - nominal, 700.0))
        return np.asarray(1.0 / ratio)

    def _parts(self) -> Iterator[tuple[np.ndarray, np.ndarray, float]]:
        """Mean, root of the covariance, and part of the mixture; equal ones of all Gaussians, so that no way to fail is forgotten."""
        for mean, roots in zip(self.means, self._roots, strict=True):
            for root, share in zip(roots, SHARES[1:], strict=True):
                yield mean, root, share / len(self.means)


def _far_apart(u: np.ndarray, share: np.ndarray, n: int) -> np.ndarray:
    """Points far from each other, (n, d): the heaviest one, then each time the one farthest from all before."""
    chosen = [u[int(np.argmax(share))]]
    while len(chosen) < n:
        gaps = np.min([((u - point) ** 2).sum(axis=1) for point in chosen], axis=0)
        chosen.append(u[int(np.argmax(gaps))])
    return np.array(chosen)


def _covariance(u: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Covariance of weighted points, (d, d); few points know little of correlations, and of variances."""
    d, apart = u.shape[1], u - share @ u
    found = (share[:, None] * apart).T @ apart
    spread = np.maximum(np.diag(found), MIN_VARIANCE)
    kept = max(0.0, 1.0 - (d + 1) * float(total(share * share)))
    return np.asarray(kept * found + np.diag(spread - kept * np.diag(found)))


def _root(covariance: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.cholesky(covariance))


def _log_density(u: np.ndarray, mean: np.ndarray, root: np.ndarray) -> np.ndarray:
    """Logarithm of the density of a Gaussian, (n,), less that of the standard normal one at 0."""
    z = np.linalg.solve(root, (u - mean).T)
    return np.asarray(-0.5 * (z * z).sum(axis=0) - float(total(log(np.diag(root)))))


def estimate(robustness_of: Robustness, d: int, games: int, per_round: int, seed: int) -> ImportanceEstimate:
    """Estimate the probability that a game fails.

    Args:
        robustness_of: Plays games.
        d: How many values vary.
        games: Of the last sample.
        per_round: Games of each round before.
        seed: Of the draws.

    Raises:
        ParameterError: All games fail, or none and none comes nearer to it.
    """
    proposal, levels, n_before = Proposal(d), list[float](), 0
    found = []
    for number in range(SEARCHES):
        own, fallen = _searched(robustness_of, d, per_round, seed, number, n_before)
        n_before += per_round * len(fallen)
        levels += fallen
        found.append(own)
    proposal.join(found)
    u = proposal.draw(_draws(seed, games, MAX_ROUNDS, SEARCHES, d))
    has_failed = robustness_of(u, n_before) < 0.0
    return _estimated(np.where(has_failed, proposal.weights(u), 0.0), n_before, levels, proposal.means)


def _searched(
    robustness_of: Robustness, d: int, per_round: int, seed: int, number: int, n_before: int
) -> tuple[Proposal, list[float]]:
    """A proposal whose games fail often, and the levels of its rounds."""
    proposal, levels, n_reached = Proposal(d), list[float](), 0
    while len(levels) < MAX_ROUNDS:
        u = proposal.draw(_draws(seed, per_round, len(levels), number, d))
        robustness = robustness_of(u, n_before + per_round * len(levels))
        has_failed = robustness < 0.0
        if not levels and has_failed.all():
            raise ParameterError(
                f"all of {per_round:,} games fail with values of the given distributions: nothing is rare"
            )
        levels.append(float(np.sort(robustness)[math.ceil(ELITE * per_round) - 1]))
        is_reached = np.count_nonzero(has_failed) >= FAILING * per_round
        if is_reached or not n_reached:  # a round with few failures after one with many teaches nothing
            is_elite = has_failed if is_reached else robustness <= levels[-1]
            proposal.fit(u[is_elite], _cut(proposal.weights(u)[is_elite]))
        n_reached += bool(is_reached or n_reached)
        if n_reached == ROUNDS_REACHED:
            return proposal, levels
        if not n_reached and len(levels) > MAX_IDLE and min(levels[-MAX_IDLE:]) >= min(levels[:-MAX_IDLE]):
            break
    raise ParameterError(
        f"no failure was found: the nearest tenth of {per_round * len(levels):,} games stays at a robustness of {min(levels):.6g}, and "
        "other values of the distributions lead no nearer"
    )


def _cut(weights: np.ndarray) -> np.ndarray:
    """Weights for a fit, (n,): great ones are cut (Ionides 2008, "Truncated importance sampling"), so that no few points decide it."""
    return np.asarray(np.minimum(weights, CUT * np.median(weights)))


def _draws(seed: int, n: int, round_: int, number: int, d: int) -> np.ndarray:
    """Standard normal numbers, (n, d), of a round of a search."""
    return np.ascontiguousarray(normal(seed % 2**64, DRAW, np.arange(n), np.full(n, round_), number, d).T)


def _estimated(
    weights: np.ndarray, n_before: int, levels: list[float], means: np.ndarray
) -> ImportanceEstimate:
    """The estimate from the weights of the last sample, 0 for games that did not fail, (n,)."""
    n, n_failed = len(weights), int(np.count_nonzero(weights))
    if not n_failed:  # the first ones are plain games
        high = 1.0 - 0.05 ** (1.0 / max(1, round(SHARES[0] * n)))
        return ImportanceEstimate(
            0.0, 0.0, high, n, n_before + n, 0, levels, 0.0, 0.0, means, 0.0, notes=[NOTHING]
        )
    whole, squares = float(total(weights)), float(total(weights * weights))
    value, effective, greatest = whole / n, whole * whole / squares, float(weights.max()) / whole
    error = math.sqrt(max(squares / n - value * value, 0.0) / max(n - 1, 1))
    half = float(scipy_package().special.ndtri(0.5 + LEVEL / 2.0)) * error / value
    low, high = (float(exp(log(value) + sign * half)) for sign in (-1.0, 1.0))
    notes = []
    if effective < MIN_EFFECTIVE or greatest > MAX_SHARE:
        notes.append(
            f"the estimate cannot be trusted: it rests on {effective:.1f} effective games, and one game has {greatest:.0%} of it; "
            "play more games with -n, or vary fewer values"
        )
    return ImportanceEstimate(
        value, low, min(high, 1.0), n, n_before + n, n_failed, levels, effective, greatest, means, error, notes=notes
    )  # fmt: skip


def entry(found: ImportanceEstimate) -> dict[str, Any]:
    """An estimate as in `result.json`."""
    kept = ("low", "high", "n_games", "n_failed", "levels", "effective", "greatest", "error", "notes")
    return {"probability": found.value, "games": found.n, **{name: getattr(found, name) for name in kept}}
