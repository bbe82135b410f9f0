"""How many are left over time."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_batches import made_batch

from tussle.batch.results import Results
from tussle.batch.run_table import survival_of
from tussle.errors import ParameterError

TIMES = np.linspace(0.0, 10.0, 41)

Steps = st.lists(st.tuples(st.integers(0, 40), st.integers(0, 9)), min_size=1, max_size=8)


def looked_up(runs: list[list[tuple[float, int]]]) -> np.ndarray:
    """Number left of each run at each time, one by one."""
    table = np.zeros((len(runs), len(TIMES)))
    for i, rows in enumerate(runs):
        for j, time in enumerate(TIMES):
            table[i, j] = next((n for t, n in reversed(rows) if t <= time), 0)
    return table


@given(st.lists(Steps, min_size=2, max_size=6))
def test_the_mean_is_that_of_the_step_functions(drawn):
    runs = [[(0.25 * k, n) for k, n in sorted(dict(rows).items())] for rows in drawn]
    flat = [(i, t, n) for i, rows in enumerate(runs) for t, n in rows]
    run, t, alive = (np.array(column) for column in zip(*flat, strict=True))
    found = survival_of("", 1, run, t, alive, len(runs), TIMES)
    expected = looked_up(runs)
    np.testing.assert_allclose(found.mean, expected.mean(axis=0), atol=1e-12)
    half = 1.959964 * expected.std(axis=0, ddof=1) / np.sqrt(len(runs))
    np.testing.assert_allclose(found.high - found.mean, half, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(found.low, np.maximum(found.mean - half, 0.0), rtol=1e-6, atol=1e-6)


def test_a_run_that_ends_early_stays_as_it_ended():
    alive = {0: [(1, 0.0, 4), (1, 2.0, 0), (1, 2.0, 0)], 1: [(1, 0.0, 4), (1, 5.0, 2), (1, 8.0, 2)]}
    results = Results(made_batch({1: [[0.0], [0.0]]}, alive=alive))
    found = results.survival(1)
    assert (found.n, found.t[0], found.t[-1]) == (2, 0.0, 8.0)
    assert found.mean[[0, -1]].tolist() == [4.0, 1.0]
    assert found.mean[np.searchsorted(found.t, 3.0)] == 2.0


def test_one_run_has_no_interval_and_none_no_mean():
    one = Results(made_batch({1: [[0.0], [0.0]]}, failed={1: "boom"})).survival(1)
    assert one.n == 1
    assert np.isfinite(one.mean).all()
    assert np.isnan(one.low).all()
    none = Results(made_batch({1: [[0.0]]}, failed={0: "boom"})).survival(1)
    assert none.n == 0
    assert np.isnan(none.mean).all()


def test_a_team_that_is_not_there_is_told():
    with pytest.raises(ParameterError, match=r"there is no team 7; there are: 1 \(prey\), 2 \(keepers\)"):
        Results(made_batch({1: [[0.0]]})).survival(7)
