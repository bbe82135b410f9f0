"""Points where rays end."""

import math

from tussle.numeric.kernel import kernel


@kernel("F2 F2 F (F F) F F2w")
def points(mount, pattern, distance, limits, near_end, out):
    """Set x, y, z in the body frame, range and whether it is in range, of every ray.

    mount (12, n): place of the sensor on the body [m], and its axes in the body frame; pattern (3, k); distance (n k,) [m]; limits:
    least and greatest range [m], (n,). Ranges outside of them are those of REP 117: inf beyond the greatest, -inf below the least, nan
    where the distance is nan. Such a ray ends at the greatest range, or at near_end (n,) if the range is -inf. Written: out (5, n k).
    """
    least, greatest = limits
    k = pattern.shape[1]
    for i in range(least.shape[0]):
        for j in range(k):
            reach = distance[i * k + j]
            inside = least[i] <= reach <= greatest[i]
            t = reach if inside else greatest[i]
            if reach < least[i]:
                t, reach = near_end[i], -math.inf
            elif reach > greatest[i]:
                reach = math.inf
            a, b, c = t * pattern[0, j], t * pattern[1, j], t * pattern[2, j]
            for axis in range(3):
                out[axis, i * k + j] = (
                    mount[axis, i] + mount[3 + axis, i] * a + mount[6 + axis, i] * b + mount[9 + axis, i] * c
                )
            out[3, i * k + j] = reach
            out[4, i * k + j] = 1.0 if inside else 0.0
