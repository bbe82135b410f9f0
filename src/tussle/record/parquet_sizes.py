"""The sizes that a Parquet file declares, read before Arrow opens it.

Arrow allocates as much memory as a page declares, and aborts the process on the sizes of a damaged footer. The field numbers are
those of parquet.thrift (Apache Parquet 2.9), encoded in Thrift's compact protocol.
"""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Any, BinaryIO

MAX_FOOTER = 1 << 22
MAX_PAGES = 300_000
MAX_HEAD = 1 << 16
"""Maximum size of a page header [B]."""
MAX_DEPTH = 16
TRUE, FALSE, BYTE, DOUBLE, BINARY, LIST, SET, STRUCT = 1, 2, 3, 7, 8, 9, 10, 12
ROWS, GROUPS = 3, 4
COLUMNS, GROUP_ROWS = 1, 3
ELSEWHERE, ABOUT = 1, 3
VALUES, PACKED, DATA_AT, DICTIONARY_AT = 5, 7, 9, 11
PAGE_SIZE, PAGE_PACKED, PAGE_KINDS, PAGE_VALUES = 2, 3, (5, 7, 8), 1


@dataclass
class Sizes:
    """Sizes that a file declares.

    Attributes:
        rows: Rows of the table, or of its row groups together if these are more.
        values: Values of the column that has the most.
        bytes: Decompressed size of all pages [B].
        largest: Decompressed size of the largest page [B].
    """

    rows: int
    values: int = 0
    bytes: int = 0
    largest: int = 0


def sizes_of(file: BinaryIO, size: int, only: Collection[int] | None = None) -> Sizes:
    """Read the sizes that a file declares.

    Args:
        file: The file.
        size: Its size [B].
        only: Numbers of the row groups that are read; None for all.

    Raises:
        ValueError: It is not a Parquet file, or is damaged.
    """
    try:
        file.seek(max(0, size - 8))
        length, mark = struct.unpack("<I4s", file.read(8))
        if mark != b"PAR1" or not 0 < length <= min(MAX_FOOTER, size - 8):
            raise ValueError("it is not a Parquet file")
        file.seek(size - 8 - length)
        footer, _ = _value(STRUCT, file.read(length), 0, 0)
        groups = footer.get(GROUPS, [])
        found = Sizes(max(footer[ROWS], sum(group[GROUP_ROWS] for group in groups)))
        values: dict[int, int] = {}
        n_pages = 0
        for number, group in enumerate(groups):
            if only is not None and number not in only:
                continue
            for i, column in enumerate(group[COLUMNS]):
                for n, page in _pages(file, column, size):
                    n_pages += 1
                    if n_pages > MAX_PAGES:
                        raise ValueError(f"it has more than {MAX_PAGES:,} pages")
                    values[i] = values.get(i, 0) + n
                    found.bytes, found.largest = found.bytes + page, max(found.largest, page)
        found.values = max(values.values(), default=0)
    except (struct.error, LookupError, TypeError, AttributeError, OverflowError) as error:
        raise ValueError(f"its metadata is damaged ({type(error).__name__})") from None
    return found


def _pages(file: BinaryIO, column: dict[int, Any], size: int) -> Iterator[tuple[int, int]]:
    """Number of values and decompressed size [B] of each page of a column."""
    about = column[ABOUT]
    if about[VALUES] == 0:  # Arrow writes no offsets then, and reads no page
        return
    at = min(about[DATA_AT], about.get(DICTIONARY_AT) or about[DATA_AT])
    end = at + about[PACKED]
    if ELSEWHERE in column or not 0 < at < end <= size:
        raise ValueError("a column lies outside the file")
    while at < end:
        file.seek(at)
        page, length = _value(STRUCT, file.read(min(MAX_HEAD, end - at)), 0, 0)
        n = max((page[kind][PAGE_VALUES] for kind in PAGE_KINDS if kind in page), default=0)
        if min(n, page[PAGE_SIZE], page[PAGE_PACKED]) < 0:
            raise ValueError("a page declares a negative size")
        yield n, page[PAGE_SIZE]
        at += length + page[PAGE_PACKED]


# -- Thrift's compact protocol --------------------------------------------------------------------------------------------------


def _value(kind: int, data: bytes, at: int, depth: int) -> tuple[Any, int]:
    """Decode a value; also return the position behind it. A struct is a dict from field numbers to values."""
    if depth > MAX_DEPTH:
        raise ValueError("its metadata is nested too deeply")
    if kind == BYTE:
        return data[at], at + 1
    if kind == DOUBLE:
        return None, at + 8
    if kind == BINARY:
        length, at = _varint(data, at)
        return None, at + length
    if kind in (LIST, SET):
        return _list(data, at, depth)
    if kind == STRUCT:
        return _struct(data, at, depth)
    if kind in (TRUE, FALSE):
        return None, at
    if kind in (4, 5, 6):
        number, at = _varint(data, at)
        return (number >> 1) ^ -(number & 1), at
    raise ValueError(f"its metadata is damaged (a field of type {kind})")


def _struct(data: bytes, at: int, depth: int) -> tuple[dict[int, Any], int]:
    found: dict[int, Any] = {}
    number = 0
    while head := data[at]:
        at += 1
        if head >> 4:
            number += head >> 4
        else:
            number, at = _value(4, data, at, depth)
        found[number], at = _value(head & 15, data, at, depth + 1)
    return found, at + 1


def _list(data: bytes, at: int, depth: int) -> tuple[list[Any], int]:
    head = data[at]
    n, at = head >> 4, at + 1
    if n == 15:
        n, at = _varint(data, at)
    kind = head & 15
    if n > len(data) - at:  # each item takes at least a byte
        raise ValueError("a list declares more items than the file has bytes")
    found = []
    for _ in range(n):
        item, at = _value(BYTE if kind in (TRUE, FALSE) else kind, data, at, depth + 1)
        found.append(item)
    return found, at


def _varint(data: bytes, at: int) -> tuple[int, int]:
    number = shift = 0
    while True:
        byte = data[at]
        number |= (byte & 127) << shift
        at, shift = at + 1, shift + 7
        if byte < 128:
            return number, at
        if shift > 63:
            raise ValueError("a number is longer than 64 bits")
