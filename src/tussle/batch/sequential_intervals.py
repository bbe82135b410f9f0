"""Intervals of a mean that stay valid however often, and whenever, somebody looks at them."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np

from tussle.batch.statistics import scipy_package

N_BETS = 256
"""Bets that are placed side by side. Any number is valid; this many lose nothing up to 20,000 runs."""

MIN_FOR_NORMAL = 10
"""Fewest values for the interval of a quantity without bounds, whose mean is taken to be normal."""


def seen_in(values: np.ndarray, may_be_negative: bool) -> tuple[float, float]:
    """Smallest and largest value in all runs, as `sequential_interval` takes them; infinite if none is known.

    Args:
        values: Of all points; NaN where a game failed or is not played.
        may_be_negative: Of a difference of shares: that it was never negative does not bound it by 0.
    """
    known = values[np.isfinite(values)]
    if not len(known):
        return -math.inf, math.inf
    low, high = float(known.min()), float(known.max())
    return (-1.0, 1.0) if may_be_negative and low >= 0.0 and high <= 1.0 else (low, high)


def sequential_interval(values: np.ndarray, alpha: float, seen: tuple[float, float]) -> tuple[float, float]:
    """Interval of a mean from n values, (n,), that holds for all n at once: a confidence sequence.

    The probability that there is any n at which it does not contain the mean is at most `alpha`, so it may decide when to stop.

    Args:
        values: Finite values of independent runs, in any order.
        alpha: Error probability, both sides together.
        seen: Smallest and largest value of the quantity in all runs, those of other points included, see `seen_in`. Between 0 and 1
            the quantity is taken to have these bounds.

    Returns:
        Its ends; infinite where too few values are known.
    """
    low, high = seen
    if low >= 0.0 and high <= 1.0:
        return bounded_interval(values, alpha)
    if len(values) < MIN_FOR_NORMAL:
        return -math.inf, math.inf
    if np.ptp(values) > 0.0:
        return normal_interval(values, alpha)
    if low == high:
        return low, high
    ends = bounded_interval(
        (values - low) / (high - low), alpha
    )  # so many equal values have no spread to go by
    return low + (high - low) * ends[0], low + (high - low) * ends[1]


def bounded_interval(values: np.ndarray, alpha: float) -> tuple[float, float]:
    """Confidence sequence of the mean of values between 0 and 1, of any distribution.

    A mean m is left out when bets against it have won 1/alpha times their stake (Waudby-Smith and Ramdas, JRSS B 86 (2024), 1-27,
    with a constant mixture of bets as in Cover's universal portfolio). For 0 and 1 alone it is the beta-binomial mixture of Robbins.
    """
    n = len(values)
    if n == 0:
        return 0.0, 1.0
    x, counts = np.unique(values, return_counts=True)
    p = _bets()[:, None]

    def excess(m: float) -> float:
        """Logarithm of what the bets have won, less that of 1/alpha; convex in m."""
        gains = np.log(x * p / m + (1.0 - x) * (1.0 - p) / (1.0 - m)) @ counts
        top = float(gains.max())
        return top + math.log(float(np.exp(gains - top).mean())) + math.log(alpha)

    mean = float(values.mean())
    root: Any = scipy_package().optimize.brentq
    tiny = 1e-12
    inner = min(max(mean, tiny), 1.0 - tiny)
    low = root(excess, tiny, inner, xtol=1e-9) if inner > tiny and excess(tiny) > 0.0 else 0.0
    high = (
        root(excess, inner, 1.0 - tiny, xtol=1e-9) if inner < 1.0 - tiny and excess(1.0 - tiny) > 0.0 else 1.0
    )
    return float(low), float(high)


@cache
def _bets() -> np.ndarray:
    """Quantiles of Jeffreys' prior Beta(1/2, 1/2), (N_BETS,)."""
    return np.asarray(np.sin(0.5 * math.pi * (np.arange(N_BETS) + 0.5) / N_BETS) ** 2)


def normal_interval(values: np.ndarray, alpha: float) -> tuple[float, float]:
    """Confidence sequence of the mean of normal values of unknown spread.

    Lai, Annals of Statistics 4 (1976), 265-280; Wang and Ramdas, Anytime-valid t-tests (2024), theorem 4.7, with unit information.
    """
    n, mean, variance = len(values), float(values.mean()), float(values.var())
    growth = ((n + 1.0) / alpha**2) ** (1.0 / n)
    room = n + 1.0 - growth
    if room <= 0.0:
        return -math.inf, math.inf
    half = math.sqrt((growth - 1.0) * (n + 1.0) / room * variance)
    return mean - half, mean + half
