"""Laws of sampling, over any ranges and choices: bounds, strata, equal shares, the same points again."""

from __future__ import annotations

import math
from collections import Counter

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tussle.batch.points import settings_of
from tussle.batch.sampling import sample
from tussle.batch.variables import Choice, Range, parse_variable
from tussle.declare.units import parse
from tussle.errors import ParameterError
from tussle.mission.codecs import written

DRAWN = ("lhs", "sobol", "saltelli", "product")
SEEDS = st.integers(0, 2**32)
N = st.integers(1, 16) | st.integers(101, 110)
"""Latin hypercubes of up to 100 points are improved by exchanges, which takes a while."""

slow_law = settings(max_examples=40)


@st.composite
def ranges(draw, name="x"):
    """A range of any kind, from the smallest to the largest numbers."""
    is_int, is_log = draw(st.booleans()), draw(st.booleans())
    if is_int:
        bounds = st.integers(1 if is_log else -(10**15), 10**15).map(float)
    else:
        bounds = st.floats(1e-300 if is_log else -1.7e308, 1.7e308)
    low, high = sorted((draw(bounds), draw(bounds)))
    assume(low < high)
    return Range(name, low, high, is_int, is_log, unit=draw(st.sampled_from(["", "kt"])), is_text=True)


def choices(name):
    values = st.lists(st.integers(-5, 5) | st.text("abc", min_size=1), min_size=1, max_size=7, unique_by=str)
    return values.map(lambda found: Choice(name, tuple(found)))


@given(variable=ranges(), share=st.floats(0, 1), n=st.integers(2, 9))
def test_values_lie_within_their_bounds(variable, share, n):
    for value in (variable.value_at(share), *variable.spread(n)):
        assert variable.low <= value <= variable.high
        assert type(value) is (int if variable.is_int else float)


@given(variable=ranges(), shares=st.tuples(st.floats(0, 1), st.floats(0, 1)))
def test_more_of_the_way_is_no_smaller_value(variable, shares):
    a, b = sorted(shares)
    # What is mixed of two bounds is rounded three times, each by half a unit in the last of 53 bits.
    slack = 4 * math.ulp(max(abs(variable.low), abs(variable.high)))
    if variable.is_log:
        # The logarithms, up to 710 in size, are rounded likewise, and so is the exponential of what they give.
        slack = variable.high * 8 * math.ulp(710.0)
    assert variable.value_at(a) <= variable.value_at(b) + slack


@given(variable=ranges(), share=st.floats(0, 1))
def test_the_text_of_a_value_is_that_value(variable, share):
    value = variable.value_at(share)
    text = written(settings_of({"x": value}, [variable])["x"])
    number, _, unit = text.partition(" ")
    assert (float(number), unit) == (value, variable.unit)
    assert math.isfinite(parse(text, "m/s" if variable.unit else ""))


@slow_law
@given(
    variables=st.tuples(ranges("x"), choices("y"), ranges("z")),
    method=st.sampled_from(DRAWN),
    n=st.integers(1, 12),
    seed=SEEDS,
)
def test_points_lie_within_bounds_and_come_again(variables, method, n, seed):
    points = sample(variables, method, n, seed)
    for point in points:
        for variable in variables:
            value = point[variable.name]
            if isinstance(variable, Choice):
                assert value in variable.values
            else:
                assert variable.low <= value <= variable.high
    assert sample(variables, method, n, seed) == points


@slow_law
@given(n=N, k=st.integers(1, 4), seed=SEEDS)
def test_a_latin_hypercube_has_one_point_in_each_stratum_of_each_dimension(n, k, seed):
    variables = [Range(f"x{i}", 0, 1) for i in range(k)]
    points = sample(variables, "lhs", n, seed)
    for variable in variables:
        assert sorted(int(point[variable.name] * n) for point in points) == list(range(n))


@slow_law
@given(choice=choices("y"), n=N, seed=SEEDS, levels=st.integers(2, 9))
def test_shares_of_a_latin_hypercube_are_equal_within_one(choice, n, seed, levels):
    variables = [choice, Range("x", 0, 1), Range("v", 0, 1, levels=levels), Range("i", 1, 6, is_int=True)]
    points = sample(variables, "lhs", n, seed)
    for variable in (variables[0], variables[2], variables[3]):
        counts = Counter(point[variable.name] for point in points)
        if variable is choice or variable.n_values <= n:
            allowed = {n // variable.n_values, -(-n // variable.n_values)}
            assert set(counts.values()) <= allowed
            assert len(counts) == min(n, variable.n_values)


@slow_law
@given(m=st.integers(0, 6), k=st.integers(1, 4), seed=SEEDS)
def test_a_power_of_two_of_sobol_points_has_one_in_each_stratum(m, k, seed):
    variables = [Range(f"x{i}", 0, 1) for i in range(k)]
    points = sample(variables, "sobol", 2**m, seed)
    for variable in variables:
        assert sorted(int(point[variable.name] * 2**m) for point in points) == list(range(2**m))


@slow_law
@given(n=st.integers(1, 20), k=st.integers(1, 5), seed=SEEDS)
def test_rows_of_saltelli_come_from_two_points(n, k, seed):
    """A, then A with one variable of B each, then B."""
    names = [f"x{i}" for i in range(k)]
    points = sample([Range(name, 0, 1) for name in names], "saltelli", n, seed)
    assert len(points) == n * (k + 2)
    for i in range(0, len(points), k + 2):
        a, *mixed, b = points[i : i + k + 2]
        for j, name in enumerate(names):
            assert mixed[j] == {**a, name: b[name]}


@given(text=st.text(st.sampled_from("x=:,.-+e019 ktinolgf"), max_size=25) | st.text(max_size=40))
def test_any_text_is_a_variable_or_one_of_our_errors(text):
    try:
        variable = parse_variable(text)
    except ParameterError:
        return
    assert len(sample([variable], "lhs", 3)) == 3


@given(variable=ranges())
def test_a_range_that_is_written_is_the_range_that_is_read(variable):
    ending = ("int" * variable.is_int, "log" * variable.is_log)
    text = f"x={variable.low!r}:{variable.high!r} {variable.unit}".strip()
    assert parse_variable(":".join([text, *filter(None, ending)])) == variable


@pytest.mark.parametrize("method", DRAWN)
def test_neighbouring_seeds_share_no_point(method):
    variables = [Range("x", 0, 1), Range("y", 0, 1)]
    seen = [tuple(p.values()) for seed in range(20) for p in sample(variables, method, 8, seed)]
    assert len(set(seen)) == len(seen)
