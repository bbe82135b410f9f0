"""Tiles of a PMTiles file: PMTiles version 3 (github.com/protomaps/PMTiles, spec/v3/spec.md)."""

from __future__ import annotations

import struct
import zlib
from bisect import bisect_right
from pathlib import Path
from typing import NamedTuple

from tussle.documents import read_part
from tussle.errors import ParameterError
from tussle.view.ground_map.tiles import MAX_TILE_BYTES, checked_zooms

HEADER = struct.Struct("<7sB11Q6B")
"""Magic, version, eleven offsets, lengths and counts, then clustering, compressions, type of the tiles, and zooms."""
MAX_DIRECTORY = 1 << 24
"""Bytes of a directory, packed and unpacked."""
MAX_ENTRIES = 1 << 21
MAX_DEPTH = 4
"""Directories on the way to a tile: the specification has at most four."""
NONE, GZIP = 1, 2
RASTER = {2: "png", 3: "jpg", 4: "webp"}


class Entry(NamedTuple):
    """A line of a directory: the first tile, its place and size, and for how many tiles it stands; 0 for another directory."""

    tile: int
    offset: int
    length: int
    run: int


class PmTiles:
    """A PMTiles file; each tile is read when it is asked for.

    Args:
        path: The file.

    Raises:
        ParameterError: It is no such file, or its tiles are no pictures.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        head = read_part(path, ParameterError, 0, HEADER.size)
        if len(head) < HEADER.size or head[:8] != b"PMTiles\x03":
            raise self._wrong("it is no PMTiles file of version 3")
        fields = HEADER.unpack(head)
        self._root = fields[2], fields[3]
        self._leaves, self._tiles = fields[6], fields[8]
        _, self._packed, tile_packed, kind, least, largest = fields[13:]
        if kind not in RASTER or tile_packed not in (0, NONE):
            raise self._wrong(
                f"its tiles are no pictures; a map on the ground takes {', '.join(RASTER.values())}"
            )
        if self._packed not in (NONE, GZIP):
            raise self._wrong("its directories are packed by neither gzip nor nothing")
        self.zooms = checked_zooms(str(path), least, largest)
        self._directories: dict[tuple[int, int], list[Entry]] = {}

    def tile(self, zoom: int, column: int, row: int) -> bytes | None:
        """The image at a place, counted from the north-west; None where there is none.

        Raises:
            ParameterError: The file is damaged.
        """
        number, place = tile_number(zoom, column, row), self._root
        for _ in range(MAX_DEPTH):
            entries = self._directory(*place)
            i = bisect_right(entries, number, key=lambda entry: entry.tile) - 1
            if i < 0:
                return None
            entry = entries[i]
            if entry.run:
                is_it = number < entry.tile + entry.run
                return self._part(self._tiles + entry.offset, entry.length, MAX_TILE_BYTES) if is_it else None
            place = self._leaves + entry.offset, entry.length
        raise self._wrong(f"its directories are more than {MAX_DEPTH} deep")

    def _directory(self, start: int, n: int) -> list[Entry]:
        if (start, n) not in self._directories:
            data = self._part(start, n, MAX_DIRECTORY)
            try:
                self._directories[start, n] = entries_of(_unpacked(data) if self._packed == GZIP else data)
            except (ValueError, IndexError, zlib.error) as error:
                raise self._wrong(f"a directory is damaged: {error}") from None
        return self._directories[start, n]

    def _part(self, start: int, n: int, most: int) -> bytes:
        if n > most:
            raise self._wrong(f"it names a part of {n:,} bytes; allowed are {most:,}")
        data = read_part(self._path, ParameterError, start, n)
        if len(data) < n:
            raise self._wrong("it is cut off")
        return data

    def _wrong(self, why: str) -> ParameterError:
        return ParameterError(f"{self._path}: {why}")


def _unpacked(data: bytes) -> bytes:
    """The content of gzip.

    Raises:
        ValueError: It is cut off, or larger than `MAX_DIRECTORY`.
    """
    packer = zlib.decompressobj(31)
    content = packer.decompress(data, MAX_DIRECTORY)
    if not packer.eof:
        raise ValueError("it is cut off, or too large")
    return content


def entries_of(data: bytes) -> list[Entry]:
    """Entries of a directory: columns of numbers of variable length, the first column as differences.

    Raises:
        ValueError: They are too many, or not in order.
        IndexError: It is cut off.
    """
    at = 0

    def number() -> int:
        nonlocal at
        value, shift = 0, 0
        while True:
            byte = data[at]
            at += 1
            value |= (byte & 127) << shift
            if byte < 128:
                return value
            shift += 7
            if shift > 63:
                raise ValueError("a number is too long")

    n = number()
    if n > min(MAX_ENTRIES, len(data)):
        raise ValueError(f"it has {n:,} entries")
    tiles = []
    tile = 0
    for _ in range(n):
        tile += number()
        tiles.append(tile)
    runs = [number() for _ in range(n)]
    lengths = [number() for _ in range(n)]
    offsets: list[int] = []
    for i in range(n):
        value = number()
        offsets.append(value - 1 if value else offsets[i - 1] + lengths[i - 1])
    return [Entry(*each) for each in zip(tiles, offsets, lengths, runs, strict=True)]


def tile_number(zoom: int, column: int, row: int) -> int:
    """Number of a tile: those of smaller zooms come first; those of one zoom lie along a curve of Hilbert, section 4.1."""
    number: int = (4**zoom - 1) // 3
    side: int = 2**zoom // 2
    while side:
        right, below = int(bool(column & side)), int(bool(row & side))
        number += side * side * ((3 * right) ^ below)
        if not below:
            if right:
                column, row = side - 1 - column, side - 1 - row
            column, row = row, column
        column, row = column & (side - 1), row & (side - 1)
        side //= 2
    return number
