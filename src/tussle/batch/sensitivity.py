"""What each variable does to a quantity: rank correlation, and its part of the variance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import Any

import numpy as np

from tussle.batch.factorial import Part, as_factorial, parts_of_variance
from tussle.batch.statistics import BLOCKS_FROM, LEVEL, SEED
from tussle.batch.variables import Range, Variable
from tussle.errors import MissingExtraError

FROM_POINTS = 64
"""RBD-FAST looks at harmonics and needs many points for each; with 64 its error is 0.1, with 512 it is 0.03 (Ishigami function)."""
N_HARMONICS = 4
"""SALib's default of 10 adds noise at a few hundred points; responses of a game have no finer structure."""
N_RESAMPLES = 200


@dataclass(frozen=True)
class Effect:
    """What a variable does to a quantity.

    Attributes:
        variable: Its name; also "interaction" and "seed" for what no variable does alone.
        rank_correlation: Spearman's, -1 to 1; NaN for a variable without order.
        rank_low: Lower end of its interval.
        rank_high: Upper end.
        first_order: Part of the variance that the variable makes by itself.
        first_low: Lower end of its interval.
        first_high: Upper end.
        total: The same with all interactions that the variable is in.
        total_low: Lower end of its interval.
        total_high: Upper end.
        method: How the parts were found: "sobol", "rbd_fast", "levels", "anova", or "" where they were not.
        note: What was done with which values, and what limits it.
    """

    variable: str
    rank_correlation: float
    rank_low: float
    rank_high: float
    first_order: float | None = None
    first_low: float | None = None
    first_high: float | None = None
    total: float | None = None
    total_low: float | None = None
    total_high: float | None = None
    method: str = ""
    note: str = ""


Points = Sequence[dict[str, Any]]


def effects(variables: Sequence[Variable], points: Points, matrix: np.ndarray, step: int = 0) -> list[Effect]:
    """What each variable does.

    Args:
        variables: What was varied.
        points: Its values at each point.
        matrix: The quantity by seed and point, (n_seeds, n_points); NaN where it is not known.
        step: Of a sample for Saltelli's indices, points from one base row to the next; 0 for other samples.

    Raises:
        MissingExtraError: The points were sampled for Saltelli's indices, and SALib is not there.
    """
    if not variables:
        return []
    found = rank_effects(variables, points, matrix, step)
    if step:
        return _by_saltelli(found, _means(matrix))
    values = as_factorial([[p[v.name] for p in points] for v in variables], matrix)
    if values is not None and (len(variables) > 1 or len(matrix) > 1):
        return _by_anova(found, values, len(matrix))
    return _by_given_data(found, variables, points, _means(matrix))


# -- rank correlation -----------------------------------------------------------------------------------------------------


def rank_effects(
    variables: Sequence[Variable], points: Points, matrix: np.ndarray, step: int = 0
) -> list[Effect]:
    """Rank correlations only, which need no further package.

    Args:
        variables: What was varied.
        points: Its values at each point.
        matrix: The quantity by seed and point, (n_seeds, n_points).
        step: As for `effects`; of each base row only the first and the last point are independent of each other.
    """
    chosen = np.arange(matrix.shape[1])
    if step:
        chosen = chosen[(chosen % step == 0) | (chosen % step == step - 1)]
    if len(chosen) >= BLOCKS_FROM:
        place, y = chosen, _means(matrix)[chosen]
        note = "rank correlation over the points' means"
    else:
        place, y = np.tile(np.arange(matrix.shape[1]), len(matrix)), matrix.ravel()
        note = "rank correlation over runs"
    is_known = np.isfinite(y)
    place, y = place[is_known], y[is_known]
    found = []
    for variable in variables:
        x = _numbers(variable, points)
        ends = (math.nan,) * 3 if x is None else spearman(x[place], y)
        found.append(
            Effect(variable.name, *ends, note=note if x is not None else f"{variable.name} has no order")
        )
    return found


