"""Walls from an image of a map."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from tussle.api import Interaction, Param
from tussle.documents import read_bytes
from tussle.errors import ParameterError
from tussle.scene import Cuboid, Volume

MOST_WALLS = 20_000
FORMATS = ("PNG", "JPEG", "TIFF", "BMP", "GIF", "PPM")
"""Formats of images. Others, such as PostScript, are read by programs that Pillow starts."""


class MapGen2D(Interaction):
    """Walls where the image of a map is dark: boxes on which rays of the scene end. The upper edge of the image is north.

    It needs Pillow, which `pip install 'tussle[maps]'` installs. SCRIMMAGE looked the map up in its own folders.
    Entities collide with the walls where the mission has `BulletCollision` or `SceneCollision`.

    Raises:
        ParameterError: The map is not a readable image, has more than 20,000 walls, or Pillow is not installed.
    """

    grade = "portable"

    map = Param("maze_2d_1", doc="Path of the image.")
    resolution = Param(1.0, unit="m", gt=0.0, structural=True, doc="Width of a pixel.")
    corner = Param(
        (0.0, 0.0, 0.0), fields="x y z", unit="m", structural=True, doc="South-western corner of the map, on the ground."
    )  # fmt: skip
    height = Param(10.0, unit="m", gt=0.0, structural=True, doc="Height of the walls.")
    threshold = Param(
        128, ge=0, le=256, structural=True, doc="Brightness, 0 to 255, below which a pixel is a wall."
    )

    def walls(self) -> tuple[Volume, ...]:
        """Return the walls: dark pixels as few boxes along the axes."""
        is_wall = self._brightness() < self.threshold
        size, (x, y, z) = self.resolution, self.corner
        found = _boxes(is_wall)
        if len(found) > MOST_WALLS:
            raise ParameterError(
                f"MapGen2D.map = {self.map!r} has {len(found):,} walls; it may have {MOST_WALLS:,}"
            )
        north = y + size * len(is_wall)
        return tuple(
            Cuboid(
                center=(x + 0.5 * size * (left + right), north - 0.5 * size * (top + bottom), z + 0.5 * self.height),
                lengths=(size * (right - left), size * (bottom - top), self.height),
            )
            for top, bottom, left, right in found
        )  # fmt: skip

    def _brightness(self) -> np.ndarray:
        """Brightness of the pixels, 0 to 255, (rows, columns), from north to south."""
        try:
            from PIL import Image, UnidentifiedImageError
        except ImportError:
            raise ParameterError(
                "MapGen2D needs Pillow, which is not installed: pip install 'tussle[maps]'"
            ) from None
        try:
            data = read_bytes(Path(self.map), ParameterError)
            with Image.open(io.BytesIO(data), formats=FORMATS) as image:
                return np.asarray(image.convert("L"))
        except Exception as error:  # decoders of damaged data raise errors of many kinds
            reason = (
                f"it is no {', '.join(FORMATS)} file" if isinstance(error, UnidentifiedImageError) else error
            )
            raise ParameterError(
                f"MapGen2D.map = {self.map!r} cannot be read ({reason!s:.300}); it takes the path of an image"
            ) from error


def _boxes(is_wall: np.ndarray) -> list[tuple[int, int, int, int]]:
    """Return first and end row, first and end column of boxes: runs of pixels, joined with equal runs in the rows below."""
    found, growing = [], dict[tuple[int, int], int]()
    for row in range(len(is_wall) + 1):
        runs = set()
        if row < len(is_wall):
            edges = np.flatnonzero(np.diff(np.concatenate([[False], is_wall[row], [False]])))
            runs = set(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
        found += [(growing.pop(run), row, *run) for run in sorted(set(growing) - runs)]
        growing |= {run: row for run in runs if run not in growing}
    return found
