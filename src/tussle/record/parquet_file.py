"""Reads Parquet tables that anybody may have written: what a table says it takes in memory is bounded by the size of its file."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from tussle.documents import size_of
from tussle.errors import TussleError
from tussle.record.arrow_file import same_columns
from tussle.record.parquet_sizes import Sizes, sizes_of

MOST_EXPANSION = 1000
"""Bytes in memory for each byte of a table's file, besides those that any table may take. In the results of a batch all that is of a run
stands in each of its rows, which Parquet packs a hundred times smaller; a file that is a bomb goes to some millions."""
MARGIN = 1 << 26
MOST_COLUMNS = 10_000
AT_ONCE = 65_536
"""Rows that are unpacked before their size is looked at."""


def read_parquet(
    path: Path,
    wanted: pa.Schema,
    error: type[TussleError],
    only: Collection[str] | None = None,
    most_rows: int = 2**40,
) -> pa.Table:
    """A table.

    Args:
        path: The file.
        wanted: Columns that it has at least.
        error: What is raised.
        only: Columns that are read, so far as they are there; None for all.
        most_rows: Rows that it may have.

    Raises:
        TussleError: It is no regular file, no such table, damaged, or takes far more memory than its size lets expect.
    """
    try:
        size = size_of(path)
        most = MARGIN + MOST_EXPANSION * size
        with path.open("rb") as opened:
            sizes = sizes_of(opened, size)
        if said := _too_large(sizes, most, most_rows):
            raise error(f"{path}: {said}")
        with pq.ParquetFile(path) as file:
            schema = file.schema_arrow
        if said := same_columns(schema, wanted):
            raise error(f"{path}: is another table; {said}")
        names = [name for name in schema.names if only is None or name in only]
        if said := _against(schema, names):
            raise error(f"{path}: {said}")
        texts = [name for name in names if _is_text(schema.field(name).type)]
        with pq.ParquetFile(path, read_dictionary=texts, page_checksum_verification=True) as file:
            return _unpacked(file, pa.schema([schema.field(name) for name in names]), most)
    except (OSError, ValueError, TypeError, KeyError, pa.ArrowException) as reason:
        raise error(f"{path}: cannot be read: {reason}") from None


def _against(schema: pa.Schema, names: list[str]) -> str:
    """What is wrong with the columns; "" for nothing."""
    if len(schema) > MOST_COLUMNS or len(set(schema.names)) < len(schema):
        return f"it has {len(schema):,} columns; allowed are {MOST_COLUMNS:,}, each with a name of its own"
    odd = [schema.field(name) for name in names if not _is_plain(schema.field(name).type)]
    return f"column {odd[0].name!r} holds {odd[0].type}, which is not read" if odd else ""


def _is_plain(kind: pa.DataType) -> bool:
    is_packed, is_list = pa.types.is_dictionary(kind), kind == pa.list_(pa.float64())
    inner = kind.value_type if is_packed else kind
    is_number = pa.types.is_integer(inner) or pa.types.is_floating(inner) or pa.types.is_boolean(inner)
    return is_list or is_number or _is_text(inner)


def _is_text(kind: pa.DataType) -> bool:
    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind))


def _too_large(sizes: Sizes, most: int, most_rows: int) -> str:
    """What is wrong with the sizes that a file names; "" for nothing."""
    if not 0 <= sizes.rows <= most_rows:
        return f"it has {sizes.rows:,} rows; allowed are {most_rows:,}"
    if sizes.largest > MARGIN:
        return f"it has a page of {sizes.largest:,} bytes; allowed are {MARGIN:,}"
    n_bytes = max(8 * sizes.rows, 8 * sizes.values, sizes.bytes)
    return (
        ""
        if n_bytes <= most
        else f"unpacked it takes {n_bytes:,} bytes; a file of its size may take {most:,}"
    )


def _unpacked(file: pq.ParquetFile, schema: pa.Schema, most: int) -> pa.Table:
    """The rows of a table, some at a time; texts stay packed until it is known how long they are.

    Raises:
        ValueError: They take too much memory.
    """
    batches, left = [], most
    for batch in file.iter_batches(AT_ONCE, columns=schema.names):
        batch.validate(full=True)
        left -= sum(_length(column) for column in batch.columns)
        if left < 0:
            raise ValueError(f"unpacked it takes more than {most:,} bytes")
        columns = [column.cast(field.type) for column, field in zip(batch.columns, schema, strict=True)]
        batches.append(pa.RecordBatch.from_arrays(columns, schema=schema))
    return pa.Table.from_batches(batches, schema).combine_chunks()


def _length(column: pa.Array) -> int:
    """Bytes of a column once it is unpacked."""
    if not pa.types.is_dictionary(column.type):
        return int(column.nbytes)
    lengths = pc.binary_length(column.dictionary).take(column.indices)
    return 4 * len(column) + (pc.sum(lengths.cast(pa.int64())).as_py() or 0)
