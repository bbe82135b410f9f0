"""Gusts with the Dryden spectra of MIL-F-8785C (1980), section 3.7, by forming filters that are advanced exactly.

The longitudinal gust is noise through 1 / (1 + T s), the others through (1 + sqrt(3) T s) / (1 + T s)^2, T = L / V for a length scale L
and speed V. Filters are discretized without error for any step: the covariance of the added noise is P - F P F', P that of the
stationary state and F its transition (Van Loan 1978 for a stationary process).

In compiled code the functions take and return components, in Python component-first arrays.
"""

import math

from tussle.numeric.functions import exp, log
from tussle.numeric.kernel import device
from tussle.numeric.quaternion import Columnar

FOOT = 0.3048  # [m]
SQRT3 = 3.0**0.5
HALF_ROOT = 0.5**0.5
HIGH_SCALE = 1750.0 * FOOT  # section 3.7.2.1


@device
def _low_altitude(height, wind):
    """Scales and deviations near the ground."""
    h = min(max(height / FOOT, 10.0), 1000.0)
    logarithm = log(0.177 + 0.000823 * h)
    return (
        FOOT * (h / exp(1.2 * logarithm)),
        FOOT * h,
        0.1 * (wind / exp(0.4 * logarithm)),
        0.1 * wind,
    )


@device
def _any_altitude(height, wind, deviation):
    """Scales and deviations at any height."""
    share = min(max(height / FOOT / 1000.0 - 1.0, 0.0), 1.0)
    scale_uv, scale_w, sd_uv, sd_w = _low_altitude(height, wind)
    return (
        scale_uv + share * (HIGH_SCALE - scale_uv),
        scale_w + share * (HIGH_SCALE - scale_w),
        sd_uv + share * (deviation - sd_uv),
        sd_w + share * (deviation - sd_w),
    )


@device
def _at_start(u, a, b, c, d):
    """States from draws."""
    return u, a, 0.5 * (a + b), c, 0.5 * (c + d)


@device
def _second_order(first, second, h, draw, other):
    """Two lags in series, x1' = (n - x1) / T and x2' = (x1 - x2) / T, with P = [[1, 1/2], [1/2, 1/2]], advanced by h T."""
    decay = exp(-h)
    rest = decay * decay
    q11, q12, q22 = 1.0 - rest, 0.5 - rest * (h + 0.5), 0.5 - rest * (h * h + h + 0.5)
    l11 = math.sqrt(q11)
    l21 = q12 / (l11 if l11 > 0.0 else 1.0)
    l22 = math.sqrt(max(q22 - l21 * l21, 0.0))
    return decay * first + l11 * draw, decay * (h * first + second) + l21 * draw + l22 * other


@device
def _passed(u, v1, v2, w1, w2, h_uv, h_w, d0, d1, d2, d3, d4):
    """States after a path."""
    decay = exp(-h_uv)
    u = decay * u + math.sqrt(1.0 - decay * decay) * d0
    v1, v2 = _second_order(v1, v2, h_uv, d1, d2)
    w1, w2 = _second_order(w1, w2, h_w, d3, d4)
    return u, v1, v2, w1, w2


@device
def _gust(u, v1, v2, w1, w2):
    """Gusts from states."""
    return (
        u,
        HALF_ROOT * (SQRT3 * v1 + (1.0 - SQRT3) * v2),
        HALF_ROOT * (SQRT3 * w1 + (1.0 - SQRT3) * w2),
    )


low_altitude = Columnar(_low_altitude, (0, 0), 4)
"""Length scales of horizontal and vertical gusts [m], and their standard deviations [m/s], (4, n), near the ground.

MIL-F-8785C section 3.7.3.4, in feet: L_w = h, L_u = L_v = h / (0.177 + 0.000823 h)^1.2, sd_w = 0.1 W20,
sd_u = sd_v = sd_w / (0.177 + 0.000823 h)^0.4; from height above the ground [m], held between 10 and 1000 ft, and wind speed at 20 ft [m/s].
"""
any_altitude = Columnar(_any_altitude, (0, 0, 0), 4)
"""Like `low_altitude`; above 2000 ft all scales are 1750 ft and all deviations the third argument [m/s], with a linear transition."""
at_start = Columnar(_at_start, (5,), 5)
"""Filter states in the stationary distribution, (5, n), from standard normal draws, (5, n)."""
passed = Columnar(_passed, (5, 0, 0, 5), 5)
"""Filter states after a path, (5, n): from states, path in horizontal and in vertical length scales, and standard normal draws, (5, n)."""
gust = Columnar(_gust, (5,), 3)
"""Longitudinal, lateral and vertical gust of unit variance, (3, n), from filter states; sqrt(3) x1 + (1 - sqrt(3)) x2 has variance 2."""
