"""Reductions over segments of an array: segment i is values[start[i] : start[i + 1]], and each is taken one item after another."""

from __future__ import annotations

from tussle.numeric.kernel import kernel


@kernel("I F Fw")
def segment_sum(start, values, out):
    """Sums of values[start[i] : start[i + 1]], one after another; 0 of none."""
    for i in range(out.shape[0]):
        total = 0.0
        for k in range(start[i], start[i + 1]):
            total += values[k]
        out[i] = total


@kernel("I F Fw f8")
def segment_mean(start, values, out, empty):
    """Means of values[start[i] : start[i + 1]], summed one after another; `empty` of none."""
    for i in range(out.shape[0]):
        total = 0.0
        for k in range(start[i], start[i + 1]):
            total += values[k]
        n = start[i + 1] - start[i]
        out[i] = total / n if n > 0 else empty


@kernel("I F Fw f8")
def segment_min(start, values, out, empty):
    """Least of values[start[i] : start[i + 1]]; `empty` of none."""
    for i in range(out.shape[0]):
        least = empty
        for k in range(start[i], start[i + 1]):
            least = values[k] if k == start[i] or values[k] < least else least
        out[i] = least


@kernel("I F Iw")
def segment_first_min(start, values, out):
    """Where values[start[i] : start[i + 1]] is least, the first of equals; -1 of none."""
    for i in range(out.shape[0]):
        at = -1
        for k in range(start[i], start[i + 1]):
            if at < 0 or values[k] < values[at]:
                at = k
        out[i] = at
