"""Parquet tables in blocks of whole runs: the file holds a checksum of each row group, and one of its footer.

Parquet's own checksums cover neither the headers of pages nor the footer.
"""

from __future__ import annotations

import re
import zlib
from itertools import pairwise
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from tussle.checksums import BLANK, MARK, N_DIGITS, as_digits, crc_of_part, crc_with_zeros
from tussle.record.parquet_sizes import MAX_FOOTER

ROWS_OF_GROUP = 8192
"""Rows of a row group, rounded down to whole runs. What a damaged byte destroys is the runs of its group."""
MAX_GROUPS = 500
"""Maximum number of row groups, so that the footer of a large table stays small."""
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


def write_parquet(table: pa.Table, path: Path) -> None:
    """Write a table that is sorted by its column "run".

    Raises:
        OSError: The file cannot be written.
    """
    sink, groups, end = _Sink(), "", 0
    with path.open("wb") as file:
        with pq.ParquetWriter(sink, table.schema, compression="zstd", write_page_checksum=True) as writer:
            for first, last in _groups(table["run"].to_numpy()):
                writer.write_table(table.slice(first, last - first), row_group_size=last - first)
                data = sink.take()
                end += len(data)
                groups += f"{end:016x}{zlib.crc32(data):08x},"
                file.write(data)
            writer.add_key_value_metadata({KEY: f"groups:{groups} {BLANK}"})
        data = sink.take()
        found = list(_ENTRY.finditer(data))[-1]
        data[found.start(2) : found.end(2)] = as_digits(crc_with_zeros(data, found.start(2)))
        file.write(data)


def _groups(run: np.ndarray) -> list[tuple[int, int]]:
    """First row of each row group, and the row behind it."""
    n = len(run)
    size = max(ROWS_OF_GROUP, n // MAX_GROUPS)
    starts = np.append(np.flatnonzero(np.append(True, run[1:] != run[:-1])), n) if n else np.zeros(1, int)
    cuts = [0]
    while cuts[-1] < n:
        last = starts[np.searchsorted(starts, cuts[-1] + size, "right") - 1]
        cuts.append(int(last if last > cuts[-1] else starts[np.searchsorted(starts, cuts[-1], "right")]))
    return list(pairwise(cuts))


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
