"""A Gaussian process: its kernel, its posterior, and the parts that variables have in its variance.

C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine Learning (2006). Matérn's kernel with 5/2 over numbers, one
correlation between any two values of a choice, and the largest posterior density of the lengths and the noise; Laplace's
approximation for shares (3.4 and 5.5.1), and the slopes of its evidence (5.4.1 and 5.5.1).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tussle.batch.statistics import SEED, scipy_package

MAX_TUNED = 200
"""So many points, evenly spaced by number, choose lengths and noise."""
JITTER = 1e-8
N_DRAWS = 200
MAX_DRAWN = 200
"""So many points, evenly spaced by number, stand for all in a draw of the posterior."""

Part = tuple[float, float, float]
"""A part of a variance, and its 95 % interval."""
CONSTANT = 25.0
"""Variance of the constant: wide, so that data decide."""


def thinned(chosen: np.ndarray, most: int) -> np.ndarray:
    """Return at most so many of them, evenly spaced."""
    if len(chosen) <= most:
        return chosen
    return np.asarray(chosen[np.linspace(0, len(chosen) - 1, most).round().astype(int)])


@dataclass(frozen=True)
class Observed:
    """Means on the scale on which they are fitted: standardized numbers, or shares of the logit.

    Attributes:
        mean: Standardized means, or shares, (n,).
        weight: One over their variance; of shares, the number of runs of 0 or 1 that would have it, (n,).
        common: Variance of what is added to all of them alike, on the scale of the fit.
        centre: What was subtracted from numbers.
        scale: What they were divided by then.
        is_share: They are shares.
        noise: Variance of the runs of a point on the scale of the means; None if no point has two runs.
    """

    mean: np.ndarray
    weight: np.ndarray
    common: float
    centre: float
    scale: float
    is_share: bool
    noise: float | None

    def slopes(self, f: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """First and negative second derivative of the logarithm of the likelihood, (n,) each, and its value."""
        if not self.is_share:
            return (
                (self.mean - f) * self.weight,
                self.weight,
                -0.5 * float((self.weight * (self.mean - f) ** 2).sum()),
            )
        p = scipy_package().special.expit(f)
        value = float((self.weight * (self.mean * f - np.logaddexp(0.0, f))).sum())
        return self.weight * (self.mean - p), self.weight * p * (1.0 - p), value

    def third_derivative(self, f: np.ndarray) -> np.ndarray:
        """Third derivative of the logarithm of the likelihood of shares, (n,)."""
        p = scipy_package().special.expit(f)
        return np.asarray(self.weight * p * (1.0 - p) * (2.0 * p - 1.0))


@dataclass(frozen=True)
class Covariance:
    """Covariance of the fit.

    Attributes:
        amplitude: Variance of what varies.
        shape: Length of each number's axis; correlation of two values of each choice, (n_axes,).
        is_number: (n_axes,).
        noise: Variance at each point that no variable explains.
    """

    amplitude: float
    shape: tuple[float, ...]
    is_number: tuple[bool, ...]
    noise: float

    def factor(self, i: int, apart: np.ndarray) -> np.ndarray:
        """Correlation along one axis of places that are so far apart."""
        if not self.is_number[i]:
            return np.where(apart == 0.0, 1.0, self.shape[i])
        r = apart * (math.sqrt(5.0) / self.shape[i])
        return np.asarray((1.0 + r + r * r / 3.0) * np.exp(-r))

    def varying(self, apart: np.ndarray) -> np.ndarray:
        """Covariance of what varies at pairs of rows, (n, m).

        Args:
            apart: Their distances along each axis, (n_axes, n, m).
        """
        found = np.full(apart.shape[1:], self.amplitude)
        for i, along in enumerate(apart):
            found *= self.factor(i, along)
        return found

    def of_points(self, varying: np.ndarray) -> np.ndarray:
        """Covariance at the points themselves, (n, n), with the variance that no variable explains; `varying` as `varying` returns it."""
        found = varying + CONSTANT
        found[np.diag_indices(len(found))] += self.noise + JITTER
        return found

    def log_slope(self, i: int, apart: np.ndarray) -> np.ndarray:
        """Slope of the logarithm of the correlation along one axis, by the logarithm of its length or the logit of its correlation."""
        if not self.is_number[i]:
            return np.where(apart == 0.0, 0.0, 1.0 - self.shape[i])
        r = apart * (math.sqrt(5.0) / self.shape[i])
        square = r * r
        return np.asarray((square + square * r) / (3.0 + 3.0 * r + square))

    def __call__(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Covariance of the fit at rows of coordinates, (len(a), len(b))."""
        return self.varying(distances(a, b)) + CONSTANT


