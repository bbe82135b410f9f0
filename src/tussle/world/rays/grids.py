"""Height fields from files: Esri's ASCII grid, PNG and TIFF."""

from __future__ import annotations

import io
from codecs import BOM_UTF8
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tussle.errors import MissingExtraError, ParameterError, clipped, listed, nearest_name
from tussle.world.rays.surfaces import MAX_HEIGHTS, HeightField

KEYS = ("ncols", "nrows", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "cellsize", "nodata_value")
NEEDED = ("ncols", "nrows", "cellsize")
PIXEL_SCALE, GEO_KEYS, NO_DATA = 33550, 34735, 42113
"""TIFF tags of OGC GeoTIFF 1.1 (2019), annexes, and GDAL's for cells without data."""
MODEL_TYPE, GEOGRAPHIC = 1024, 2
"""Key and value of a GeoTIFF whose coordinates are latitude and longitude."""
UNITS = {3076: "coordinates", 4099: "heights"}
"""Keys of the units of a GeoTIFF."""
FEET = {9002: "feet", 9003: "US survey feet"}
SAMPLE_FORMAT, SIGNED = 339, 2
"""Tag and value of a TIFF of whole numbers with a sign, as which programs write heights in m."""
IN_DEGREES = "in degrees; convert it to metres, for example with gdalwarp -t_srs EPSG:326XX"


def read_ascii_grid(path: Path, data: bytes) -> HeightField:
    """An ASCII grid as geographic tools write it, with its corner and cells in m of the world frame.

    Cells without data are as high as the lowest.

    Raises:
        ParameterError: It is not such a grid.
    """
    try:
        lines = data.removeprefix(BOM_UTF8).decode("ascii").splitlines()
    except UnicodeDecodeError as error:
        raise ParameterError(f"{path}: the terrain cannot be read: {error}") from error
    head, n_head = _read_head(path, lines)
    nx, ny, cell = int(head["ncols"]), int(head["nrows"]), head["cellsize"]
    _check_size(path, nx, ny, cell)
    try:
        values = np.array(" ".join(lines[n_head:]).split(), float)
    except ValueError as error:
        raise ParameterError(f"{path}: not all heights are numbers: {error}") from None
    if len(values) != nx * ny:
        raise ParameterError(f"{path}: there are {len(values)} heights; needed are {nx} x {ny}")
    height = _filled(
        path, values.reshape(ny, nx)[::-1], head.get("nodata_value", -9999.0)
    )  # the file begins in the north
    _check_relief(path, height, cell)
    west = head["xllcenter"] if "xllcenter" in head else head.get("xllcorner", 0.0) + 0.5 * cell
    south = head["yllcenter"] if "yllcenter" in head else head.get("yllcorner", 0.0) + 0.5 * cell
    return HeightField(height, west, south, cell)


def _read_head(path: Path, lines: list[str]) -> tuple[dict[str, float], int]:
    """Values by key, and the number of their lines."""
    head: dict[str, float] = {}
    number = 0
    for line in lines[: len(KEYS)]:
        words = line.split()
        if not words or not words[0][0].isalpha():
            break
        number += 1
        key = words[0].lower()
        if key not in KEYS:
            raise ParameterError(
                f"{path}:{number}: a terrain has no {clipped(words[0])!r}{nearest_name(key, KEYS)}; {listed(KEYS)}"
            )
        try:
            (head[key],) = (float(word) for word in words[1:])
        except ValueError:
            raise ParameterError(f"{path}:{number}: {key} takes one number") from None
    for key in NEEDED:
        if key not in head or (key != "cellsize" and not head[key].is_integer()):
            raise ParameterError(f"{path}: the terrain has no {key}, or one that is not allowed")
    return head, number


def _check_size(path: Path, nx: int, ny: int, cell: float) -> None:
    if nx < 2 or ny < 2 or nx * ny > MAX_HEIGHTS or not 0.0 < cell < float("inf"):
        raise ParameterError(
            f"{path}: a terrain of {nx} x {ny} heights every {cell:g} m is not allowed; it takes 2 x 2 to {MAX_HEIGHTS} heights"
        )


