"""Map files made by hand."""

from __future__ import annotations

import io
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


def geo_keys(code: int, is_point: bool = False) -> tuple[int, ...]:
    """The keys of a projection: a head, and four numbers of each."""
    kind, key = GEOGRAPHIC if code in (4326, 4269) else PROJECTED
    keys = [(1024, kind), (1025, 2 if is_point else 1), (key, code)]
    return (1, 1, 0, len(keys), *(n for name, value in keys for n in (name, 0, 1, value)))


def write_geotiff(
    path: Path, image: np.ndarray, code: int | None, *, scale: tuple[float, ...] = (), tie: tuple[float, ...] = (),
    matrix: tuple[float, ...] = (), is_point: bool = False, compression: str = "tiff_lzw",
) -> Path:  # fmt: skip
    """Write a GeoTIFF, or one that lacks something."""
    tags = ImageFileDirectory_v2()
    for tag, kind, values in (
        (33550, DOUBLE, scale), (33922, DOUBLE, tie), (34264, DOUBLE, matrix),
        (34735, SHORT, () if code is None else geo_keys(code, is_point)),
    ):  # fmt: skip
        if values:
            tags.tagtype[tag] = kind
            tags[tag] = values
    Image.fromarray(image).save(path, "TIFF", tiffinfo=tags, compression=compression)
    return path
