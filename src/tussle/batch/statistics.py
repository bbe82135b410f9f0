"""Shares, means and paired differences, with their 95 % intervals.

Only finite values are used; `n` counts them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import Any

import numpy as np

from tussle.errors import MissingExtraError

LEVEL = 0.95
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)

BOOTSTRAP_FROM = 20
"""Smallest number of values for a bootstrap: the BCa interval of the mean of ten exponential numbers contains the true mean in 87 % of
cases, Student's in 90 %. Below, Student's interval is used."""
MAX_BOOTSTRAPPED = 2000
"""More values make the mean normal enough (the skewness of its distribution falls with 1/sqrt(n)), and the jackknife in the BCa
interval takes n^2 numbers. Above, the normal interval."""
N_RESAMPLES = 2000
"""Efron and Tibshirani, An Introduction to the Bootstrap (1993), section 14: at least 1,000 for intervals of 95 %."""
NUMBERS_AT_ONCE = 4_000_000
"""Largest count of numbers that the bootstrap holds at a time, 32 MB."""
ROUNDING = 1e-12
"""Relative tolerance below which values are equal, such as differences of equal effects after rounding."""
SEED = 20180101


@dataclass(frozen=True)
class Share:
    """Return the share of runs with one outcome.

    Attributes:
        name: Of the team, or "ties".
        team: Its number; None for ties.
        n: Runs with it.
        of: Runs.
        value: n / of.
        low: Lower end of Wilson's interval.
        high: Its upper end.
    """

    name: str
    team: int | None
    n: int
    of: int
    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Mean:
    """Mean of a quantity over runs.

    Attributes:
        name: The quantity.
        n: Runs.
        value: The mean; NaN for none.
        low: Lower end of the interval of the mean; NaN for less than two runs.
        high: Its upper end.
        sd: Standard deviation of the runs.
        quantiles: Share -> value below which that share of the runs is, for 5, 25, 50, 75 and 95 %.
    """

    name: str
    n: int
    value: float
    low: float
    high: float
    sd: float
    quantiles: dict[float, float]


@dataclass(frozen=True)
class PairedComparison:
    """The second side minus the first, in pairs of runs with the same seed.

    Attributes:
        quantity: What is compared.
        a: The reference.
        b: What is compared.
        n: Pairs.
        mean_a: Mean of a's runs; over several points, of the points' means.
        mean_b: Mean of b's runs, likewise.
        difference: mean_b - mean_a.
        low: Lower end of the interval of the difference.
        high: Its upper end.
        n_greater: Pairs in which b has more.
        n_less: Pairs in which b has less.
        n_equal: Pairs in which both have the same.
        p: Of the exact sign test, two-sided, in which a seed counts once, with the sign of most of its pairs.
    """

    quantity: str
    a: str
    b: str
    n: int
    mean_a: float
    mean_b: float
    difference: float
    low: float
    high: float
    n_greater: int
    n_less: int
    n_equal: int
    p: float


def scipy_package() -> Any:
    """Return the package `scipy`, which loads its submodules on first access.

    Raises:
        MissingExtraError: It cannot be imported.
    """
    try:
        import scipy
    except ImportError as error:
        raise MissingExtraError(
            f"statistics of batches need scipy, which cannot be imported ({error}); pip install 'tussle[batch]' installs it"
        ) from None
    return scipy


# -- shares ---------------------------------------------------------------------------------------------------------------


def wilson(k: float, n: float) -> tuple[float, float]:
    """Wilson's interval of a share, k of n; NaN for n = 0. Numbers of runs that stand for others need not be whole."""
    if n <= 0:
        return math.nan, math.nan
    return _wilson(k / n, NormalDist().inv_cdf(0.5 + LEVEL / 2.0) ** 2 / n)


def _wilson(share: float, ratio: float) -> tuple[float, float]:
    """Wilson's interval.

    Args:
        share: The share.
        ratio: Squared quantile of the normal distribution over the number of runs.
    """
    centre = (share + ratio / 2.0) / (1.0 + ratio)
    half = math.sqrt(max(ratio * share * (1.0 - share), 0.0) + ratio**2 / 4.0) / (1.0 + ratio)
    low, high = max(centre - half, 0.0), min(centre + half, 1.0)
    return low if share > 0.0 else 0.0, high if share < 1.0 else 1.0  # which rounding would miss


