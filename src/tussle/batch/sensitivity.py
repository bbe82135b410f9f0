"""Sensitivity analysis: rank correlations, and the share of the variance of each variable."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import Any

import numpy as np

from tussle.batch.response import MIN_POINTS, Response, fitted
from tussle.batch.statistics import BOOTSTRAP_FROM, LEVEL, SEED, scipy_package
from tussle.batch.variables import Variable
from tussle.errors import MissingExtraError

N_RESAMPLES = 200
MAX_LEVELS = 30
"""Largest number of levels of a factor in an analysis of variance."""

Points = Sequence[dict[str, Any]]
Number = float | None
Parts = tuple[Number, Number, Number, Number, Number, Number]
"""First-order index with the ends of its interval, then total index with the ends of its interval."""


@dataclass(frozen=True)
class Effect:
    """Effect of a variable on a quantity.

    Attributes:
        variable: Its name; also "interaction", "seed" and "unexplained".
        rank_correlation: Spearman's rank correlation, -1 to 1; NaN for a variable without order.
        rank_low: Lower end of its interval.
        rank_high: Upper end.
        first_order: Share of the variance due to the variable alone.
        first_low: Lower end of its interval.
        first_high: Upper end.
        total: Share of the variance due to the variable and its interactions.
        total_low: Lower end of its interval.
        total_high: Upper end.
        method: Method for the shares: "sobol", "fit", "anova", or "" if there are none.
        note: The values and methods that were used, and their limits.
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

    def having(self, parts: Parts, method: str, note: str) -> Effect:
        """Return a copy with shares of the variance."""
        names = ("first_order", "first_low", "first_high", "total", "total_low", "total_high")
        found: dict[str, Any] = dict(zip(names, parts, strict=True))
        return replace(
            self, **found, method=method, note="; ".join(text for text in (self.note, note) if text)
        )


def effects(
    variables: Sequence[Variable],
    points: Points,
    matrix: np.ndarray,
    step: int = 0,
    fit: Callable[[], Response] | None = None,
) -> list[Effect]:
    """Return the effect of each variable.

    Args:
        variables: What was varied.
        points: Its values at each point.
        matrix: The quantity by seed and point, (n_seeds, n_points); NaN if unknown.
        step: Points per base row of a Saltelli sample; 0 for other samples.
        fit: Gives a fit of the quantity, not as a share; by default that of the matrix.

    Raises:
        MissingExtraError: The points are a Saltelli sample, and SALib is not installed.
    """
    if not variables:
        return []
    found = rank_effects(variables, points, matrix, step)
    if step:
        return _by_saltelli(found, _means(matrix))
    values = as_factorial([[p[v.name] for p in points] for v in variables], matrix)
    if values is not None and (len(variables) > 1 or len(matrix) > 1):
        return _by_anova(found, values, len(matrix))
    return _by_fit(found, variables, matrix, fit or (lambda: fitted(variables, points, matrix)))


def _without_parts(found: Sequence[Effect], reason: str) -> list[Effect]:
    return [replace(e, note=f"{e.note}; no parts of the variance: {reason}") for e in found]


# -- rank correlation -----------------------------------------------------------------------------------------------------


def rank_effects(
    variables: Sequence[Variable], points: Points, matrix: np.ndarray, step: int = 0
) -> list[Effect]:
    """Return rank correlations only, without SALib.

    Args:
        variables: What was varied.
        points: Its values at each point.
        matrix: The quantity by seed and point, (n_seeds, n_points).
        step: As for `effects`; of each base row only the first and the last point are independent of each other.
    """
    chosen = np.arange(matrix.shape[1])
    if step:
        chosen = chosen[(chosen % step == 0) | (chosen % step == step - 1)]
    if len(chosen) >= BOOTSTRAP_FROM:
        place, y, over = chosen, _means(matrix)[chosen], "the points' means"
    else:
        place, y, over = np.tile(np.arange(matrix.shape[1]), len(matrix)), matrix.ravel(), "runs"
    is_known = np.isfinite(y)
    found = []
    for variable in variables:
        values = [point[variable.name] for point in points]
        if any(isinstance(value, (str, bool)) for value in values):
            found.append(Effect(variable.name, *(math.nan,) * 3, note=f"{variable.name} has no order"))
            continue
        x = np.array(values, dtype=np.float64)[place[is_known]]
        r, low, high = spearman(x, y[is_known])
        if over == "runs":  # those of a point are alike, so the interval would be too narrow
            low = high = math.nan
        found.append(Effect(variable.name, r, low, high, note=f"rank correlation over {over}"))
    return found


