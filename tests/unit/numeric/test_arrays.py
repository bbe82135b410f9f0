"""Unit vectors and the product whose columns do not know of each other."""

from __future__ import annotations

import numpy as np
import pytest

from tussle.numeric import clip
from tussle.numeric.arrays import matmul, order_by_row, unit

DRAW = np.random.default_rng(3)


def test_unit_vectors_have_length_one_and_zero_stays_zero():
    v = DRAW.normal(size=(3, 50))
    v[:, 7] = 0.0
    lengths = np.sqrt((unit(v) ** 2).sum(axis=0))
    np.testing.assert_allclose(np.delete(lengths, 7), 1.0, rtol=1e-15)
    assert (unit(v)[:, 7] == 0.0).all()
    np.testing.assert_allclose(unit(np.array([3.0, 0.0, 4.0])), [0.6, 0.0, 0.8], rtol=1e-15)


@pytest.mark.parametrize("size", [1e-300, 5e-324, 1e300])
def test_unit_of_tiny_and_huge_vectors_neither_overflows_nor_vanishes(size):
    np.testing.assert_allclose(unit(np.full((3, 1), size)), 3.0**-0.5, rtol=1e-15)


def test_matmul_is_the_product():
    w, x = DRAW.normal(size=(5, 7)), DRAW.normal(size=(7, 33))
    np.testing.assert_allclose(matmul(w, x), w @ x, rtol=1e-12, atol=1e-12)
    assert matmul(w, x[:, :0]).shape == (5, 0)


def test_a_column_of_the_product_does_not_depend_on_the_others():
    w, x = DRAW.normal(size=(6, 40)), DRAW.normal(size=(40, 77))
    whole = matmul(w, x)
    for first in (0, 1, 5, 70):
        for n in (1, 2, 3, 7):
            np.testing.assert_array_equal(matmul(w, x[:, first : first + n]), whole[:, first : first + n])


def test_sizes_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match=r"not \(2, 3\) and \(2, 3\)"):
        matmul(np.ones((2, 3)), np.ones((2, 3)))


def test_items_are_ordered_by_row_and_keep_their_order_within_one():
    row = np.random.default_rng(1).integers(0, 50, 500)
    assert np.array_equal(order_by_row(row, 60), np.argsort(row, kind="stable"))
    assert len(order_by_row(row[:0], 0)) == 0


@pytest.mark.parametrize("n", [1, 2, 9])
def test_values_are_limited_with_the_same_signs_of_zeros_for_any_number_of_columns(n):
    zeros, limit = np.full((3, n), -0.0), np.zeros(n)
    assert np.signbit(clip(zeros, -limit, limit)).all()
    values = np.array([[-3.0], [-0.0], [2.0], [np.nan], [np.inf]]) * np.ones(n)
    np.testing.assert_array_equal(clip(values, -1.0, 1.5), np.clip(values, -1.0, 1.5))
    assert clip(1.0, 5.0, 3.0) == np.clip(1.0, 5.0, 3.0) == 3.0