def share_of(
    name: str,
    team: int | None,
    won: np.ndarray,
    blocks: np.ndarray | None = None,
    strata: np.ndarray | None = None,
) -> Share:
    """Share of the runs with one outcome.

    Args:
        name: Of the team, or "ties".
        team: Its number; None for ties.
        won: 1 for runs with the outcome, 0 for others, NaN for unknown runs, (n,).
        blocks: Number of the block that each run belongs to, (n,); None where runs are independent.
        strata: Number of the point that each run belongs to, (n,), if blocks go over several points, which are as they are.
    """
    is_known = np.isfinite(won)
    won = won[is_known]
    k, n = int(won.sum()), len(won)
    value = k / n if n else math.nan
    size = effective_size(won, *(None if by is None else by[is_known] for by in (blocks, strata)))
    low, high = wilson(value * size, size) if n else (math.nan, math.nan)
    return Share(name, team, k, n, value, low, high)


def effective_size(won: np.ndarray, blocks: np.ndarray | None, strata: np.ndarray | None = None) -> float:
    """Number of independent runs whose share has the same variance as that of runs in blocks.

    Kish, Survey Sampling (1965), 8.2: n over the design effect. Not less than the blocks, not more than the runs.
    """
    n = len(won)
    if blocks is None or n == 0:
        return float(n)
    sums = block_values(won, blocks, strata)
    share = float(won.mean())
    variance = float(sums.var(ddof=1)) / len(sums) if len(sums) > 1 else 0.0
    if variance <= ROUNDING**2:  # always or never so, or in every block alike
        return float(len(sums))
    return min(max(share * (1.0 - share) / variance, float(len(sums))), float(n))


def running_result(wins: Mapping[str, int], n: int) -> str:
    """The wins so far, on one line: "keepers 59.8 % ±3.0, switchers 35.9 % ±3.0, ties 4.3 %".

    Args:
        wins: Name of a team -> runs that it has won; teams without a win are left out.
        n: Runs, ties included.
    """
    if not wins or n == 0:
        return ""
    parts = []
    for name, k in wins.items():
        if k:
            low, high = wilson(k, n)
            parts.append(f"{name} {100.0 * k / n:.1f} % ±{50.0 * (high - low):.1f}")
    n_ties = n - sum(wins.values())
    return ", ".join([*parts, *([f"ties {100.0 * n_ties / n:.1f} %"] if n_ties else [])])


# -- means ----------------------------------------------------------------------------------------------------------------


def mean_of(
    name: str,
    values: np.ndarray,
    blocks: np.ndarray | None = None,
    strata: np.ndarray | None = None,
    *,
    are_copies: bool = False,
    is_share: bool = False,
) -> Mean:
    """Mean of a quantity over runs.

    Args:
        name: The quantity.
        values: Its value for each run, (n,).
        blocks: Number of the block that each run belongs to, (n,); None where runs are independent.
        strata: Number of the point that each run belongs to, (n,); None for runs of one point. Mean and interval are those over these
            points, each of which counts as much, however many runs it has; how they differ is no part of the width.
        are_copies: The runs of a block are copies of one run, so that no block goes over several points.
        is_share: The quantity is a share, see `within_one`.
    """
    mean = means_of(name, [values], is_share=is_share)[0]
    if (blocks is None and strata is None) or mean.n == 0:
        return mean
    is_known = np.isfinite(values)
    block, stratum = (None if by is None else by[is_known] for by in (blocks, strata))
    if stratum is not None:
        mean = replace(mean, value=_over_strata(values[is_known], stratum)[0])
    if stratum is not None and (block is None or are_copies):
        low, high = stratified_interval(values[is_known], stratum, block)
    else:
        assert block is not None
        own = block_values(values[is_known], block, stratum)
        low, high = (float(ends[0]) for ends in (_by_t if is_share else mean_intervals)(own[None, :]))
    if is_share:
        low, high = within_one(mean.value, low, high, mean.n if block is None else len(np.unique(block)))
    return replace(mean, low=low, high=high)


def within_one(mean: float, low: float, high: float, n: int) -> tuple[float, float]:
    """The interval of a mean of values between 0 and 1, which is within 0 and 1, too.

    Wilson's interval, of as many runs that are 0 or 1 as have a mean with this variance (Kish, Survey Sampling (1965), 8.2; Korn and
    Graubard, Survey Methodology 24 (1998), 193-201); of n such runs where the mean is 0 or 1.

    Args:
        mean: The mean.
        low: Lower end of Student's interval of the mean; NaN if it is not known.
        high: Its upper end.
        n: Independent runs.
    """
    spread = mean * (1.0 - mean)
    if spread > ROUNDING:
        half = (high - low) / 2.0
        ratio = half**2 / spread  # squared quantile over the number of runs
    elif n > 1:
        ratio = NormalDist().inv_cdf(0.5 + LEVEL / 2.0) ** 2 / n
    else:
        return math.nan, math.nan
    return _wilson(mean, ratio)


