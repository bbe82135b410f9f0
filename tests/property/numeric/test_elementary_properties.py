"""An element's bits depend on that element alone; identities hold within rounding."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from tussle.numeric import acos, asin, atan2, cos, exp, log, sin, sincos, tan, wrap

UNARY = [sin, cos, tan, asin, acos, exp, log, wrap]
ANYTHING = arrays.arrays(np.float64, st.integers(1, 40), elements=st.floats(width=64))
MODERATE = st.floats(-1e5, 1e5)
relaxed = settings(max_examples=100)


def same_bits(a, b):
    return np.asarray(a, dtype=np.float64).tobytes() == np.asarray(b, dtype=np.float64).tobytes()


@pytest.mark.parametrize("function", UNARY, ids=lambda f: f.__name__)
@relaxed
@given(x=ANYTHING)
def test_array_equals_its_elements_and_its_parts(function, x):
    whole = function(x)
    for i, value in enumerate(x):
        # The sign of a NaN is no number's bit: it differs between lanes and scalars in the processor itself.
        assert same_bits(whole[i], function(float(value))) or (
            math.isnan(whole[i]) and math.isnan(function(float(value)))
        )
    for first in range(min(len(x), 9)):
        np.testing.assert_array_equal(function(x[first:]), whole[first:])


@relaxed
@given(x=ANYTHING, y=ANYTHING)
def test_atan2_of_arrays_equals_that_of_elements(x, y):
    n = min(len(x), len(y))
    whole = atan2(y[:n], x[:n])
    for i in range(n):
        np.testing.assert_array_equal(whole[i], atan2(float(y[i]), float(x[i])))


@relaxed
@given(x=ANYTHING)
def test_sincos_is_sin_and_cos(x):
    s, c = sincos(x)
    np.testing.assert_array_equal(s, sin(x))
    np.testing.assert_array_equal(c, cos(x))


@relaxed
@given(x=MODERATE)
def test_sine_is_odd_and_cosine_even_bit_for_bit(x):
    assert sin(-x) == -sin(x)
    assert cos(-x) == cos(x)
    assert tan(-x) == -tan(x)


@relaxed
@given(x=MODERATE)
def test_sine_and_cosine_lie_on_the_circle(x):
    s, c = sincos(x)
    assert abs(s * s + c * c - 1.0) < 4e-16


@relaxed
@given(x=MODERATE, y=MODERATE)
def test_atan2_inverts_sincos(x, y):
    angle = atan2(y, x)
    assert -math.pi <= angle <= math.pi
    s, c = sincos(angle)
    length = math.hypot(x, y)
    assert abs(length * s - y) <= 1e-15 * length
    assert abs(length * c - x) <= 1e-15 * length


@relaxed
@given(x=st.floats(-700.0, 700.0))
def test_log_inverts_exp(x):
    assert abs(log(exp(x)) - x) <= 3e-16 * max(1.0, abs(x))


@relaxed
@given(x=st.floats(allow_nan=False, allow_infinity=False))
def test_wrap_lies_in_its_interval_and_is_idempotent(x):
    angle = wrap(x)
    assert -math.pi < angle <= math.pi
    assert wrap(angle) == angle
