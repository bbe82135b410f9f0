"""Searches for the nearest others of each agent, which start from the distances of the last search and are shared within a step.

Whoever is nearest now was about as far away at the last decision. So a search takes all within a distance that is a little larger than
that of the last k-th other, which are few, and sorts these without branches. If they are fewer than k, it takes a larger distance: the
result is that of a full search in every bit, whatever the guess was.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tussle.numeric.kernel import kernel, lean_device
from tussle.numeric.neighbors.kernels import rank_bits
from tussle.numeric.neighbors.lane_count import LANES
from tussle.numeric.neighbors.lanes import bits, choose, load, lowest, splat, store
from tussle.numeric.neighbors.search import DIFFERENT, SAME, TABLE, table_of

GUESS = 1.1
"""Distance of the next search over that of the last k-th other, and its factor while too few are found: 1.5."""
MAX_RANKED = 48
"""Candidates that are compared all with all, instead of inserted one after another."""


@lean_device
def put_key(key, item, n, keys, items):
    """Insert a key and its item into the sorted lists keys[:n] and items[:n]."""
    p = n
    while p > 0 and keys[p - 1] > key:
        keys[p], items[p] = keys[p - 1], items[p - 1]
        p -= 1
    keys[p], items[p] = key, item


@lean_device
def scan_world(me, x, y, z, radius, mode, wanted, table, start, end, found):
    """Write the places in [start, end) nearer than the radius, without `me`, to `found`; returns how many.

    It tests 64 places before it looks at the result: each look is a branch that the processor cannot predict.
    """
    sx, sy, sz, team = table[5], table[6], table[7], table[8]
    radius2, n = radius * radius, 0
    for first in range(start, end, 64):
        word = np.uint64(0)
        for p in range(first, min(first + 64, end), LANES):
            dx, dy, dz = load(sx, p) - x, load(sy, p) - y, load(sz, p) - z
            hit = dx * dx + dy * dy + dz * dz < radius2
            if mode == SAME:
                hit = hit & (load(team, p) == wanted)
            elif mode == DIFFERENT:
                hit = hit & (load(team, p) != wanted)
            word |= np.uint64(bits(hit)) << np.uint64(p - first)
        if end - first < 64:
            word &= (np.uint64(1) << np.uint64(end - first)) - np.uint64(1)
        if first <= me < first + 64:
            word &= ~(np.uint64(1) << np.uint64(me - first))
        while word != 0:
            found[n] = first + lowest(np.int64(word))
            word &= word - np.uint64(1)
            n += 1
    return n


@lean_device
def sort_keys(keys, items, n, k, places, sorted_keys, sorted_items):
    """Write the k smallest of n different keys, and their items, in order; the rest of the n places may be written, too."""
    if n > MAX_RANKED:
        for i in range(n):
            if i < k:
                put_key(keys[i], items[i], i, sorted_keys, sorted_items)
            elif keys[i] < sorted_keys[k - 1]:
                put_key(keys[i], items[i], k - 1, sorted_keys, sorted_items)
        return
    for first in range(0, n, LANES):
        mine, smaller = load(keys, first), splat(0.0)
        for j in range(n):
            smaller = smaller + choose(mine > keys[j], splat(1.0), splat(0.0))
        store(places, first, smaller)
    for i in range(n):
        at = np.uint64(places[i])
        sorted_keys[at], sorted_items[at] = keys[i], items[i]


@kernel(f"F2 (I I F) (I I I) {TABLE} (i8 i8 f8) Fw (i8 i8) I2w")
def find_nearest(floats, who, places, arrays, numbers, guesses, part, near):
    """Write the rows of the k nearest others within a radius to near, (m, k), nearest first; -1 for those that are missing.

    who: rows, agents, and what each looks for, (m,). places, arrays: as in `kernels.nearest_apart`; a world is one cell of the index.
    numbers: k, mode of the teams, radius [m]. guesses: distance that is searched first by agent [m]; set for the next search. part:
    agents [begin, end) of those in `who`.
    """
    source, ids, wanted = who
    row_world, place, order = places
    k, mode, radius = numbers
    table = table_of(arrays)
    world_start, keys, sx, sy, sz = table[0], table[1], table[5], table[6], table[7]
    room = order.shape[0] + LANES
    other, sorted_rows = np.empty(room, np.int64), np.empty(room, np.int64)
    squares, ranks, sorted_keys = np.empty(room), np.empty(room), np.empty(room)
    whole = squares.view(np.int64)
    for i in range(part[0], part[1]):
        row, a = source[i], ids[i]
        w, me, x, y, z = row_world[row], place[row], floats[0, row], floats[1, row], floats[2, row]
        start, end = world_start[w], world_start[w + 1]
        shift = rank_bits(end - start)
        mask = (1 << shift) - 1
        reach = min(guesses[a], radius)
        n = scan_world(me, x, y, z, reach, mode, wanted[i], table, start, end, other)
        while n < k and reach < radius:
            reach = min(1.5 * reach if reach < 1e150 else np.inf, radius)
            n = scan_world(me, x, y, z, reach, mode, wanted[i], table, start, end, other)
        for j in range(n):
            q = np.uint64(other[j])
            dx, dy, dz = x - sx[q], y - sy[q], z - sz[q]
            squares[j] = dx * dx + dy * dy + dz * dz
        for j in range(n):
            q = np.uint64(other[j])
            whole[j] = (whole[j] >> shift << shift) | (keys[q] & mask)
            other[j] = order[q]
        sort_keys(squares, other, n, k, ranks, sorted_keys, sorted_rows)
        for j in range(k):
            near[i, j] = sorted_rows[j] if j < n else -1
        if n >= k:
            guesses[a] = GUESS * math.sqrt(sorted_keys[k - 1]) + 1e-3


class SharedSearches:
    """What searches of the agents of a stack of worlds keep: guesses from step to step, and results within a step.

    Args:
        n_agents: Agents of all worlds.
    """

    def __init__(self, n_agents: int) -> None:
        self._n_agents = n_agents
        self._guesses: dict[Any, np.ndarray] = {}
        self._results: dict[Any, tuple[int, np.ndarray, np.ndarray]] = {}

    def nearest(
        self, bodies: Any, of: Any, who: tuple[np.ndarray, np.ndarray, np.ndarray], places: Any, arrays: Any,
        numbers: tuple[int, int, float], split: Any,
    ) -> np.ndarray:  # fmt: skip
        """Rows of the nearest others of some agents, (m, k or more), nearest first; -1 where there are fewer.

        Args:
            bodies: The body table.
            of: Name of the others.
            who: Rows and agents, and what each looks for, (m,) each.
            places: row_world, place and order of the index; arrays: its table.
            numbers: Number of others k, mode of the search, and radius [m].
            split: Calls a function for parts of the agents in several threads.
        """
        rows = who[0]
        k, mode, radius = numbers
        version, known, near = self._results.get((of, radius), (-1, None, np.zeros((0, 0), np.int64)))
        if version == bodies.version and known is rows and near.shape[1] >= k:
            return near
        k = max(k, near.shape[1])  # so that the first search of the next step serves all that follow
        guesses = self._guesses.get((of, radius))
        if guesses is None:
            guesses = self._guesses[of, radius] = np.full(self._n_agents, np.inf)
        near = np.empty((len(rows), k), np.int64)
        split(
            len(rows),
            lambda *part: find_nearest(
                bodies.floats, who, places, arrays, (k, mode, radius), guesses, part, near
            ),
        )
        self._results[of, radius] = bodies.version, rows, near
        return near


__all__ = ["SharedSearches"]
