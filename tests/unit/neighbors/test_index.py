"""The index on layouts that break naive grids."""

import numpy as np
import pytest
from neighbor_stacks import block_candidates, stack

from tussle.numeric.neighbors import Index, nearest, pairs

RNG = np.random.default_rng(3)


def check_blocks(s, index, reach, first, last):
    places = []
    for place, candidates in block_candidates(index.blocks(first, last)):
        row = index.order[place]
        near, _ = s.near(row, reach)
        assert np.isin(index.place[near], candidates).all()
        assert (np.diff(candidates) > 0).all()
        assert (s.world[index.order[candidates]] == s.world[row]).all()
        places.append(place)
    assert sorted(index.order[places]) == list(range(first, last))


@pytest.mark.parametrize("n", [1, 2, 8, 9, 110, 500])
def test_blocks_hold_every_neighbour_of_every_query_once(n):
    s = stack([RNG.normal(size=(3, n)) * 300.0, RNG.normal(size=(3, n)) * 50.0], groups=2)
    index = s.index(100.0)
    check_blocks(s, index, 100.0, 0, 2 * n)
    check_blocks(s, index, 100.0, n // 2, n)


def test_order_is_cell_row_then_cell_then_id():
    pos = RNG.normal(size=(3, 600)) * 300.0
    s = stack([pos], groups=3)
    index = s.index(100.0)
    cells = np.floor(s.pos[:2] * index.inverse_cell[0])
    np.testing.assert_array_equal(index.order, np.lexsort((s.ids, cells[0], cells[1])))
    np.testing.assert_array_equal(index.place[index.order], np.arange(600))
    np.testing.assert_array_equal(index.points[0, :600], s.pos[0][index.order])


def test_far_entities_cost_no_memory_and_are_found():
    pos = RNG.normal(size=(3, 600)) * 100.0
    pos[:, 0] = 1e300, -1e300, 0.0
    pos[:, 1] = 3e12, 5e11, 0.0
    pos[:, 2] = 3e12 + 1.0, 5e11, 0.0
    s = stack([pos])
    index = s.index(50.0)
    check_blocks(s, index, 50.0, 0, 600)
    assert nearest(index, 1, 2, *s.pos[:, 1:2].copy())[0][0, 0] == 2


def test_nan_neither_hangs_nor_hides_the_others():
    pos = RNG.normal(size=(3, 600)) * 100.0
    pos[0, 5] = pos[1, 17] = pos[2, 30] = np.nan
    pos[:, 40] = np.inf
    s = stack([pos])
    index = s.index(50.0)
    found = pairs(index, 0, 600, *s.pos, np.full(600, 50.0))
    for row in range(600):
        near, _ = s.near(row, 50.0)
        assert set(found.other[found.row == row]) == set(near)
    assert (nearest(index, 0, 600, *s.pos)[0][0, [5, 17, 30]] == -1).all()


@pytest.mark.parametrize("reach", [0.0, 1e-9, 1e300, np.inf])
def test_any_reach_is_correct(reach):
    s = stack([RNG.normal(size=(3, 450)) * 10.0, np.zeros((3, 5))])
    check_blocks(s, s.index(reach), reach, 0, 455)


def test_coincident_entities_are_ordered_by_id():
    s = stack([np.zeros((3, 30))], groups=2, reverse_groups=True)
    index = s.index(10.0)
    assert (np.diff(s.ids[index.order]) > 0).all()
    other, distance = nearest(index, 0, 30, *s.pos, k=2)
    assert (distance == 0.0).all()
    assert (s.ids[other[0]] == np.where(s.ids == 1, 4, 1)).all()


def test_empty_worlds_and_tables():
    index = Index()
    index.layout(np.zeros(0, np.int64), np.zeros(0, np.int64), 2)
    index.build(np.zeros(0), np.zeros(0), np.zeros(0), np.ones(2))
    assert index.blocks(0, 0, lambda n, run: run(0, n)).n_blocks == 0
    index.build(np.zeros(0), np.zeros(0), np.zeros(0), np.ones(2))
    assert index.blocks(0, 0).n_blocks == 0
    s = stack([np.zeros((3, 0)), np.ones((3, 1)), np.zeros((3, 0))])
    index = s.index(10.0)
    assert index.blocks(0, 1).n_blocks == 1
    assert pairs(index, 0, 1, *s.pos, np.ones(1)).other.size == 0
    assert nearest(index, 0, 1, *s.pos)[0][0, 0] == -1


def test_moved_rows_keep_their_places_with_one_cell_per_world():
    s = stack([RNG.normal(size=(3, 20)), RNG.normal(size=(3, 20))], groups=20)
    index = s.index(np.inf)
    blocks = index.blocks(4, 6)
    assert blocks.n_blocks == 2
    x = np.zeros(40)
    x[4:6] = 7.0, 8.0
    index.update(4, 6, x, np.zeros(40), np.zeros(40))
    assert (index.points[0, index.place[[4, 5]]] == [7.0, 8.0]).all()
    again = index.blocks(4, 6)
    assert again.spans is blocks.spans
    assert sorted(again.points[0, :2]) == [7.0, 8.0]


def test_unknown_team_filter_is_refused():
    s = stack([np.zeros((3, 2))])
    index = s.index(1.0)
    with pytest.raises(ValueError, match="teams='own' needs the argument team"):
        nearest(index, 0, 2, *s.pos, teams="own")
    with pytest.raises(ValueError, match=r"'mine' must be None"):
        nearest(index, 0, 2, *s.pos, team=np.ones(2, np.int64), teams="mine")
