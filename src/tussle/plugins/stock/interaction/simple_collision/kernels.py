"""Search for pairs that come within range on straight ways."""

import math

import numpy as np

from tussle.numeric.kernel import kernel
from tussle.numeric.neighbors.search import ANY, TABLE, in_range, table_of

FAR = 1e150
"""Length of a way that does not count [m]: its square would overflow."""


@kernel("F2 F2 Fw -> f8")
def measure(pos, start, far):
    """Write the lengths of the straight ways from `start` to `pos`, (3, n), to `far`, (n,) [m]; returns the greatest."""
    longest = 0.0
    for i in range(far.shape[0]):
        x, y, z = pos[0, i] - start[0, i], pos[1, i] - start[1, i], pos[2, i] - start[2, i]
        way = math.sqrt(x * x + y * y + z * z)
        far[i] = way if way < FAR else 0.0
        longest = max(longest, far[i])
    return longest


@kernel(f"(F2 F2 F) F (B B) (I I I I I) {TABLE} (Iw Iw) -> i8")
def swept_pairs(ways, limit, enabled, rows, arrays, pairs):
    """Collect the pairs of entities that come nearer than `limit` on their straight ways in a step.

    The one of a pair that moves farther finds it, within its limit and twice the length of its way.

    Args:
        ways: Positions at the end and at the start of the step [m], (3, n) each, and lengths of the ways between, (n,).
        limit: Distance below which entities meet [m], (n,).
        enabled: Whether team mates, and entities of different teams, count, (n,).
        rows: id, team, world and place of each row; row of each place.
        arrays: Neighbour index of the positions at the end, and team of each place.
        pairs: Rows with the smaller and the larger id of each pair, as many as fit; written.

    Returns:
        Number of pairs, which may exceed the room for them.
    """
    pos, start, far = ways
    mates, strangers = enabled
    ids, team, world, place, order = rows
    table = table_of(arrays)
    first, second = pairs
    n = limit.shape[0]
    places = np.empty(n, np.int64)
    n_pairs = np.int64(0)
    for i in range(n):
        reach = limit[i] + (2.0 + 1e-9) * far[i]
        m = in_range(
            world[i], place[i], pos[0, i], pos[1, i], pos[2, i], reach, ANY, 0.0, table, places, np.int64(0)
        )
        for k in range(m):
            j = order[places[k]]
            if far[j] > far[i] or (far[j] == far[i] and ids[j] < ids[i]):
                continue
            if not (mates[i] if team[i] == team[j] else strangers[i]):
                continue
            x, y, z = pos[0, j] - pos[0, i], pos[1, j] - pos[1, i], pos[2, j] - pos[2, i]
            if not math.sqrt(x * x + y * y + z * z) < limit[i]:
                if not far[i] > 0.0:
                    continue
                u, v, w = (
                    x - (start[0, j] - start[0, i]),
                    y - (start[1, j] - start[1, i]),
                    z - (start[2, j] - start[2, i]),
                )
                square = u * u + v * v + w * w
                if not square > 0.0:
                    continue
                part = min((x * u + y * v + z * w) / square, 1.0)  # of the way, back from its end
                if not part > 0.0:
                    continue
                x, y, z = x - part * u, y - part * v, z - part * w
                if not math.sqrt(x * x + y * y + z * z) < limit[i]:
                    continue
            if n_pairs < first.shape[0]:
                first[n_pairs], second[n_pairs] = (i, j) if ids[i] < ids[j] else (j, i)
            n_pairs += 1
    return n_pairs
