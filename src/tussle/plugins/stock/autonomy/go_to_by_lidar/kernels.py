"""Choice of a direction among obstacles."""

import math

from tussle.numeric import sincos, wrap
from tussle.numeric.kernel import device, kernel

N_WAYS = 72
"""Directions that are compared: every 5 degrees, one of them towards the goal."""
STEP = 2.0 * math.pi / N_WAYS


@device
def free_way(cosine, sine, points, first, last, room, limit):
    """Free distance [m], at most limit, of a disc of radius room [m] in a direction; points (2, m) [m] are relative to it."""
    free = limit
    for k in range(first, last):
        x, y = points[0, k], points[1, k]
        ahead, aside = cosine * x + sine * y, cosine * y - sine * x
        inside = room * room - aside * aside
        if ahead > 0.0 and inside > 0.0:
            free = min(free, max(ahead - math.sqrt(inside), 0.0))
    return free


@kernel("F2 I (F F F) (F F F) Fw Fw")
def choose(points, start, goal, limits, heading, free):
    """Choose the direction of least cost: angle to the goal, turn from the last direction, and blocked part of the path.

    Args:
        points: Obstacles relative to their entity, east and north [m], (2, m), entity after entity.
        start: First point of each entity, and m, (n + 1,).
        goal: Bearing [rad] and distance [m] of the goal, and the weight of a turn, (n,) each.
        limits: Radius of an entity with its clearance, look-ahead distance [m], and the weight of a way that is not free, (n,) each.
        heading: Last direction [rad], (n,); the chosen one is written.
        free: Free distance in the chosen direction [m], (n,), written.
    """
    bearing, distance, turn_weight = goal
    room, ahead, block_weight = limits
    for i in range(heading.shape[0]):
        first, last, look = start[i], start[i + 1], ahead[i]
        reach = max(min(look, distance[i]), 1e-9)
        least, chosen, way = math.inf, bearing[i], look
        for k in range(N_WAYS):
            # Right before left: two entities that meet head on both turn right.
            off = STEP * (-((k + 1) // 2) if k % 2 else k // 2)
            angle = wrap(bearing[i] + off)
            sine, cosine = sincos(angle)
            open_way = free_way(cosine, sine, points, first, last, room[i], look)
            cost = abs(off) + turn_weight[i] * abs(wrap(angle - heading[i]))
            cost += block_weight[i] * (1.0 - min(open_way, reach) / reach)
            if cost < least:
                least, chosen, way = cost, angle, open_way
        heading[i], free[i] = chosen, way
