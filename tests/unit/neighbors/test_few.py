"""The branch-free selection finds the places of the sorted insertion, also of equal distances, small teams and far radii."""

import numpy as np
import pytest

from tussle.neighbors import few
from tussle.neighbors.few import nearest_few, scratch_of
from tussle.neighbors.index import Index
from tussle.neighbors.search import ANY, DIFFERENT, SAME, TABLE, nearest_places, table_of
from tussle.numeric.kernel import kernel


@kernel(f"F2 (I I) {TABLE} (i8 i8) f8 I2w")
def both(pos, rows, arrays, options, radius, out):
    """Places by selection, then by insertion, (2 k, n)."""
    row_world, place = rows
    k, mode = options
    table = table_of(arrays)
    scratch = scratch_of(k, row_world.shape[0])
    for i in range(row_world.shape[0]):
        w, me, x, y, z = row_world[i], place[i], pos[0, i], pos[1, i], pos[2, i]
        nearest_few(w, me, x, y, z, radius, mode, 1.0, table, scratch, k)
        for j in range(k):
            out[j, i] = scratch[2][j]
        best, ranks, places = np.empty(k), np.empty(k, np.int64), np.empty(k, np.int64)
        nearest_places(w, me, x, y, z, mode, 1.0, table, best, ranks, places, k)
        for j in range(k):
            out[k + j, i] = places[j] if best[j] < radius * radius else -1


@pytest.mark.parametrize("sizes", [(1, 5, 110), (700, 30)])
@pytest.mark.parametrize("is_grid", [False, True])
def test_selection_equals_insertion(sizes, is_grid):
    chance, n = np.random.default_rng(5), sum(sizes)
    pos = chance.uniform(-40, 40, (3, n))
    if is_grid:  # many equal distances
        pos = np.round(pos / 10.0) * 10.0
    world = np.repeat(np.arange(len(sizes)), sizes)
    ids = np.concatenate([chance.permutation(m) + 1 for m in sizes])
    team = np.zeros(n + 8)[:n]
    team[:] = chance.integers(0, 3, n)
    index = Index()
    index.layout(world, ids, len(sizes))
    for reach in (np.inf, 15.0):
        index.build(*pos, np.full(len(sizes), reach))
        by_place = np.zeros(n + 8)[:n]
        by_place[:] = team[index.order]
        for k in (1, 3, 8, 13, few.LARGEST_K + 1):
            for mode in (ANY, SAME, DIFFERENT):
                for radius in (np.inf, 12.0):
                    out = np.zeros((2 * k, n), np.int64)
                    both(
                        pos, (index.row_world, index.place), (*index.table, by_place), (k, mode), radius, out
                    )
                    np.testing.assert_array_equal(out[:k], out[k:])
