"""Rays of all entities from one pattern, and the points where they end."""

from __future__ import annotations

from tussle.numeric.kernel import kernel


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


@kernel("F2 F2 F (F F) F2w")
def points(mount, pattern, distance, limits, out):
    """Set x, y, z in the body frame, range and whether it is in range, of every ray.

    mount (12, n): place of the sensor on the body [m], and its axes in the body frame; pattern (3, k); distance (n k,) [m]; limits:
    least and greatest range [m], (n,). A ray out of range ends at the greatest range. Written: out (5, n k).
    """
    least, greatest = limits
    k = pattern.shape[1]
    for i in range(least.shape[0]):
        for j in range(k):
            t = distance[i * k + j]
            inside = least[i] <= t <= greatest[i]
            t = t if inside else greatest[i]
            a, b, c = t * pattern[0, j], t * pattern[1, j], t * pattern[2, j]
            for axis in range(3):
                out[axis, i * k + j] = (
                    mount[axis, i] + mount[3 + axis, i] * a + mount[6 + axis, i] * b + mount[9 + axis, i] * c
                )
            out[3, i * k + j] = t
            out[4, i * k + j] = 1.0 if inside else 0.0
