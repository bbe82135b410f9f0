"""The storage of one group: all columns of its plugins as rows of one array per dtype."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tussle.engine import kernels

DTYPES: dict[type, Any] = {float: np.float64, int: np.int64, bool: np.bool_}


_GATHER = {float: kernels.gather_floats, int: kernels.gather_ints, bool: kernels.gather_truths}


@dataclass(frozen=True, slots=True)
class Place:
    """Where a column lies: `k` rows from `first` in the array of a dtype; k = 0 is one row seen as (n,)."""

    dtype: type
    first: int
    k: int


@dataclass
class Table:
    """Columns of n rows. Declare all with `add`, then `rows` gives each its array; `rearrange` moves rows.

    Attributes:
        n: Number of rows.
        arrays: dtype -> (columns, n).
        places: Column key -> its place.
    """

    n: int = 0
    defaults: dict[type, list[float]] = field(default_factory=lambda: {float: [], int: [], bool: []})
    arrays: dict[type, np.ndarray] = field(default_factory=dict)
    places: dict[Any, Place] = field(default_factory=dict)

    def add(self, key: Any, dtype: type, k: int, default: Any = 0.0) -> Place:
        """Declare a column of k components (0: one number a row); default is a number or k numbers."""
        values = self.defaults[dtype]
        place = Place(dtype, len(values), k)
        values.extend(default if isinstance(default, tuple) else [default] * max(1, k))
        self.places[key] = place
        return place

    def allocate(self, n: int) -> None:
        """Make room for n rows at their defaults."""
        self.n = n
        for dtype, values in self.defaults.items():
            self.arrays[dtype] = np.repeat(np.array(values, DTYPES[dtype])[:, None], n, axis=1)

    def array(self, place: Place) -> np.ndarray:
        """The array of a place, (n,) or (k, n), C-contiguous."""
        data = self.arrays[place.dtype]
        return data[place.first : place.first + place.k] if place.k else data[place.first]

    def rearrange(self, index: np.ndarray, first: int = 0) -> bool:
        """New row i is old row index[i] - first; one below 0 is a new row at the defaults. Whether the arrays are other ones."""
        if kernels.stays(index, first, self.n):
            fresh = np.flatnonzero(index < 0)
            for dtype, values in self.defaults.items():
                self.arrays[dtype][:, fresh] = np.array(values, DTYPES[dtype])[:, None]
            return False
        for dtype, old in self.arrays.items():
            new = np.empty((len(old), len(index)), old.dtype)
            if len(old):
                _GATHER[dtype](old, first, np.array(self.defaults[dtype], old.dtype)[:, None], index, new)
            self.arrays[dtype] = new
        self.n = len(index)
        return True

    def copy(self) -> dict[type, np.ndarray]:
        return {dtype: array.copy() for dtype, array in self.arrays.items()}

    def restore(self, arrays: dict[type, np.ndarray]) -> None:
        self.arrays = {dtype: array.copy() for dtype, array in arrays.items()}
        self.n = self.arrays[float].shape[1] if arrays else 0
