"""Portable operations on component-first arrays; columns do not affect each other."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tussle.errors import ParameterError
from tussle.numeric.kernel import kernel

Floats = NDArray[np.float64]


def unit(v: ArrayLike) -> Floats:
    """Scale vectors (3, n), or any (k, n), to length 1; a zero vector stays zero."""
    vectors = np.asarray(v, dtype=np.float64)
    # Dividing by the largest component first avoids overflow and underflow of the squares.
    largest = np.abs(vectors[0])
    for component in vectors[1:]:
        largest = np.maximum(largest, np.abs(component))
    scaled = vectors / np.where(largest > 0.0, largest, 1.0)
    square = scaled[0] * scaled[0]
    for component in scaled[1:]:
        square = square + component * component
    return np.asarray(scaled / np.where(square > 0.0, np.sqrt(square), 1.0))


@kernel("F2 F2 F2w")
def matmul_columns(w, x, out):
    """Compute out = w @ x with a fixed summation order for each column: (m, k), (k, n), (m, n)."""
    for i in range(out.shape[0]):
        row = out[i]
        row[:] = 0.0
        for j in range(x.shape[0]):
            weight = w[i, j]
            values = x[j]
            for column in range(row.shape[0]):
                row[column] += weight * values[column]


def matmul(w: ArrayLike, x: ArrayLike) -> Floats:
    """Matrix product of w (m, k) and x (k, n) in a fixed summation order.

    The bits of a column do not depend on other columns. NumPy's product depends on the processor and the number of columns.

    Raises:
        ValueError: The inner sizes differ.
    """
    left = np.ascontiguousarray(w, dtype=np.float64)
    right = np.ascontiguousarray(x, dtype=np.float64)
    if left.ndim != 2 or right.ndim != 2 or left.shape[1] != right.shape[0]:
        raise ValueError(f"matmul takes (m, k) and (k, n), not {left.shape} and {right.shape}")
    out = np.empty((left.shape[0], right.shape[1]))
    matmul_columns(left, right, out)
    return out


def numbers_of(given: ArrayLike, where: str, kinds: str = "biuf") -> NDArray[Any]:
    """Return numbers as an array, real ones (kinds "biuf") as floats.

    Raises:
        ParameterError: They are something else; `where` begins the message.
    """
    try:
        array = np.asarray(given)
    except ValueError:  # lists of different lengths
        array = np.empty(1, object)
    if array.size and array.dtype.kind not in kinds:
        raise ParameterError(
            f"{where} = {given!r:.60} is not allowed; it takes {'numbers' if 'f' in kinds else 'whole numbers'}"
        )
    return array.astype(float, copy=False) if "f" in kinds else array


def numbers_below(n: int, given: ArrayLike, where: str, hint: str = "") -> NDArray[np.int64]:
    """Return numbers from 0 to n - 1, (m,), given as one, several, or a mask (n,).

    Raises:
        ParameterError: There is another number, or the mask has another shape; `where` and `hint` are parts of the message.
    """
    array = np.atleast_1d(np.asarray(given))
    if array.dtype == bool and array.shape == (n,):
        return np.flatnonzero(array)
    if not array.size and array.ndim == 1:
        return np.zeros(0, np.int64)
    if array.dtype.kind not in "iu" or array.ndim != 1:
        kind = f"an array of {array.dtype}, {array.shape}"
    elif 0 <= array.min() and array.max() < n:
        return array.astype(np.int64)
    else:
        wrong = array[(array < 0) | (array >= n)][0]
        kind = f"{wrong}{hint if wrong == -1 else ''}"
    raise ParameterError(
        f"{where} = {kind} is not allowed; it takes whole numbers from 0 to {n - 1}, or a mask ({n},)"
    )


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
