"""Units of JSBSim."""

FOOT = 0.3048
"""[m]"""
KNOT = 1852.0 / 3600.0
"""[m/s]"""
