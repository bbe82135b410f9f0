"""Tiles of an MBTiles file: MBTiles 1.3, an SQLite database."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any

from tussle.documents import size_of
from tussle.errors import ParameterError
from tussle.view.ground_map.tiles import MAX_TILE_BYTES, checked_zooms

MAX_INSTRUCTIONS = 100_000_000
"""Instructions of SQLite for one question: views of a hostile file may never end."""
MAX_VALUE = 1 << 26
"""Bytes of a value in SQLite: such a view may also make large ones."""
TILE = "SELECT tile_data FROM tiles WHERE zoom_level = ? AND tile_column = ? AND tile_row = ?"
TILE_LENGTH = TILE.replace("tile_data", "length(tile_data)")
RASTER = ("png", "jpg", "jpeg", "webp")


class MbTiles:
    """An MBTiles file that is open.

    Args:
        path: The file.

    Raises:
        ParameterError: It is no such file, or its tiles are no pictures.
    """

    def __init__(self, path: Path) -> None:
        self._where = str(path)
        try:
            size_of(path)
        except (OSError, ValueError) as reason:
            raise ParameterError(
                f"{path}: cannot be read: {getattr(reason, 'strerror', None) or reason}"
            ) from None
        with self._asking():
            self._base = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)
            self._base.execute("PRAGMA trusted_schema = OFF")
            self._base.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_VALUE)
            self._base.set_progress_handler(lambda: 1, MAX_INSTRUCTIONS)
        try:
            kind = self._one("SELECT value FROM metadata WHERE name = 'format'")
            if kind not in RASTER:
                raise ParameterError(
                    f"{path}: its tiles are {kind!r}; a map on the ground takes pictures: {', '.join(RASTER)}"
                )
        except ParameterError:
            self.close()
            raise

    @contextmanager
    def _asking(self) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, OverflowError) as error:
            raise ParameterError(f"{self._where}: it is no MBTiles file that can be read: {error}") from None

    def _one(self, question: str, *values: int) -> Any:
        with self._asking():
            row = self._base.execute(question, values).fetchone()
        return None if row is None else row[0]

    def close(self) -> None:
        """Close the file."""
        self._base.close()

    @cached_property
    def zooms(self) -> tuple[int, int]:
        """Least and largest zoom of its tiles."""
        least = self._one("SELECT MIN(zoom_level) FROM tiles")
        return checked_zooms(self._where, least, self._one("SELECT MAX(zoom_level) FROM tiles"))

    def tile(self, zoom: int, column: int, row: int) -> bytes | None:
        """The image at a place, counted from the north-west; None where there is none. In the file, rows count from the south.

        Raises:
            ParameterError: The file is damaged.
        """
        key = zoom, column, 2**zoom - 1 - row
        length = self._one(TILE_LENGTH, *key)
        if length is None:
            return None
        if length > MAX_TILE_BYTES:
            raise ParameterError(
                f"{self._where}: a tile has {length:,} bytes; allowed are {MAX_TILE_BYTES:,}"
            )
        data = self._one(TILE, *key)
        if not isinstance(data, bytes):
            raise ParameterError(f"{self._where}: a tile is no picture")
        return data
