"""Ragged columns: one list per row, as declared by `ragged=True`, and reductions over each row's items."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import numpy as np

from tussle.declare.columns import Numbers
from tussle.errors import ParameterError
from tussle.numeric import arrays


class Segments:
    """Items grouped by row: row i has items start[i] to start[i + 1]; abstract.

    Attributes:
        start: First item of each row, then the number of items, (n + 1,), int64.
    """

    start: np.ndarray
    items: ClassVar[str] = "items"
    """Name of the items in error messages."""

    def _each(self, reduce: Callable[..., None], values: Any, dtype: type, *rest: float) -> np.ndarray:
        n, m = len(self.start) - 1, int(self.start[-1])
        values = np.asarray(values, float)
        if values.shape[-1:] != (m,):
            raise ParameterError(
                f"values of {self.items} have shape {values.shape}; the last axis must have length {m}, one per item"
            )
        out = np.zeros((*values.shape[:-1], n), dtype)
        k = int(np.prod(values.shape[:-1]))  # -1 in reshape is ambiguous if there are no items
        flat = np.ascontiguousarray(values.reshape(k, m))
        for source, target in zip(flat, out.reshape(k, n), strict=True):
            reduce(self.start, source, target, *rest)
        return out

    def sum(self, values: Any) -> np.ndarray:
        """Sum over each row's items of values (m,) or (k, m): (n,) or (k, n), 0 for rows without items."""
        return self._each(arrays.segment_sum, values, float)

    def mean(self, values: Any) -> np.ndarray:
        """Mean over each row's items, 0 for rows without items."""
        return self._each(arrays.segment_mean, values, float, 0.0)

    def min(self, values: Any) -> np.ndarray:
        """Minimum over each row's items, infinity for rows without items."""
        return self._each(arrays.segment_min, values, float, np.inf)

    def argmin(self, values: Any) -> np.ndarray:
        """Item with the smallest value in each row, (n,), the first of equal ones; -1 for rows without items."""
        return self._each(arrays.segment_first_min, values, np.int64)


