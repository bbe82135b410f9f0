"""The search of eight agents at a time finds what sorting all distances does, also equal distances, small teams and far radii."""

import numpy as np
import pytest

from tussle.numeric.kernel import kernel
from tussle.numeric.neighbors.index import Index
from tussle.numeric.neighbors.lane_count import LANES
from tussle.numeric.neighbors.nearest_lanes import NONE, find_nearest
from tussle.numeric.neighbors.search import ANY, DIFFERENT, SAME


@kernel("(I2 I2 F2) (I I I I F2 F) (i8 f8 i8) i8 F2w I2w")
def ranks_of(blocks, index, options, n_blocks, square, rank):
    """Squared distance and rank of the k nearest entities of team 1 of each place, (LANES, n); -1 for missing ones."""
    cuts, spans, points = blocks
    strip_world, order, world_start, keys, placed, team = index
    mode, radius, k = options
    kept, wanted = np.empty((LANES, LANES)), np.ones(LANES)
    table = world_start, keys, (placed[0], placed[1], placed[2]), team
    for b in range(n_blocks):
        w = strip_world[cuts[2, b]]
        span, candidates = (cuts[3, b], cuts[4, b]), (cuts[0], spans[0], spans[1], points)
        find_nearest(cuts[1, b], span, w, candidates, table, mode, wanted, radius, k, kept)
        for q in range(cuts[1, b], cuts[1, b + 1]):
            for j in range(k):
                key = kept[j, q - cuts[1, b]]
                square[j, order[cuts[0, q]]] = key
                bits = 0
                while (1 << bits) < world_start[w + 1] - world_start[w] or bits == 0:
                    bits += 1
                whole = kept.view(np.int64)[j, q - cuts[1, b]]
                rank[j, order[cuts[0, q]]] = whole & ((1 << bits) - 1) if key < NONE else -1


@pytest.mark.parametrize("k", range(1, LANES + 1))
@pytest.mark.parametrize("is_grid", [False, True])
def test_the_nearest_of_each_lane(is_grid, k):
    chance, sizes = np.random.default_rng(5), (1, 5, 110, 300)
    n = sum(sizes)
    pos = chance.uniform(-40, 40, (3, n))
    if is_grid:  # many equal distances: the lower rank is first
        pos = np.round(pos / 10.0) * 10.0
    world = np.repeat(np.arange(len(sizes)), sizes)
    ids = np.concatenate([chance.permutation(m) + 1 for m in sizes])
    team = chance.integers(0, 3, n)
    index = Index()
    index.layout(world, ids, len(sizes))
    for radius in (np.inf, 12.0):
        index.build(*pos, np.full(len(sizes), radius))
        starts, keys, strips, _, _, points = index.table
        blocks, by_place = index.blocks(0, n), index.gather(team.astype(float))
        table = strips[1], index.order, starts, keys, points, by_place
        for mode in (ANY, SAME, DIFFERENT):
            square, rank = np.zeros((LANES, n)), np.zeros((LANES, n), np.int64)
            arrays = blocks.cuts, blocks.spans, blocks.points
            ranks_of(arrays, table, (mode, radius, k), blocks.n_blocks, square, rank)
            counts = {ANY: team >= 0, SAME: team == 1, DIFFERENT: team != 1}[mode]
            for i in range(n):
                squares = ((pos - pos[:, i : i + 1]) ** 2).sum(axis=0)
                others = np.flatnonzero((world == world[i]) & counts & (squares < radius**2))
                others = others[others != i]
                first = others[np.lexsort((ids[others], squares[others]))][:k]
                assert rank[:k, i].tolist() == [*(ids[first] - 1), *[-1] * (k - len(first))]
                np.testing.assert_allclose(square[: len(first), i], squares[first], rtol=1e-12, atol=1e-300)
