"""Which part of a quantity's variance each factor makes, where all combinations of their levels were played."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.batch.statistics import BLOCKS_FROM, SEED

MOST_LEVELS = 30
N_RESAMPLES = 400


@dataclass(frozen=True)
class Part:
    """A part of the variance, and the interval that drawing seeds again gives it; None with few seeds.

    Attributes:
        share: The part.
        low: Lower end.
        high: Upper end.
    """

    share: float
    low: float | None
    high: float | None


@dataclass(frozen=True)
class Parts:
    """Parts of the variance of a quantity; factors, interaction and noise sum to 1.

    Attributes:
        first: What each factor does by itself (eta squared).
        total: The same with all its interactions.
        interaction: What factors do together beyond that.
        noise: What differs from seed to seed; None with a single seed, where it is in the interaction.
        n_seeds: Seeds that every point was played with.
    """

    first: list[Part]
    total: list[Part]
    interaction: Part
    noise: Part | None
    n_seeds: int


def as_factorial(columns: Sequence[Sequence[Any]], matrix: np.ndarray) -> np.ndarray | None:
    """Values by seed and level of each factor, (n_seeds, levels of the first factor, ...); None for points that are no full factorial.

    Args:
        columns: Value of each factor at each point.
        matrix: Quantity by seed and point, (n_seeds, n_points); seeds that lack a point are left out.
    """
    levels = [{value: i for i, value in enumerate(dict.fromkeys(column))} for column in columns]
    shape = tuple(len(of_factor) for of_factor in levels)
    n_points = matrix.shape[1]
    if not shape or min(shape) < 2 or max(shape) > MOST_LEVELS or np.prod(shape, dtype=float) != n_points:
        return None
    place = np.ravel_multi_index(
        tuple(
            np.array([of_factor[v] for v in column])
            for of_factor, column in zip(levels, columns, strict=True)
        ),
        shape,
    )
    if len(np.unique(place)) != n_points:
        return None
    ordered = np.empty_like(matrix)
    ordered[:, place] = matrix
    whole: np.ndarray = ordered[np.isfinite(ordered).all(axis=1)]
    return whole.reshape(-1, *shape)


def parts_of_variance(values: np.ndarray) -> Parts | None:
    """Analysis of variance of a full factorial (Montgomery, Design and Analysis of Experiments, section 5.4).

    Args:
        values: By seed and level of each factor, as `as_factorial` gives them; None comes of values that do not vary.
    """
    n_seeds, n_factors = len(values), values.ndim - 1
    if n_seeds == 0 or np.ptp(values) == 0.0:
        return None
    shares = _shares(values)
    ends = np.full((2, len(shares)), np.nan)
    if n_seeds >= BLOCKS_FROM:
        draws = np.random.default_rng(SEED).integers(n_seeds, size=(N_RESAMPLES, n_seeds))
        ends = np.quantile([_shares(values[draw]) for draw in draws], (0.025, 0.975), axis=0)
    has_ends = n_seeds >= BLOCKS_FROM
    parts = [
        Part(float(share), *((float(low), float(high)) if has_ends else (None, None)))
        for share, low, high in zip(shares, *ends, strict=True)
    ]
    first, total = parts[:n_factors], parts[n_factors : 2 * n_factors]
    return Parts(first, total, parts[-2], parts[-1] if n_seeds > 1 else None, n_seeds)


def _shares(values: np.ndarray) -> np.ndarray:
    """First order of each factor, total of each, interaction, noise; (2 n_factors + 2,)."""
    n_factors = values.ndim - 1
    centered = values - values.mean()
    whole = float((centered**2).mean())
    if whole == 0.0:
        return np.zeros(2 * n_factors + 2)
    cells = centered.mean(axis=0)
    between = float((cells**2).mean())
    first, total = [], []
    for factor in range(n_factors):
        others = tuple(axis for axis in range(n_factors) if axis != factor)
        first.append(float((cells.mean(axis=others) ** 2).mean()))
        total.append(between - float((cells.mean(axis=factor) ** 2).mean()))
    return np.array([*first, *total, between - sum(first), whole - between]) / whole
