"""Geographic origin: conversion between the local East-North-Up frame on its tangent plane and WGS84 coordinates.

pymap3d does the same with NumPy's sin and cos, whose last bits differ between machines; start positions given by latitude and
longitude would carry that difference into every later step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tussle.errors import ParameterError
from tussle.numeric import atan2, cos, sin, total
from tussle.numeric.quaternion import quat_from_euler, quat_multiply, quat_rotate, quat_rotate_inverse

# NGA.STND.0036, Department of Defense World Geodetic System 1984 (2014), table 3.1: both are defining and exact.
SEMI_MAJOR = 6378137.0
FLATTENING = 1.0 / 298.257223563

SEMI_MINOR = SEMI_MAJOR * (1.0 - FLATTENING)
ECCENTRICITY_SQUARED = FLATTENING * (2.0 - FLATTENING)
SECOND_ECCENTRICITY_SQUARED = ECCENTRICITY_SQUARED / (1.0 - ECCENTRICITY_SQUARED)
# Bowring's first step is accurate to 1e-9 rad from 100 km below the ground to far above it; each further step gains more digits
# than that, so the second reaches rounding error and the third is a margin for orbits.
LATITUDE_STEPS = 3
CENTRAL_SCALE, FALSE_EASTING, FALSE_NORTHING = 0.9996, 500_000.0, 10_000_000.0
"""UTM: NGA.SIG.0012, The Universal Grids and the Transverse Mercator and Polar Stereographic Map Projections (2014), section 7."""
FORWARD_RIGHT_DOWN = 0.0, 1.0, 0.0, 0.0
"""Rotation from forward-right-down to forward-left-up body axes, and back: half a turn about the axis forward."""

NOT_GIVEN: Any = None
DEFAULT_PLACE = {"latitude": math.radians(29.0), "longitude": math.radians(-95.0), "altitude": 0.0}


@dataclass(frozen=True)
class Origin:
    """The point on Earth at which the world frame is tangent; z is measured from its altitude along its vertical.

    The default, 29 N, 95 W, is in Houston: the mission format documents it as latitude -95, longitude 29, which swaps the two numbers.

    Args:
        latitude: Geodetic latitude on WGS84, north positive [rad].
        longitude: East positive [rad].
        altitude: Height above the ellipsoid [m].

    Attributes:
        is_default: True if nothing is given, so that the world is nowhere on Earth for maps; the same place, given, is on them.

    Raises:
        ParameterError: A value is not finite, or an angle is out of range.
    """

    latitude: float = NOT_GIVEN
    longitude: float = NOT_GIVEN
    altitude: float = NOT_GIVEN
    is_default: bool = field(init=False, repr=False)

    def __post_init__(self) -> None:
        given = {name: getattr(self, name) for name in DEFAULT_PLACE}
        object.__setattr__(self, "is_default", all(value is NOT_GIVEN for value in given.values()))
        for name, default in DEFAULT_PLACE.items():
            value = float(default if given[name] is NOT_GIVEN else given[name])
            if not math.isfinite(value):
                raise ParameterError(f"Origin.{name} = {value!r} is not allowed; it takes a finite number")
            object.__setattr__(self, name, value)
        limits = {"latitude": math.pi / 2.0, "longitude": 2.0 * math.pi}
        for name, limit in limits.items():
            value = getattr(self, name)
            if abs(value) > limit:
                raise ParameterError(
                    f"Origin.{name} = {value!r} is not allowed; it takes radians within +-{limit:.6g} "
                    f"(use Origin.from_degrees for degrees)"
                )

    @classmethod
    def from_degrees(cls, latitude: float, longitude: float, altitude: float = 0.0) -> Origin:
        """Make an origin from latitude and longitude in degrees and altitude in metres."""
        return cls(math.radians(latitude), math.radians(longitude), altitude)

    def from_geodetic(self, geodetic: ArrayLike) -> np.ndarray:
        """Convert geodetic coordinates to world positions.

        Args:
            geodetic: Latitude [rad], longitude [rad], altitude above the ellipsoid [m], (3, n) or (3,).

        Returns:
            East, north, up [m], same shape.
        """
        latitude, longitude, altitude = np.asarray(geodetic, np.float64)
        x, y, z = _earth_centred(sin(latitude), cos(latitude), sin(longitude), cos(longitude), altitude)
        (sin_lat, cos_lat, sin_lon, cos_lon), (x0, y0, z0) = self._frame
        x, y, z = x - x0, y - y0, z - z0
        outward = cos_lon * x + sin_lon * y
        return np.stack(
            [cos_lon * y - sin_lon * x, cos_lat * z - sin_lat * outward, sin_lat * z + cos_lat * outward]
        )

    def to_geodetic(self, pos: ArrayLike) -> np.ndarray:
        """Convert world positions to geodetic coordinates; the inverse of `from_geodetic` down to 1000 km below the ground.

        B. R. Bowring, The accuracy of geodetic latitude and height equations, Survey Review 28 (1985), 202-206.

        Args:
            pos: East, north, up [m], (3, n) or (3,).

        Returns:
            Latitude [rad], longitude in (-pi, pi] [rad], altitude above the ellipsoid [m], same shape.
        """
        east, north, up = np.asarray(pos, np.float64)
        (sin_lat, cos_lat, sin_lon, cos_lon), (x0, y0, z0) = self._frame
        outward = cos_lat * up - sin_lat * north
        x = x0 + (cos_lon * outward - sin_lon * east)
        y = y0 + (sin_lon * outward + cos_lon * east)
        z = z0 + (cos_lat * north + sin_lat * up)
        axis = np.sqrt(x * x + y * y)
        # tan(latitude) = rise / run, and b rise / (a run) for the parametric latitude; run = 0 at the poles rules out the ratio.
        rise, run = z * (1.0 + SECOND_ECCENTRICITY_SQUARED * SEMI_MINOR / np.sqrt(axis * axis + z * z)), axis
        for _ in range(LATITUDE_STEPS):
            length = np.sqrt(
                (SEMI_MINOR * rise) * (SEMI_MINOR * rise) + (SEMI_MAJOR * run) * (SEMI_MAJOR * run)
            )
            sine, cosine = SEMI_MINOR * rise / length, SEMI_MAJOR * run / length
            rise = z + SECOND_ECCENTRICITY_SQUARED * SEMI_MINOR * (sine * sine * sine)
            run = axis - ECCENTRICITY_SQUARED * SEMI_MAJOR * (cosine * cosine * cosine)
        length = np.sqrt(rise * rise + run * run)
        sine, cosine = rise / length, run / length
        altitude = axis * cosine + z * sine - SEMI_MAJOR * np.sqrt(1.0 - ECCENTRICITY_SQUARED * sine * sine)
        return np.stack([atan2(rise, run), atan2(y, x), altitude])

    @property
    def earth_centred(self) -> tuple[float, float, float]:
        """Its position in Earth-centred axes: equator at longitude 0, at 90 degrees east, north pole [m]."""
        return self._frame[1]

    @cached_property
    def quat(self) -> np.ndarray:
        """Rotation from the world frame to Earth-centred axes, a quaternion (w, x, y, z), (4,)."""
        turned = quat_from_euler(0.0, 0.0, self.longitude + 0.5 * math.pi)
        return np.asarray(quat_multiply(turned, quat_from_euler(0.5 * math.pi - self.latitude, 0.0, 0.0)))

    def earth_attitude(self, quat: np.ndarray) -> np.ndarray:
        """Attitudes of bodies as DIS and FlightGear define them: from forward-right-down body axes to Earth-centred axes, (4, n).

        Args:
            quat: From forward-left-up body axes to the world frame, (4, n).
        """
        return np.asarray(quat_multiply(quat_multiply(self.quat, quat), FORWARD_RIGHT_DOWN))

    def to_earth_centred(self, pos: ArrayLike) -> np.ndarray:
        """Convert world positions [m], (3, n) or (3,), to positions in Earth-centred axes [m], same shape."""
        pos = np.asarray(pos, np.float64)
        return np.asarray(quat_rotate(self.quat, pos) + self._centre(pos))

    def from_earth_centred(self, pos: ArrayLike) -> np.ndarray:
        """Convert positions in Earth-centred axes [m], (3, n) or (3,), to world positions [m], same shape."""
        pos = np.asarray(pos, np.float64)
        return np.asarray(quat_rotate_inverse(self.quat, pos - self._centre(pos)))

    def _centre(self, pos: np.ndarray) -> np.ndarray:
        """The place of the origin in Earth-centred axes [m], (3, 1), or (3,) for a single position."""
        return np.reshape(self.earth_centred, (3, *[1] * (pos.ndim - 1)))

    @cached_property
    def _frame(self) -> tuple[tuple[float, float, float, float], tuple[float, float, float]]:
        """Sine and cosine of latitude and longitude, and the Earth-centred position [m]."""
        angles = sin(self.latitude), cos(self.latitude), sin(self.longitude), cos(self.longitude)
        x, y, z = _earth_centred(*angles, self.altitude)
        return angles, (float(x), float(y), float(z))


def to_forward_right_down(quat: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Vectors of the world frame, (3, n), in forward-right-down axes, (3, n), of bodies with the attitudes quat, (4, n)."""
    return np.asarray(quat_rotate_inverse(quat_multiply(quat, FORWARD_RIGHT_DOWN), vector))


