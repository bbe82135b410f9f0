"""Parquet tables in blocks of whole runs: the file holds a checksum of each row group, and one of its footer.

Parquet's own checksums cover neither the headers of pages nor the footer.
"""

from __future__ import annotations

import re
import zlib
from itertools import pairwise
from pathlib import Path
from typing import BinaryIO, Self

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from tussle.checksums import BLANK, MARK, N_DIGITS, as_digits, crc_of_part, crc_with_zeros
from tussle.record.parquet_sizes import MAX_FOOTER

ROWS_OF_GROUP = 8192
"""Rows of a row group, rounded down to whole runs. What a damaged byte destroys is the runs of its group."""
GROUPS_OF_SIZE = 125
"""Row groups after which they become twice as large, so that the footer of a large table stays small."""
KEY = "checksums"
"""Name of the metadata entry with the end and CRC-32 of each row group, then the checksum of the footer."""
_ENTRY = re.compile(rb"groups:((?:[0-9a-f]{24},)*) " + re.escape(MARK) + rb"([0-9a-f]{8})")
_RESTS = re.compile(rb"groups:[0-9a-f]{24}|" + re.escape(MARK))


class _Sink:
    """A file that holds what is written until it is taken."""

    closed = False

    def __init__(self) -> None:
        self._held = bytearray()

    def write(self, data: bytes) -> int:
        self._held += data
        return len(data)

    def flush(self) -> None: ...

    def close(self) -> None: ...

    def take(self) -> bytearray:
        data, self._held = self._held, bytearray()
        return data


class ParquetBlocks:
    """A table that is written some runs at a time. On leaving its `with` statement, the file is complete, unless an exception was raised.

    Args:
        path: The file.
        schema: Its columns, one of them "run".

    Raises:
        OSError: The file cannot be written.
    """

    def __init__(self, path: Path, schema: pa.Schema) -> None:
        self._sink, self._file = _Sink(), path.open("wb")
        self._writer = pq.ParquetWriter(self._sink, schema, compression="zstd", write_page_checksum=True)
        self._held = schema.empty_table()
        self._ends: list[str] = []
        self._end = 0

    def add(self, table: pa.Table) -> None:
        """Append rows, sorted by "run", of runs behind those that were added before."""
        self._held = pa.concat_tables([self._held, table])
        self._write(is_last=False)

    def _write(self, is_last: bool) -> None:
        """Write the row groups that are full, or all."""
        run, first = self._held["run"].to_numpy(), 0
        starts = np.append(np.flatnonzero(np.append(True, run[1:] != run[:-1])), len(run))
        while first < len(run):
            size = ROWS_OF_GROUP << (len(self._ends) // GROUPS_OF_SIZE)
            if not is_last and first + size >= len(run):
                break
            last = int(starts[np.searchsorted(starts, first + size, "right") - 1])
            if last <= first:  # a run that is larger
                last = int(starts[np.searchsorted(starts, first, "right")])
            self._write_group(self._held.slice(first, last - first))
            first = last
        self._held = self._held.slice(first)

    def _write_group(self, rows: pa.Table) -> None:
        self._writer.write_table(rows, row_group_size=len(rows))
        data = self._sink.take()
        self._end += len(data)
        self._ends.append(f"{self._end:016x}{zlib.crc32(data):08x},")
        self._file.write(data)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        with self._file:
            if kind is not None:
                return
            self._write(is_last=True)
            self._writer.add_key_value_metadata({KEY: f"groups:{''.join(self._ends)} {BLANK}"})
            self._writer.close()
            data = self._sink.take()
            found = list(_ENTRY.finditer(data))[-1]
            data[found.start(2) : found.end(2)] = as_digits(crc_with_zeros(data, found.start(2)))
            self._file.write(data)


def write_parquet(table: pa.Table, path: Path) -> None:
    """Write a table that is sorted by its column "run".

    Raises:
        OSError: The file cannot be written.
    """
    with ParquetBlocks(path, table.schema) as file:
        file.add(table)


def intact_groups(file: BinaryIO, size: int) -> tuple[list[int], int] | None:
    """The row groups of a file whose checksums match, and the number of all; None for a file without checksums.

    Args:
        file: The file.
        size: Its size [B].

    Raises:
        ValueError: The footer is damaged.
    """
    tail_start = max(0, size - MAX_FOOTER)
    file.seek(tail_start)
    tail = file.read(MAX_FOOTER)
    found = list(_ENTRY.finditer(tail))
    if not found:
        if _RESTS.search(tail):  # of an entry in which a byte is wrong
            raise ValueError("its footer is damaged")
        return None
    entries = [entry for entry in found[-1][1].decode().split(",") if entry]
    ends = [0, *(int(entry[:16], 16) for entry in entries)]
    if ends != sorted(ends) or not size - MAX_FOOTER <= ends[-1] < size:
        raise ValueError("its footer is damaged")
    file.seek(ends[-1])
    footer = file.read(MAX_FOOTER)
    digits = tail_start + found[-1].start(2) - ends[-1]
    if digits < 0 or as_digits(crc_with_zeros(footer, digits)) != footer[digits : digits + N_DIGITS]:
        raise ValueError("its footer is damaged")
    intact = [
        number
        for number, (before, end) in enumerate(pairwise(ends))
        if crc_of_part(file, 0, before, end) == int(entries[number][16:], 16)
    ]
    return intact, len(entries)
