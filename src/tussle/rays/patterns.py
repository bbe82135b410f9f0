"""Rays of sensors on bodies: one pattern, turned by the attitude of each sensor."""

from __future__ import annotations

import numpy as np

from tussle.numeric.kernel import kernel
from tussle.numeric.quaternion import quat_from_euler, quat_multiply, quat_rotate


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
    aim(turned, origin, pattern, origins, directions, (0, m))
    return origins, directions


@kernel("F2 F2 F2 F2w F2w (i8 i8)")
def aim(quat, origin, pattern, origins, directions, part):
    """Turn a pattern of rays by the attitude of each sensor.

    quat (4, n) and origin (3, n) [m] of the sensors, world frame; pattern (3, k): unit directions, sensor frame. Written: origins and
    directions of the rays, (3, n k), sensor after sensor. part: first and last sensor.
    """
    k = pattern.shape[1]
    first, last = part
    for i in range(first, last):
        w, x, y, z = quat[0, i], quat[1, i], quat[2, i], quat[3, i]
        xx, xy, xz = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
        yx, yy, yz = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
        zx, zy, zz = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
        for j in range(k):
            a, b, c = pattern[0, j], pattern[1, j], pattern[2, j]
            directions[0, i * k + j] = xx * a + xy * b + xz * c
            directions[1, i * k + j] = yx * a + yy * b + yz * c
            directions[2, i * k + j] = zx * a + zy * b + zz * c
            origins[0, i * k + j], origins[1, i * k + j], origins[2, i * k + j] = (
                origin[0, i],
                origin[1, i],
                origin[2, i],
            )
