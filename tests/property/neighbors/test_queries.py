"""Pairs and nearest against brute force, and a world's results in any stack, on layouts with many ties and clusters."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from neighbor_stacks import stack

from tussle.numeric.arrays import segment_first_min, segment_mean, segment_min, segment_sum
from tussle.numeric.neighbors import nearest, pairs, search

RADIUS = 5.0
QUICK = settings(max_examples=40, derandomize=True)


@st.composite
def layouts(draw, least=1, most=60):
    """Positions (3, n): grids with exact ties, clusters, normal clouds, lines of points far out."""
    n = draw(st.integers(least, most))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    kind = draw(st.sampled_from(["grid", "cluster", "cloud", "far", "line"]))
    if kind == "grid":
        return rng.integers(-4, 5, (3, n)).astype(float)
    if kind == "cluster":
        return np.repeat(rng.normal(size=(3, 1)) * 1000.0, n, axis=1)
    if kind == "cloud":
        return rng.normal(size=(3, n)) * 8.0
    if kind == "far":
        return rng.normal(size=(3, n)) * 4.0 + 10.0 ** rng.integers(3, 12)
    return np.stack([np.arange(n) * 2.5, np.zeros(n), np.zeros(n)])


def check_pairs(s, index, team, teams):
    n = s.pos.shape[1]
    found = pairs(index, 0, n, *s.pos, np.full(n, RADIUS), team, teams)
    for row in range(n):
        near, square = s.near(row, RADIUS)
        near = near[passes(team, teams, row)[near]]
        near = near[np.argsort(index.place[near])]
        mine = slice(found.start[row], found.start[row + 1])
        np.testing.assert_array_equal(found.other[mine], near)
        np.testing.assert_array_equal(found.distance[mine], np.sqrt(square[near]))
        np.testing.assert_array_equal(found.offset[:, mine], s.pos[:, near] - s.pos[:, [row]])
        assert found.count[row] == len(near)


def passes(team, teams, row):
    if teams is None:
        return np.ones(len(team), bool)
    return {"own": team == team[row], "other": team != team[row], 2: team == 2}[teams]


def check_nearest(s, index, team, teams, k):
    n = s.pos.shape[1]
    other, distance = nearest(index, 0, n, *s.pos, k, team, teams)
    for row in range(n):
        _, square = s.near(row, RADIUS)
        candidates = np.flatnonzero(
            (s.world == s.world[row]) & passes(team, teams, row) & (np.arange(n) != row)
        )
        expected = candidates[np.lexsort((s.ids[candidates], square[candidates]))][:k]
        np.testing.assert_array_equal(other[: len(expected), row], expected)
        assert (other[len(expected) :, row] == -1).all()
        np.testing.assert_array_equal(distance[: len(expected), row], np.sqrt(square[expected]))


@given(
    st.lists(layouts(), min_size=1, max_size=3), st.sampled_from([None, "own", "other", 2]), st.integers(1, 4)
)
@QUICK
def test_pairs_and_nearest_equal_brute_force(worlds, teams, k):
    s = stack(worlds, groups=2)
    team = s.source % 3
    index = s.index(RADIUS)
    check_pairs(s, index, team, teams)
    check_nearest(s, index, team, teams, k)


@pytest.mark.parametrize("teams", [None, "own", 2])
def test_expanding_search_equals_brute_force_in_a_large_world(teams):
    rng = np.random.default_rng(1)
    pos = rng.integers(-150, 150, (3, search.SMALL_WORLD + 500)).astype(float)
    pos[:2, :3] = 1e5, 1e9, -1e18
    s = stack([pos])
    index = s.index(8.0)
    team = (rng.random(len(s.ids)) < 0.02) * 2
    rows = np.arange(0, len(s.ids), 40)
    other, _ = nearest(index, 0, len(s.ids), *s.pos, 3, team, teams)
    for row in rows:
        _, square = s.near(row, 1.0)
        candidates = np.flatnonzero(passes(team, teams, row) & (np.arange(len(s.ids)) != row))
        np.testing.assert_array_equal(
            other[:, row], candidates[np.lexsort((s.ids[candidates], square[candidates]))][:3]
        )


@given(st.lists(layouts(), min_size=2, max_size=4), st.booleans())
@QUICK
def test_a_world_in_a_stack_gives_the_bits_it_gives_alone(worlds, reverse_groups):
    s = stack(worlds, groups=3, reverse_groups=reverse_groups)
    n = s.pos.shape[1]
    index = s.index(RADIUS)
    found = pairs(index, 0, n, *s.pos, np.full(n, RADIUS))
    sums = np.empty(n)
    segment_sum(found.start, found.offset[0].copy(), sums)
    for w, pos in enumerate(worlds):
        alone = stack([pos])
        single = alone.index(RADIUS)
        m = pos.shape[1]
        expected = pairs(single, 0, m, *alone.pos, np.full(m, RADIUS))
        alone_sums = np.empty(m)
        segment_sum(expected.start, expected.offset[0].copy(), alone_sums)
        for row in np.flatnonzero(s.world == w):
            mine = slice(found.start[row], found.start[row + 1])
            own = s.source[row]
            theirs = slice(expected.start[own], expected.start[own + 1])
            np.testing.assert_array_equal(s.source[found.other[mine]], expected.other[theirs])
            assert sums[row].tobytes() == alone_sums[own].tobytes()


@given(st.integers(0, 2**32), st.integers(2, 500), st.sampled_from([0.01, 3.0, 200.0]))
@QUICK
def test_order_does_not_depend_on_history(seed, n, stride):
    rng = np.random.default_rng(seed)
    s = stack([rng.normal(size=(3, n)) * 60.0], groups=2)
    index = s.index(20.0)
    for _ in range(5):
        s.pos = s.pos + rng.normal(size=(3, n)) * stride
        index.build(*s.pos, np.full(1, 20.0))
        np.testing.assert_array_equal(index.order, s.index(20.0).order)


@given(st.integers(0, 2**32), st.integers(1, 80))
@QUICK
def test_order_survives_deaths_and_births(seed, n):
    rng = np.random.default_rng(seed)
    s = stack([rng.normal(size=(3, n)) * 40.0, rng.normal(size=(3, n)) * 40.0], groups=2)
    index = s.index(20.0)
    for _ in range(3):
        keep = rng.random(len(s.ids)) < 0.7
        ids = np.append(s.ids[keep], 10_000 + rng.integers(1000))
        world = np.append(s.world[keep], rng.integers(2))
        pos = np.ascontiguousarray(np.hstack([s.pos[:, keep], rng.normal(size=(3, 1)) * 40.0]))
        s.ids, s.world, s.pos = ids, world, pos
        index.layout(s.world, s.ids, 2)
        index.build(*s.pos, np.full(2, 20.0))
        np.testing.assert_array_equal(index.order, s.index(20.0).order)


@given(st.lists(st.integers(0, 6), min_size=1, max_size=30), st.integers(0, 2**32))
@QUICK
def test_segments_are_sums_one_after_another(counts, seed):
    start = np.concatenate([[0], np.cumsum(counts)])
    values = np.random.default_rng(seed).normal(size=start[-1]) * 1e3
    n = len(counts)
    total, mean, least, first = np.empty(n), np.empty(n), np.empty(n), np.empty(n, np.int64)
    segment_sum(start, values, total)
    segment_mean(start, values, mean, -1.0)
    segment_min(start, values, least, np.inf)
    segment_first_min(start, values, first)
    for i in range(n):
        mine = values[start[i] : start[i + 1]]
        expected = 0.0
        for value in mine:
            expected += value
        assert total[i] == expected
        assert mean[i] == (expected / len(mine) if len(mine) else -1.0)
        assert least[i] == (mine.min() if len(mine) else np.inf)
        assert first[i] == (start[i] + mine.argmin() if len(mine) else -1)
