"""Robustness is that of rtamt, and what is known of it during a game never rises and ends there."""

from __future__ import annotations

import logging
import math

import needs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tussle.stress.formulas import Above, Every, Formula, Not, UntilHolds, Window, records
from tussle.stress.grammar import negated

NUMBERS = st.floats(-1e6, 1e6, allow_nan=False).map(lambda x: round(x, 3))
WINDOWS = st.tuples(st.integers(0, 4), st.one_of(st.none(), st.integers(0, 5))).map(
    lambda w: (w[0], None if w[1] is None else w[0] + w[1])
)
FORMULAS = st.recursive(
    st.sampled_from("xyz").map(Above),
    lambda inner: st.one_of(
        inner.map(Not),
        st.tuples(st.lists(inner, min_size=2, max_size=2).map(tuple), st.booleans()).map(lambda a: Every(*a)),
        st.tuples(inner, WINDOWS, st.booleans()).map(lambda a: Window(a[0], *a[1], a[2])),
        st.tuples(inner, inner, WINDOWS).map(lambda a: UntilHolds(a[0], a[1], *a[2])),
    ),
    max_leaves=5,
)


def as_rtamt(f: Formula) -> str:
    """The formula in the language of rtamt."""
    if isinstance(f, Above):
        return f"({f.term} > 0)"
    if isinstance(f, Not):
        return f"not({as_rtamt(f.inner)})"
    if isinstance(f, Every):
        return f"({(' or ' if f.is_any else ' and ').join(map(as_rtamt, f.parts))})"
    # Windows that end with the game: rtamt has none that begin later, so they are as long as the longest signal here.
    window = f"[{f.first},{f.first + 30 if f.last is None else f.last}]"
    if isinstance(f, Window):
        return f"({'eventually' if f.is_any else 'always'}{window} {as_rtamt(f.inner)})"
    assert isinstance(f, UntilHolds)
    return f"({as_rtamt(f.left)} until{window} {as_rtamt(f.right)})"


def by_rtamt(f: Formula, traces) -> float:
    """Robustness at the start."""
    needs.require("rtamt")
    rtamt = pytest.importorskip("rtamt")  # warnings of its modules are none of the test
    logging.disable(logging.WARNING)
    specification = rtamt.StlDiscreteTimeSpecification()
    for name in traces:
        specification.declare_var(name, "float")
    specification.spec = f"out = {as_rtamt(f)}"
    specification.parse()
    n = len(traces["x"])
    found = specification.evaluate(
        {"time": list(range(n)), **{name: values.tolist() for name, values in traces.items()}}
    )
    logging.disable(logging.NOTSET)
    return found[0][1]


def signals(n, data):
    return {name: np.array(data.draw(st.lists(NUMBERS, min_size=n, max_size=n))) for name in "xyz"}


@settings(max_examples=200)
@given(FORMULAS, st.integers(2, 12), st.data())  # rtamt takes no signal of one sample
def test_robustness_is_that_of_rtamt(formula, n, data):
    """To the last bit, also where windows reach beyond the end of the signal."""
    traces = signals(n, data)
    assert formula.robustness(traces) == by_rtamt(formula, traces)


def by_definition(f: Formula, traces, k: int, n: int) -> float:
    """The textbook's definition, sample by sample."""
    if isinstance(f, Above):
        return traces[f.term][k]
    if isinstance(f, Not):
        return -by_definition(f.inner, traces, k, n)
    if isinstance(f, Every):
        return (max if f.is_any else min)(by_definition(p, traces, k, n) for p in f.parts)
    window = range(k + f.first, n if f.last is None else min(n, k + f.last + 1))
    if isinstance(f, Window):
        values = [by_definition(f.inner, traces, j, n) for j in window]
        return max(values, default=-math.inf) if f.is_any else min(values, default=math.inf)
    assert isinstance(f, UntilHolds)
    return max(
        (
            min(
                by_definition(f.right, traces, j, n),
                min((by_definition(f.left, traces, i, n) for i in range(k, j)), default=math.inf),
            )
            for j in window
        ),
        default=-math.inf,
    )


@settings(max_examples=200)
@given(FORMULAS, st.integers(1, 9), st.data())
def test_robustness_is_that_of_the_definition_at_every_sample(formula, n, data):
    traces = signals(n, data)
    assert formula.over(traces).tolist() == [by_definition(formula, traces, k, n) for k in range(n)]


@settings(max_examples=200)
@given(FORMULAS, st.integers(2, 12), st.data())
def test_what_is_known_of_a_game_holds_however_it_goes_on(formula, n, data):
    """It never rises, ends at the robustness, and no future is better."""
    traces = signals(n, data)
    known = formula.known(traces)
    assert (np.diff(known[np.isfinite(known)]) <= 0.0).all()
    assert known[-1] == formula.robustness(traces)
    k = data.draw(st.integers(0, n - 1))
    longer = n + 12  # what is decided by samples so far does not depend on where the game ends
    other = {name: np.concatenate([v[: k + 1], signals(longer, data)[name]]) for name, v in traces.items()}
    if k < n - 1:
        assert formula.robustness(other) <= known[k]


@settings(max_examples=200)
@given(FORMULAS, st.integers(2, 12), st.data())
def test_what_is_known_while_a_game_goes_on_does_not_change_later(formula, n, data):
    """Neither does the robustness of a sample alone, which does not depend on any other; under `always`, the least is the robustness."""
    traces = signals(n, data)
    k = data.draw(st.integers(0, n - 2))
    so_far = {name: np.append(values[: k + 1], values[k]) for name, values in traces.items()}
    assert formula.known(so_far)[k] == formula.known(traces)[k]
    present = formula.present(traces)
    others = {name: np.where(np.arange(n) == k, v, signals(n, data)[name]) for name, v in traces.items()}
    assert np.array_equal(formula.present(others)[k], present[k], equal_nan=True)
    assert np.array_equal(formula.present(so_far)[k], present[k], equal_nan=True)
    if formula.delay == 0:
        assert Window(formula).robustness(traces) == Window(formula).present(traces).min()


@settings(max_examples=100)
@given(FORMULAS, st.integers(1, 9), st.data())
def test_the_opposite_has_the_negative_robustness(formula, n, data):
    traces = signals(n, data)
    assert negated(formula).robustness(traces) == -formula.robustness(traces)


def test_records_are_where_a_game_comes_nearer_to_failure():
    steps, levels = records(np.array([np.inf, 5.0, 5.0, 2.0, 2.0, -1.0]))
    assert (steps.tolist(), levels.tolist()) == ([1, 3, 5], [5.0, 2.0, -1.0])