def stratified_interval(
    values: np.ndarray, strata: np.ndarray, copies: np.ndarray | None = None
) -> tuple[float, float]:
    """Interval of the mean of independent runs of several points; NaN if a point has less than two distinct runs.

    Cochran, Sampling Techniques (1977), 5.4: the variance is the sum of those of the points' means, with the degrees of freedom of
    Satterthwaite.

    Args:
        values: Value of each run, (n,).
        strata: Number of the point that it belongs to, (n,).
        copies: Number of the distinct run that it is a copy of, (n,); None if all are distinct.
    """
    mean, stratum = _over_strata(values, strata)
    first = slice(None) if copies is None else np.unique(copies, return_index=True)[1]
    own, stratum = values[first], stratum[first]
    n_own = np.bincount(stratum)
    if n_own.min() < 2:
        return math.nan, math.nan
    apart = own - (np.bincount(stratum, own) / n_own)[stratum]
    apart[np.abs(apart) <= ROUNDING * np.abs(own)] = 0.0
    parts = np.bincount(stratum, apart**2) / (n_own - 1) / n_own / len(n_own) ** 2
    variance = float(parts.sum())
    if variance == 0.0:
        return mean, mean
    freedom = variance**2 / float((parts**2 / (n_own - 1)).sum())
    half = float(scipy_package().special.stdtrit(freedom, 0.5 + LEVEL / 2.0)) * math.sqrt(variance)
    return mean - half, mean + half


def _over_strata(values: np.ndarray, strata: np.ndarray) -> tuple[float, np.ndarray]:
    """Mean of the means of strata, and the number of the stratum of each value, (n,), from 0 on."""
    _, stratum = np.unique(strata, return_inverse=True)
    return float((np.bincount(stratum, values) / np.bincount(stratum)).mean()), stratum


def means_of(name: str, rows: Sequence[np.ndarray], *, is_share: bool = False) -> list[Mean]:
    """Mean of a quantity over the runs of each point; what `mean_of` gives for each, faster.

    Args:
        name: The quantity.
        rows: Its values for the runs of each point.
        is_share: It is a share, see `within_one`.
    """
    known = [row[np.isfinite(row)] for row in rows]
    sizes = np.array([len(row) for row in known])
    found: dict[int, Mean] = {}
    for n in np.unique(sizes).tolist():
        places = np.flatnonzero(sizes == n).tolist()
        same = np.array([known[i] for i in places])
        low, high = (_by_t if is_share else mean_intervals)(same)
        nothing = np.full(len(same), np.nan)
        sd = same.std(axis=1, ddof=1) if n > 1 else nothing
        mean = same.mean(axis=1) if n else nothing
        quantiles = np.quantile(same, QUANTILES, axis=1).T if n else np.tile(nothing[:, None], len(QUANTILES))
        numbers = zip(places, *(v.tolist() for v in (mean, low, high, sd, quantiles)), strict=True)
        for i, m, lower, upper, spread, q in numbers:
            found[i] = Mean(name, n, m, lower, upper, spread, dict(zip(QUANTILES, q, strict=True)))
            if is_share and n:
                narrow = within_one(m, lower, upper, n)
                found[i] = replace(found[i], low=narrow[0], high=narrow[1])
    return [found[i] for i in range(len(rows))]


def mean_interval(values: np.ndarray) -> tuple[float, float]:
    """Interval of the mean of n values, (n,): BCa bootstrap for 20 to 2,000 values, Student's t below, normal above."""
    low, high = mean_intervals(np.asarray(values, dtype=np.float64)[None, :])
    return float(low[0]), float(high[0])


