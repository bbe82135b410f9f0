"""Random numbers: published vectors, statistics, and that nothing but the named draw decides a number."""

from __future__ import annotations

import numpy as np
import pytest

from tussle.numeric import rng
from tussle.numeric.kernel import kernel

FULL = 2**64 - 1
STREAM = rng.stream_key("predator", "Chaser", "aim")


@kernel("u8 u8 u8 u8 -> u8 u8")
def threefry(key0, key1, counter0, counter1):
    return rng.threefry(key0, key1, counter0, counter1)


@pytest.mark.parametrize(
    ("key", "counter", "expected"),  # Random123 1.14, tests/kat_vectors, threefry2x64 with 20 rounds
    [
        ((0, 0), (0, 0), (0xC2B6E3A8C2C69865, 0x6F81ED42F350084D)),
        ((FULL, FULL), (FULL, FULL), (0xE02CB7C4D95D277A, 0xD06633D0893B8B68)),
        (
            (0xA4093822299F31D0, 0x082EFA98EC4E6C89),
            (0x243F6A8885A308D3, 0x13198A2E03707344),
            (0x263C7D30BB0F0AF1, 0x56BE8361D3311526),
        ),
    ],
)
def test_published_vectors(key, counter, expected):
    assert threefry(*key, *counter) == expected


@kernel("u8 u8 u8 u8 u8 u8 -> u8 u8")
def bits(seed, stream, index, step, substep, draw):
    return rng.random_bits(seed, stream, index, step, substep, draw)


def test_counter_holds_index_step_substep_and_draw_in_their_bits():
    assert bits(3, 4, 5, 6, 7, 8) == threefry(3, 4, (5 << 32) | 6, (7 << 48) | 8)


def test_first_number_of_a_stream_is_frozen():
    # A change here changes every recorded run.
    assert STREAM == 0xC3A5C3668A7EF597
    expected = bits(11, STREAM, 2, 9, 1, 0)[0] >> 11
    assert rng.uniform(11, STREAM, 2, 9, 1)[0, 0] == expected * 2.0**-53


def test_streams_are_told_apart_by_every_name_and_its_length():
    keys = {
        rng.stream_key(*names)
        for names in [("a", "b"), ("ab",), ("a", "b", ""), ("", "ab"), ("ab", ""), ("b", "a")]
    }
    assert len(keys) == 6
    assert all(0 <= key < 2**64 for key in keys)
    assert rng.stream_key("a", "b", "c") == 0x2FD706211AC9BC0B


@pytest.mark.parametrize("fill", [rng.uniform, rng.normal])
@pytest.mark.parametrize("k", [1, 2, 3, 5])
def test_number_depends_on_its_own_row_only(fill, k):
    seeds, index, step = (
        np.repeat(np.arange(10, dtype=np.uint64), 7),
        np.tile(np.arange(7), 10),
        np.repeat(np.arange(10) % 3, 7),
    )
    whole = fill(seeds, STREAM, index, step, 0, k)
    order = np.random.default_rng(0).permutation(70)
    np.testing.assert_array_equal(
        fill(seeds[order], STREAM, index[order], step[order], 0, k), whole[:, order]
    )
    for i in (0, 13, 69):
        np.testing.assert_array_equal(fill(int(seeds[i]), STREAM, index[i], step[i], 0, k)[:, 0], whole[:, i])
    np.testing.assert_array_equal(fill(seeds, STREAM, index, step, 0, k + 1)[:k], whole)


@pytest.mark.parametrize(
    "change", [{"seeds": 8}, {"stream": STREAM ^ 1}, {"index": 1}, {"step": 5}, {"substep": 1}]
)
def test_each_part_of_the_name_gives_other_numbers(change):
    base = {"seeds": 7, "stream": STREAM, "index": 0, "step": 4, "substep": 0, "k": 100}
    assert not np.isin(rng.uniform(**base), rng.uniform(**(base | change))).any()


def test_uniform_numbers_are_uniform_and_independent():
    u = rng.uniform(1, STREAM, np.arange(50_000), 0, 0, 4)
    n = u.size
    assert u.min() >= 0.0
    assert u.max() < 1.0
    assert abs(u.mean() - 0.5) < 5.0 / (12.0 * n) ** 0.5
    counts = np.histogram(u, bins=64, range=(0.0, 1.0))[0]
    assert ((counts - n / 64) ** 2 / (n / 64)).sum() < 63 + 5 * (2 * 63) ** 0.5
    correlations = np.corrcoef(
        np.vstack(
            [u, rng.uniform(1, STREAM, np.arange(50_000), 1), rng.uniform(2, STREAM, np.arange(50_000), 0)]
        )
    )
    assert np.abs(correlations - np.eye(6)).max() < 5.0 / 50_000**0.5


def test_normal_numbers_are_normal_and_independent():
    z = rng.normal(1, STREAM, np.arange(100_000), 0, 0, 3)
    n = z.size
    assert abs(z.mean()) < 5.0 / n**0.5
    assert abs(z.var() - 1.0) < 5.0 * (2.0 / n) ** 0.5
    assert abs((z**3).mean()) < 5.0 * (15.0 / n) ** 0.5
    assert abs((z**4).mean() - 3.0) < 5.0 * (96.0 / n) ** 0.5
    assert np.isfinite(z).all()
    assert 4.0 < np.abs(z).max() < 8.5
    assert np.abs(np.corrcoef(z) - np.eye(3)).max() < 5.0 / 100_000**0.5
    for limit, share in ((1.0, 0.6826894921370859), (2.0, 0.9544997361036416), (3.0, 0.9973002039367398)):
        assert abs((np.abs(z) < limit).mean() - share) < 5.0 * (share * (1 - share) / n) ** 0.5


def test_scalar_functions_give_what_the_fills_give():
    @kernel("u8 u8 u8 u8 u8 u8 -> f8 f8 f8")
    def one(seed, stream, index, step, substep, draw):
        a, b = rng.normal2(seed, stream, index, step, substep, draw)
        return rng.uniform01(seed, stream, index, step, substep, draw), a, b

    assert one(9, STREAM, 3, 2, 1, 1)[0] == rng.uniform(9, STREAM, 3, 2, 1, 3)[2, 0]
    assert one(9, STREAM, 3, 2, 1, 1)[1:] == tuple(rng.normal(9, STREAM, 3, 2, 1, 4)[2:, 0])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"index": 2**32}, "index must be in"),
        ({"step": -1}, "step must be in"),
        ({"substep": 65536}, "substep must be in"),
        ({"k": -1}, "k must"),
    ],
)
def test_number_beyond_its_bits_is_refused(change, message):
    base = {"seeds": 7, "stream": STREAM, "index": 0, "step": 4, "substep": 0, "k": 1}
    with pytest.raises(ValueError, match=message):
        rng.uniform(**(base | change))


def test_nobody_asks_for_nothing():
    assert rng.uniform(np.empty(0, np.uint64), STREAM, np.empty(0, int), 0, 0, 3).shape == (3, 0)
    assert rng.normal(1, STREAM, [1, 2], 0, 0, 0).shape == (0, 2)
