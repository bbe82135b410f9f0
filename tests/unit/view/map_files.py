"""Map files made by hand."""

from __future__ import annotations

import gzip
import io
import sqlite3
import struct
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from PIL import Image
from PIL.TiffImagePlugin import ImageFileDirectory_v2

DOUBLE, SHORT = 12, 3
PROJECTED, GEOGRAPHIC = (1, 3072), (2, 2048)


def coded(width: int = 240, height: int = 200) -> np.ndarray:
    """An image whose red is the column and whose green is the row, (height, width, 3)."""
    image = np.zeros((height, width, 3), np.uint8)
    image[:, :, 0], image[:, :, 1] = np.arange(width), np.arange(height)[:, None]
    return image


def encoded(image: np.ndarray, kind: str = "PNG") -> bytes:
    """The bytes of an image file."""
    file = io.BytesIO()
    Image.fromarray(image).save(file, kind)
    return file.getvalue()


def geo_keys(code: int, is_point: bool = False, unit: int = 0) -> tuple[int, ...]:
    """The keys of a projection: a head, and four numbers of each."""
    kind, key = GEOGRAPHIC if code in (4326, 4269) else PROJECTED
    keys = [(1024, kind), (1025, 2 if is_point else 1), (key, code), *([(3076, unit)] if unit else [])]
    return (1, 1, 0, len(keys), *(n for name, value in keys for n in (name, 0, 1, value)))


def write_geotiff(
    path: Path, image: np.ndarray, code: int | None, *, scale: tuple[float, ...] = (), tie: tuple[float, ...] = (),
    matrix: tuple[float, ...] = (), is_point: bool = False, unit: int = 0, compression: str = "tiff_lzw",
) -> Path:  # fmt: skip
    """Write a GeoTIFF, or one that lacks something."""
    tags = ImageFileDirectory_v2()
    for tag, kind, values in (
        (33550, DOUBLE, scale), (33922, DOUBLE, tie), (34264, DOUBLE, matrix),
        (34735, SHORT, () if code is None else geo_keys(code, is_point, unit)),
    ):  # fmt: skip
        if values:
            tags.tagtype[tag] = kind
            tags[tag] = values
    Image.fromarray(image).save(path, "TIFF", tiffinfo=tags, compression=compression)
    return path


Tile = tuple[int, int, int]
"""Zoom, column, row from the north."""


def write_mbtiles(path: Path, tiles: dict[Tile, object], kind: str = "png") -> Path:
    """Write an MBTiles file, whose rows count from the south."""
    base = sqlite3.connect(path)
    base.execute("CREATE TABLE metadata (name text, value text)")
    base.execute("INSERT INTO metadata VALUES ('format', ?)", (kind,))
    base.execute(
        "CREATE TABLE tiles (zoom_level integer, tile_column integer, tile_row integer, tile_data blob)"
    )
    rows = [(zoom, column, 2**zoom - 1 - row, data) for (zoom, column, row), data in tiles.items()]
    base.executemany("INSERT INTO tiles VALUES (?, ?, ?, ?)", rows)
    base.commit()
    base.close()
    return path


def varint(value: int) -> bytes:
    """A number of variable length, seven bits a byte."""
    found = bytearray()
    while value > 127:
        found.append(value & 127 | 128)
        value >>= 7
    return bytes([*found, value])


def directory(entries: Iterable[tuple[int, int, int, int]]) -> bytes:
    """A directory of PMTiles: number, offset, length and run of each entry."""
    entries = list(entries)
    numbers, offsets, lengths, runs = (list(column) for column in zip(*entries, strict=True))
    steps = [b - a for a, b in zip([0, *numbers], numbers, strict=False)]
    follows = [i > 0 and offsets[i] == offsets[i - 1] + lengths[i - 1] for i in range(len(entries))]
    kept = [0 if follows[i] else offset + 1 for i, offset in enumerate(offsets)]
    return b"".join(map(varint, [len(entries), *steps, *runs, *lengths, *kept]))


def write_pmtiles(
    path: Path,
    tiles: dict[int, bytes],
    zooms: tuple[int, int],
    *,
    kind: int = 2,
    packed: int = 2,
    leaf: int = 0,
) -> Path:
    """Write a PMTiles file of tiles by their numbers; with `leaf`, so many entries are in a directory below the root."""
    data, entries = b"", []
    for number in sorted(tiles):
        entries.append((number, len(data), len(tiles[number]), 1))
        data += tiles[number]

    def pack(content: bytes) -> bytes:
        return gzip.compress(content, mtime=0) if packed == 2 else content

    leaves = b""
    if leaf:
        root = []
        for i in range(0, len(entries), leaf):
            part = pack(directory(entries[i : i + leaf]))
            root.append((entries[i][0], len(leaves), len(part), 0))
            leaves += part
        entries = root
    top = pack(directory(entries))
    at = 127
    head = struct.pack(
        "<7sB11Q6B", b"PMTiles", 3, at, len(top), at + len(top), 0, at + len(top), len(leaves),
        at + len(top) + len(leaves), len(data), len(tiles), len(tiles), len(tiles), 1, packed, 1, kind, *zooms,
    )  # fmt: skip
    path.write_bytes(head.ljust(127, b"\0") + top + leaves + data)
    return path
