"""Packs numbers into few bytes: differences and byte planes, which deflate compresses further."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np

MAX_VALUE = 2**28
"""Largest number that a column takes: its second differences then fit 31 bits."""


def ints(values: np.ndarray) -> bytes:
    """Pack integers; small ones take few bytes.

    One byte p from 0 to 4, then p planes of one byte per number, the lowest first, of the numbers in zigzag (0, -1, 1, -2 are 0, 1,
    2, 3). Deflate finds more in planes than in numbers that lie one after another.

    Args:
        values: Within ±(2**31 - 1), (n,).
    """
    values = np.asarray(values, np.int64)
    zigzag = ((values << 1) ^ (values >> 63)).astype(np.uint32)
    n_planes = (int(zigzag.max(initial=0)).bit_length() + 7) // 8
    planes = [(zigzag >> np.uint32(8 * i)).astype(np.uint8).tobytes() for i in range(n_planes)]
    return bytes([n_planes]) + b"".join(planes)


def column(values: np.ndarray, is_head: np.ndarray) -> bytes:
    """Pack series of integers as first values and differences.

    One byte: 1 where the differences stand themselves, 2 where the differences of these do, whichever is smaller; then `ints` of the
    first number of each series, and `ints` of all that follow, series by series. The first difference of a series counts as one to 0.

    Args:
        values: Series after series, within ±MAX_VALUE, (n,).
        is_head: Where one begins, (n,).
    """
    values = np.asarray(values, np.int64)
    first = np.diff(values, prepend=np.int64(0))
    before = np.roll(first, 1)
    second = first - np.where(np.roll(is_head, 1), 0, before)
    residuals = [first[~is_head], second[~is_head]]
    cost = [float(np.log2(1.0 + np.abs(r)).sum()) for r in residuals]
    order = 1 if cost[0] <= cost[1] else 2
    return bytes([order]) + ints(values[is_head]) + ints(residuals[order - 1])


def reals(values: np.ndarray) -> bytes:
    """Pack floats without loss, eight bytes each, lowest first.

    Args:
        values: (n,).
    """
    return np.ascontiguousarray(values, "<f8").tobytes()


def message(header: dict[str, Any], data: bytes) -> bytes:
    """Return header and data as one block: length of the header, JSON header padded to four bytes, data."""
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<I", len(text)) + text + data
