"""Words on a picture: letters as they are printed, drawn into an array."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from tussle.errors import MissingExtraError, visible

MOST_KEPT = 4096
"""Words whose pictures are kept; a film shows the same ones again and again."""


class Lettering:
    """Letters of one family in any size.

    Raises:
        MissingExtraError: Matplotlib, whose font and drawing of letters this uses, is not installed.
    """

    def __init__(self) -> None:
        try:
            from matplotlib import get_data_path
        except ImportError as error:
            raise MissingExtraError(
                "words on pictures need matplotlib, which is not installed: pip install 'tussle[view]'"
            ) from error
        self._folder = Path(get_data_path()) / "fonts" / "ttf"
        self._fonts: dict[tuple[float, bool], Any] = {}
        self.mask = lru_cache(maxsize=MOST_KEPT)(self._mask)

    def _font(self, height: float, is_bold: bool) -> Any:
        from matplotlib.ft2font import FT2Font

        key = (height, is_bold)
        if key not in self._fonts:
            font = FT2Font(str(self._folder / ("DejaVuSans-Bold.ttf" if is_bold else "DejaVuSans.ttf")))
            font.set_size(height, 72)  # at 72 dots per inch, a point is a pixel
            self._fonts[key] = font
        return self._fonts[key]

    def _mask(self, text: str, height: float, is_bold: bool) -> tuple[np.ndarray, int]:
        """How much of each pixel a word covers, 0 to 1, (rows, columns), and how many rows are above its base line."""
        font = self._font(height, is_bold)
        font.set_text(visible(" ".join(text.split())), 0.0)
        font.draw_glyphs_to_bitmap(antialiased=True)
        mask = np.asarray(font.get_image(), np.float32) / 255.0
        return mask, mask.shape[0] - round(font.get_descent() / 64.0)

    def write(
        self, picture: np.ndarray, text: str, at: tuple[float, float], height: float,
        colour: tuple[int, int, int], is_bold: bool = False, anchor: str = "left",
    ) -> float:  # fmt: skip
        """Draw a word; what is outside the picture is left out. Its width [pixels].

        Args:
            picture: (rows, columns, 3), uint8, written to.
            text: The word.
            at: Where its base line begins, or is in the middle, or ends: column, row.
            height: Of the letters, about 1.4 of that of an x [pixels].
            colour: Red, green, blue.
            is_bold: In bold letters.
            anchor: "left", "middle" or "right".
        """
        if not text.strip():
            return 0.0
        mask, above = self.mask(text, height, is_bold)
        rows, columns = mask.shape
        shift = {"left": 0.0, "middle": 0.5 * columns, "right": float(columns)}[anchor]
        left, top = round(at[0] - shift), round(at[1]) - above
        x0, y0 = max(left, 0), max(top, 0)
        x1, y1 = min(left + columns, picture.shape[1]), min(top + rows, picture.shape[0])
        if x0 < x1 and y0 < y1:
            share = mask[y0 - top : y1 - top, x0 - left : x1 - left, None]
            under = picture[y0:y1, x0:x1]
            under[:] = np.round(under + share * (np.array(colour, np.float32) - under)).astype(np.uint8)
        return float(columns)


def fill(
    picture: np.ndarray, box: tuple[float, float, float, float], colour: tuple[int, int, int], opacity: float
) -> None:
    """Cover a box (left, top, right, bottom) [pixels] with a colour."""
    left, top, right, bottom = (max(0, round(v)) for v in box)
    under = picture[top:bottom, left:right]
    if opacity >= 1.0:
        under[:] = colour
    else:
        share = round(256.0 * opacity)
        under[:] = (under.astype(np.uint16) * (256 - share) + np.array(colour, np.uint16) * share) >> 8
