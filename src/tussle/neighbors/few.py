"""The k nearest of some candidates, without branches that depend on the data.

`search.nearest_places` inserts candidates into a sorted list; each insertion costs a few mispredicted branches, so that with k = 8 of
110 entities it takes 1.2 us. Here the two smallest distances per lane bound the k-th nearest distance, few candidates are nearer than
the bound, and each of these counts how many are nearer than itself: 0.3 us. Equal distances are left to `nearest_places`, so that the
results are the same bits.
"""

from __future__ import annotations

import numpy as np

from tussle.neighbors.lane_count import LANES
from tussle.neighbors.lanes import below, bits, choose, lane_of, load, lowest, number, splat, store
from tussle.neighbors.search import DIFFERENT, SAME, in_range, nearest_places, squares
from tussle.numeric.kernel import device

MOST = 64
"""Candidates within the bound that are compared pairwise; with more, the insertion of `nearest_places` is faster."""
LARGEST_K = 2 * LANES
FINITE = float(np.finfo(np.float64).max)
WHOLE_WORLD = 500
"""Up to this many entities, all of a world are candidates, which takes 0.1 us; of larger worlds those within the radius."""


@device
def all_squares(me, x, y, z, radius2, mode, wanted, table, start, end, near):
    """Write squared distances of the places [start, end) to `near`, inf for the place `me` and those that do not count."""
    sx, sy, sz, team = table[5], table[6], table[7], table[8]
    for p in range(start, end, LANES):
        square = squares(sx, sy, sz, p, x, y, z)
        if mode == SAME:
            square = choose(load(team, p) == wanted, square, splat(np.inf))
        elif mode == DIFFERENT:
            square = choose(load(team, p) != wanted, square, splat(np.inf))
        square = choose(below(end - p), square, splat(np.inf))
        store(near, p - start, choose(square < radius2, square, splat(np.inf)))
    if start <= me < end:
        near[me - start] = np.inf


@device
def bound_of(near, n, k, pair):
    """A squared distance that at least k <= LARGEST_K of n candidates do not exceed; inf if there may be fewer.

    It is the k-th smallest of the two smallest of each lane. pair: scratch (LARGEST_K,).
    """
    low, high = splat(np.inf), splat(np.inf)
    for p in range(0, n, LANES):
        square = load(near, p)
        larger = choose(square < low, low, square)
        low = choose(square < low, square, low)
        high = choose(larger < high, larger, high)
    store(pair, 0, low)
    store(pair, LANES, high)
    n_low, n_high = splat(0.0), splat(0.0)
    for j in range(LARGEST_K):
        square = splat(pair[j])
        n_low += number(square < low)
        n_high += number(square < high)
    low, high = choose(n_low < float(k), low, splat(0.0)), choose(n_high < float(k), high, splat(0.0))
    most = choose(low < high, high, low)
    bound = 0.0
    for lane in range(LANES):
        bound = max(bound, lane_of(most, lane))
    return bound


@device
def select(near, n, listed, first, k, few, order, few_places, best, places):
    """Write the k nearest of n candidates by squared distance; -1 if there are fewer. Returns false for equal distances and large n.

    near: squared distances, inf for none, padded with inf to LANES. Their places are those from `first` on, or in `listed` if it is -1.
    few, order: scratch (MOST + LANES,); few_places: (MOST,).
    """
    for j in range(k):
        best[j] = np.inf
        places[j] = -1
    bound, m = bound_of(near, n, k, order), 0
    bound = min(bound, FINITE)
    for base in range(
        0, n, 64
    ):  # the hits of 64 candidates as one number: one loop whose length the CPU mispredicts
        hits = 0
        for p in range(base, min(base + 64, n), LANES):
            hits |= bits(load(near, p) <= bound) << (p - base)
        while hits != 0:
            i = base + lowest(hits)
            hits &= hits - 1
            if m == MOST:
                return False
            few_places[m], few[m] = first + i if first >= 0 else listed[i], near[i]
            m += 1
    store(few, m, splat(np.inf))
    for p in range(0, m, LANES):
        square, n_nearer = load(few, p), splat(0.0)
        for j in range(m):
            n_nearer += number(splat(few[j]) < square)
        store(order, p, n_nearer)
    n_selected, total = 0, 0
    for i in range(m):
        at = int(order[i])
        if at < k:
            best[at], places[at] = few[i], few_places[i]
            n_selected += 1
            total += at
    wanted = min(m, k)
    return n_selected == wanted and 2 * total == wanted * (
        wanted - 1
    )  # equal distances have equal, smaller counts


@device
def nearest_few(w, me, x, y, z, radius, mode, wanted, table, scratch, k):
    """Write the k nearest places of world w within `radius` [m], by (squared distance, rank); -1 and inf if there are fewer.

    scratch: best (k,), ranks (k,), places (k,), near (n + LANES,), listed (n,), few and order (MOST + LANES,), few_places (MOST,)
    for worlds of up to n entities; the result is in best, squared distances, and places.
    """
    best, ranks, places, near, listed, few, order, few_places = scratch
    start, end = table[0][w], table[0][w + 1]
    n_all, fits = end - start, False
    if k <= LARGEST_K and n_all <= WHOLE_WORLD:
        all_squares(me, x, y, z, radius * radius, mode, wanted, table, start, end, near)
        fits = select(near, n_all, listed, start, k, few, order, few_places, best, places)
    elif k <= LARGEST_K and radius < np.inf:
        n = in_range(w, me, x, y, z, radius, mode, wanted, table, listed, 0)
        for i in range(n):
            dx, dy, dz = table[5][listed[i]] - x, table[6][listed[i]] - y, table[7][listed[i]] - z
            near[i] = dx * dx + dy * dy + dz * dz
        near[n : n + LANES] = np.inf
        fits = select(near, n, listed, -1, k, few, order, few_places, best, places)
    if not fits:
        nearest_places(w, me, x, y, z, mode, wanted, table, best, ranks, places, k)
        for j in range(k):
            if not best[j] < radius * radius:
                best[j], places[j] = np.inf, -1


@device
def scratch_of(k, n):
    """Scratch of `nearest_few` for worlds of up to n entities."""
    near, listed, few, order = (
        np.empty(n + LANES),
        np.empty(n, np.int64),
        np.empty(MOST + LANES),
        np.empty(MOST + LANES),
    )
    return (
        np.empty(k),
        np.empty(k, np.int64),
        np.empty(k, np.int64),
        near,
        listed,
        few,
        order,
        np.empty(MOST, np.int64),
    )
