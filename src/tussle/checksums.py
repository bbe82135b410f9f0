"""Checksums inside files: a block of bytes holds the CRC-32 of itself, computed while the digits of the checksum are zeros."""

from __future__ import annotations

import re
import zlib
from typing import BinaryIO

MARK = b"tussle-crc32:"
BLANK = (MARK + b"00000000").decode()
"""Text that a writer puts into a block, for `seal` to fill in."""
_FILLED = re.compile(re.escape(MARK) + rb"[0-9a-f]{8}")
N_DIGITS = 8
CHUNK = 1 << 20


def find_seal(data: bytes) -> int | None:
    """Position of the digits of the checksum in a part of a block; None if there is none."""
    found = _FILLED.search(data)
    return None if found is None else found.end() - N_DIGITS


def crc_of_zeros(before: int) -> int:
    """CRC-32 of a part of a block and of the zeros that stand for the digits of its checksum."""
    return zlib.crc32(b"0" * N_DIGITS, before)


def crc_with_zeros(data: bytes | bytearray | memoryview, digits: int) -> int:
    """CRC-32 of a block.

    Args:
        data: The block.
        digits: Position of its checksum's digits, which count as zeros.
    """
    return zlib.crc32(data[digits + N_DIGITS :], crc_of_zeros(zlib.crc32(data[:digits])))


def sealed(data: bytes) -> bytes:
    """A block that contains `BLANK`, with its checksum filled in."""
    digits = find_seal(data)
    assert digits is not None
    return data[:digits] + as_digits(crc_with_zeros(data, digits)) + data[digits + N_DIGITS :]


def is_intact(data: bytes) -> bool:
    """Return True if a block with a checksum matches it."""
    digits = find_seal(data)
    return digits is not None and as_digits(crc_with_zeros(data, digits)) == data[digits : digits + N_DIGITS]


def crc_of_part(file: BinaryIO, crc: int, start: int, end: int) -> int:
    """CRC-32 of a part of a file, continued from that of the parts before; -1 if the file ends within it."""
    file.seek(start)
    while start < end:
        data = file.read(min(CHUNK, end - start))
        if not data:
            return -1
        crc, start = zlib.crc32(data, crc), start + len(data)
    return crc


def as_digits(crc: int) -> bytes:
    """A checksum as it is written."""
    return b"%08x" % crc
