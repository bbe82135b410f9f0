"""Reader for untrusted Parquet tables: the memory that a table takes is bounded by the size of its file."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from tussle.declare.displays import counted
from tussle.documents import size_of
from tussle.errors import TussleError
from tussle.record.arrow_file import same_columns
from tussle.record.parquet_blocks import intact_groups
from tussle.record.parquet_sizes import Sizes, sizes_of

MAX_EXPANSION = 1000
"""Maximum memory for each byte of a file, in addition to MARGIN. The results of a batch repeat a run's values in each of its rows,
which Parquet compresses about a hundredfold; a decompression bomb reaches millions."""
MARGIN = 1 << 26
"""Memory that any table may take [B]."""
MAX_COLUMNS = 10_000
AT_ONCE = 65_536
"""Rows that are decoded before their size is checked."""


class ParquetTable:
    """An untrusted table whose undamaged row groups are read one after another.

    Args:
        path: The file.
        wanted: Required columns.
        error: Class of the errors that are raised.
        only: Names of the columns to read, if present; None for all.
        most_rows: Maximum number of rows.
        notes: Receives a line if row groups are damaged, or if the file cannot be read; None if that is an error.
        optional: Names of required columns that files of older versions lack.

    Attributes:
        schema: Of the columns that are read.
        is_readable: False as soon as the file cannot be read on.

    Raises:
        TussleError: As `error`: the file is not a regular file, is not such a table, is damaged, or takes too much memory for its
            size.
    """

    def __init__(
        self,
        path: Path,
        wanted: pa.Schema,
        error: type[TussleError],
        only: Collection[str] | None = None,
        most_rows: int = 2**40,
        notes: list[str] | None = None,
        optional: Collection[str] = (),
    ) -> None:
        self._path, self._error, self._notes = path, error, notes
        self.schema, self.is_readable = wanted, True
        self._groups: list[int] | None = None
        with self._reported():
            size = size_of(path)
            self._most = MARGIN + MAX_EXPANSION * size
            with path.open("rb") as opened:
                self._groups = _intact_groups(path, opened, size, error, notes)
                sizes = sizes_of(opened, size, self._groups)
            if problem := _too_large(sizes, self._most, most_rows):
                raise error(f"{path}: {problem}")
            with pq.ParquetFile(path) as file:
                schema = file.schema_arrow
            if difference := same_columns(schema, wanted, optional):
                raise error(f"{path}: is another table; {difference}")
            names = [name for name in schema.names if only is None or name in only]
            if problem := _columns_problem(schema, names):
                raise error(f"{path}: {problem}")
            self.schema = pa.schema([schema.field(name) for name in names])

    def __iter__(self) -> Iterator[pa.RecordBatch]:
        if not self.is_readable:
            return
        texts = [name for name in self.schema.names if _is_text(self.schema.field(name).type)]
        with (
            self._reported(),
            pq.ParquetFile(self._path, read_dictionary=texts, page_checksum_verification=True) as file,
        ):
            batches = _decoded(file, self.schema, self._most, self._groups)
            yield from batches if self._groups is not None else list(batches)  # of a damaged file, nothing

    def read(self) -> pa.Table:
        """All rows; none if the file cannot be read, where that is only noted."""
        batches = list(self)
        if not self.is_readable:
            return self.schema.empty_table()
        return pa.Table.from_batches(batches, self.schema).combine_chunks()

    @contextmanager
    def _reported(self) -> Iterator[None]:
        """Tell why the file cannot be read."""
        try:
            yield
        except (OSError, ValueError, TypeError, KeyError, pa.ArrowException) as reason:
            self.is_readable = False
            if self._notes is None:
                raise self._error(f"{self._path}: cannot be read: {reason}") from None
            self._notes.append(f"{self._path.name} cannot be read: {reason}")


def _columns_problem(schema: pa.Schema, names: list[str]) -> str:
    """Describe what is wrong with the columns; "" if nothing is."""
    if len(schema) > MAX_COLUMNS or len(set(schema.names)) < len(schema):
        return f"it has {len(schema):,} columns; at most {MAX_COLUMNS:,} with unique names are allowed"
    other = [schema.field(name) for name in names if not _is_supported(schema.field(name).type)]
    return f"column {other[0].name!r} has type {other[0].type}, which is not supported" if other else ""


def _is_supported(kind: pa.DataType) -> bool:
    is_encoded, is_list = pa.types.is_dictionary(kind), kind == pa.list_(pa.float64())
    inner = kind.value_type if is_encoded else kind
    is_number = pa.types.is_integer(inner) or pa.types.is_floating(inner) or pa.types.is_boolean(inner)
    return is_list or is_number or _is_text(inner)


def _is_text(kind: pa.DataType) -> bool:
    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind))


def _too_large(sizes: Sizes, most: int, most_rows: int) -> str:
    """Describe the size that exceeds its limit; "" if none does."""
    if not 0 <= sizes.rows <= most_rows:
        return f"it has {sizes.rows:,} rows; the limit is {most_rows:,}"
    if sizes.largest > MARGIN:
        return f"it has a page of {sizes.largest:,} bytes; the limit is {MARGIN:,}"
    n_bytes = max(8 * sizes.rows, 8 * sizes.values, sizes.bytes)
    return (
        ""
        if n_bytes <= most
        else f"it takes {n_bytes:,} bytes in memory; the limit for a file of its size is {most:,}"
    )


def _intact_groups(
    path: Path, file: BinaryIO, size: int, error: type[TussleError], notes: list[str] | None
) -> list[int] | None:
    """Row groups whose checksums match; None if the file has no checksums.

    Raises:
        TussleError: As `error`: a row group is damaged, and there are no notes to tell it.
        ValueError: The footer is damaged.
    """
    found = intact_groups(file, size)
    if found is None:
        return None
    intact, n = found
    if len(intact) < n:
        damage = f"{path.name} is damaged: the checksums of {n - len(intact)} of {counted(n, 'row group')} do not match"
        if notes is None:
            raise error(f"{path.parent}: {damage}")
        notes.append(damage)
    return intact


def _decoded(
    file: pq.ParquetFile, schema: pa.Schema, most: int, groups: list[int] | None
) -> Iterator[pa.RecordBatch]:
    """Decode the rows in batches, none of which has rows of two groups; texts stay dictionary-encoded until their size is known.

    Raises:
        ValueError: They take too much memory.
    """
    left = most
    for group in range(file.num_row_groups) if groups is None else groups:
        for batch in file.iter_batches(AT_ONCE, row_groups=[group], columns=schema.names):
            batch.validate(full=True)
            left -= sum(_length(column) for column in batch.columns)
            if left < 0:
                raise ValueError(f"it takes more than {most:,} bytes in memory")
            columns = [column.cast(field.type) for column, field in zip(batch.columns, schema, strict=True)]
            yield pa.RecordBatch.from_arrays(columns, schema=schema)


def _length(column: pa.Array) -> int:
    """Size of a decoded column [B]."""
    if not pa.types.is_dictionary(column.type):
        return int(column.nbytes)
    lengths = pc.binary_length(column.dictionary).take(column.indices)
    return 4 * len(column) + (pc.sum(lengths.cast(pa.int64())).as_py() or 0)
