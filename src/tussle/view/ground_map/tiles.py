"""Pyramids of square tiles in Web Mercator, of which as much is read as an area needs."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from tussle.errors import ParameterError
from tussle.view.ground_map.placed import GREY, MAX_PIXELS, Area, PlacedPicture, flat, opened, reading
from tussle.view.ground_map.projections import EARTH_WIDTH, MERCATOR

MAX_TILES = 256
"""Tiles that are read: with those of `MAX_SIDE` pixels they have `MAX_PIXELS`."""
MAX_TILE_SIDE = 512
MAX_TILE_BYTES = 1 << 22
MAX_ZOOM = 30
FORMATS = ("PNG", "JPEG", "WEBP")
assert MAX_TILES * MAX_TILE_SIDE**2 <= MAX_PIXELS


class TileSource(Protocol):
    """A file of tiles."""

    @property
    def zooms(self) -> tuple[int, int]:
        """Least and largest zoom of its tiles."""
        ...

    def tile(self, zoom: int, column: int, row: int) -> bytes | None:
        """The image at a place, counted from the north-west; None where there is none.

        Raises:
            ParameterError: The file is damaged.
        """
        ...


def stitched(where: str, source: TileSource, area: Area) -> PlacedPicture:
    """The tiles of an area as one picture: those of the largest zoom at which they are at most `MAX_TILES`, and there is one.

    In place of one that is missing, a part of one of a smaller zoom is shown.

    Args:
        where: The file, for messages.
        source: Its tiles.
        area: The area.

    Raises:
        ParameterError: The file has no tile there, or is damaged.
    """
    east, north = area.projected(MERCATOR, *area.grid())
    middle = float(east[0, 0])  # an area across the 180th meridian is whole
    east = east - EARTH_WIDTH * np.round((east - middle) / EARTH_WIDTH)
    edges = np.array([east.min(), -north.max(), east.max(), -north.min()]) / EARTH_WIDTH + 0.5
    least, largest = source.zooms
    n_tiles = 0
    for zoom in range(largest, least - 1, -1):
        n = 2**zoom
        first_column, first_row, last_column, last_row = np.floor(edges * n).astype(int).tolist()
        rows = range(max(0, first_row), min(n - 1, last_row) + 1)
        columns = range(first_column, last_column + 1)
        n_tiles = len(rows) * len(columns)
        if n_tiles > MAX_TILES:
            continue
        places = [(i, j) for j in range(len(rows)) for i in range(len(columns))]
        tiles = {(i, j): source.tile(zoom, columns[i] % n, rows[j]) for i, j in places}
        if not any(tiles.values()):
            continue
        images: dict[tuple[int, int], Any] = {}
        for (i, j), data in tiles.items():
            images[i, j] = (
                _part(where, source, least, zoom, columns[i] % n, rows[j])
                if data is None
                else _image(where, data)
            )
        return _joined(where, images, zoom, columns, rows)
    if n_tiles > MAX_TILES:
        raise ParameterError(
            f"{where}: at its least zoom, {least}, the mission's area takes {n_tiles:,} tiles; allowed are {MAX_TILES}"
        )
    raise ParameterError(f"{where}: the map lies outside the mission's area: it has no tile there")


def _image(where: str, data: bytes) -> Any:
    with reading(where):
        return flat(opened(where, data, FORMATS, MAX_TILE_SIDE**2))


def _part(where: str, source: TileSource, least: int, zoom: int, column: int, row: int) -> Any | None:
    """A missing tile, cut from the nearest one of a smaller zoom that is there and enlarged; None without one."""
    for up in range(1, zoom - least + 1):
        data = source.tile(zoom - up, column >> up, row >> up)
        if data is None:
            continue
        image = _image(where, data)
        share, part = image.size[0] / 2**up, 2**up - 1
        left, top = (column & part) * share, (row & part) * share
        with reading(where):
            return image.resize(image.size, box=(left, top, left + share, top + share))
    return None


def _joined(
    where: str, images: dict[tuple[int, int], Any], zoom: int, columns: range, rows: range
) -> PlacedPicture:
    """One picture of tiles by column and row, counted from the first ones; None is grey."""
    from PIL import Image

    sides = {image.size for image in images.values() if image is not None}
    (width, height), *others = sides
    if others or width != height:
        raise ParameterError(f"{where}: its tiles at zoom {zoom} are not squares of one size")
    whole = Image.new("RGB", (len(columns) * width, len(rows) * width), GREY)
    for (i, j), image in images.items():
        if image is not None:
            whole.paste(image, (i * width, j * width))
    tile = EARTH_WIDTH / 2**zoom
    west, north = columns[0] * tile - 0.5 * EARTH_WIDTH, 0.5 * EARTH_WIDTH - rows[0] * tile
    return PlacedPicture(where, whole, MERCATOR, west, north, (tile / width, tile / width))


def checked_zooms(where: str, least: object, largest: object) -> tuple[int, int]:
    """Zooms as a file names them.

    Raises:
        ParameterError: They are not whole numbers in order.
    """
    if not (isinstance(least, int) and isinstance(largest, int) and 0 <= least <= largest <= MAX_ZOOM):
        raise ParameterError(
            f"{where}: zooms from {least!r} to {largest!r} are no zooms of a map; they are 0 to {MAX_ZOOM}"
        )
    return least, largest
