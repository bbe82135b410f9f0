"""Kernels of signals: distances, networks and extremes of the entities of each world."""

import math

import numpy as np

from tussle.numeric.kernel import device, kernel

NEVER = 2**62
"""Step that no game reaches."""
SWEEP_FROM = 40_000
"""Pairs of a world from which on sorting by x is faster than looking at all of them."""


@device
def square(pos, a, b):
    """Squared distance of two columns [m^2]; the same whichever comes first."""
    dx = pos[0, a] - pos[0, b]
    dy = pos[1, a] - pos[1, b]
    dz = pos[2, a] - pos[2, b]
    return dx * dx + dy * dy + dz * dz


@device
def lower(x, y, z, px, py, pz, best):
    """Lower best, (n,), to the squared distances of n places from two places p; the lanes are the n places."""
    ax, ay, az = px[0], py[0], pz[0]
    bx, by, bz = px[1], py[1], pz[1]
    for i in range(len(best)):
        dx = x[i] - ax
        dy = y[i] - ay
        dz = z[i] - az
        d = dx * dx + dy * dy + dz * dz
        ex = x[i] - bx
        ey = y[i] - by
        ez = z[i] - bz
        e = ex * ex + ey * ey + ez * ez
        d = e if e < d else d
        best[i] = d if d < best[i] else best[i]


@kernel("F2 I Fw")
def least_within(pos, start, out):
    """Least distance [m] of each world between two of its entities, every pair looked at; inf for fewer than two.

    Entities of world w are the columns start[w] to start[w + 1] of pos [m], (3, n).
    """
    place, best = np.empty((3, pos.shape[1])), np.empty(pos.shape[1])
    x, y, z = place[0], place[1], place[2]
    for w in range(len(out)):
        n = 0
        for i in range(start[w], start[w + 1]):
            x[n], y[n], z[n], best[n] = pos[0, i], pos[1, i], pos[2, i], np.inf
            n += 1
        for j in range(0, n - 1, 2):
            lower(x[:j], y[:j], z[:j], x[j : j + 2], y[j : j + 2], z[j : j + 2], best[:j])
            best[j] = min(best[j], square(place, j, j + 1))
        if n % 2 == 1:
            for i in range(n - 1):
                best[i] = min(best[i], square(place, i, n - 1))
        least = np.inf
        for i in range(n):
            least = min(least, best[i])
        out[w] = math.sqrt(least)


@kernel("F2 I I F2 I I Fw")
def least_between(pos_a, row_a, start_a, pos_b, row_b, start_b, out):
    """Least distance [m] of each world between an entity a and another b, every pair looked at; inf without a pair.

    Entities a of world w are the columns start_a[w] to start_a[w + 1] of pos_a [m], (3, n); row_a tells which they are.
    """
    x, y, z = np.empty(pos_a.shape[1]), np.empty(pos_a.shape[1]), np.empty(pos_a.shape[1])
    best = np.empty(pos_a.shape[1])
    rows = np.empty(pos_a.shape[1], np.int64)
    for w in range(len(out)):
        n = 0
        for i in range(start_a[w], start_a[w + 1]):
            x[n], y[n], z[n], rows[n], best[n] = pos_a[0, i], pos_a[1, i], pos_a[2, i], row_a[i], np.inf
            n += 1
        for j in range(start_b[w], start_b[w + 1]):
            px, py, pz, row = pos_b[0, j], pos_b[1, j], pos_b[2, j], row_b[j]
            for i in range(n):
                dx = x[i] - px
                dy = y[i] - py
                dz = z[i] - pz
                d = dx * dx + dy * dy + dz * dz
                d = d if rows[i] != row else np.inf
                best[i] = d if d < best[i] else best[i]
        least = np.inf
        for i in range(n):
            least = min(least, best[i])
        out[w] = math.sqrt(least)


@kernel("F2 B B I Fw")
def least_by_sweep(pos, is_a, is_b, start, out):
    """The same number, from entities of each world in order of their x: only pairs whose x are nearer than the least distance so far."""
    for w in range(len(out)):
        least = np.inf
        for i in range(start[w], start[w + 1]):
            for j in range(i + 1, start[w + 1]):
                if (pos[0, j] - pos[0, i]) * (pos[0, j] - pos[0, i]) >= least:
                    break
                if (is_a[i] and is_b[j]) or (is_b[i] and is_a[j]):
                    least = min(least, square(pos, i, j))
        out[w] = math.sqrt(least)


