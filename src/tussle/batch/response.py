"""The response of a quantity to what varies: a smooth fit with its band, for grids, hypercubes and lists of points alike.

A Gaussian process over the means of the points. A share is fitted by its logit, with the binomial likelihood of as many runs as its
variance says, so that value and band are within 0 and 1.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from statistics import NormalDist
from typing import Any

import numpy as np

from tussle.batch.gaussian_process import Observed, Part, Posterior, thinned, tuned_kernel, variance_parts
from tussle.batch.statistics import LEVEL, scipy_package
from tussle.batch.variables import Choice, Range, Variable
from tussle.errors import ParameterError, listed, nearest_name

MIN_POINTS = 4
MIN_LEVELS = 3
"""A choice of numbers is a number if it has at least so many, else a choice like any other."""
WIDE_RATIO = 50.0
"""Numbers whose largest ratio is at least this are fitted by their logarithm."""
MAX_POINTS = 400
"""Largest number of points that are fitted, evenly spaced by number: the time of a fit grows with its third power."""
PRIOR_DEGREES = 4.0
"""Degrees of freedom with which the spread over all points counts into that of a point with few runs."""
N_AROUND = 48
"""So many points, evenly spaced by number, stand for the other variables behind a curve."""

_QUANTILE = NormalDist().inv_cdf(0.5 + LEVEL / 2.0)


@dataclass(frozen=True)
class Estimates:
    """Values with their 95 % bands.

    Attributes:
        value: (n,).
        low: Lower end of the band at each place by itself, (n,).
        high: Its upper end, (n,).
    """

    value: np.ndarray
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True)
class FittedVariable:
    """A variable of a fit.

    Attributes:
        variable: The variable.
        values: Its different values at the points; ascending numbers, or as they were given.
        is_number: The fit is smooth over it.
        is_log: By its logarithm.
    """

    variable: Variable
    values: tuple[Any, ...]
    is_number: bool
    is_log: bool

    def spread(self, n: int) -> list[Any]:
        """Values, at most n of them, evenly from the lowest to the highest; whole ones of a range of whole numbers."""
        if not self.is_number:
            return list(self.values)
        space = np.geomspace if self.is_log else np.linspace
        found = space(float(self.values[0]), float(self.values[-1]), n)
        if self.is_whole:
            found = np.unique(np.round(found))
        return [int(value) if self.is_whole else float(value) for value in found]

    @property
    def unit(self) -> str:
        """Unit of its values; empty for none, and for choices."""
        return self.variable.unit if isinstance(self.variable, Range) else ""

    @property
    def is_whole(self) -> bool:
        """All values are whole numbers."""
        return self.is_number and all(float(value).is_integer() for value in self.values)

    def coordinates(self, values: Sequence[Any]) -> np.ndarray:
        """Places from 0 to 1 of numbers, numbers of choices, (n,).

        Raises:
            ParameterError: There is no such choice.
        """
        if not self.is_number:
            for value in values:
                if value not in self.values:
                    raise ParameterError(
                        f"{self.variable.name} was never {value!r}{nearest_name(str(value), map(str, self.values))}; "
                        f"{listed(map(str, self.values))}"
                    )
            return np.array([self.values.index(value) for value in values], dtype=float)
        low, high, x = float(self.values[0]), float(self.values[-1]), np.asarray(values, dtype=float)
        if self.is_log:
            low, high, x = math.log(low), math.log(high), np.log(x)
        return np.asarray((x - low) / (high - low))


def axes_of(variables: Sequence[Variable], points: Sequence[Mapping[str, Any]]) -> list[FittedVariable]:
    """The variables that have several values, as axes."""
    found = []
    for variable in variables:
        values = list(dict.fromkeys(point[variable.name] for point in points))
        if len(values) < 2:
            continue
        is_number = all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in values)
        is_number &= isinstance(variable, Range) or len(values) >= MIN_LEVELS
        if is_number:
            values.sort()
        elif isinstance(variable, Choice):
            order = list(variable.values)
            values.sort(key=lambda v: order.index(v) if v in order else len(order))
        is_log = is_number and values[0] > 0.0
        if isinstance(variable, Range):
            is_log &= variable.is_log
        else:
            is_log = is_log and values[-1] >= WIDE_RATIO * values[0]
        found.append(FittedVariable(variable, tuple(values), is_number, is_log))
    return found


@dataclass(frozen=True)
class PointMeans:
    """Means of a quantity at the points, and what chance does to them.

    Attributes:
        mean: (n_points,); NaN without runs.
        variance: Of each mean, without what the seeds add to all of them alike, (n_points,); NaN if no point has two runs.
        common: Variance of what the seeds add to all means alike.
    """

    mean: np.ndarray
    variance: np.ndarray
    common: float


def point_means(matrix: np.ndarray, *, has_own_seeds: bool = False) -> PointMeans:
    """Means over the seeds, and their variances.

    Of runs that share their seeds over the points, the variance of the seeds' own effect is that of the seeds' means less its noise.

    Args:
        matrix: Quantity by seed and point, (n_seeds, n_points); NaN if unknown.
        has_own_seeds: Each run has a seed of its own.
    """
    is_known = np.isfinite(matrix)
    n = is_known.sum(axis=0)
    filled = np.where(is_known, matrix, 0.0)
    mean = np.where(n > 0, filled.sum(axis=0) / np.maximum(n, 1), np.nan)
    apart = np.where(is_known, matrix - mean, 0.0)
    per_seed = is_known.sum(axis=1)
    freedom = float(np.maximum(n - 1, 0).sum())
    if freedom == 0.0:
        return PointMeans(mean, np.full(len(mean), np.nan), 0.0)
    within = float((apart**2).sum()) / freedom
    common = 0.0
    if not has_own_seeds and (per_seed > 1).sum() > 1:
        whole = per_seed > 1
        of_seed = apart[whole].sum(axis=1) / per_seed[whole]
        n_seeds, size = int(whole.sum()), float(per_seed[whole].mean())
        between = float((of_seed**2).sum()) / (n_seeds - 1)
        rest = max(within - between, 0.0) * size / max(size - 1.0, 1.0)
        common = max(between - rest / size, 0.0)
    own = (apart**2).sum(axis=0) + PRIOR_DEGREES * within
    own = own / (np.maximum(n - 1, 0) + PRIOR_DEGREES)
    variance = np.maximum(own - common, 0.05 * own) / np.maximum(n, 1)
    return PointMeans(mean, variance, common / max(float(n[n > 0].mean()), 1.0))


def fitted(
    variables: Sequence[Variable],
    points: Sequence[Mapping[str, Any]],
    matrix: np.ndarray,
    *,
    is_share: bool = False,
    has_own_seeds: bool = False,
    what: str = "the quantity",
) -> Response:
    """Fit a quantity over variables.

    Args:
        variables: What varies.
        points: Its values at each point.
        matrix: The quantity by seed and point, (n_seeds, n_points); NaN if unknown.
        is_share: Its values are between 0 and 1, and the fit is, too.
        has_own_seeds: Each run has a seed of its own.
        what: Its name, for messages.

    Raises:
        ParameterError: Nothing varies, or too few points have runs.
    """
    means = point_means(matrix, has_own_seeds=has_own_seeds)
    chosen = np.flatnonzero(np.isfinite(means.mean))
    axes = axes_of(variables, [points[i] for i in chosen.tolist()])
    if not axes or len(chosen) < MIN_POINTS:
        raise ParameterError(
            f"{what} cannot be fitted over {'what varies' if axes else 'nothing that varies'}: "
            f"{len(chosen)} points have runs, and a fit takes {MIN_POINTS} that differ"
        )
    chosen = thinned(chosen, MAX_POINTS)
    known = PointMeans(means.mean[chosen], means.variance[chosen], means.common)
    n = np.isfinite(matrix).sum(axis=0)[chosen]
    at = [points[i] for i in chosen.tolist()]
    observed = _as_share(known, n) if is_share else _as_number(known, n)
    return Response(axes, at, observed)


def _as_number(means: PointMeans, n: np.ndarray) -> Observed:
    centre = float(means.mean.mean())
    is_known = bool(np.isfinite(means.variance).all())
    spread = float(means.mean.std()) or (math.sqrt(float(means.variance.mean())) if is_known else 0.0)
    scale = spread or 1.0  # of runs that are all equal, the fit is a line without a band, in whatever unit
    least = 1e-6 * scale**2
    variance = np.maximum(means.variance, least) if is_known else np.full(len(means.mean), least)
    noise = float((means.variance * n).mean() + means.common * n.mean()) / scale**2 if is_known else None
    return Observed(
        (means.mean - centre) / scale, scale**2 / variance, means.common / scale**2, centre, spread, False, noise
    )  # fmt: skip


def _as_share(means: PointMeans, n: np.ndarray) -> Observed:
    """Shares with the numbers of runs of 0 or 1 that vary as much (Kish, Survey Sampling (1965), 8.2)."""
    spread = float((means.mean * (1.0 - means.mean)).mean())
    is_known = bool(np.isfinite(means.variance).all())
    noise = float((means.variance * n).mean()) if is_known else 0.0
    least = 1e-3 * spread
    ratio = max(spread / max(noise, least), 1.0) if spread > 0.0 and is_known else 1.0
    common = means.common / max(spread, 1e-3) ** 2
    return Observed(means.mean, n * ratio, common, 0.0, 1.0, True, noise if is_known else None)


class Response:
    """A quantity as a smooth function of what varies.

    Args:
        axes: The variables.
        points: Their values at the points that are fitted.
        observed: The means there.
    """

    def __init__(
        self, axes: Sequence[FittedVariable], points: Sequence[Mapping[str, Any]], observed: Observed
    ) -> None:
        self.axes = list(axes)
        self.points = list(points)
        self.observed = observed
        self._x = self._coordinates(points)
        self._kernel = tuned_kernel([axis.is_number for axis in self.axes], self._x, observed)
        self._mode = Posterior(self._kernel, self._x, observed)

    @property
    def is_share(self) -> bool:
        """The values are between 0 and 1."""
        return self.observed.is_share

    def axis(self, name: str) -> FittedVariable:
        """The axis of a variable.

        Raises:
            ParameterError: It does not vary.
        """
        for axis in self.axes:
            if axis.variable.name == name:
                return axis
        known = [axis.variable.name for axis in self.axes]
        raise ParameterError(f"{name!r} does not vary{nearest_name(name, known)}; {listed(known)}")

    def at(self, points: Sequence[Mapping[str, Any]]) -> Estimates:
        """The fit at points; each has a value of each variable.

        Raises:
            ParameterError: A choice was never played.
        """
        return self._averaged(self._coordinates(points)[:, None, :])

    def along(self, name: str, values: Sequence[Any], given: Mapping[str, Any] | None = None) -> Estimates:
        """The fit along a variable, the others as at the points: their mean response.

        Args:
            name: The variable.
            values: Where.
            given: Values of other variables that are held.

        Raises:
            ParameterError: A variable does not vary, or a choice was never played.
        """
        rows = np.stack([self._around({**(given or {}), name: value}) for value in values])
        return self._averaged(rows)

    def difference(
        self, name: str, a: Any, b: Any, given: Mapping[str, Any] | None = None
    ) -> tuple[float, float, float]:
        """The fit with b less that with a, the other variables as at the points, and its 95 % interval.

        Raises:
            ParameterError: A variable does not vary, or a choice was never played.
        """
        first, second = (self._around({**(given or {}), name: value}) for value in (a, b))
        rows = np.concatenate([first, second])
        mean, covariance = self._joint(rows)
        value, slope = self._outward(mean)
        weight = np.repeat([-1.0, 1.0], len(first)) / len(first)
        found = float(value[len(first) :].mean() - value[: len(first)].mean())  # exactly 0 of a constant
        half = _QUANTILE * math.sqrt(max(float((weight * slope) @ covariance @ (weight * slope)), 0.0))
        low, high = found - half, found + half
        return (found, max(low, -1.0), min(high, 1.0)) if self.is_share else (found, low, high)

    def plane(
        self,
        across: str,
        up: str,
        xs: Sequence[Any],
        ys: Sequence[Any],
        given: Mapping[str, Any] | None = None,
    ) -> np.ndarray:
        """The fit over two variables, the others given or as at the points, (len(ys), len(xs)).

        Raises:
            ParameterError: A variable does not vary, or a choice was never played.
        """
        held = given or {}
        rows = np.stack([self._around({**held, across: x, up: y}, N_AROUND // 4) for y in ys for x in xs])
        shape = rows.shape
        mean = self._mode.mean(rows.reshape(-1, shape[-1])).reshape(shape[:2])
        return np.asarray(self._outward(mean)[0].mean(axis=1).reshape(len(ys), len(xs)))

    def joint(self, points: Sequence[Mapping[str, Any]]) -> tuple[np.ndarray, np.ndarray]:
        """Mean and covariance of the posterior of the fit at points, (n,) and (n, n); of a share, of its logit.

        Raises:
            ParameterError: A choice was never played.
        """
        mean, covariance = self._joint(self._coordinates(points))
        if self.is_share:
            return mean, covariance
        return self.observed.centre + self.observed.scale * mean, self.observed.scale**2 * covariance

    def parts(self) -> list[tuple[Part, Part]]:
        """First-order and total part of each axis in the variance of the runs, and twice that of what no axis explains, as the last.

        Sobol's indices, in closed form since the kernel is a product (Oakley and O'Hagan, JRSS B 66 (2004), 751-769), over the values
        at the points, as if they were independent of each other; median and 95 % interval of draws of the posterior.
        """
        noise = self._kernel.noise + (self.observed.noise or 0.0)
        return variance_parts(self._kernel, self._x, self._mode, noise)

    # -- inside -----------------------------------------------------------------------------------------------------------

    def _coordinates(self, points: Sequence[Mapping[str, Any]]) -> np.ndarray:
        return np.stack(
            [axis.coordinates([p[axis.variable.name] for p in points]) for axis in self.axes], axis=1
        )

    @cached_property
    def _others(self) -> np.ndarray:
        return np.asarray(self._x[thinned(np.arange(len(self._x)), N_AROUND)])

    def _around(self, given: Mapping[str, Any], n: int = N_AROUND) -> np.ndarray:
        """Coordinates of points at which some variables are given, (n, n_axes); one if all are."""
        rows = self._others[thinned(np.arange(len(self._others)), n)].copy()
        for name, value in given.items():
            axis = self.axis(name)
            rows[:, self.axes.index(axis)] = axis.coordinates([value])[0]
        return np.asarray(rows[:1] if len({*given}) == len(self.axes) else rows)

    def _joint(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        mean, covariance = self._mode.joint(rows)
        return mean, covariance + self.observed.common

    def _outward(self, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values of the quantity, and their slopes in the scale of the fit."""
        if self.is_share:
            p = scipy_package().special.expit(f)
            return p, p * (1.0 - p)
        return self.observed.centre + self.observed.scale * f, np.full(f.shape, self.observed.scale)

    def _averaged(self, rows: np.ndarray) -> Estimates:
        """Means of the fit over groups of rows, (n, n_around, n_axes), with their bands."""
        found = np.empty((len(rows), 3))
        for i, group in enumerate(rows):
            mean, covariance = self._joint(group)
            value, slope = self._outward(mean)
            weight = slope / len(group)
            sd = math.sqrt(max(float(weight @ covariance @ weight), 0.0))
            found[i] = self._band(float(value.mean()), _QUANTILE * sd)
        return Estimates(*found.T)

    def _band(self, value: float, half: float) -> tuple[float, float, float]:
        if not self.is_share:
            return value, value - half, value + half
        slope = max(value * (1.0 - value), 1e-300)
        middle, expit = (
            math.log(max(value, 1e-300)) - math.log1p(-min(value, 1.0 - 1e-16)),
            scipy_package().special.expit,
        )
        return value, float(expit(middle - half / slope)), float(expit(middle + half / slope))
