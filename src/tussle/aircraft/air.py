"""The standard atmosphere and airspeeds, for generated code."""

import math

from tussle.aircraft.constants import (
    ALTITUDES,
    DENSITIES,
    EARTH_RADIUS,
    GAS,
    LAPSES,
    PRESSURES,
    SEA_LEVEL_PRESSURE,
    SEA_LEVEL_SOUND,
    STANDARD_GRAVITY,
    TEMPERATURES,
)
from tussle.aircraft.runtime import outlined, power
from tussle.numeric import exp, log


@outlined
def atmosphere(height):
    """Temperature [R] and pressure [lbf/ft^2] at a geometric altitude [ft] (U.S. Standard Atmosphere 1976, equations 18, 23, 33)."""
    h = height * EARTH_RADIUS / (EARTH_RADIUS + height)
    b = 0
    while b < 7 and h >= ALTITUDES[b + 1]:
        b += 1
    lapse = LAPSES[b]
    temperature = TEMPERATURES[b] + lapse * (h - ALTITUDES[b])
    if lapse != 0.0:
        return temperature, PRESSURES[b] * power(
            TEMPERATURES[b] / temperature, STANDARD_GRAVITY / (GAS * lapse)
        )
    return temperature, PRESSURES[b] * exp(-STANDARD_GRAVITY * (h - ALTITUDES[b]) / (GAS * TEMPERATURES[b]))


@outlined
def density_altitude(density):
    """Geometric altitude [ft] of a density [slug/ft^3] in the standard atmosphere."""
    b = 0
    while b < 7 and density < DENSITIES[b + 1]:
        b += 1
    lapse, base = LAPSES[b], TEMPERATURES[b]
    if lapse != 0.0:
        exponent = -1.0 / (1.0 + STANDARD_GRAVITY / (GAS * lapse))
        h = ALTITUDES[b] + (base / lapse) * (power(density / DENSITIES[b], exponent) - 1.0)
    else:
        h = ALTITUDES[b] - GAS * base / STANDARD_GRAVITY * log(density / DENSITIES[b])
    return h * EARTH_RADIUS / (EARTH_RADIUS - h)


@outlined
def pressure_altitude(pressure):
    """Geometric altitude [ft] of a pressure [lbf/ft^2] in the standard atmosphere."""
    b = 0
    while b < 7 and pressure < PRESSURES[b + 1]:
        b += 1
    lapse, base = LAPSES[b], TEMPERATURES[b]
    if lapse != 0.0:
        h = ALTITUDES[b] + (base / lapse) * (
            power(pressure / PRESSURES[b], -GAS * lapse / STANDARD_GRAVITY) - 1.0
        )
    else:
        h = ALTITUDES[b] - GAS * base / STANDARD_GRAVITY * log(pressure / PRESSURES[b])
    return h * EARTH_RADIUS / (EARTH_RADIUS - h)


@outlined
def total_pressure(pressure, mach):
    """Pressure of a Pitot tube [lbf/ft^2]: isentropic below Mach 1, behind a normal shock above (NACA report 1135, equations 44, 100)."""
    if mach < 1.0:
        m = 1.0 + 0.2 * mach * mach
        return pressure * (m * m * m * math.sqrt(m))
    m = 7.0 * mach * mach - 1.0
    m2 = mach * mach
    return pressure * 166.92158009316827 * (m2 * m2 * m2 * mach) / (m * m * math.sqrt(m))


@outlined
def calibrated_airspeed(total, pressure):
    """Airspeed [ft/s] that an instrument for sea level shows at a total and a static pressure [lbf/ft^2]."""
    ratio = (total - pressure) / SEA_LEVEL_PRESSURE + 1.0
    mach = math.sqrt(max(5.0 * (power(ratio, 1.0 / 3.5) - 1.0), 0.0))
    if mach > 1.0:
        for _ in range(10):
            m = 1.0 - 1.0 / (7.0 * mach * mach)
            mach = 0.8812848543473311 * math.sqrt(ratio * m * m * math.sqrt(m))
    return mach * SEA_LEVEL_SOUND
