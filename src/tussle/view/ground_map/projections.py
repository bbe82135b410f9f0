"""Projections in which maps come: from latitude and longitude on WGS84 to the coordinates of a map."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from tussle.world.geodesy import SEMI_MAJOR, utm

EARTH_WIDTH = 2.0 * math.pi * SEMI_MAJOR
"""Width of the whole Earth in Web Mercator [m]."""
FIRST_NORTH, FIRST_SOUTH, N_ZONES = 32601, 32701, 60
"""EPSG codes of UTM zones on WGS84, from zone 1."""


@dataclass(frozen=True)
class Projection:
    """A projection.

    Attributes:
        name: Its EPSG code, "EPSG:4326".
        project: From latitude and longitude [rad], (n,) each, to coordinates east and north, (n,) each.
        period: Coordinate east after which the Earth repeats; 0 if it does not.
    """

    name: str
    project: Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
    period: float = 0.0


def _degrees(latitude: np.ndarray, longitude: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.degrees(longitude), np.degrees(latitude)


def _mercator(latitude: np.ndarray, longitude: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """OGC 17-083r4 (2022), annex D: the sphere's Mercator projection of latitudes on the ellipsoid."""
    return SEMI_MAJOR * longitude, SEMI_MAJOR * np.asinh(np.tan(latitude))


GEOGRAPHIC = Projection("EPSG:4326", _degrees, 360.0)
MERCATOR = Projection("EPSG:3857", _mercator, EARTH_WIDTH)


def projection_of(code: int) -> Projection | None:
    """The projection with this EPSG code; None if it is none of WGS84 in degrees, Web Mercator and UTM on WGS84."""
    for first, is_south in ((FIRST_NORTH, False), (FIRST_SOUTH, True)):
        if first <= code < first + N_ZONES:
            project = partial(utm, zone=code - first + 1, is_south=is_south, maths=np)
            return Projection(f"EPSG:{code}", project)
    return {4326: GEOGRAPHIC, 3857: MERCATOR}.get(code)