def distances(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Distances of rows of coordinates along each axis, (n_axes, len(a), len(b))."""
    return np.asarray(np.abs(a.T[:, :, None] - b.T[:, None, :]))


class Posterior:
    """The most probable fit, and the curvature there; of numbers, the posterior itself.

    Newton's method as in Rasmussen and Williams, algorithm 3.1.
    """

    def __init__(
        self, kernel: Covariance, x: np.ndarray, observed: Observed, varying: np.ndarray | None = None
    ) -> None:
        linalg = scipy_package().linalg
        self.kernel, self.x = kernel, x
        whole = kernel.of_points(kernel.varying(distances(x, x)) if varying is None else varying)
        f, a = np.zeros(len(x)), np.zeros(len(x))
        if observed.is_share:  # a good place to begin
            f = np.log(
                (observed.mean * observed.weight + 0.5) / ((1.0 - observed.mean) * observed.weight + 0.5)
            )
        best = -math.inf
        for _ in range(30):
            slope, weight, _ = observed.slopes(f)
            root = np.sqrt(weight)
            factor = linalg.cholesky(np.eye(len(x)) + root[:, None] * whole * root[None, :], lower=True)
            b = weight * f + slope
            a = b - root * linalg.cho_solve((factor, True), root * (whole @ b))
            f = whole @ a
            value = observed.slopes(f)[2] - 0.5 * float(a @ f)
            if value - best < 1e-6 * (1.0 + abs(value)):
                break
            best = value
        self.a, self.f, self.root, self.factor = a, f, root, factor
        self.evidence = value - float(np.log(np.diag(factor)).sum())

    def mean(self, rows: np.ndarray) -> np.ndarray:
        """Mean of the fit, (n,)."""
        return np.asarray(self.kernel(rows, self.x) @ self.a)

    def joint(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and covariance of the fit, (n,) and (n, n)."""
        between = self.kernel(rows, self.x)
        half = scipy_package().linalg.solve_triangular(
            self.factor, self.root[:, None] * between.T, lower=True
        )
        return between @ self.a, self.kernel(rows, rows) - half.T @ half


def evidence_slopes(
    mode: Posterior, observed: Observed, apart: np.ndarray, varying: np.ndarray
) -> np.ndarray:
    """Slopes of the evidence by the logarithms of amplitude and noise, and by each axis as in `Covariance.log_slope`, (2 + n_axes,).

    Rasmussen and Williams, algorithm 5.1.

    Args:
        mode: The posterior at the points.
        observed: What was observed there.
        apart: Their distances along each axis, (n_axes, n, n).
        varying: `Covariance.varying` of these.
    """
    kernel, root = mode.kernel, mode.root
    inverse = root[:, None] * scipy_package().linalg.cho_solve((mode.factor, True), np.diag(root))
    slope = observed.slopes(mode.f)[0]
    # The slope by the covariance of each pair: where the mode stands still, and by its move, which changes the curvature of shares.
    by_pair = 0.5 * (np.outer(mode.a, mode.a) - inverse)
    if observed.is_share:
        whole = kernel.of_points(varying)
        solved = inverse @ whole
        spread = whole.diagonal() - (whole * solved).sum(axis=0)
        by_mode = 0.5 * spread * observed.third_derivative(mode.f)
        by_pair += np.outer(by_mode - solved @ by_mode, slope)
    by_noise = kernel.noise * by_pair.trace()
    by_pair *= varying
    by_shape = [float((by_pair * kernel.log_slope(i, along)).sum()) for i, along in enumerate(apart)]
    return np.array([by_pair.sum(), by_noise, *by_shape])


def _kernel_of(is_number: Sequence[bool], theta: np.ndarray) -> Covariance:
    shape = [
        math.exp(value) if is_length else 1.0 / (1.0 + math.exp(-value))
        for is_length, value in zip(is_number, theta[2:], strict=True)
    ]
    return Covariance(math.exp(theta[0]), tuple(shape), tuple(is_number), math.exp(theta[1]))


def tuned_kernel(is_number: Sequence[bool], x: np.ndarray, observed: Observed) -> Covariance:
    """The kernel of the largest posterior density.

    Priors of the logarithms are normal: lengths around 0.8 of the range; the variance that no variable explains small where the runs
    of a point tell the noise, else a part of the whole.
    """
    centre = [0.0, math.log(1e-3 if observed.noise is not None else 0.1)]
    centre += [math.log(0.8) if is_length else 1.0 for is_length in is_number]
    spread = [1.5, 2.0, *(0.8 if is_length else 1.5 for is_length in is_number)]
    middle, sd = np.array(centre), np.array(spread)
    some = thinned(np.arange(len(x)), MAX_TUNED)
    x, observed = x[some], replace(observed, mean=observed.mean[some], weight=observed.weight[some])

    apart = distances(x, x)

    def loss(theta: np.ndarray) -> tuple[float, np.ndarray]:
        kernel, off = _kernel_of(is_number, theta), (theta - middle) / sd
        varying = kernel.varying(apart)
        mode = Posterior(kernel, x, observed, varying)
        slopes = off / sd - evidence_slopes(mode, observed, apart, varying)
        return 0.5 * float((off**2).sum()) - mode.evidence, slopes

    bounds = [(m - 4.0 * s, m + 4.0 * s) for m, s in zip(centre, spread, strict=True)]
    options = {"maxiter": 60, "ftol": 1e-7}
    minimize = scipy_package().optimize.minimize
    found = minimize(loss, middle, method="L-BFGS-B", jac=True, bounds=bounds, options=options)
    return _kernel_of(is_number, found.x)


def variance_parts(
    kernel: Covariance, x: np.ndarray, mode: Posterior, noise: float
) -> list[tuple[Part, Part]]:
    """First-order and total part of each axis in the variance of the runs, and of what no axis explains, as the last; see `Response.parts`.

    Args:
        kernel: The covariance.
        x: Coordinates of the points, (n, n_axes).
        mode: The posterior.
        noise: Variance of the runs of a point, on the scale of the fit.
    """
    linalg, some = scipy_package().linalg, thinned(np.arange(len(x)), MAX_DRAWN)
    own = x[some]
    mean, covariance = mode.joint(own)
    covariance[np.diag_indices(len(own))] += 1e-9 * (1.0 + covariance.diagonal())
    values, vectors = np.linalg.eigh(covariance)
    normal = np.random.default_rng(SEED).normal(size=(len(own), N_DRAWS))
    draws = mean[:, None] + vectors @ (np.sqrt(np.maximum(values, 0.0))[:, None] * normal)
    whole = kernel(own, own)
    whole[np.diag_indices(len(own))] += 1e-6 * kernel.amplitude
    alpha = linalg.cho_solve(linalg.cho_factor(whole, lower=True), draws)
    square, product = [], []  # of each axis: means of k(x, .) k(x, .)', and products of the means of k(x, .)
    for i in range(x.shape[1]):
        at, n = np.unique(own[:, i], return_counts=True)
        factor = kernel.factor(i, np.abs(at[:, None] - own[None, :, i]))
        share = n / n.sum()
        square.append(factor.T @ (share[:, None] * factor))
        middle = share @ factor
        product.append(np.outer(middle, middle))

    def variance(of: Sequence[np.ndarray]) -> np.ndarray:
        """Variance of the mean over all other axes, of each draw, (N_DRAWS,)."""
        inner = np.prod(of, axis=0) - np.prod(product, axis=0)
        return np.asarray(kernel.amplitude**2 * np.maximum((alpha * (inner @ alpha)).sum(axis=0), 0.0))

    of_fit = variance(square)
    whole_of_it = np.maximum(of_fit + noise, 1e-300)
    found = []
    for i in range(x.shape[1]):
        alone = [square[j] if j == i else product[j] for j in range(x.shape[1])]
        without = [product[j] if j == i else square[j] for j in range(x.shape[1])]
        found.append(
            (_part(variance(alone) / whole_of_it), _part((of_fit - variance(without)) / whole_of_it))
        )
    rest = _part(noise / whole_of_it)
    return [*found, (rest, rest)]


def _part(draws: np.ndarray) -> Part:
    low, value, high = np.quantile(draws, (0.025, 0.5, 0.975)).tolist()
    return value, low, high
