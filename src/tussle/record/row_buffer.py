"""Buffer for rows of the body table that are written to a file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyarrow as pa

from tussle.api.bodies import FLOATS, STORED_INTS
from tussle.record.arrow_values import arrow_array
from tussle.record.plugin_columns import PluginColumn, Values
from tussle.record.schema import FLOAT_COLUMNS, INT_COLUMNS, TRAJECTORY

CAPACITY = 32_768
"""Rows in a batch: 5 MB, where Arrow's overhead per batch is negligible."""

_FIRST = {name: sum(list(FLOATS.values())[:i]) for i, name in enumerate(FLOATS)}
_N_STATE = FLOATS["pos"] + FLOATS["vel"] + FLOATS["quat"]
assert (_FIRST["vel"], _FIRST["quat"]) == (3, 6), "pos, vel and quat are copied as one block"


class RowSelection:
    """Selected rows of a body table in the order of the file; valid until entities are added or removed.

    Args:
        ints: Integer columns of the table, (6, n).
        worlds: Mask of the worlds to select, (n_worlds,); None for all.

    Attributes:
        order: Rows ordered by (world, id), (m,); None if these are all rows as they are stored.
        columns: INT_COLUMNS of these rows, (4, m).
        world: World of each, (m,).
    """

    def __init__(self, ints: np.ndarray, worlds: np.ndarray | None = None) -> None:
        by_name = dict(zip(STORED_INTS, ints, strict=True))
        world, ids = by_name["world"], by_name["id"]
        order = np.lexsort((ids, world))
        if worlds is not None:
            order = order[worlds[world[order]]]
        is_all = len(order) == len(world) and bool((order[1:] > order[:-1]).all())
        self.order = None if is_all else order
        self.columns = np.array([by_name[name][order] for name in INT_COLUMNS], np.int32)
        self.world = world[order]
        self.n = len(order)


class RowBuffer:
    """Preallocated columns that are filled step by step and written batch by batch.

    Args:
        blocks: Names of the blocks, by number.
        start: Time of step 0 [s].
        dt: Length of a step [s].
        columns: Columns of plugins.
        capacity: Rows in a batch.

    Attributes:
        schema: Columns of the batches.
    """

    def __init__(
        self,
        blocks: Sequence[str],
        start: float,
        dt: float,
        columns: Sequence[PluginColumn] = (),
        capacity: int = CAPACITY,
    ) -> None:
        self.start, self.dt, self._columns = start, dt, columns
        self.schema = pa.schema([*TRAJECTORY, *(part for column in columns for part in column.schema())])
        self._blocks = arrow_array(blocks, pa.string())
        self._allocate(capacity)

    def _allocate(self, capacity: int) -> None:
        self.capacity, self.n = capacity, 0
        self._floats = np.empty((len(FLOAT_COLUMNS), capacity))
        self._ints = np.empty((len(INT_COLUMNS), capacity), np.int32)
        self._step = np.empty(capacity, np.int32)
        self._values: list[Values] = [
            (np.empty((len(c.parts), capacity), c.dtype), np.empty(capacity, bool)) for c in self._columns
        ]

    def has_room(self, n: int) -> bool:
        return self.n + n <= self.capacity

    def add(
        self, floats: np.ndarray, rows: RowSelection, step: int | np.ndarray, values: Sequence[Values] = ()
    ) -> None:
        """Copy rows of a body table. The buffer must be empty or have room.

        Args:
            floats: Float columns of the table, (22, n).
            rows: Rows to copy.
            step: Step of all rows, or of each row, (m,).
            values: Of the columns of plugins, for all rows of the table.
        """
        if not self.has_room(rows.n):
            assert self.n == 0
            self._allocate(rows.n)
        first, last = self.n, self.n + rows.n
        out = self._floats[:, first:last]
        if rows.order is None:
            out[:_N_STATE] = floats[:_N_STATE]
            out[_N_STATE] = floats[_FIRST["health"]]
        else:
            out[:_N_STATE] = floats[:_N_STATE].take(rows.order, axis=1)
            out[_N_STATE] = floats[_FIRST["health"]].take(rows.order)
        self._ints[:, first:last] = rows.columns
        self._step[first:last] = step
        for own, new in zip(self._values, values, strict=True):
            for stored, found in zip(own, new, strict=True):
                stored[..., first:last] = found if rows.order is None else found.take(rows.order, axis=-1)
        self.n = last

    def take(self) -> pa.RecordBatch:
        """Empty the buffer; the returned batch is a view of it and must be written before the next `add`."""
        n = self.n
        self.n = 0
        step = self._step[:n]
        columns = dict(zip(FLOAT_COLUMNS, self._floats[:, :n], strict=True))
        columns |= dict(zip(INT_COLUMNS, self._ints[:, :n], strict=True))
        columns |= {"step": step, "t": self.start + step.astype(np.int64) * self.dt}  # as in the clock
        arrays = {name: arrow_array(column) for name, column in columns.items()}
        arrays["block"] = pa.DictionaryArray.from_arrays(arrays["block"], self._blocks)
        for column, (values, has_value) in zip(self._columns, self._values, strict=True):
            mask = None if has_value[:n].all() else ~has_value[:n]
            parts = (arrow_array(part[:n], mask=mask) for part in values)
            arrays |= dict(zip(column.parts, parts, strict=True))
        return pa.RecordBatch.from_arrays([arrays[name] for name in self.schema.names], schema=self.schema)