class RaggedColumn(Segments):
    """One list per row; a list of m items with k fields is (k, m), or (m,) without fields.

    `lists[row]` is the list of a row, `lists[row] = values` replaces it, and `set` replaces all lists.

    Attributes:
        data: Items of all rows, (k, total) or (total,).
        row: Row of each item, (total,).
        count: Number of items of each row, (n,).
    """

    def __init__(self, start: np.ndarray, data: np.ndarray) -> None:
        self._start, self._data = start, data
        self._pending: dict[int, np.ndarray] = {}  # assigned lists by row, merged on the next read

    @classmethod
    def empty(cls, n: int, declaration: Numbers) -> RaggedColumn:
        """Make a column of n empty lists."""
        shape = (*declaration.shape, 0)
        return RaggedColumn(np.zeros(n + 1, np.int64), np.zeros(shape, np.dtype(declaration.dtype)))

    @classmethod
    def from_rows(cls, rows: Sequence[Any], declaration: Numbers) -> RaggedColumn:
        """Make a column from one list per row, each (k, m) or (m,).

        Raises:
            ParameterError: A list has the wrong shape.
        """
        column = cls.empty(len(rows), declaration)
        for row, values in enumerate(rows):
            column[row] = values
        return column

    @classmethod
    def join(cls, columns: Sequence[RaggedColumn]) -> RaggedColumn:
        """Concatenate the rows of several columns."""
        counts = np.concatenate([c.count for c in columns])
        return RaggedColumn(_starts(counts), np.concatenate([c.data for c in columns], axis=-1))

    @property
    def start(self) -> np.ndarray:  # type: ignore[override]
        self._merge_pending()
        return self._start

    @property
    def data(self) -> np.ndarray:
        self._merge_pending()
        return self._data

    @property
    def row(self) -> np.ndarray:
        return np.repeat(np.arange(len(self)), self.count)

    @property
    def count(self) -> np.ndarray:
        return np.diff(self.start)

    def __len__(self) -> int:
        return len(self._start) - 1

    def __getitem__(self, row: Any) -> np.ndarray:
        """The list of a row; `lists[..., row]` is the same, as for other columns."""
        row = _row(row, len(self))
        pending = self._pending.get(row)
        return self._data[..., self._start[row] : self._start[row + 1]] if pending is None else pending

    def __setitem__(self, row: Any, values: Any) -> None:
        row, shape = _row(row, len(self)), self._data.shape[:-1]
        items = np.array(values, self._data.dtype)
        if not items.size:
            items = items.reshape(*shape, 0)
        if items.shape[:-1] != shape or items.ndim != len(shape) + 1:
            wanted = f"({shape[0]}, m)" if shape else "(m,)"
            raise ParameterError(f"the list of row {row} has shape {items.shape}; expected {wanted}")
        self._pending[row] = items

    def _merge_pending(self) -> None:
        if self._pending:
            pending, self._pending = self._pending, {}
            lists = [*pending.values()]
            part = RaggedColumn(
                _starts(np.array([v.shape[-1] for v in lists])), np.concatenate(lists, axis=-1)
            )
            self.put(np.array([*pending]), part)

    def set(self, start: np.ndarray, data: np.ndarray) -> None:
        """Replace all lists.

        Raises:
            ValueError: A shape does not fit, or `start` does not rise from 0 to the number of items.
        """
        start = np.array(start, np.int64)
        data = np.array(data, self._data.dtype, order="C")
        if start.shape != self._start.shape or data.shape[:-1] != self._data.shape[:-1]:
            raise ValueError(
                f"start has shape {start.shape} and data {data.shape}; expected {self._start.shape} and "
                f"{self._data.shape[:-1]} + (total,)"
            )
        if start[0] != 0 or start[-1] != data.shape[-1] or (np.diff(start) < 0).any():
            raise ValueError(f"start must rise from 0 to the number of items, {data.shape[-1]}")
        self._start, self._data, self._pending = start, data, {}

    def put(self, rows: np.ndarray, part: RaggedColumn) -> None:
        """Replace the lists of `rows` by the lists of `part`, in order."""
        source = np.arange(len(self))
        source[rows] = len(self) + np.arange(len(rows))
        merged = RaggedColumn.join([self, part]).take(source)
        self.set(merged.start, merged.data)

    def take(self, rows: np.ndarray) -> RaggedColumn:
        """Copy the lists of `rows`; -1 gives an empty list."""
        rows = np.asarray(rows, np.int64)
        kept = np.where(rows >= 0, rows, 0)
        first = self.start[kept] if len(self) else np.zeros(len(rows), np.int64)
        length = np.where(rows >= 0, (self.start[kept + 1] if len(self) else first) - first, 0)
        start = _starts(length)
        items = np.repeat(first - start[:-1], length) + np.arange(start[-1])
        return RaggedColumn(start, np.ascontiguousarray(self.data[..., items]))

    def copy(self) -> RaggedColumn:
        return RaggedColumn(self.start.copy(), self.data.copy())

    def read_only(self) -> RaggedColumn:
        """A read-only view of this column."""
        return _ReadOnly(self)


class _ReadOnly(RaggedColumn):
    """Read-only view of another column."""

    def __init__(self, source: RaggedColumn) -> None:
        self._source = source

    @property
    def start(self) -> np.ndarray:  # type: ignore[override]
        return _locked(self._source.start)

    @property
    def data(self) -> np.ndarray:
        return _locked(self._source.data)

    def __len__(self) -> int:
        return len(self._source)

    def __getitem__(self, row: Any) -> np.ndarray:
        return _locked(self._source[row])

    def __setitem__(self, row: Any, values: Any) -> None:
        raise ValueError("this ragged column is read-only, because it is an Input or a Param")

    def set(self, start: np.ndarray, data: np.ndarray) -> None:
        raise ValueError("this ragged column is read-only, because it is an Input or a Param")


def _locked(array: np.ndarray) -> np.ndarray:
    view = array[...]
    view.flags.writeable = False
    return view


def _row(row: Any, n: int) -> int:
    if isinstance(row, tuple) and len(row) == 2 and row[0] is Ellipsis:
        row = row[1]
    place = int(row)
    if not -n <= place < n:
        raise IndexError(f"row {place} is out of range; there are {n} lists")
    return place % n


def _starts(counts: np.ndarray) -> np.ndarray:
    """First item of each row, then the number of items, from the number of items in each row."""
    start = np.zeros(len(counts) + 1, np.int64)
    np.cumsum(counts, out=start[1:])
    return start
