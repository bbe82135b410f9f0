"""Portable operations on component-first arrays; columns do not affect each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
