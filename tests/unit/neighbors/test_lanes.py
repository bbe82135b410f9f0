"""Lanes compiled are lanes in Python, bit for bit, and the inverse square root is exact enough."""

import subprocess
import sys

import numpy as np
import pytest

from tussle.numeric.fingerprint import Fingerprint
from tussle.numeric.kernel import kernel
from tussle.numeric.neighbors import lanes
from tussle.numeric.neighbors.lanes import (
    LANES,
    bits,
    choose,
    inverse_sqrt,
    load,
    load_some,
    lowest,
    ones,
    pack,
    splat,
    store_some,
    unlike,
)


@kernel("F F Fw Iw")
def compiled(a, b, out, hits):
    for i in range(0, a.shape[0], LANES):
        count = min(LANES, a.shape[0] - i)
        x = load_some(a, i, count)
        y = load_some(b, i, count)
        near = (x < y) & (x != 0.5)
        store_some(
            out, i, count, choose(near, x * y - 1.5, splat(2.0) / (y + 3.0)) * inverse_sqrt(y * y + 1.0)
        )
        hits[i // LANES] = bits(near)


def plain(a, b):
    guess = np.int64(0x5FE6EB50C7B537A9) - ((b * b + 1.0).view(np.int64) >> 1)
    root = guess.view(np.float64)
    for _ in range(4):
        root = root * (1.5 - 0.5 * (b * b + 1.0) * root * root)
    return np.where((a < b) & (a != 0.5), a * b - 1.5, 2.0 / (b + 3.0)) * root


@pytest.mark.parametrize("n", [1, 7, 8, 9, 21])
def test_lanes_equal_numpy_bitwise_and_stop_at_the_end(n):
    rng = np.random.default_rng(n)
    a, b = rng.normal(size=n), rng.normal(size=n) ** 2
    out, hits = np.full(n + LANES, 7.0), np.zeros(n, np.int64)
    compiled(a, b, out[:n], hits)
    np.testing.assert_array_equal(out[:n], plain(a, b))
    np.testing.assert_array_equal(out[n:], 7.0)
    assert hits[0] & 255 == sum(1 << k for k in range(min(n, 8)) if a[k] < b[k]) | (
        hits[0] & ~((1 << min(n, 8)) - 1)
    )


@kernel("F Fw")
def roots(squares, out):
    for i in range(0, squares.shape[0], LANES):
        count = min(LANES, squares.shape[0] - i)
        store_some(out, i, count, inverse_sqrt(load_some(squares, i, count)))


def test_inverse_sqrt_is_within_four_ulp_and_finite_at_zero():
    squares = np.append(10.0 ** np.random.default_rng(0).uniform(-100, 100, 100_000), 0.0)
    out = np.empty_like(squares)
    roots(squares, out)
    error = np.abs(out[:-1] * np.sqrt(squares[:-1]) - 1.0)
    assert error.max() < 4 * np.finfo(float).eps
    assert np.isfinite(out[-1])


@kernel("i8 Iw")
def bit_counts(hits, out):
    out[0] = lowest(hits)
    out[1] = ones(hits)


@pytest.mark.parametrize("hits", [1, 6, 0x80, 0xFF])
def test_bits_are_counted(hits):
    out = np.zeros(2, np.int64)
    bit_counts(hits, out)
    assert tuple(out) == (lowest(hits), ones(hits))


def test_kernels_are_keyed_by_the_code_generators(monkeypatch):
    before = Fingerprint(compiled.py_func)
    assert not before.opaque
    monkeypatch.setattr(lanes, "generators", lambda: "others")
    assert Fingerprint(compiled.py_func).digest != before.digest


def test_importing_the_package_does_not_import_numba():
    code = "import sys, tussle.numeric.neighbors; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_operations_on_lanes_are_found_before_those_on_anything_else(monkeypatch):
    import operator

    from numba.core.registry import cpu_target
    from numba.core.types import float64
    from numba.core.typing.templates import _OverloadFunctionTemplate

    from tussle.numeric.neighbors.lanes_codegen import LANES_TYPE, MASK_TYPE

    def asked(*_):
        raise AssertionError("an overload for other types was asked first")

    find = cpu_target.typing_context.resolve_function_type
    cpu_target.typing_context.refresh()
    monkeypatch.setattr(_OverloadFunctionTemplate, "generic", asked)
    assert find(operator.add, (LANES_TYPE, float64), {}).return_type == LANES_TYPE
    assert find(operator.lt, (LANES_TYPE, LANES_TYPE), {}).return_type == MASK_TYPE


@kernel("I i8 i8 Iw -> i8")
def packed(wholes, start, whole, found):
    return pack(found, 1, start, bits(unlike(load(wholes, 0), whole)))


def test_places_are_packed_in_order_for_every_mask():
    for mask in range(256):
        wholes = np.array([9 if mask >> k & 1 else 4 for k in range(LANES)])
        found, plain = np.zeros(2 * LANES, np.int64), np.zeros(2 * LANES, np.int64)
        n = packed(wholes, 100, 4, found)
        assert found[1:n].tolist() == [100 + k for k in range(LANES) if mask >> k & 1]
        assert pack.py_func(plain, 1, 100, mask) == n
        assert plain[1:n].tolist() == found[1:n].tolist()
