"""Accuracy and special values of the elementary functions, against 80-bit functions and the C standard's tables."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tussle.numeric import acos, asin, atan2, cos, exp, log, sin, sincos, tan, wrap
from tussle.numeric.kernel import kernel

if np.finfo(np.longdouble).nmant < 60:
    pytest.skip("needs an 80-bit long double as reference", allow_module_level=True)

N = 100_000
DRAW = np.random.default_rng(20)
NEAR_MULTIPLES = np.arange(-63_000, 63_000) * (math.pi / 2.0)
ANGLES = np.concatenate(
    [DRAW.uniform(-1e5, 1e5, N), DRAW.normal(size=N), NEAR_MULTIPLES, 10.0 ** DRAW.uniform(-300, 5, N)]
)


def worst_ulp(values, reference):
    """Largest distance from the 80-bit reference in units of the last place of the reference."""
    with np.errstate(all="ignore"):
        spacing = np.spacing(np.abs(reference.astype(np.float64)))
        return float(np.max(np.abs((values.astype(np.longdouble) - reference) / spacing)))


@pytest.mark.parametrize(
    ("function", "reference", "x", "limit"),
    [
        (sin, np.sin, ANGLES, 0.8),
        (cos, np.cos, ANGLES, 0.8),
        (tan, np.tan, ANGLES, 2.1),
        (exp, np.exp, DRAW.uniform(-708.0, 709.7, N), 1.0),
        (exp, np.exp, DRAW.normal(size=N) * 0.1, 1.0),
        (log, np.log, 10.0 ** DRAW.uniform(-323, 308, N), 1.0),
        (log, np.log, 1.0 + DRAW.normal(size=N) * 0.05, 1.0),
        (asin, np.arcsin, DRAW.uniform(-1, 1, N), 1.0),
        (asin, np.arcsin, 10.0 ** DRAW.uniform(-300, 0, N), 1.0),
        (acos, np.arccos, DRAW.uniform(-1, 1, N), 1.0),
        (acos, np.arccos, 1.0 - 10.0 ** DRAW.uniform(-16, 0, N), 1.0),
    ],
)
def test_error_stays_below_its_limit(function, reference, x, limit):
    assert worst_ulp(function(x), reference(x.astype(np.longdouble))) < limit


@pytest.mark.parametrize(
    ("size_y", "size_x"),
    [(1.0, 1.0), (1e-12, 1.0), (1.0, 1e-12), (1e-310, 1e-310), (1e300, 1e300), (1e-290, 1e10)],
)
def test_atan2_is_good_to_two_and_a_half_ulp_in_all_quadrants(size_y, size_x):
    y, x = DRAW.normal(size=N) * size_y, DRAW.normal(size=N) * size_x
    assert worst_ulp(atan2(y, x), np.arctan2(y.astype(np.longdouble), x.astype(np.longdouble))) < 2.5


def test_atan2_of_zeros_infinities_and_nan_is_that_of_c():
    special = np.array([0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, 5e-324, -5e-324, 1.7e308, -1.7e308, np.nan])
    y, x = np.meshgrid(special, special)
    ours, reference = atan2(y, x), np.arctan2(y, x)
    np.testing.assert_array_equal(ours, reference)
    known = ~np.isnan(reference)
    np.testing.assert_array_equal(np.signbit(ours[known]), np.signbit(reference[known]))


def test_subnormal_results_of_exp_are_rounded_once():
    x = DRAW.uniform(-745.1, -708.5, N)
    assert worst_ulp(exp(x), np.exp(x.astype(np.longdouble))) < 1.0


def test_exp_at_its_ends():
    assert exp(np.inf) == np.inf
    assert exp(710.0) == np.inf
    assert exp(1e300) == np.inf
    assert exp(709.782712893384) > 1.797e308
    assert exp(709.782712893384) < np.inf
    assert exp(-np.inf) == 0.0
    assert exp(-745.2) == 0.0
    assert exp(-1e300) == 0.0
    assert exp(-745.13) == 5e-324
    assert math.isnan(exp(math.nan))
    assert exp(0.0) == 1.0
    assert exp(-0.0) == 1.0


def test_log_at_its_ends():
    assert log(0.0) == -np.inf
    assert log(-0.0) == -np.inf
    assert log(np.inf) == np.inf
    assert log(1.0) == 0.0
    assert math.isnan(log(-1.0))
    assert math.isnan(log(math.nan))
    assert math.isnan(log(-np.inf))
    assert log(5e-324) == math.log(5e-324)


@pytest.mark.parametrize("function", [sin, cos, tan, wrap])
def test_angles_without_a_value_give_nan(function):
    assert np.isnan(function(np.array([np.inf, -np.inf, np.nan]))).all()


@pytest.mark.parametrize("function", [asin, acos])
def test_inverse_functions_outside_their_domain_give_nan(function):
    assert np.isnan(
        function(np.array([1.0000000000000002, -1.0000000000000002, 2.0, np.inf, -np.inf, np.nan]))
    ).all()


def test_inverse_functions_at_their_ends():
    assert asin(1.0) == math.pi / 2
    assert asin(-1.0) == -math.pi / 2
    assert acos(1.0) == 0.0
    assert acos(-1.0) == math.pi
    assert acos(0.0) == math.pi / 2


@pytest.mark.parametrize("function", [sin, tan, asin, wrap])
def test_odd_functions_keep_the_sign_of_zero(function):
    assert math.copysign(1.0, function(-0.0)) == -1.0
    assert math.copysign(1.0, function(0.0)) == 1.0


def test_sine_and_cosine_of_huge_angles_stay_within_one():
    huge = np.concatenate(
        [10.0 ** DRAW.uniform(5, 308, N), -(10.0 ** DRAW.uniform(5, 308, N)), [1.7976931348623157e308]]
    )
    s, c = sincos(huge)
    assert (np.abs(s) <= 1.0).all()
    assert (np.abs(c) <= 1.0).all()


def test_wrap_ends_at_plus_pi_and_changes_nothing_inside():
    assert wrap(math.pi) == math.pi
    assert wrap(-math.pi) == math.pi
    assert wrap(3.0 * math.pi) == pytest.approx(math.pi)
    inside = np.concatenate(
        [DRAW.uniform(-math.pi, math.pi, N), [np.nextafter(math.pi, 0.0), np.nextafter(-math.pi, 0.0)]]
    )
    np.testing.assert_array_equal(wrap(inside), inside)


def test_wrap_of_many_turns_is_that_of_the_exact_circle():
    x = DRAW.uniform(-1e5, 1e5, N)
    np.testing.assert_allclose(
        np.sin(wrap(x).astype(np.longdouble)), np.sin(x.astype(np.longdouble)), atol=1e-15, rtol=0
    )


def test_float_gives_float_and_array_gives_array_of_its_shape():
    assert type(sin(1.0)) is float
    assert type(sin(1)) is float
    assert type(sin(np.float64(1.0))) is float
    assert type(atan2(1, 2.0)) is float
    assert [type(v) for v in sincos(1.0)] == [float, float]
    assert sin(np.ones((2, 3))).shape == (2, 3)
    assert sin([0.0, 1.0]).shape == (2,)
    assert sin(np.ones((2, 0))).shape == (2, 0)
    assert [v.shape for v in sincos(np.ones((2, 3)))] == [(2, 3), (2, 3)]
    assert type(sin(np.array(1.0))) is float


def test_atan2_broadcasts():
    y, x = np.arange(3.0)[:, None], np.arange(1.0, 5.0)
    assert atan2(y, x).shape == (3, 4)
    assert atan2(y, x)[2, 1] == atan2(2.0, 2.0)
    assert atan2(y, 1.0)[2, 0] == atan2(2.0, 1.0)


def test_array_that_is_not_contiguous_is_read_as_it_lies():
    table = DRAW.normal(size=(4, 6))
    np.testing.assert_array_equal(sin(table.T), sin(table).T)
    np.testing.assert_array_equal(sin(table[:, ::2]), sin(table)[:, ::2])


def test_same_name_in_jitted_code_has_the_same_bits():
    @kernel("F F Fw")
    def all_of_them(x, y, out):
        for i in range(x.shape[0]):
            s, c = sincos(x[i])
            out[i] = (
                sin(x[i])
                + cos(y[i]) * tan(x[i])
                - atan2(y[i], x[i])
                + exp(x[i]) * log(abs(y[i]))
                + wrap(9.0 * x[i])
                + s * c
            )

    x, y = DRAW.normal(size=(2, 1000))
    out = np.empty(1000)
    all_of_them(x, y, out)
    s, c = sincos(x)
    expected = sin(x) + cos(y) * tan(x) - atan2(y, x) + exp(x) * log(np.abs(y)) + wrap(9.0 * x) + s * c
    np.testing.assert_array_equal(out, expected)
