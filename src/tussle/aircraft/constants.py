"""Units of JSBSim's files, and constants of its equations."""

from __future__ import annotations

import math

FOOT = 0.3048  # [m]
METRE = 3.2808399  # [ft]
KILOGRAM = 1.0 / 0.45359237  # [lb]
_TABLE: dict[tuple[str, str], float] = {
    ("M", "FT"): METRE, ("FT", "M"): 1.0 / METRE, ("CM", "FT"): METRE / 100.0, ("KM", "FT"): 1000.0 * METRE,
    ("FT", "IN"): 12.0, ("IN", "FT"): 1.0 / 12.0, ("IN", "M"): 1.0 / (12.0 * METRE), ("M", "IN"): METRE * 12.0,
    ("CM", "IN"): METRE * 12.0 / 100.0,
    ("M2", "FT2"): METRE * METRE, ("FT2", "M2"): 1.0 / (METRE * METRE), ("CM2", "IN2"): 0.15500031, ("M2", "IN2"): METRE * METRE * 144.0,
    ("FT2", "IN2"): 144.0, ("IN2", "FT2"): 1.0 / 144.0,
    ("M3", "FT3"): METRE**3, ("IN3", "CC"): 1.0 / 0.06102374, ("CC", "IN3"): 0.06102374, ("LTR", "IN3"): 61.0237441,
    ("LTR", "FT3"): 1.0 / 28.316846592, ("FT3", "IN3"): 1728.0,
    ("KG", "LBS"): KILOGRAM, ("LBS", "KG"): 1.0 / KILOGRAM, ("KG", "SLUG"): 0.06852168, ("SLUG", "KG"): 1.0 / 0.06852168,
    ("KG*M2", "SLUG*FT2"): 1.0 / 1.35594, ("SLUG*FT2", "KG*M2"): 1.35594,
    ("DEG", "RAD"): math.pi / 180.0, ("RAD", "DEG"): 180.0 / math.pi,
    ("N/M", "LBS/FT"): 1.0 / 14.5939, ("LBS/FT", "N/M"): 14.5939,
    ("N/M/SEC", "LBS/FT/SEC"): 1.0 / 14.5939, ("N/M2/SEC2", "LBS/FT2/SEC2"): (1.0 / 14.5939) / METRE,
    ("WATTS", "HP"): 0.001341022, ("HP", "WATTS"): 1.0 / 0.001341022,
    ("N", "LBS"): 0.22482, ("LBS", "N"): 1.0 / 0.22482,
    ("KTS", "FT/SEC"): 1.0 / 0.592483801, ("FT/SEC", "KTS"): 0.592483801, ("M/S", "FT/S"): METRE, ("M/S", "KTS"): METRE * 0.592483801,
    ("M/SEC", "FT/SEC"): METRE, ("KM/SEC", "FT/SEC"): 1000.0 * METRE,
    ("FT*LBS", "N*M"): 1.35581795, ("N*M", "FT*LBS"): 1.0 / 1.35581795,
    ("ATM", "INHG"): 29.9246899, ("PSI", "INHG"): 2.03625437, ("INHG", "PSI"): 1.0 / 2.03625437, ("PA", "PSI"): 1.0 / 6894.75729,
    ("INHG", "PA"): 3386.0, ("PA", "INHG"): 1.0 / 3386.0, ("PSI", "PA"): 6894.75729, ("ATM", "PA"): 101325.0,
    ("KG/KW*HR", "LBS/HP*HR"): 1.0 / 0.6083, ("KG/KW-HR", "LBS/HP*HR"): 1.0 / 0.6083,
    ("LBS/HP*HR", "KG/KW*HR"): 0.6083, ("GAL", "LBS"): 6.02,
    ("PA", "LBS/FT2"): 1.0 / (14.5939 * METRE), ("N/M2", "LBS/FT2"): 1.0 / (14.5939 * METRE), ("PSI", "LBS/FT2"): 144.0,
    ("M4*SEC/KG", "FT4*SEC/SLUG"): METRE**4 / 0.06852168, ("KG/L", "LBS/GAL"): 8.3454045,
    ("KG/SEC", "LBS/SEC"): KILOGRAM, ("N/SEC", "LBS/SEC"): 0.224808943,
}  # fmt: skip


def factor(given: str, wanted: str) -> float | None:
    """Factor from one unit to another, names in capitals; None if it is not known."""
    return 1.0 if given == wanted else _TABLE.get((given, wanted))


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
