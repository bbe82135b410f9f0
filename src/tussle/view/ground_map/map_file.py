"""A map file that the user has."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from tussle.arguments import explained
from tussle.documents import read_bytes
from tussle.errors import ParameterError, clipped, listed, nearest_name
from tussle.view.ground_map.geotiff import placed_geotiff
from tussle.view.ground_map.mbtiles import MbTiles
from tussle.view.ground_map.placed import Area, GroundPicture, PlacedPicture, opened, reading
from tussle.view.ground_map.pmtiles import PmTiles
from tussle.view.ground_map.projections import GEOGRAPHIC
from tussle.view.ground_map.tiles import stitched
from tussle.world.rays.textures import upright

MAX_BYTES = 1 << 28
"""Size of a picture's file."""
FORMATS = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG", ".tif": "TIFF", ".tiff": "TIFF"}
"""Pictures, by the ends of their names."""
TILES = (".mbtiles", ".pmtiles")
"""Files of tiles, by the ends of their names."""
NO_ORIGIN = (
    "the mission has no origin, so a map has no place in it; set <latitude_origin> and <longitude_origin>, "
    "in Python Scene(origin=Origin.from_degrees(latitude, longitude))"
)


@explained
@dataclass(frozen=True)
class GroundMap:
    """A map that pictures show on the ground: a PNG or JPEG with bounds, a GeoTIFF, MBTiles or PMTiles.

    Args:
        path: Its file.
        bounds: West, south, east, north [degrees] of the edges of a picture that does not know its place; None for others.

    Raises:
        ParameterError: The bounds are not allowed, or do not fit the file.
    """

    path: Path
    bounds: tuple[float, float, float, float] | None = None

    @classmethod
    def of_mission(cls, said: Mapping[str, str]) -> GroundMap:
        """The map of a mission file, see `tussle.mission.Loaded.viewer`.

        Raises:
            ParameterError: As for a map of one's own.
        """
        return cls(Path(said["file"]), read_bounds(said["bounds"]) if said["bounds"] else None)

    def __post_init__(self) -> None:
        suffix = self.path.suffix.lower()
        known = (*FORMATS, *TILES)
        if suffix not in known:
            raise ParameterError(
                f"{self.path}: {suffix!r} is no format of maps{nearest_name(suffix, known)}; {listed(known)}"
            )
        if self.bounds is not None and suffix in TILES:
            raise ParameterError(f"{self.path}: tiles have their own bounds; --map-bounds is for pictures")
        if self.bounds is not None:
            _check_bounds(self.path, self.bounds)
        elif FORMATS.get(suffix) in ("PNG", "JPEG"):
            raise ParameterError(
                f"{self.path}: a picture without bounds has no place; give west, south, east and north in degrees: "
                f"--map-bounds W,S,E,N"
            )

    def over(self, area: Area, is_trimmed: bool = True) -> GroundPicture:
        """The map on the ground of an area.

        Args:
            area: The area.
            is_trimmed: The result ends where the map ends; otherwise it covers the area, with grey where there is no map.

        Raises:
            ParameterError: The mission has no origin, or the file cannot be read or lies elsewhere.
            MissingExtraError: Pillow is not installed.
        """
        if area.origin.is_default:
            raise ParameterError(f"{self.path}: {NO_ORIGIN}")
        return self._placed(area).laid(area, is_trimmed)

    def _placed(self, area: Area) -> PlacedPicture:
        where, suffix = str(self.path), self.path.suffix.lower()
        if suffix == ".pmtiles":
            return stitched(where, PmTiles(self.path), area)
        if suffix == ".mbtiles":
            with closing(MbTiles(self.path)) as tiles:
                return stitched(where, tiles, area)
        data = read_bytes(self.path, ParameterError, MAX_BYTES)
        image = opened(where, data, (FORMATS[suffix],))
        if self.bounds is None:
            with reading(where):  # its tags can be of any type
                return placed_geotiff(where, image)
        with reading(where):
            image = upright(image)
        west, south, east, north = self.bounds
        width, height = image.size
        cell = ((east - west) / width, (north - south) / height)
        return PlacedPicture(where, image, GEOGRAPHIC, west, north, cell)


def read_bounds(text: str) -> tuple[float, float, float, float]:
    """Parse west, south, east and north.

    Raises:
        ParameterError: They are not four numbers.
    """
    try:
        west, south, east, north = (float(word) for word in text.replace(",", " ").split())
    except ValueError:
        raise ParameterError(
            f"bounds {clipped(text)!r} are not four numbers: west, south, east, north in degrees, such as -95.2,28.9,-95,29.1"
        ) from None
    return west, south, east, north


def _check_bounds(path: Path, bounds: tuple[float, float, float, float]) -> None:
    west, south, east, north = bounds
    shown = ", ".join(f"{value:g}" for value in bounds)
    if not all(map(math.isfinite, bounds)) or max(abs(west), abs(east)) > 540.0 or max(-south, north) > 90.0:
        raise ParameterError(
            f"{path}: the bounds {shown} are not degrees; they are west, south, east, north: longitude, latitude, longitude, latitude"
        )
    if not west < east <= west + 360.0 or not south < north:
        raise ParameterError(
            f"{path}: the bounds {shown} are swapped; they are west, south, east, north, with west < east and south < north "
            f"(a map across the 180th meridian ends beyond it, such as 179, -17, 181, -16)"
        )
