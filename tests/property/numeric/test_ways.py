"""Nearest distances along straight ways, against many points of them."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tussle.numeric.ways import closest_approach, turn

N, FINE = 50, 4001


@given(st.integers(0, 10_000), st.sampled_from([1e-3, 1.0, 1e3]))
def test_the_closest_approach_is_the_least_distance_of_all_points_of_the_way(seed, length):
    chance = np.random.default_rng(seed)
    offset, way, first = (
        chance.normal(0, 1, (3, N)),
        chance.normal(0, length, (3, N)),
        chance.uniform(0, 1, N),
    )
    way[:, 0] = 0.0
    for begin in (np.zeros(N), first):
        part, distance = closest_approach(offset, way, begin)
        parts = begin + (1.0 - begin) * np.linspace(0, 1, FINE)[:, None]
        fine = np.sqrt(((offset[:, None] + parts * way[:, None]) ** 2).sum(axis=0)).min(axis=0)
        assert (distance <= fine * (1.0 + 1e-12)).all()
        assert (fine - distance <= np.sqrt((way**2).sum(axis=0)) / FINE).all()
        assert ((part >= begin) & (part <= 1.0)).all()


@given(st.floats(-3.0, 3.0), st.floats(0.0, 6.0))
def test_a_turn_is_the_angle_between(angle, at):
    begin = np.array([[np.cos(at)], [np.sin(at)]])
    end = 3.0 * np.array([[np.cos(at + angle)], [np.sin(at + angle)]])
    assert np.isclose(turn(begin, end)[0], angle)
