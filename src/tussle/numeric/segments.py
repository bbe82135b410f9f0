"""Reductions over segments of an array, in order. Segment i is values[start[i] : start[i + 1]]."""

from __future__ import annotations

import numpy as np

from tussle.numeric.kernel import kernel


@kernel("I F Fw")
def segment_sum(start, values, out):
    """Sum of each segment; 0 if it is empty."""
    for i in range(out.shape[0]):
        total = 0.0
        for k in range(start[i], start[i + 1]):
            total += values[k]
        out[i] = total


@kernel("I F Fw f8")
def segment_mean(start, values, out, empty):
    """Mean of each segment; `empty` if it is empty."""
    for i in range(out.shape[0]):
        total = 0.0
        for k in range(start[i], start[i + 1]):
            total += values[k]
        n = start[i + 1] - start[i]
        out[i] = total / n if n > 0 else empty


@kernel("I F Fw f8")
def segment_min(start, values, out, empty):
    """Minimum of each segment; `empty` if it is empty."""
    for i in range(out.shape[0]):
        least = empty
        for k in range(start[i], start[i + 1]):
            least = values[k] if k == start[i] or values[k] < least else least
        out[i] = least


@kernel("I F Iw")
def segment_first_min(start, values, out):
    """Index into `values` of the first minimum of each segment; -1 if it is empty."""
    for i in range(out.shape[0]):
        at = -1
        for k in range(start[i], start[i + 1]):
            if at < 0 or values[k] < values[at]:
                at = k
        out[i] = at


@kernel("I Iw Iw")
def count_and_place(row, place, order):
    """Counting sort. Row numbers (m,) are 0 ... n - 1; place (n + 1,), 0 on entry, is scratch; order (m,) is written."""
    for k in range(row.shape[0]):
        place[row[k] + 1] += 1
    for i in range(1, place.shape[0]):
        place[i] += place[i - 1]
    for k in range(row.shape[0]):
        order[place[row[k]]] = k
        place[row[k]] += 1


def order_by_row(row: np.ndarray, n: int) -> np.ndarray:
    """Stable order of items by their row numbers, (m,); the numbers are 0 ... n - 1."""
    order = np.empty(len(row), np.int64)
    count_and_place(np.ascontiguousarray(row, np.int64), np.zeros(n + 1, np.int64), order)
    return order
