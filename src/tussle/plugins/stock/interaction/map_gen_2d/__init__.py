"""Walls from an image of a map."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from tussle import documents
from tussle.api import Interaction, Param
from tussle.declare import units
from tussle.declare.texts import shown, truth
from tussle.documents import read_bytes
from tussle.errors import MissingFileError, ParameterError, listed, nearest_name
from tussle.world.scene import Cuboid, Volume

MAX_WALLS = 20_000
FORMATS = ("PNG", "JPEG", "TIFF", "BMP", "GIF", "PPM")
"""Formats of images. Others, such as PostScript, are read by programs that Pillow starts."""


class MapGen2D(Interaction):
    """Walls where the image of a map is dark: boxes on which rays of the scene end. The upper edge of the image is north.

    It needs Pillow, which `pip install 'tussle[maps]'` installs. A mission may name a map file of SCRIMMAGE instead of the image: an .xml
    beside the mission or in a folder of data, which has the image and the values of the other parameters. Its `occupied_thresh` is
    truncated there: below 1, only black pixels are walls.
    Entities collide with the walls where the mission has `BulletCollision` or `SceneCollision`.

    Raises:
        ParameterError: The map is not a readable image, has more than 20,000 walls, or Pillow is not installed.
    """

    grade = "portable"

    map = Param("maze_2d_1", doc="Path of the image; in a mission also of a map file, or its name.")
    resolution = Param(1.0, unit="m", gt=0.0, structural=True, doc="Width of a pixel.")
    corner = Param(
        (0.0, 0.0, 0.0), fields="x y z", unit="m", structural=True, doc="South-western corner of the map, on the ground."
    )  # fmt: skip
    height = Param(10.0, unit="m", gt=0.0, structural=True, doc="Height of the walls.")
    threshold = Param(
        128, ge=0, le=256, structural=True, doc="Brightness, 0 to 255, below which a pixel is a wall."
    )

    boundary = Param(False, structural=True, doc="Walls, a pixel thick, along the four edges of the map.")

    @classmethod
    def with_files(cls, given: Mapping[str, str], find: Callable[[str], Path]) -> dict[str, str]:
        """Return the path of the image, and the values of the map file that the tag does not have.

        Raises:
            MissingFileError: There is no such map, or not its image.
            TussleError: The map file is damaged, or a value of it is wrong.
        """
        name = given.get("map", cls.params()["map"].default)
        path = Path(name)
        if not path.suffix:
            path = find(f"{name}.xml")
        elif not path.is_file():
            path = find(name)
        if path.suffix != ".xml":
            return {} if str(path) == name else {"map": str(path)}
        found = read_map_file(path)
        return {key: text for key, text in found.items() if key == "map" or key not in given}

    def walls(self) -> tuple[Volume, ...]:
        """Return the walls: dark pixels as few boxes along the axes."""
        is_wall = self._brightness() < self.threshold
        size, (x, y, z) = self.resolution, self.corner
        found = _boxes(is_wall)
        if self.boundary:
            rows, columns = is_wall.shape
            found += [
                (0, 1, 0, columns), (0, rows, 0, 1), (0, rows, columns, columns + 1), (rows, rows + 1, 0, columns),
            ]  # fmt: skip
        if len(found) > MAX_WALLS:
            raise ParameterError(
                f"MapGen2D.map = {self.map!r} has {len(found):,} walls; it may have {MAX_WALLS:,}"
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


NUMBERS = {
    "resolution": 1.0, "wall_bottom_z": 0.0, "wall_height": 5.0, "occupied_thresh": 0.65, "x_origin": 0.0, "y_origin": 0.0,
    "z_origin": 0.0,
}  # fmt: skip
"""Numbers of a map file, with their defaults."""
TAGS = (*NUMBERS, "filename", "enable_map_boundary", "wall_color")
ABOVE_WHITE = 256


def read_map_file(path: Path) -> dict[str, str]:
    """Return the attributes of MapGen2D that stand for a map file.

    Raises:
        ParameterError: It cannot be read, or has a tag or value that is not allowed.
        MissingFileError: Its image is not beside it.
    """
    text = documents.read_text(path, ParameterError)
    if "<!DOCTYPE" in text:
        raise ParameterError(f"{path}: a DOCTYPE is not allowed")
    try:
        root = ET.fromstring(text)  # noqa: S314 - without a DOCTYPE there are no entities
    except ET.ParseError as error:
        raise ParameterError(f"{path}: it is not well-formed XML: {error}") from None
    given = {}
    for tag in root:
        if tag.tag not in TAGS:
            raise ParameterError(
                f"{path}: a map has no {shown(tag.tag)}{nearest_name(tag.tag, TAGS)}; {listed(TAGS)}"
            )
        given[tag.tag] = (tag.text or "").strip()
    if not given.get("filename"):
        raise ParameterError(f"{path}: the map has no <filename>, which names its image")
    image = path.parent / given["filename"]
    if not image.is_file():
        raise MissingFileError(f"{path}: its image {shown(given['filename'])} is not beside it")
    try:
        number = {name: units.parse(given.get(name, str(default)), "") for name, default in NUMBERS.items()}
        has_boundary = truth(given.get("enable_map_boundary", "false"))
    except ParameterError as error:
        raise ParameterError(f"{path}: {error}") from None
    threshold = 255.0 * int(number["occupied_thresh"])
    corner = number["x_origin"], number["y_origin"], number["z_origin"] + number["wall_bottom_z"]
    return {
        "map": str(image),
        "resolution": repr(number["resolution"]),
        "corner": ", ".join(map(repr, corner)),
        "height": repr(number["wall_height"]),
        "threshold": str(int(min(max(threshold + 1.0, 0.0), ABOVE_WHITE))),
        "boundary": str(has_boundary).lower(),
    }