def _check_relief(path: Path, height: np.ndarray, cell: float) -> None:
    """Cells of 1 cm or less under heights that differ by more than the field is wide are of degrees: 1" is 0.00028 degrees."""
    if cell < 0.01 and np.ptp(height) > cell * max(height.shape):
        raise ParameterError(
            f"{path}: cells of {cell:g} m are too small for heights that differ by {np.ptp(height):g} m, so the grid is {IN_DEGREES}"
        )


def foreign_unit(keys: Sequence[Any]) -> str:
    """What a GeoTIFF with such keys has in another unit than metres, and in which; "" if nothing."""
    for i in range(4, len(keys) - 3, 4):
        key, place, _, unit = keys[i : i + 4]
        if key in UNITS and place == 0 and unit in range(9002, 10000):
            return f"{UNITS[key]} in {FEET.get(unit, f'the unit EPSG:{unit}')}, not in metres"
    return ""


def _filled(path: Path, height: np.ndarray, no_data: float) -> np.ndarray:
    """Heights in which those without data are as high as the lowest."""
    missing = (height == no_data) | ~np.isfinite(height)
    if missing.all():
        raise ParameterError(f"{path}: no cell has a height")
    return np.where(missing, height[~missing].min(), height)


def read_image(path: Path, data: bytes, cell: float | None, white: float | None) -> HeightField:
    """A PNG or TIFF: one height for each pixel, the upper edge in the north; its first pixel is at x = y = 0 of the field.

    Args:
        path: The file, for messages.
        data: Its content.
        cell: Width of a pixel [m]; None for a GeoTIFF, which has its own.
        white: Height of the brightest value that the format can hold above 0 [m]; None for a TIFF of heights in m.

    Raises:
        MissingExtraError: Pillow is not installed.
        ParameterError: It is not such an image, or it needs `cell` or `white`.
    """
    try:
        from PIL import Image
    except ImportError:
        raise MissingExtraError(f"{path}: images need Pillow: pip install 'tussle[maps]'") from None
    try:
        with Image.open(io.BytesIO(data), formats=("PNG", "TIFF")) as image:
            _check_size(
                path, *image.size, 1.0 if cell is None else cell
            )  # the header's size, before pixels are read
            tags: Any = getattr(image, "tag_v2", {})
            scale, keys, no_data = tags.get(PIXEL_SCALE), tags.get(GEO_KEYS, ()), tags.get(NO_DATA, "nan")
            mode, is_signed = image.mode, SIGNED in tags.get(SAMPLE_FORMAT, ())
            pixels = np.asarray(image if mode[0] in "IF" else image.convert("L"), float)
    except ParameterError:
        raise
    except (OSError, ValueError, SyntaxError, OverflowError, Image.DecompressionBombError) as error:
        raise ParameterError(f"{path}: the terrain is no PNG or TIFF that can be read: {error}") from error
    if any(keys[i] == MODEL_TYPE and keys[i + 3] == GEOGRAPHIC for i in range(4, len(keys) - 3, 4)):
        raise ParameterError(f"{path}: the GeoTIFF is {IN_DEGREES}")
    if unit := foreign_unit(keys):
        raise ParameterError(f"{path}: the GeoTIFF has {unit}; convert it to metres")
    is_own = False
    if cell is None and scale is not None:
        if scale[0] != scale[1]:
            raise ParameterError(f"{path}: the pixels are {scale[0]:g} x {scale[1]:g} m; they must be square")
        cell, is_own = float(scale[0]), True
    if cell is None:
        raise ParameterError(f"{path}: the width of a pixel is not known; give cell='...' [m]")
    if white is None and mode != "F" and not is_signed:
        raise ParameterError(
            f"{path}: the pixels are brightnesses; give height='...', the height of white [m]"
        )
    if white is not None:
        pixels *= white / (65535.0 if mode[0] == "I" else 255.0 if mode != "F" else 1.0)
    try:
        height = _filled(path, pixels, float(str(no_data).strip("\0 ")))
    except ValueError:
        raise ParameterError(
            f"{path}: the value for pixels without data is {no_data!r}, which is no number"
        ) from None
    if is_own:
        _check_relief(path, height, cell)
    return HeightField(height[::-1], 0.0, 0.0, cell)