def utm(latitude: Any, longitude: Any, zone: int, is_south: bool, maths: Any = math) -> tuple[Any, Any]:
    """Return easting and northing [m]. L. Krueger (1912), fourth order: the error is below 1 um inside the zone.

    Args:
        latitude: Of a point [rad]; with `maths` = numpy of points, (n,).
        longitude: As well [rad].
        zone: 1 to 60.
        is_south: Whether northings count from the pole, as in zones of the southern hemisphere.
        maths: Module whose functions are used, math or numpy.
    """
    n = FLATTENING / (2.0 - FLATTENING)
    radius = SEMI_MAJOR / (1.0 + n) * (1.0 + n**2 / 4.0 + n**4 / 64.0)
    alpha = (
        n / 2.0 - 2.0 * n**2 / 3.0 + 5.0 * n**3 / 16.0 + 41.0 * n**4 / 180.0,
        13.0 * n**2 / 48.0 - 3.0 * n**3 / 5.0 + 557.0 * n**4 / 1440.0,
        61.0 * n**3 / 240.0 - 103.0 * n**4 / 140.0,
        49561.0 * n**4 / 161280.0,
    )
    away = longitude - math.radians(6.0 * zone - 183.0)
    sine, e = maths.sin(latitude), math.sqrt(FLATTENING * (2.0 - FLATTENING))
    t = maths.sinh(maths.atanh(sine) - e * maths.atanh(e * sine))
    xi, eta = maths.atan2(t, maths.cos(away)), maths.atanh(maths.sin(away) / maths.hypot(1.0, t))
    north = xi + total(a * maths.sin(2 * j * xi) * maths.cosh(2 * j * eta) for j, a in enumerate(alpha, 1))
    east = eta + total(a * maths.cos(2 * j * xi) * maths.sinh(2 * j * eta) for j, a in enumerate(alpha, 1))
    return FALSE_EASTING + CENTRAL_SCALE * radius * east, CENTRAL_SCALE * radius * north + (
        FALSE_NORTHING if is_south else 0.0
    )


def _earth_centred(
    sin_lat: Any, cos_lat: Any, sin_lon: Any, cos_lon: Any, altitude: Any
) -> tuple[Any, Any, Any]:
    """Earth-centred, Earth-fixed position [m] of geodetic coordinates."""
    curvature = SEMI_MAJOR / np.sqrt(1.0 - ECCENTRICITY_SQUARED * sin_lat * sin_lat)
    axis = (curvature + altitude) * cos_lat
    return axis * cos_lon, axis * sin_lon, (curvature * (1.0 - ECCENTRICITY_SQUARED) + altitude) * sin_lat
