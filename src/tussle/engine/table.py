"""Storage of one group: the columns of its plugins as rows of one array per dtype, and its lists."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tussle.declare.columns import Numbers
from tussle.declare.lists import RaggedColumn
from tussle.engine import kernels

DTYPES: dict[type, Any] = {float: np.float64, int: np.int64, bool: np.bool_}


_GATHER = {float: kernels.gather_floats, int: kernels.gather_ints, bool: kernels.gather_truths}


def span(rows: np.ndarray) -> Any:
    """Return ascending rows as a slice if they are contiguous, which is faster to write to; otherwise unchanged."""
    first, last = rows[0], rows[-1] + 1
    return slice(first, last) if last - first == len(rows) else rows


@dataclass(frozen=True, slots=True)
class ColumnPlace:
    """Location of a column: `k` rows from `first` in the array of a dtype; k = 0 is one row with shape (n,)."""

    dtype: type
    first: int
    k: int


@dataclass(frozen=True, slots=True)
class Stored:
    """Copy of rows of a table: dtype -> (columns, n), and lists."""

    arrays: dict[type, np.ndarray]
    lists: list[RaggedColumn]


@dataclass
class Table:
    """Columns of n rows. Declare columns with `add` and `add_list`, then call `allocate`.

    Attributes:
        n: Number of rows.
        arrays: dtype -> (columns, n).
        fresh: dtype -> values of a new row, (columns, 1).
        places: Column key -> location.
        lists: List columns, in order of declaration.
    """

    n: int = 0
    defaults: dict[type, list[float]] = field(default_factory=lambda: {float: [], int: [], bool: []})
    arrays: dict[type, np.ndarray] = field(default_factory=dict)
    fresh: dict[type, np.ndarray] = field(default_factory=dict)
    places: dict[Any, ColumnPlace] = field(default_factory=dict)
    lists: list[RaggedColumn] = field(default_factory=list)

    def add(self, key: Any, dtype: type, k: int, default: Any = 0.0) -> ColumnPlace:
        """Declare a column of k components (0: one number per row); the default is a number or k numbers."""
        values = self.defaults[dtype]
        place = ColumnPlace(dtype, len(values), k)
        values.extend(default if isinstance(default, tuple) else [default] * max(1, k))
        self.places[key] = place
        return place

    def add_list(self, declaration: Numbers) -> int:
        """Declare a list per row, initially empty. Returns its index in `lists`."""
        self.lists.append(RaggedColumn.empty(0, declaration))
        return len(self.lists) - 1

    def allocate(self, n: int) -> None:
        """Allocate n rows with default values."""
        self.n = n
        for dtype, values in self.defaults.items():
            self.fresh[dtype] = np.array(values, DTYPES[dtype])[:, None]
            self.arrays[dtype] = np.repeat(self.fresh[dtype], n, axis=1)
        self.lists = [column.take(np.full(n, -1)) for column in self.lists]

    def array(self, place: ColumnPlace) -> np.ndarray:
        """Return the array of a column, (n,) or (k, n), C-contiguous."""
        data = self.arrays[place.dtype]
        return data[place.first : place.first + place.k] if place.k else data[place.first]

    def renew(self, rows: np.ndarray) -> None:
        """Reset rows, (m,), to the defaults."""
        places = span(rows)
        for dtype, values in self.fresh.items():
            if len(values):
                self.arrays[dtype][:, places] = values
        for column in self.lists:
            column.put(rows, column.take(np.full(len(rows), -1)))

    def rearrange(self, index: np.ndarray, first: int = 0) -> None:
        """Reorder rows into new arrays: new row i is old row index[i] - first; negative indices are new rows with default values."""
        for dtype, old in self.arrays.items():
            new = np.empty((len(old), len(index)), old.dtype)
            if len(old):
                _GATHER[dtype](old, first, self.fresh[dtype], index, new)
            self.arrays[dtype] = new
        if self.lists:
            index = np.where(index >= 0, index - first, -1)
            self.lists = [column.take(index) for column in self.lists]
        self.n = len(index)

    def copy(self) -> Stored:
        return Stored({d: a.copy() for d, a in self.arrays.items()}, [c.copy() for c in self.lists])

    def take(self, rows: np.ndarray) -> Stored:
        """Copy some rows."""
        arrays = {d: np.ascontiguousarray(a[:, rows]) for d, a in self.arrays.items()}
        return Stored(arrays, [column.take(rows) for column in self.lists])

    def put(self, rows: np.ndarray, part: Table) -> None:
        """Write rows from a table that holds only these rows."""
        for dtype, array in part.arrays.items():
            self.arrays[dtype][:, rows] = array
        for column, lists in zip(self.lists, part.lists, strict=True):
            column.put(rows, lists)

    def restore(self, stored: Stored) -> None:
        self.arrays = {dtype: array.copy() for dtype, array in stored.arrays.items()}
        self.lists = [column.copy() for column in stored.lists]
        self.n = self.arrays[float].shape[1] if self.arrays else 0
