"""Reader for untrusted Arrow streams: the sizes that a message declares are checked against the file before Arrow reads it."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import pyarrow as pa
import pyarrow.compute as pc

from tussle.documents import size_of
from tussle.errors import TussleError
from tussle.record.table_values import Rules, check_values

MOST_HEAD = 1 << 24
"""Maximum size of a message's metadata [B]."""
MOST_BODY = 1 << 29
"""Maximum size of a message's body [B]; tussle writes about 5 MB at a time."""
MOST_WORDS = 1 << 26
"""Maximum size of a dictionary column if every row held its longest entry [B]; block names take about 2 MB."""
DICTIONARY, BATCH = 2, 3
"""Message types with a body, from Arrow's Message.fbs."""


class _InvalidStreamError(Exception):
    """The stream is not one that tussle writes, or its metadata is inconsistent."""


def read_batches(
    path: Path,
    notes: list[str],
    error: type[TussleError],
    schema: pa.Schema | None = None,
    rules: Rules | None = None,
    *,
    is_mapped: bool = False,
) -> Iterator[pa.RecordBatch]:
    """Yield the complete batches of a file, in order.

    Args:
        path: The file.
        notes: Receives a line for each part that is missing.
        error: Class of the errors that are raised.
        schema: Required columns; None for any.
        rules: Allowed values by column.
        is_mapped: Leave the rows in the file, which is mapped into memory, and check no values.

    Raises:
        TussleError: As `error`: the file is not a regular file, has other columns, is compressed, or a batch is invalid.
    """
    if not path.exists():
        notes.append(f"{path.name} is missing")
        return
    n = 0
    try:
        end, is_truncated = _complete_part(path)
        if not end:
            notes.append(f"{path.name} is truncated before its first batch")
            return
        with pa.memory_map(str(path)) if is_mapped else pa.OSFile(str(path), "rb") as file:
            reader = pa.ipc.open_stream(file.read_buffer(end) if is_mapped else file.get_stream(0, end))
            if schema is not None:
                _check_schema(reader.schema, schema)
            while (batch := _next(reader)) is not None:
                if schema is not None:
                    batch = pa.RecordBatch.from_arrays(batch.columns, schema=schema)
                batch.validate(full=not is_mapped)
                _check_columns(batch)
                if not is_mapped:
                    check_values(
                        zip(batch.schema.names, batch.columns, strict=True), rules or {}, path, error
                    )
                n += 1
                yield batch
    except (_InvalidStreamError, pa.ArrowException, OSError, ValueError) as reason:
        raise error(f"{path}: cannot be read: {reason}") from None
    if is_truncated:
        notes.append(f"{path.name} is truncated after {n} complete batches")


def _next(reader: pa.RecordBatchReader) -> pa.RecordBatch | None:
    try:
        return reader.read_next_batch()
    except StopIteration:
        return None


def same_columns(found: pa.Schema, wanted: pa.Schema) -> str:
    """Describe the first column that is missing or has another type; "" if there is none."""
    types = dict(zip(found.names, found.types, strict=True))
    wrong = [column for column in wanted if types.get(column.name) != column.type]
    return f"it has no column {wrong[0].name!r} of {wrong[0].type}" if wrong else ""


def _check_schema(found: pa.Schema, wanted: pa.Schema) -> None:
    difference = same_columns(found, wanted)
    if not difference and found.names != wanted.names:
        difference = "it has other columns than a table of tussle"
    if difference:
        raise _InvalidStreamError(difference)


def _check_columns(batch: pa.RecordBatch) -> None:
    """Check that a batch has no nulls where none are allowed, and stays small when its dictionaries are decoded."""
    for field, column in zip(batch.schema, batch.columns, strict=True):
        if not field.nullable and column.null_count:
            raise _InvalidStreamError(f"column {field.name!r} has nulls")
        if pa.types.is_dictionary(column.type):
            column.dictionary.validate(full=True)
            longest = pc.max(pc.binary_length(column.dictionary)).as_py() or 0
            if longest * len(column) > MOST_WORDS:
                raise _InvalidStreamError(
                    f"column {field.name!r} has {len(column):,} rows and a text of {longest:,} bytes; "
                    f"the limit of their product is {MOST_WORDS:,} bytes"
                )


# -- messages -----------------------------------------------------------------------------------------------------------------


def _complete_part(path: Path) -> tuple[int, bool]:
    """End of the last complete message [B], and whether a part of another message follows.

    Raises:
        OSError: It is not a regular file.
        _InvalidStreamError: A message's metadata is invalid.
    """
    size, end = size_of(path), 0
    with path.open("rb") as file:
        while True:
            head = file.read(8)
            if len(head) < 8:
                return end, bool(head)
            mark, length = struct.unpack("<Ii", head)
            if mark != 0xFFFFFFFF:
                if not end:
                    raise _InvalidStreamError("it is not an Arrow stream")
                return end, True
            if length == 0:
                return end + 8, False
            if not 0 < length <= MOST_HEAD or end + 8 + length > size:
                return _refused_or_truncated(end, length, MOST_HEAD)
            body = _body(file, length)
            if body > MOST_BODY or end + 8 + length + body > size:
                return _refused_or_truncated(end, body, MOST_BODY)
            end += 8 + length + body
            file.seek(end)


def _refused_or_truncated(end: int, length: int, most: int) -> tuple[int, bool]:
    if not 0 <= length <= most:
        raise _InvalidStreamError(f"a message declares {length:,} bytes; the limit is {most:,}")
    return end, True


def _body(file: BinaryIO, length: int) -> int:
    """Size of a message's body [B]; checks the sizes that the metadata declares.

    The metadata is a FlatBuffer: a table begins with the offset back to its vtable, which holds the offsets of its fields.
    """
    data = file.read(length)
    try:
        message = _u32(data, 0)
        place = _field(data, message, 1)
        kind = data[place] if place else 0
        place = _field(data, message, 3)
        body: int = struct.unpack_from("<q", data, place)[0] if place else 0
        if kind in (DICTIONARY, BATCH):
            place = _field(data, message, 2)
            header = place + _u32(data, place)
            if kind == DICTIONARY:
                place = _field(data, header, 1)
                header = place + _u32(data, place)
            _check_rows(data, header, body)
    except (struct.error, IndexError):
        raise _InvalidStreamError("the metadata of a message is damaged") from None
    if body < 0:
        raise _InvalidStreamError(f"a message declares {body:,} bytes")
    return body


def _check_rows(data: bytes, header: int, body: int) -> None:
    """Check that a batch is not compressed, and that its body has at least one bit per row."""
    place = _field(data, header, 0)
    rows = struct.unpack_from("<q", data, place)[0] if place else 0
    if _field(data, header, 3):
        raise _InvalidStreamError("it is compressed, which is not supported")
    if not 0 <= rows <= 8 * body:
        raise _InvalidStreamError(f"a batch of {body:,} bytes declares {rows:,} rows")


def _field(data: bytes, table: int, number: int) -> int:
    """Position of a table's field; 0 if the table does not have it."""
    fields = table - struct.unpack_from("<i", data, table)[0]
    at = 4 + 2 * number
    if fields < 0 or table < 0:
        raise IndexError
    if at + 2 > struct.unpack_from("<H", data, fields)[0]:
        return 0
    offset: int = struct.unpack_from("<H", data, fields + at)[0]
    return table + offset if offset else 0


def _u32(data: bytes, place: int) -> int:
    number: int = struct.unpack_from("<I", data, place)[0]
    return number
