"""Pictures whose place on Earth is known, laid on the ground of a mission."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.errors import MissingExtraError, ParameterError, clipped
from tussle.view.ground_map.projections import Projection
from tussle.world.geodesy import Origin
from tussle.world.rays.textures import MAX_SIDE

MAX_PIXELS = 1 << 26
"""Pixels of a picture that is decoded: 200 MB."""
MIN_SIDE = 256
"""Least pixels of a side of the picture on the ground: pixels of a coarse one stay where they are when it is drawn."""
N_CELLS = 32
"""Cells of a side in which the projection is taken as bilinear: over 20 km that is wrong by a centimetre."""
GREY = (128, 128, 128)
"""What is shown where a picture ends or is transparent."""


@dataclass(frozen=True)
class Area:
    """A rectangle on the ground of a mission.

    Attributes:
        origin: Of the world frame.
        low: Its south-western corner [m], (2,).
        high: Its north-eastern corner [m], (2,).
        height: z of the ground [m].
    """

    origin: Origin
    low: tuple[float, float]
    high: tuple[float, float]
    height: float

    def grid(self) -> tuple[np.ndarray, np.ndarray]:
        """East and north of points all over it [m], (k, k) each, from its south-western corner."""
        east, north = (np.linspace(self.low[i], self.high[i], N_CELLS + 1) for i in range(2))
        x, y = np.meshgrid(east, north)
        return x, y

    def projected(
        self, projection: Projection, x: np.ndarray, y: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates of points on the ground, given by east and north [m], in a projection."""
        points = np.stack([x, y, np.full_like(x, self.height)]).reshape(3, -1)
        latitude, longitude, _ = self.origin.to_geodetic(points)
        with np.errstate(all="ignore"):  # a place may have no coordinates in a zone that is far away
            east, north = projection.project(latitude, longitude)
        return east.reshape(x.shape), north.reshape(x.shape)


@dataclass(frozen=True, eq=False)
class GroundPicture:
    """A picture on the ground, of whole pixels from edge to edge.

    Attributes:
        low: Its south-western corner [m], (2,).
        high: Its north-eastern corner [m], (2,).
        image: Red, green, blue, (height, width, 3), uint8, from its north-western corner.
    """

    low: tuple[float, float]
    high: tuple[float, float]
    image: np.ndarray