def spearman(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Rank correlation and its interval by Fisher's z with the variance of Bonett and Wright (Psychometrika 65 (2000), 23-28).

    NaN where one of them does not vary.
    """
    if len(x) < 2 or np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return math.nan, math.nan, math.nan
    r = float(scipy_package().stats.spearmanr(x, y).statistic)
    if len(x) < 5:
        return r, math.nan, math.nan
    if abs(r) > 1.0 - 1e-12:
        return round(r), round(r), round(r)
    half = NormalDist().inv_cdf(0.5 + LEVEL / 2.0) * math.sqrt((1.0 + r * r / 2.0) / (len(x) - 3.0))
    return r, math.tanh(math.atanh(r) - half), math.tanh(math.atanh(r) + half)


def _means(matrix: np.ndarray) -> np.ndarray:
    """Return the mean over the known seeds, (n_points,); NaN if none is known."""
    is_known = np.isfinite(matrix)
    n = is_known.sum(axis=0)
    return np.where(n > 0, np.where(is_known, matrix, 0.0).sum(axis=0) / np.maximum(n, 1), np.nan)


# -- SALib ----------------------------------------------------------------------------------------------------------------


def _by_saltelli(found: list[Effect], y: np.ndarray) -> list[Effect]:
    """Return Saltelli's indices of a Saltelli sample.

    Raises:
        MissingExtraError: SALib is not installed.
    """
    k = len(found)
    rows = y.reshape(-1, k + 2)
    whole = rows[np.isfinite(rows).all(axis=1)]
    note = f"Saltelli's indices of {len(whole)} base rows, over the points' means"
    if len(whole) < len(rows):
        note += f"; {len(rows) - len(whole)} rows lack a run and are left out"
    note += "; seed noise that is left in the means counts into every total"
    if len(whole) < 2 or np.ptp(whole) == 0.0:
        return _without_parts(found, "the quantity does not vary")
    problem = {"num_vars": k, "names": [e.variable for e in found], "bounds": [[0.0, 1.0]] * k}
    try:
        from SALib.analyze import sobol
    except ImportError as error:
        raise MissingExtraError(
            f"parts of the variance need SALib, which is not installed: pip install 'tussle[batch]' ({error})"
        ) from None
    indices = sobol.analyze(
        problem, whole.ravel(), calc_second_order=False, num_resamples=N_RESAMPLES, seed=SEED
    )
    columns = (indices[name].tolist() for name in ("S1", "S1_conf", "ST", "ST_conf"))
    return [
        e.having((s, s - s_half, s + s_half, t, t - t_half, t + t_half), "sobol", note)
        for e, s, s_half, t, t_half in zip(found, *columns, strict=True)
    ]


# -- a fit ------------------------------------------------------------------------------------------------------------------


def _by_fit(
    found: list[Effect], variables: Sequence[Variable], matrix: np.ndarray, fit: Callable[[], Response]
) -> list[Effect]:
    """Return the parts of the variance of the runs by a smooth fit, for points of any sample."""
    y = _means(matrix)
    n, needed = int(np.isfinite(y).sum()), max(MIN_POINTS, 2 * len(variables) + 1)
    if n < needed or np.nanmax(y) == np.nanmin(y):
        return _without_parts(
            found, f"they take {needed} points" if n < needed else "the quantity does not vary"
        )
    response = fit()
    parts = dict(zip([axis.variable.name for axis in response.axes] + [""], response.parts(), strict=True))
    is_seed = response.observed.noise is not None
    note = f"parts of the variance of the runs by a smooth fit over {len(response.points)} points"
    done = [
        e.having((*parts[e.variable][0], *parts[e.variable][1]), "fit", note) if e.variable in parts else e
        for e in found
    ]
    rest = Effect("seed" if is_seed else "unexplained", *(math.nan,) * 3)
    return [*done, rest.having((*parts[""][0], None, None, None), "fit", note)]


# -- factorials ------------------------------------------------------------------------------------------------------------


def as_factorial(columns: Sequence[Sequence[Any]], matrix: np.ndarray) -> np.ndarray | None:
    """Values by seed and level of each factor, (n_seeds, levels of the first factor, ...); None for points that are no full factorial.

    Args:
        columns: Value of each factor at each point.
        matrix: Quantity by seed and point, (n_seeds, n_points); seeds that lack a point are left out.
    """
    codes = [{value: i for i, value in enumerate(dict.fromkeys(column))} for column in columns]
    shape, n_points = tuple(map(len, codes)), matrix.shape[1]
    if min(shape) < 2 or max(shape) > MAX_LEVELS or np.prod(shape, dtype=float) != n_points:
        return None
    level = [np.array([code[v] for v in column]) for code, column in zip(codes, columns, strict=True)]
    place = np.ravel_multi_index(tuple(level), shape)
    if len(np.unique(place)) != n_points:
        return None
    ordered = np.empty_like(matrix)
    ordered[:, place] = matrix
    whole: np.ndarray = ordered[np.isfinite(ordered).all(axis=1)]
    return whole.reshape(-1, *shape)


def _by_anova(found: list[Effect], values: np.ndarray, n_seeds: int) -> list[Effect]:
    """Return shares of the variance of a full factorial, including the share of the seeds."""
    n, k = len(values), len(found)
    if not n or np.ptp(values) == 0.0:
        return _without_parts(
            found, "the quantity does not vary" if n else "no seed has been played at every point"
        )
    shares = np.full((3, 2 * k + 2), np.nan)
    shares[0] = variance_shares(values)
    note = f"analysis of variance over all {np.prod(values.shape[1:])} combinations × {n} seeds"
    note += f"; {n_seeds - n} seeds lack a run and are left out" if n < n_seeds else ""
    if n >= BOOTSTRAP_FROM:
        draws = np.random.default_rng(SEED).integers(n, size=(2 * N_RESAMPLES, n))
        shares[1:] = np.quantile([variance_shares(values[draw]) for draw in draws], (0.025, 0.975), axis=0)
    else:
        note += f"; intervals take {BOOTSTRAP_FROM} seeds"
    parts = [tuple(None if math.isnan(v) else v for v in column) for column in shares.T.tolist()]
    nothing = (None, None, None)  # of one seed, the total would be taken for interaction
    done = [
        e.having((*first, *(total if n > 1 else nothing)), "anova", note)  # type: ignore[arg-type]
        for e, first, total in zip(found, parts[:k], parts[k : 2 * k], strict=True)
    ]
    rest = [("interaction" if n > 1 else "interaction and seed", parts[-2])] if k > 1 else []
    rest += [("seed", parts[-1])] if n > 1 else []
    for name, part in rest:
        done.append(Effect(name, *(math.nan,) * 3).having((*part, *nothing), "anova", note))  # type: ignore[arg-type]
    return done


def variance_shares(values: np.ndarray) -> np.ndarray:
    """Parts of the variance: first order of each factor (eta squared), total of each, interaction, seeds; (2 n_factors + 2,).

    Analysis of variance of a full factorial (Montgomery, Design and Analysis of Experiments, section 5.4). Written out, since a
    linear model would have one column for each combination.

    Args:
        values: By seed and level of each factor, as `as_factorial` gives them.
    """
    n_factors = values.ndim - 1
    centered = values - values.mean()
    whole = float((centered**2).mean())
    if whole == 0.0:
        return np.zeros(2 * n_factors + 2)
    cells = centered.mean(axis=0)
    between = float((cells**2).mean())
    others = [tuple(axis for axis in range(n_factors) if axis != factor) for factor in range(n_factors)]
    first = [float((cells.mean(axis=axes) ** 2).mean()) for axes in others]
    total = [between - float((cells.mean(axis=factor) ** 2).mean()) for factor in range(n_factors)]
    return np.array([*first, *total, between - sum(first), whole - between]) / whole
