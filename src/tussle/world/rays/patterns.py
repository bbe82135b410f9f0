"""Rays of sensors on bodies: one pattern, turned by the attitude of each sensor."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tussle.numeric.quaternion import quat_from_euler, quat_multiply, quat_rotate
from tussle.world.rays import kernels


class ScanPattern(NamedTuple):
    """How a lidar is mounted and how it scans.

    Attributes:
        pos: Position on the body [m], (3,), body frame.
        quat: Attitude on the body, (4,).
        angle_increment: Angle between two rays of one elevation, counter-clockwise [rad].
        n_elevations: Number of elevations.
        range_min: Smallest range [m].
        range_max: Largest range [m].
        scan_time: Time between two scans [s].
        time: Of the last scan [s].
    """

    pos: np.ndarray
    quat: np.ndarray
    angle_increment: float
    n_elevations: int
    range_min: float
    range_max: float
    scan_time: float
    time: float


def aimed(
    pos: np.ndarray, quat: np.ndarray, xyz: np.ndarray, rpy: np.ndarray, pattern: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Origins [m] and directions, (3, m k) each, world frame, of the rays of m sensors, sensor after sensor.

    Args:
        pos: Positions of the bodies [m], (3, m).
        quat: Their attitudes, (4, m).
        xyz: Places of the sensors on the bodies [m], (3, m).
        rpy: Attitudes of the sensors on the bodies [rad], (3, m).
        pattern: Unit directions, sensor frame, (3, k).
    """
    m, k = pos.shape[1], pattern.shape[1]
    turned = np.ascontiguousarray(quat_multiply(quat, quat_from_euler(*rpy)))
    origin = np.ascontiguousarray(pos + quat_rotate(quat, xyz))
    origins, directions = np.empty((3, m * k)), np.empty((3, m * k))
    kernels.aim(turned, origin, pattern, origins, directions, (0, m))
    return origins, directions