@dataclass(frozen=True, eq=False)
class PlacedPicture:
    """A picture with rows along the parallels of its projection.

    Attributes:
        where: Its file, for messages.
        image: The image of Pillow.
        projection: The projection of its coordinates.
        west: Coordinate of its western edge.
        north: Coordinate of its northern edge.
        cell: Width and height of a pixel in these coordinates.
    """

    where: str
    image: Any
    projection: Projection
    west: float
    north: float
    cell: tuple[float, float]

    def places(self, area: Area, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Columns and rows, counted from the north-western corner in pixels, of points on the ground given by east and north [m]."""
        east, north = area.projected(self.projection, x, y)
        if period := self.projection.period:
            middle = self.west + 0.5 * self.cell[0] * self.image.size[0]
            east = east + period * np.round((middle - east) / period)
        return (east - self.west) / self.cell[0], (self.north - north) / self.cell[1]

    def laid(self, area: Area, is_trimmed: bool = True) -> GroundPicture:
        """The part of it that lies in an area.

        Args:
            area: The area.
            is_trimmed: The result ends where the picture ends; otherwise it covers the area, with grey where there is no picture.

        Raises:
            ParameterError: The picture does not reach the area, or cannot be read.
        """
        first, last, ends = self._window(area)
        kept = area
        for _ in range(
            2 if is_trimmed else 0
        ):  # the second time, the law of the smaller area is nearly linear
            kept = Area(area.origin, *ends, area.height)
            first, last, ends = self._window(kept)
        sides = [min(MAX_SIDE, max(MIN_SIDE, int(n))) for n in last - first]
        return GroundPicture(kept.low, kept.high, self._sampled(kept, sides, first, last))

    def _window(self, area: Area) -> tuple[np.ndarray, np.ndarray, tuple[Any, Any]]:
        """First column and row that an area needs, and the last ones, (2,) each; and the corners of the part of the area with these [m].

        Raises:
            ParameterError: The picture does not reach the area.
        """
        x, y = area.grid()
        places = np.stack(self.places(area, x, y))
        if not np.isfinite(places).all():
            raise ParameterError(
                f"{self.where}: the mission's area has no coordinates in {self.projection.name}, so far is it from there"
            )
        first = np.clip(np.floor(places.min(axis=(1, 2))), 0, self.image.size).astype(int)
        last = np.clip(np.ceil(places.max(axis=(1, 2))), 0, self.image.size).astype(int)
        if (first >= last).any():
            raise ParameterError(self._outside(area))
        known = np.stack([x.ravel(), y.ravel(), np.ones(x.size)], axis=1)
        found = places.reshape(2, -1).T
        law = np.linalg.lstsq(known, found, rcond=None)[0]
        bend = np.abs(known @ law - found).max()
        (west, north), (east, south) = first - bend, last + bend
        pixels = np.array([[west, north], [west, south], [east, north], [east, south]])
        corners = np.linalg.solve(law[:2].T, (pixels - law[2]).T).T
        low, high = np.maximum(corners.min(axis=0), area.low), np.minimum(corners.max(axis=0), area.high)
        return first, last, (tuple(low.tolist()), tuple(high.tolist()))

    def _sampled(self, area: Area, sides: list[int], first: np.ndarray, last: np.ndarray) -> np.ndarray:
        """The picture over an area, with so many pixels across and down, (h, w, 3), uint8; pixels outside the window are left out."""
        from PIL import Image

        shrink = tuple(max(1, int(n) // side) for n, side in zip(last - first, sides, strict=True))
        with reading(self.where):
            part = flat(self.image.crop((*first.tolist(), *last.tolist()))).reduce(shrink)
        edges = [np.unique(np.linspace(0, side, N_CELLS + 1).astype(int)) for side in sides]
        shares = [edge / side for edge, side in zip(edges, sides, strict=True)]
        east = area.low[0] + shares[0] * (area.high[0] - area.low[0])
        north = area.high[1] - shares[1] * (area.high[1] - area.low[1])
        columns, rows = self.places(area, *np.meshgrid(east, north))
        at = np.stack([(columns - first[0]) / shrink[0], (rows - first[1]) / shrink[1]], axis=-1)
        across, down = (edge.tolist() for edge in edges)
        mesh = [
            (
                (across[i], down[j], across[i + 1], down[j + 1]),
                np.concatenate([at[j, i], at[j + 1, i], at[j + 1, i + 1], at[j, i + 1]]).tolist(),
            )
            for j in range(len(down) - 1)
            for i in range(len(across) - 1)
        ]
        method, filter_ = Image.Transform.MESH, Image.Resampling.BILINEAR
        return np.asarray(part.transform(tuple(sides), method, mesh, filter_, fillcolor=GREY))

    def _outside(self, area: Area) -> str:
        east, north = area.projected(self.projection, *area.grid())
        width, height = self.image.size
        own = (self.west, self.north - height * self.cell[1], self.west + width * self.cell[0], self.north)
        box = (east.min(), north.min(), east.max(), north.max())
        return (
            f"{self.where}: the map lies outside the mission's area: west, south, east, north in {self.projection.name} are "
            f"{_numbers(own)} of the map and {_numbers(box)} of the area"
        )


def _numbers(values: tuple[float, ...]) -> str:
    return ", ".join(f"{value:.8g}" for value in values)


@contextmanager
def reading(where: str) -> Iterator[None]:
    """Turns what a decoder of damaged data raises into one error.

    Raises:
        ParameterError: Something was raised.
        MissingExtraError: Pillow is not installed.
    """
    try:
        from PIL import Image
    except ImportError:
        raise MissingExtraError(f"{where}: maps need Pillow: pip install 'tussle[maps]'") from None
    try:
        yield
    except ParameterError:
        raise
    except Image.DecompressionBombError:
        raise ParameterError(f"{where}: {_too_large()}") from None
    except Exception as error:  # decoders of damaged data raise errors of many kinds
        raise ParameterError(f"{where}: the map cannot be read: {clipped(str(error), 200)}") from error


def opened(where: str, data: bytes, formats: tuple[str, ...], most: int = MAX_PIXELS) -> Any:
    """An image of Pillow, whose pixels are not decoded yet.

    Raises:
        ParameterError: It is no image of these formats, or has more pixels than `most`.
        MissingExtraError: Pillow is not installed.
    """
    with reading(where):
        from PIL import Image

        image = Image.open(io.BytesIO(data), formats=formats)
        if math.prod(image.size) > most:
            raise ParameterError(f"{where}: {_too_large(image.size, most)}")
        if image.mode[0] in "IF":
            raise ParameterError(
                f"{where}: its pixels have the mode {image.mode!r}; a map takes 8 bits a colour"
            )
        return image


def flat(image: Any) -> Any:
    """An image as red, green, blue, with grey where it is transparent."""
    from PIL import Image

    if image.mode not in ("RGBA", "LA", "PA") and "transparency" not in image.info:
        return image.convert("RGB")
    under = Image.new("RGBA", image.size, (*GREY, 255))
    return Image.alpha_composite(under, image.convert("RGBA")).convert("RGB")


def _too_large(size: tuple[int, int] | None = None, most: int = MAX_PIXELS) -> str:
    has = f"has {size[0]:,} x {size[1]:,} pixels" if size else "has too many pixels"
    return f"the map {has}; it takes at most {most:,}: cut out what the mission needs"
