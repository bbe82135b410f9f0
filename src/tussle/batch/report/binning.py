"""Runs gathered along a variable: by its values where they are few, by bins where they are many; means with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

import numpy as np

from tussle.batch.selection import written
from tussle.batch.variables import Range, Variable

MOST_LEVELS = 12
"""A range with no more values than this is shown value by value."""
MOST_BINS = 12
POINTS_PER_BIN = 8
WIDE_RATIO = 50.0
"""Chosen numbers whose ratio is at least this are shown on a logarithmic axis."""
FEWEST_SEEDS = 10
"""Below this many seeds, how much differs from seed to seed cannot be told; the interval then holds for these seeds only."""


@dataclass(frozen=True)
class Lane:
    """A variable as an axis.

    Args:
        variable: The variable.
        index: Which place on the axis a point has, (n_points,).
        position: Where the places lie, (n_places,): values of the variable, or 0, 1, 2, ... where these are no numbers.
        texts: The places in words; empty where they are bins.
        edges: Ends of the bins, (n_places + 1,); empty where the places are values.
        is_number: Positions are values of the variable.
    """

    variable: Variable
    index: np.ndarray
    position: np.ndarray
    texts: tuple[str, ...]
    edges: np.ndarray
    is_number: bool

    @property
    def n_places(self) -> int:
        return len(self.position)

    @property
    def is_log(self) -> bool:
        """It is read by ratios."""
        if isinstance(self.variable, Range):
            return self.variable.is_log
        low, high = float(self.position.min()), float(self.position.max())
        return self.is_number and low > 0.0 and high >= WIDE_RATIO * low


@dataclass(frozen=True)
class Means:
    """Means of groups of runs and their 95 % intervals, each (n_groups,); NaN where there is none.

    Args:
        n: Number of runs.
        mean: The means.
        low: Lower ends.
        high: Upper ends.
    """

    n: np.ndarray
    mean: np.ndarray
    low: np.ndarray
    high: np.ndarray


def lane_of(variable: Variable, points: Sequence[dict[str, Any]], most_bins: int = MOST_BINS) -> Lane:
    """A variable as an axis of places: its values where they are few, else bins that hold equally many points."""
    given = [point[variable.name] for point in points]
    if not all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in given):
        return _named(variable, [written(value) for value in given])
    values = np.array(given, dtype=float)
    levels, index = np.unique(values, return_inverse=True)
    if len(levels) <= MOST_LEVELS:
        return Lane(variable, index, levels, tuple(map(number_text, levels)), np.empty(0), True)
    n_bins = int(np.clip(len(values) // POINTS_PER_BIN, 2, most_bins))
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, n_bins + 1)))
    index = _bin(values, edges)
    n = np.bincount(index, minlength=len(edges) - 1)
    centre = np.bincount(index, weights=values, minlength=len(edges) - 1) / np.maximum(n, 1)
    return Lane(variable, index, centre, (), edges, True)


def even_lane(lane: Lane, points: Sequence[dict[str, Any]], n_bins: int) -> Lane:
    """The same axis with bins of equal width, of equal ratio where it is read by ratios; unchanged where it has values."""
    if lane.texts:
        return lane
    values = np.array([point[lane.variable.name] for point in points], dtype=float)
    space = np.geomspace if lane.is_log else np.linspace
    edges = space(values.min(), values.max(), n_bins + 1)
    return Lane(lane.variable, _bin(values, edges), (edges[1:] + edges[:-1]) / 2.0, (), edges, True)


def place_in_words(lane: Lane, place: int) -> str:
    """A place on an axis: "20 kt", "from 20 to 22.5 kt", "keep"."""
    unit = f" {lane.variable.unit}" if isinstance(lane.variable, Range) and lane.variable.unit else ""
    if lane.texts:
        return f"{lane.texts[place]}{unit}"
    low, high = (f"{edge:.3g}" for edge in lane.edges[place : place + 2])
    return f"from {low} to {high}{unit}"


def number_text(value: float) -> str:
    """A value of a variable, shortly."""
    return f"{value:.6g}"


def _named(variable: Variable, given: Sequence[str]) -> Lane:
    """Places for texts, in the order in which the variable has them, or else in the order in which they come."""
    order = [written(value) for value in variable.values] if not isinstance(variable, Range) else []
    texts = sorted(dict.fromkeys(given), key=lambda text: order.index(text) if text in order else len(order))
    index = np.array([texts.index(text) for text in given], dtype=np.int64)
    return Lane(variable, index, np.arange(float(len(texts))), tuple(texts), np.empty(0), False)


def _bin(values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    return np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)


def grouped_means(
    values: np.ndarray,
    group: np.ndarray,
    n_groups: int,
    draw: np.ndarray,
    seed: np.ndarray,
    *,
    is_share: bool,
    is_sampled: bool,
) -> Means:
    """Mean of each group of runs, with an interval that knows which runs belong together.

    Runs with the same seed share their chance, so they are not independent. The variance of the mean is the one of the sums over
    seeds (Liang and Zeger 1986, with G / (G - 1)). Where points are themselves drawn, the runs of a draw belong together as well:
    then it is the two-way variance of Cameron, Gelbach and Miller (2011), equation 2.8, or the larger of its parts. The interval
    is Student's with one degree of freedom less than there are clusters. For shares it is Wilson's with the number of runs that
    would have this variance (the effective number of Korn and Graubard 1998).

    Args:
        values: What is averaged, (n_runs,); NaN is left out.
        group: Group of each run, (n_runs,); -1 is left out.
        n_groups: Number of groups.
        draw: Which draw of points each run belongs to, (n_runs,).
        seed: Seed of each run, (n_runs,).
        is_share: The values are 0 and 1.
        is_sampled: The points were drawn; otherwise each of them is meant.
    """
    kept = np.isfinite(values) & (group >= 0)
    values, group, draw, seed = values[kept], group[kept], draw[kept], seed[kept]
    n = np.bincount(group, minlength=n_groups)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.bincount(group, weights=values, minlength=n_groups) / np.where(n > 0, n, np.nan)
    rest = values - mean[group]
    by_seed, n_seeds = _variance(rest, group, seed, n_groups, n)
    variance, clusters = by_seed, n_seeds
    if is_sampled:
        by_draw, n_draws = _variance(rest, group, draw, n_groups, n)
        alone = np.bincount(group, weights=rest**2, minlength=n_groups) / np.maximum(n, 1) ** 2
        both = np.fmax(np.fmax(by_draw, by_seed), by_draw + by_seed - alone)
        is_both = (n_seeds >= FEWEST_SEEDS) & (n_draws >= 2)
        variance = np.where(is_both, both, by_draw)
        clusters = np.where(is_both, np.minimum(n_seeds, n_draws), n_draws)
    if is_share:
        low, high = _wilson(mean, variance, n, clusters)
    else:
        half = _student(clusters) * np.sqrt(variance)
        low, high = mean - half, mean + half
    return Means(n, mean, low, high)


def _variance(
    rest: np.ndarray, group: np.ndarray, cluster: np.ndarray, n_groups: int, n: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Variance of the means by sums over clusters, and the number of clusters, each (n_groups,); NaN below two clusters."""
    _, cluster = np.unique(cluster, return_inverse=True)
    n_clusters = int(cluster.max()) + 1 if len(cluster) else 1
    pair, inverse = np.unique(group * n_clusters + cluster, return_inverse=True)
    sums = np.bincount(inverse, weights=rest, minlength=len(pair))
    count = np.bincount(pair // n_clusters, minlength=n_groups)
    total = np.bincount(pair // n_clusters, weights=sums**2, minlength=n_groups)
    correction = np.where(count >= 2, count / np.maximum(count - 1, 1), np.nan)
    return correction * total / np.maximum(n, 1) ** 2, count


def _student(clusters: np.ndarray) -> np.ndarray:
    from scipy.stats import t

    return np.asarray(t.ppf(0.975, np.maximum(clusters - 1, 1)))


def _wilson(
    mean: np.ndarray, variance: np.ndarray, n: np.ndarray, clusters: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Wilson's interval with as many games as would have the variance; with as many as there are clusters where all are alike."""
    z = NormalDist().inv_cdf(0.975)
    spread = mean * (1.0 - mean)
    corrected = variance * (clusters - 1) / np.maximum(clusters, 1)
    with np.errstate(invalid="ignore", divide="ignore"):
        # The ratio is Korn and Graubard's, for a variance that is known from few clusters.
        by_variance = spread / corrected * (_student(n) / _student(clusters)) ** 2
        n_effective = np.where(spread > 0.0, np.minimum(by_variance, n), np.minimum(clusters, n))
        n_effective = np.where(np.isfinite(variance), n_effective, np.nan)
        middle = (mean + z**2 / (2.0 * n_effective)) / (1.0 + z**2 / n_effective)
        half = z / (1.0 + z**2 / n_effective) * np.sqrt(spread / n_effective + (z / (2.0 * n_effective)) ** 2)
    return np.maximum(middle - half, 0.0), np.minimum(middle + half, 1.0)