def spearman(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Rank correlation and its interval by Fisher's z with the variance of Bonett and Wright (Psychometrika 65 (2000), 23-28).

    NaN where one of them does not vary.
    """
    if len(x) < 2 or np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return math.nan, math.nan, math.nan
    from scipy.stats import spearmanr

    r = float(spearmanr(x, y).statistic)
    if len(x) < 5:
        return r, math.nan, math.nan
    if abs(r) > 1.0 - 1e-12:
        return round(r), round(r), round(r)
    half = NormalDist().inv_cdf(0.5 + LEVEL / 2.0) * math.sqrt((1.0 + r * r / 2.0) / (len(x) - 3.0))
    return r, math.tanh(math.atanh(r) - half), math.tanh(math.atanh(r) + half)


def _numbers(variable: Variable, points: Points) -> np.ndarray | None:
    """Values at the points as numbers, (n_points,); None for a variable without order."""
    values = [point[variable.name] for point in points]
    if any(isinstance(value, (str, bool)) for value in values):
        return None
    return np.array(values, dtype=np.float64)


def _means(matrix: np.ndarray) -> np.ndarray:
    """Mean over the seeds that are known, by point, (n_points,)."""
    is_known = np.isfinite(matrix)
    n = is_known.sum(axis=0)
    total = np.where(is_known, matrix, 0.0).sum(axis=0)
    return np.where(n > 0, total / np.maximum(n, 1), np.nan)


# -- parts of the variance ------------------------------------------------------------------------------------------------


def _by_saltelli(found: list[Effect], y: np.ndarray) -> list[Effect]:
    """Indices of a sample that was made for them; seed noise that means leave counts as total effect of each variable."""
    k = len(found)
    rows = y.reshape(-1, k + 2)
    whole = rows[np.isfinite(rows).all(axis=1)]
    note = f"Saltelli's indices of {len(whole)} base rows, over the points' means"
    if len(whole) < len(rows):
        note += f"; {len(rows) - len(whole)} rows lack a run and are left out"
    note += "; what is left of seed noise in the means counts into every total"
    if len(whole) < 2 or np.ptp(whole) == 0.0:
        return [replace(e, note=f"{e.note}; no indices: the quantity does not vary") for e in found]
    problem = {"num_vars": k, "names": [e.variable for e in found], "bounds": [[0.0, 1.0]] * k}
    sobol, _ = _salib()
    indices = sobol.analyze(
        problem, whole.ravel(), calc_second_order=False, num_resamples=N_RESAMPLES, seed=SEED
    )
    done = []
    columns = (indices[name].tolist() for name in ("S1", "S1_conf", "ST", "ST_conf"))
    for e, s, s_half, t, t_half in zip(found, *columns, strict=True):
        first = _first(e, s, s - s_half, s + s_half, "sobol", note)
        done.append(replace(first, total=t, total_low=t - t_half, total_high=t + t_half))
    return done


def _by_anova(found: list[Effect], values: np.ndarray, n_seeds: int) -> list[Effect]:
    """Parts of the variance of a full factorial, what seeds do included."""
    parts = parts_of_variance(values)
    if parts is None:
        reason = "the quantity does not vary" if len(values) else "no seed has been played at every point"
        return [replace(e, note=f"{e.note}; no parts of the variance: {reason}") for e in found]
    note = f"analysis of variance over all {np.prod(values.shape[1:])} combinations × {parts.n_seeds} seeds"
    if parts.n_seeds < n_seeds:
        note += f"; {n_seeds - parts.n_seeds} seeds lack a run and are left out"
    if parts.n_seeds < BLOCKS_FROM:
        note += f"; intervals take {BLOCKS_FROM} seeds"
    done = []
    for e, first, total in zip(found, parts.first, parts.total, strict=True):
        made = replace(
            e,
            first_order=first.share,
            first_low=first.low,
            first_high=first.high,
            method="anova",
            note=f"{e.note}; {note}",
        )
        if parts.noise is not None:  # else it would be taken for interaction
            made = replace(made, total=total.share, total_low=total.low, total_high=total.high)
        done.append(made)
    if len(found) > 1:
        done.append(_rest("interaction" if parts.noise else "interaction and seed", parts.interaction, note))
    if parts.noise is not None:
        done.append(_rest("seed", parts.noise, note))
    return done


def _rest(name: str, part: Part, note: str) -> Effect:
    nan = math.nan
    return Effect(name, nan, nan, nan, part.share, part.low, part.high, method="anova", note=note)


def _by_given_data(
    found: list[Effect], variables: Sequence[Variable], points: Points, y: np.ndarray
) -> list[Effect]:
    """First-order indices of points that were not sampled for them."""
    is_known = np.isfinite(y)
    y, n = y[is_known], int(is_known.sum())
    if n < FROM_POINTS or np.ptp(y) == 0.0:
        reason = f"they take {FROM_POINTS} points" if n < FROM_POINTS else "the quantity does not vary"
        return [replace(e, note=f"{e.note}; no parts of the variance: {reason}") for e in found]
    note = f"part of the variance of {n} points' means, in which some seed noise is left"
    done = []
    for e, variable in zip(found, variables, strict=True):
        values = [point[variable.name] for point, known in zip(points, is_known, strict=True) if known]
        if isinstance(variable, Range):
            try:
                first, half = _rbd_fast(np.array(values, dtype=np.float64), y)
            except MissingExtraError as error:
                done.append(replace(e, note=f"{e.note}; {error}"))
                continue
            done.append(_first(e, first, first - half, first + half, "rbd_fast", f"{note}; RBD-FAST"))
        else:
            first, low, high = correlation_ratio(values, y)
            done.append(_first(e, first, low, high, "levels", f"{note}; between the values of the choice"))
    return done


def _first(effect: Effect, share: float, low: float, high: float, method: str, note: str) -> Effect:
    return replace(
        effect,
        first_order=share,
        first_low=low,
        first_high=high,
        method=method,
        note=f"{effect.note}; {note}",
    )


def _rbd_fast(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """First-order index of a variable from points of any sample, and half its interval.

    Not SALib's `delta`: its binned estimate finds 0.10 of 0.44 at 128 points of the Ishigami function, and it prints.
    """
    if np.ptp(x) == 0.0:
        return 0.0, 0.0
    problem = {"num_vars": 1, "names": ["x"], "bounds": [[0.0, 1.0]]}
    _, rbd_fast = _salib()
    found = rbd_fast.analyze(problem, x[:, None], y, M=N_HARMONICS, num_resamples=N_RESAMPLES, seed=SEED)
    return float(found["S1"][0]), float(found["S1_conf"][0])


def correlation_ratio(labels: Sequence[Any], y: np.ndarray) -> tuple[float, float, float]:
    """Part of the variance that lies between the values of a choice, without what chance puts there, and its interval.

    Epsilon squared (Kelley, PNAS 21 (1935), 554-559); the interval by drawing the points again.
    """
    numbers = {label: i for i, label in enumerate(dict.fromkeys(labels))}
    level = np.array([numbers[label] for label in labels])
    draws = np.random.default_rng(SEED).integers(len(y), size=(N_RESAMPLES, len(y)))
    low, high = np.quantile([_epsilon_squared(level[d], y[d], len(numbers)) for d in draws], (0.025, 0.975))
    return _epsilon_squared(level, y, len(numbers)), float(low), float(high)


def _epsilon_squared(level: np.ndarray, y: np.ndarray, n_levels: int) -> float:
    n, centered = len(y), y - y.mean()
    whole = float((centered**2).sum())
    if n_levels < 2 or n <= n_levels or whole == 0.0:
        return 0.0
    count = np.bincount(level, minlength=n_levels)
    between = float((np.bincount(level, centered, n_levels) ** 2 / np.maximum(count, 1)).sum())
    return (between - (n_levels - 1) * (whole - between) / (n - n_levels)) / whole


def _salib() -> tuple[Any, Any]:
    """SALib's modules `sobol` and `rbd_fast`.

    Raises:
        MissingExtraError: It is not installed.
    """
    try:
        from SALib.analyze import rbd_fast, sobol
    except ImportError as error:
        raise MissingExtraError(
            f"parts of the variance need SALib, which is not installed: pip install 'tussle[batch]' ({error})"
        ) from None
    return sobol, rbd_fast
