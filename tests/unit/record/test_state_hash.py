"""The hash of columns."""

from __future__ import annotations

import numpy as np

from tussle.record import hash_columns


def test_the_sign_of_zero_counts_and_that_of_nan_does_not():
    def hashed(value: float) -> str:
        return hash_columns([("x", np.array([1.0, value]))])

    assert hashed(0.0) != hashed(-0.0)
    assert hashed(np.nan) == hashed(-np.nan) == hashed(np.array([0x7FF8000000000123]).view(np.float64)[0])
    assert hashed(np.nan) != hashed(np.inf)