@kernel("(F2 F2 I I) (F2 F2 I I) f8 Fw")
def least_approach(a, b, per_second, out):
    """Least approach [m] of each world between an entity a and another b; inf without a pair.

    The approach of two is sqrt(d^2 + (per_second t)^2), where d [m] is their least distance if they fly straight on, and t [s] the time
    until then; at most their distance, and no less for those that part.

    Args:
        a: Positions [m], (3, n), by world; velocities [m/s], (3, n); which entities they are, (n,); those of world w are start[w] to
            start[w + 1].
        b: The same of the others.
        per_second: What a second counts [m/s].
        out: Receives the approach.
    """
    pos_a, vel_a, row_a, start_a = a
    pos_b, vel_b, row_b, start_b = b
    for w in range(len(out)):
        least = np.inf
        for i in range(start_a[w], start_a[w + 1]):
            for j in range(start_b[w], start_b[w + 1]):
                x, y, z = pos_b[0, j] - pos_a[0, i], pos_b[1, j] - pos_a[1, i], pos_b[2, j] - pos_a[2, i]
                u, v, s = vel_a[0, i] - vel_b[0, j], vel_a[1, i] - vel_b[1, j], vel_a[2, i] - vel_b[2, j]
                square, closing, speed = x * x + y * y + z * z, x * u + y * v + z * s, u * u + v * v + s * s
                if closing > 0.0:
                    time = closing / speed
                    ahead = max(square - closing * time, 0.0) + per_second * per_second * time * time
                    square = min(square, ahead)
                if square < least and row_a[i] != row_b[j]:
                    least = square
        out[w] = math.sqrt(least)


@kernel("F2 I f8 Fw Fw")
def spanning_tree(pos, start, reach, longest, parts):
    """Of the minimum spanning tree of each world's entities (Prim 1957): its longest link [m], and connected parts for a range.

    Args:
        pos: Positions [m], (3, n), by world.
        start: Entities of world w are the columns start[w] to start[w + 1].
        reach: Range of a link [m].
        longest: Longest link of each world [m]; 0 for fewer than two entities.
        parts: Parts that links of at most that range connect.
    """
    place, nearest = np.empty((3, pos.shape[1])), np.empty(pos.shape[1])
    is_in = np.empty(pos.shape[1], np.bool_)
    for w in range(len(longest)):
        n = 0
        for i in range(start[w], start[w + 1]):
            place[0, n], place[1, n], place[2, n] = pos[0, i], pos[1, i], pos[2, i]
            nearest[n], is_in[n] = np.inf, False
            n += 1
        longest[w] = 0.0
        parts[w] = 1.0 if n else 0.0
        here = 0
        for _ in range(n - 1):
            is_in[here] = True
            following = -1
            least = np.inf
            for i in range(n):
                if not is_in[i]:
                    nearest[i] = min(nearest[i], square(place, i, here))
                    if following < 0 or nearest[i] < least:
                        following, least = i, nearest[i]
            here = following
            link = math.sqrt(least)
            longest[w] = max(longest[w], link)
            if link > reach:
                parts[w] += 1.0


@kernel("F I f8 Fw")
def extreme(values, start, sign, out):
    """Least of sign * values of each world, times sign; sign * inf without values. Those of world w are start[w] to start[w + 1]."""
    for w in range(len(out)):
        least = np.inf
        for k in range(start[w], start[w + 1]):
            least = min(least, sign * values[k])
        out[w] = sign * least


@kernel("F2 f8 f8 f8 Fw")
def distance_to(vectors, x, y, z, out):
    """Distances of vectors (3, n) from a point, (n,)."""
    for i in range(len(out)):
        dx = vectors[0, i] - x
        dy = vectors[1, i] - y
        dz = vectors[2, i] - z
        out[i] = math.sqrt(dx * dx + dy * dy + dz * dz)


@kernel("F2 I F2 f8 I I2w Fw")
def covered(pos, start, places, reach, step, since, out):
    """Share of places of which an entity has been nearer than a distance, up to moments of games, those of a game in order.

    Args:
        pos: Positions [m], (3, n), by world.
        start: Entities of world w are the columns start[w] to start[w + 1].
        places: The places [m], (k, m); the first k components of a position are compared.
        reach: The distance [m].
        step: Step of each world, (n_worlds,).
        since: Step since which each place is covered, or `NEVER`, (n_worlds, m); (1, m) if all worlds are moments of one game.
        out: Receives the share, (n_worlds,).
    """
    for w in range(len(out)):
        first, n = since[w] if len(since) > 1 else since[0], 0
        for k in range(places.shape[1]):
            if first[k] >= step[w]:
                first[k] = NEVER
                for i in range(start[w], start[w + 1]):
                    distance = 0.0
                    for c in range(places.shape[0]):
                        distance += (pos[c, i] - places[c, k]) * (pos[c, i] - places[c, k])
                    if distance < reach * reach:
                        first[k] = step[w]
                        break
            n += first[k] <= step[w]
        out[w] = n / places.shape[1]
