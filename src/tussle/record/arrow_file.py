"""Reads Arrow streams that anybody may have written: what a message says of its size is compared with the file before it is believed."""

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
"""Bytes of what a message says of itself."""
MOST_BODY = 1 << 29
"""Bytes of the rows of a message; tussle writes some 5 MB at a time."""
MOST_WORDS = 1 << 26
"""Bytes of a batch's column that counts in words, were each written out, and the longest in all rows: names take some 2 MB."""
DICTIONARY, BATCH = 2, 3
"""Kinds of messages that have a body, in Arrow's Message.fbs."""


class _LyingError(Exception):
    """A message says what cannot be."""


def read_batches(
    path: Path,
    notes: list[str],
    error: type[TussleError],
    schema: pa.Schema | None = None,
    rules: Rules | None = None,
) -> Iterator[pa.RecordBatch]:
    """All whole batches of a file, one after another; what is missing of it is added to `notes`.

    Args:
        path: The file.
        notes: Receives what is missing.
        error: What is raised.
        schema: The columns that it must have; None for any.
        rules: What their values may be.

    Raises:
        TussleError: It is no regular file, has other columns, is compressed, or a batch does not hold what it says.
    """
    if not path.exists():
        notes.append(f"{path.name} is not there")
        return
    n = 0
    try:
        end, cut = _whole(path)
        if not end:
            notes.append(f"{path.name} is cut before its first batch")
            return
        with pa.OSFile(str(path), "rb") as file, pa.ipc.open_stream(file.get_stream(0, end)) as reader:
            if schema is not None:
                _check_schema(reader.schema, schema)
            while (batch := _next(reader)) is not None:
                if schema is not None:
                    batch = pa.RecordBatch.from_arrays(batch.columns, schema=schema)
                _check_batch(batch)
                check_values(zip(batch.schema.names, batch.columns, strict=True), rules or {}, path, error)
                n += 1
                yield batch
    except (_LyingError, pa.ArrowException, OSError, ValueError) as reason:
        raise error(f"{path}: cannot be read: {reason}") from None
    if cut:
        notes.append(f"{path.name} is cut after {n} whole batches")


def _next(reader: pa.RecordBatchReader) -> pa.RecordBatch | None:
    try:
        return reader.read_next_batch()
    except StopIteration:
        return None


def same_columns(found: pa.Schema, wanted: pa.Schema) -> str:
    """Which column of a schema is another one, or missing; "" for none."""
    types = dict(zip(found.names, found.types, strict=True))
    wrong = [column for column in wanted if types.get(column.name) != column.type]
    return f"it has no column {wrong[0].name!r} of {wrong[0].type}" if wrong else ""


def _check_schema(found: pa.Schema, wanted: pa.Schema) -> None:
    said = same_columns(found, wanted)
    if not said and found.names != wanted.names:
        said = "it has other columns than a table of tussle"
    if said:
        raise _LyingError(said)


def _check_batch(batch: pa.RecordBatch) -> None:
    """See that offsets, numbers of words and texts are those of the batch."""
    batch.validate(full=True)
    for field, column in zip(batch.schema, batch.columns, strict=True):
        if not field.nullable and column.null_count:
            raise _LyingError(f"column {field.name!r} lacks values")
        if pa.types.is_dictionary(column.type):
            column.dictionary.validate(full=True)
            longest = pc.max(pc.binary_length(column.dictionary)).as_py() or 0
            if longest * len(column) > MOST_WORDS:
                raise _LyingError(
                    f"column {field.name!r} holds a word of {longest:,} bytes in {len(column):,} rows, "
                    f"which may be {MOST_WORDS:,} bytes in all"
                )


# -- messages -----------------------------------------------------------------------------------------------------------------


def _whole(path: Path) -> tuple[int, bool]:
    """Where the last whole message ends, and whether a part of another is behind it.

    Raises:
        OSError: It is no regular file.
        _LyingError: A message says what cannot be.
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
                    raise _LyingError("this is no stream of Arrow's format")
                return end, True
            if length == 0:
                return end + 8, False
            if not 0 < length <= MOST_HEAD or end + 8 + length > size:
                return _refused_or_cut(end, length, MOST_HEAD)
            body = _body(file, length)
            if body > MOST_BODY or end + 8 + length + body > size:
                return _refused_or_cut(end, body, MOST_BODY)
            end += 8 + length + body
            file.seek(end)


def _refused_or_cut(end: int, length: int, most: int) -> tuple[int, bool]:
    if not 0 <= length <= most:
        raise _LyingError(f"a message says that it has {length:,} bytes; allowed are {most:,}")
    return end, True


def _body(file: BinaryIO, length: int) -> int:
    """Bytes of a message's body, after the sizes that it names have been checked.

    The offsets are those of FlatBuffers: a table begins with the way back to the list of where its fields are.
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
        raise _LyingError("what a message says of itself is damaged") from None
    if body < 0:
        raise _LyingError(f"a message says that it has {body:,} bytes")
    return body


def _check_rows(data: bytes, header: int, body: int) -> None:
    """See that a batch is not compressed, and has no more rows than bits."""
    place = _field(data, header, 0)
    rows = struct.unpack_from("<q", data, place)[0] if place else 0
    if _field(data, header, 3):
        raise _LyingError("it is compressed, which tables of tussle are not")
    if not 0 <= rows <= 8 * body:
        raise _LyingError(f"a batch of {body:,} bytes says that it has {rows:,} rows")


def _field(data: bytes, table: int, number: int) -> int:
    """Where a field of a table lies; 0 where the table does not have it."""
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
