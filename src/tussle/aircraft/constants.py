"""Constants of JSBSim's Earth and air, in its units: foot, slug, degree Rankine."""

from __future__ import annotations

import math

from tussle.aircraft.units import FOOT

# World Geodetic System 1984 (NIMA TR8350.2), as JSBSim rounds it.
SEMI_MAJOR = 20925646.32546
SEMI_MINOR = 20855486.5951
GM = 14.0764417572e15  # [ft^3/s^2]
J2 = 1.08262982e-03
EARTH_RATE = 0.00007292115  # [rad/s]
AXIS_RATIO = SEMI_MINOR / SEMI_MAJOR
AXIS_RATIO_SQUARED = AXIS_RATIO * AXIS_RATIO
ECCENTRICITY_SQUARED = 1.0 - AXIS_RATIO_SQUARED

POUND_PER_SLUG = 32.174049
STANDARD_GRAVITY = 9.80665 / FOOT
FPS_TO_KNOT = FOOT * 3600.0 / 1852.0

# U.S. Standard Atmosphere 1976: geopotential altitude [ft], temperature [R].
GAS = (8.31432 * 0.06852168 / (1.8 * FOOT * FOOT)) / (28.9645 * 0.06852168 / 1000.0)
EARTH_RADIUS = 6356766.0 / FOOT
SEA_LEVEL_PRESSURE = 2116.228
ALTITUDES = (
    0.0,
    36089.2388,
    65616.7979,
    104986.8766,
    154199.4751,
    167322.8346,
    232939.6325,
    278385.8268,
    298556.4304,
)
TEMPERATURES = (518.67, 389.97, 389.97, 411.57, 487.17, 487.17, 386.37, 336.5028, 336.5028)
LAPSES = tuple(
    (t1 - t0) / (h1 - h0)
    for t0, t1, h0, h1 in zip(TEMPERATURES, TEMPERATURES[1:], ALTITUDES, ALTITUDES[1:], strict=False)
)
SEA_LEVEL_DENSITY = SEA_LEVEL_PRESSURE / (GAS * TEMPERATURES[0])
SEA_LEVEL_SOUND = math.sqrt(1.4 * GAS * TEMPERATURES[0])


def _pressures() -> tuple[float, ...]:
    found = [SEA_LEVEL_PRESSURE]
    for k, lapse in enumerate(LAPSES):
        rise, base = ALTITUDES[k + 1] - ALTITUDES[k], TEMPERATURES[k]
        if lapse:
            found.append(found[-1] * math.pow(base / (base + lapse * rise), STANDARD_GRAVITY / (GAS * lapse)))
        else:
            found.append(found[-1] * math.exp(-STANDARD_GRAVITY * rise / (GAS * base)))
    return tuple(found)


PRESSURES = _pressures()
DENSITIES = tuple(p / (GAS * t) for p, t in zip(PRESSURES, TEMPERATURES, strict=True))
