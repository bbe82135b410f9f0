"""Images over surfaces, which only pictures show: rays do not see them. They come from untrusted files."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from tussle.errors import MissingExtraError, ParameterError, clipped

MAX_PIXELS = 32_000_000
"""Pixels of an image that is decoded: 128 MB."""
MAX_SIDE = 2048
"""Pixels of the longer side that are kept: every WebGL 2 browser takes them."""
FORMATS = ("PNG", "JPEG", "TIFF")
JPEG_QUALITY = 88


def decoded(where: str, data: bytes, is_photo: bool = False) -> np.ndarray:
    """Red, green, blue of an image from its upper left corner, (height, width, 3), uint8, at most `MAX_SIDE` wide and high.

    Args:
        where: File that has it, for messages.
        data: Its bytes.
        is_photo: It is shown as cameras and all viewers of pictures mean it, see `upright`.

    Raises:
        MissingExtraError: Pillow is not installed.
        ParameterError: It is no image, or has too many pixels.
    """
    try:
        from PIL import Image
    except ImportError:
        raise MissingExtraError(f"{where}: images need Pillow: pip install 'tussle[maps]'") from None
    try:
        with Image.open(io.BytesIO(data), formats=FORMATS) as image:
            return reduced(where, image, is_photo)
    except ParameterError:
        raise
    except Exception as error:  # decoders of damaged data raise errors of many kinds
        raise ParameterError(
            f"{where}: it is no PNG, JPEG or TIFF that can be read: {clipped(str(error), 200)}"
        ) from error


def reduced(where: str, image: Any, is_photo: bool = False) -> np.ndarray:
    """Pixels of an image of Pillow, as `decoded` returns them.

    Raises:
        ParameterError: It has too many pixels, or cannot be decoded.
    """
    width, height = image.size
    if width * height > MAX_PIXELS:
        raise ParameterError(
            f"{where}: the image has {width:,} x {height:,} pixels; it takes at most {MAX_PIXELS:,}"
        )
    try:
        image.thumbnail((MAX_SIDE, MAX_SIDE))
        image = upright(image) if is_photo else image
        return np.asarray(image.convert("RGB"))
    except Exception as error:  # decoders of damaged data raise errors of many kinds
        raise ParameterError(f"{where}: the image cannot be read: {clipped(str(error), 200)}") from error


def upright(image: Any) -> Any:
    """An image of Pillow, turned or mirrored as its tag of EXIF says, which cameras write that were held upright."""
    from PIL import ExifTags, ImageOps

    is_turned = image.getexif().get(ExifTags.Base.Orientation, 1) != 1
    return ImageOps.exif_transpose(image) if is_turned else image


def jpeg(pixels: np.ndarray) -> bytes:
    """An image, (height, width, 3), uint8, as a JPEG file."""
    from PIL import Image

    file: Any = io.BytesIO()
    Image.fromarray(pixels).save(file, "JPEG", quality=JPEG_QUALITY)
    return bytes(file.getvalue())
