"""Conversion between the world frame and an aircraft's local frame: north, east, down on the ellipsoid."""

from __future__ import annotations

import math

import numpy as np

from tussle.geodesy import ECCENTRICITY_SQUARED, SEMI_MAJOR, SEMI_MINOR, Origin
from tussle.numeric.quaternion import quat_conjugate, quat_from_euler, quat_multiply

FORWARD_RIGHT_DOWN = np.array([[0.0], [1.0], [0.0], [0.0]])
"""Rotation between body axes forward, left, up and forward, right, down."""
EAST_NORTH_UP = np.array([[0.0], [math.sqrt(0.5)], [math.sqrt(0.5)], [0.0]])
"""Rotation between axes east, north, up and north, east, down."""


def local_frames(latitude: np.ndarray, longitude: np.ndarray) -> np.ndarray:
    """Quaternions, (4, n), that turn vectors north, east, down at geodetic places [rad], (n,), to Earth-centred ones."""
    zero = np.zeros_like(latitude)
    tilt = quat_from_euler(zero, -(0.5 * math.pi + latitude), zero)
    return np.asarray(quat_multiply(quat_from_euler(zero, zero, longitude), tilt))


def to_world(origin: Origin, latitude: np.ndarray, longitude: np.ndarray) -> np.ndarray:
    """Quaternions, (4, n), that turn vectors north, east, down at geodetic places [rad], (n,), to the world frame."""
    at_origin = local_frames(np.array([origin.latitude]), np.array([origin.longitude]))
    world = quat_multiply(at_origin, EAST_NORTH_UP)
    frames = local_frames(latitude, longitude)
    return np.asarray(quat_multiply(np.broadcast_to(quat_conjugate(world), frames.shape), frames))


def above_sea_level(latitude: np.ndarray, altitude: np.ndarray) -> np.ndarray:
    """JSBSim's altitude [m]: radius less that of the ellipsoid at the same geocentric latitude.

    latitude: geodetic [rad], (n,); altitude: above the ellipsoid [m], (n,).
    """
    sine, cosine = np.sin(latitude), np.cos(latitude)
    normal = SEMI_MAJOR / np.sqrt(1.0 - ECCENTRICITY_SQUARED * sine * sine)
    across, along = (normal + altitude) * cosine, ((1.0 - ECCENTRICITY_SQUARED) * normal + altitude) * sine
    radius = np.hypot(across, along)
    surface = SEMI_MAJOR * SEMI_MINOR * radius / np.hypot(SEMI_MINOR * across, SEMI_MAJOR * along)
    return np.asarray(radius - surface)
