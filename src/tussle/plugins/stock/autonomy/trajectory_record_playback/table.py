"""Recorded trajectories, read from a table."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tussle.errors import ParameterError
from tussle.tables import check_columns, check_one_state, read_csv, whole_numbers

COLUMNS = ("id", "t", "x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz")


class TrajectoryTable(NamedTuple):
    """States of entities at times.

    Attributes:
        id: Ids, ascending, (m,).
        start: First state of each, then the number of states, (m + 1,).
        t: Time of each state [s], ascending for each entity, (k,).
        values: x y z [m], qw qx qy qz, vx vy vz [m/s], (10, k).
    """

    id: np.ndarray
    start: np.ndarray
    t: np.ndarray
    values: np.ndarray

    def at(self, ids: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Find the states of entities at times [s], (n,) each.

        Returns:
            For each entity, the index of its last state not after the time, else of its first state; and the time of its last state.
        """
        place = np.searchsorted(self.id, ids)
        first, end = self.start[place], self.start[place + 1]
        low, high = first.copy(), end.copy()
        while (low < high).any():  # bisection, for all rows at once
            middle = np.minimum((low + high) // 2, end - 1)
            is_past = (low < high) & (self.t[middle] <= t)
            low, high = np.where(is_past, middle + 1, low), np.where(is_past | (low >= high), high, middle)
        return np.maximum(low - 1, first), self.t[end - 1]


def read_recorded(name: str) -> TrajectoryTable:
    """Read a table in CSV with the columns of a recorded run; of several worlds, the first one.

    Raises:
        ParameterError: The file cannot be read, has no such columns, or a value is no finite number.
    """
    path = Path(name)
    try:
        about = path.stat()
    except OSError as error:
        raise ParameterError(f"{name}: {error.strerror}; it takes a table of `tussle export --csv`") from None
    return _read(name, about.st_mtime_ns, about.st_size)


@lru_cache(maxsize=8)
def _read(name: str, _changed: int, _size: int) -> TrajectoryTable:
    table = read_csv(name, name, ParameterError)
    check_columns(name, table.column_names, COLUMNS, ParameterError)
    data: dict[str, Any] = {}
    for column in (*COLUMNS, *({"world"} & set(table.column_names))):
        try:
            data[column] = table[column].to_numpy().astype(float)
        except (TypeError, ValueError):
            raise ParameterError(f"{name}: column {column!r} has values that are no numbers") from None
        bad = np.flatnonzero(~np.isfinite(data[column]))
        if len(bad):
            raise ParameterError(f"{name}, line {bad[0] + 2}: {column} is not a finite number")
    order = np.lexsort((data["t"], data["id"]))
    if "world" in data:
        order = order[data["world"][order] == data["world"].min(initial=np.inf)]
    each, t = whole_numbers(name, "id", data["id"], ParameterError)[order], data["t"][order]
    values = np.stack([data[column][order] for column in COLUMNS[2:]])
    check_one_state(name, each, t, values, ParameterError)
    ids, start = np.unique(each, return_index=True)
    return TrajectoryTable(ids, np.append(start, len(order)), t, values)
