"""Gusts with the Dryden spectra of MIL-F-8785C (1980), section 3.7.3, by forming filters that are advanced exactly.

The longitudinal gust is noise through 1 / (1 + T s), the others through (1 + sqrt(3) T s) / (1 + T s)^2, T = L / V for a length scale L
and speed V. Filters are discretized without error for any step: the covariance of the added noise is P - F P F', P that of the
stationary state and F its transition (Van Loan 1978 for a stationary process).
"""

from __future__ import annotations

import numpy as np

from tussle.numeric import exp, log

FOOT = 0.3048  # [m]
SQRT3 = 3.0**0.5


def low_altitude(height: np.ndarray, wind: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Length scales [m] and standard deviations [m/s] of the horizontal and of the vertical gust, (2, n) each.

    MIL-F-8785C section 3.7.3.4, in feet: L_w = h, L_u = L_v = h / (0.177 + 0.000823 h)^1.2, sd_w = 0.1 W20,
    sd_u = sd_v = sd_w / (0.177 + 0.000823 h)^0.4.

    Args:
        height: Height above the ground [m], (n,); held between 10 and 1000 ft.
        wind: Wind speed at 20 ft [m/s], (n,).
    """
    h = np.minimum(np.maximum(height / FOOT, 10.0), 1000.0)
    logarithm = log(0.177 + 0.000823 * h)
    scale = FOOT * np.array([h / exp(1.2 * logarithm), h])
    return scale, 0.1 * np.array([wind / exp(0.4 * logarithm), wind])


def at_start(draw: np.ndarray) -> np.ndarray:
    """Filter states in the stationary distribution, (5, n), from standard normal draws, (5, n)."""
    u, a, b, c, d = draw
    return np.array([u, a, 0.5 * (a + b), c, 0.5 * (c + d)])


def passed(filters: np.ndarray, h_uv: np.ndarray, h_w: np.ndarray, draw: np.ndarray) -> np.ndarray:
    """Filter states after a path of `h_uv` horizontal and `h_w` vertical length scales, (5, n)."""
    u, v1, v2, w1, w2 = filters
    decay = exp(-h_uv)
    u = decay * u + np.sqrt(1.0 - decay * decay) * draw[0]
    return np.array([u, *_second_order(v1, v2, h_uv, draw[1:3]), *_second_order(w1, w2, h_w, draw[3:5])])


def _second_order(
    first: np.ndarray, second: np.ndarray, h: np.ndarray, draw: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Two lags in series, x1' = (n - x1) / T and x2' = (x1 - x2) / T, with P = [[1, 1/2], [1/2, 1/2]], advanced by h T."""
    decay = exp(-h)
    rest = decay * decay
    q11, q12, q22 = 1.0 - rest, 0.5 - rest * (h + 0.5), 0.5 - rest * (h * h + h + 0.5)
    l11 = np.sqrt(q11)
    l21 = q12 / np.where(l11 > 0.0, l11, 1.0)
    l22 = np.sqrt(np.maximum(q22 - l21 * l21, 0.0))
    return decay * first + l11 * draw[0], decay * (h * first + second) + l21 * draw[0] + l22 * draw[1]


def gust(filters: np.ndarray) -> np.ndarray:
    """Longitudinal, lateral and vertical gust of unit variance, (3, n): sqrt(3) x1 + (1 - sqrt(3)) x2 has the variance 2."""
    u, v1, v2, w1, w2 = filters
    half = 0.5**0.5
    return np.array([u, half * (SQRT3 * v1 + (1.0 - SQRT3) * v2), half * (SQRT3 * w1 + (1.0 - SQRT3) * w2)])
