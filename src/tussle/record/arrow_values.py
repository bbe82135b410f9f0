"""Arrow arrays of the values that a run records."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa


def arrow_array(
    values: np.ndarray | Sequence[Any], kind: pa.DataType | None = None, mask: np.ndarray | None = None
) -> pa.Array:
    """Like `pyarrow.array`, which imports pandas where it is installed: a quarter of a second at the start of each run.

    Args:
        values: Numbers or texts, (n,); in a sequence, None is null.
        kind: Type of the array, by default that of the NumPy array, whose memory is shared if it is contiguous.
        mask: True where the value is null, (n,).

    Raises:
        OverflowError: An integer does not fit the type.
    """
    if not isinstance(values, np.ndarray):
        empty = [value is None for value in values]
        mask = np.array(empty) if any(empty) else None
    kind = kind or pa.from_numpy_dtype(values.dtype)  # type: ignore[union-attr]
    valid = None if mask is None else pa.py_buffer(np.packbits(~mask, bitorder="little"))
    if pa.types.is_string(kind):
        words = [b"" if value is None else value.encode() for value in values]
        ends = np.cumsum([0, *map(len, words)]).astype(np.int32)
        return pa.Array.from_buffers(
            kind, len(words), [valid, pa.py_buffer(ends), pa.py_buffer(b"".join(words))]
        )
    if not isinstance(values, np.ndarray):
        values = np.array([0 if value is None else value for value in values], kind.to_pandas_dtype())
    numbers = np.ascontiguousarray(values, kind.to_pandas_dtype())
    if numbers.dtype != values.dtype and (numbers != values).any():
        raise OverflowError(f"there are numbers that do not fit the type {kind}")
    if pa.types.is_boolean(kind):
        numbers = np.packbits(numbers, bitorder="little")
    return pa.Array.from_buffers(kind, len(values), [valid, pa.py_buffer(numbers)])