def mean_intervals(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper ends of the intervals of the means of rows, (k,).

    Args:
        rows: Finite values, (k, n).
    """
    n = rows.shape[1]
    low, high = _by_t(rows)
    if n < 2:
        return low, high
    varies = np.ptp(rows, axis=1) > ROUNDING * np.abs(rows).max(axis=1)
    if BOOTSTRAP_FROM <= n <= MAX_BOOTSTRAPPED and varies.any():
        low[varies], high[varies] = _by_bootstrap(rows[varies])
    return low, high


def _by_t(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Student's interval, NaN for less than two values; with many values the normal one."""
    k, n = rows.shape
    if n < 2:
        return np.full(k, np.nan), np.full(k, np.nan)
    mean = rows.mean(axis=1)
    half = (
        float(scipy_package().special.stdtrit(n - 1, 0.5 + LEVEL / 2.0))
        * rows.std(axis=1, ddof=1)
        / math.sqrt(n)
    )
    # Where the mean of equal values is not their value to the last bit.
    half[np.ptp(rows, axis=1) <= ROUNDING * np.abs(rows).max(axis=1)] = 0.0
    return mean - half, mean + half


def _by_bootstrap(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """BCa interval (Efron, JASA 82 (1987), 171-185); all rows are drawn from with the same numbers."""
    k, n = rows.shape
    n_at_once = max(1, NUMBERS_AT_ONCE // n)  # rows are taken a few at a time, and resamples a few at a time
    low, high = np.empty(k), np.empty(k)
    step = max(1, n_at_once // N_RESAMPLES)
    for i in range(0, k, step):
        some = rows[i : i + step]
        found = scipy_package().stats.bootstrap(
            (some,), np.mean, n_resamples=N_RESAMPLES, batch=max(1, n_at_once // len(some)), vectorized=True,
            axis=-1, confidence_level=LEVEL, method="BCa", rng=np.random.default_rng(SEED),
        )  # fmt: skip
        low[i : i + step] = found.confidence_interval.low
        high[i : i + step] = found.confidence_interval.high
    return low, high


def block_values(values: np.ndarray, blocks: np.ndarray, strata: np.ndarray | None = None) -> np.ndarray:
    """One value for each block, (n_blocks,): their mean is that of all values, and so is its variance from block to block.

    The mean plus what the block adds to it; for blocks of equal size, the mean of the block. With strata, the mean of their means plus
    what the block adds to these, so that blocks in which some strata are missing do not differ for that.

    Args:
        values: Value of each run, (n,).
        blocks: Number of the block that it belongs to, (n,).
        strata: Number of the stratum that it belongs to, (n,); None for one.
    """
    if len(values) == 0:
        return values
    mean = centre = float(values.mean())
    weight = 1.0
    if strata is not None:
        mean, stratum = _over_strata(values, strata)
        n = np.bincount(stratum)
        centre = (np.bincount(stratum, values) / n)[stratum]
        weight = (len(values) / (len(n) * n))[stratum]
    numbers, block = np.unique(blocks, return_inverse=True)
    sums: np.ndarray = np.bincount(block, weight * (values - centre))
    shares: np.ndarray = mean + sums * (len(numbers) / len(values))
    return shares


# -- differences ----------------------------------------------------------------------------------------------------------


def sign_test(n_greater: int, n_less: int) -> float:
    """Two-sided p of the exact sign test; 1 without any sign."""
    if n_greater + n_less == 0:
        return 1.0
    return float(scipy_package().stats.binomtest(n_greater, n_greater + n_less, 0.5).pvalue)


def paired_difference(
    quantity: str,
    names: tuple[str, str],
    a: np.ndarray,
    b: np.ndarray,
    blocks: np.ndarray | None = None,
    strata: np.ndarray | None = None,
    *,
    are_copies: bool = False,
) -> PairedComparison:
    """The second side of pairs minus the first.

    The sign test counts each block once, with the sign that most of its pairs have.

    Args:
        quantity: What is compared.
        names: Of a and b.
        a: Value of each pair's first run, (n,).
        b: Value of each pair's second run, (n,).
        blocks: Number of the block that each pair belongs to, (n,); None where pairs are independent.
        strata: Number of the two points that each pair belongs to, (n,); None for one pair of points.
        are_copies: The pairs of a block are copies of one pair, so that no block goes over several points.
    """
    is_known = np.isfinite(a) & np.isfinite(b)
    a, b = a[is_known], b[is_known]
    more, own, strata = b - a, *(None if by is None else by[is_known] for by in (blocks, strata))
    n_greater, n_less = int((more > 0.0).sum()), int((more < 0.0).sum())
    mean = mean_of(quantity, more, own, strata, are_copies=are_copies)
    signs = np.sign(more)
    if (
        own is not None
    ):  # its pairs share their luck: a block is one observation, however many points it goes over
        signs = np.sign(np.bincount(np.unique(own, return_inverse=True)[1], signs))
    mean_a, mean_b = (
        math.nan if not len(v) else float(v.mean()) if strata is None else _over_strata(v, strata)[0]
        for v in (a, b)
    )
    return PairedComparison(
        quantity, *names, len(more), mean_a, mean_b, mean.value, mean.low, mean.high,
        n_greater, n_less, len(more) - n_greater - n_less,
        sign_test(int((signs > 0.0).sum()), int((signs < 0.0).sum())),
    )  # fmt: skip


def numbered(rows: np.ndarray) -> np.ndarray:
    """A number for each row, (n,), the same for equal rows."""
    return np.asarray(np.unique(rows, axis=0, return_inverse=True)[1]).ravel()
