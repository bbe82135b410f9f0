"""Place of a GeoTIFF: OGC GeoTIFF 1.1 (2019). Its tags are read by Pillow."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.errors import ParameterError
from tussle.view.ground_map.placed import PlacedPicture
from tussle.view.ground_map.projections import Projection, projection_of
from tussle.world.rays.grids import foreign_unit

PIXEL_SCALE, TIE_POINT, TRANSFORMATION, GEO_KEYS = 33550, 33922, 34264, 34735
"""Tags, annex A and section 7."""
MODEL_TYPE, RASTER_TYPE, GEOGRAPHIC_CODE, PROJECTED_CODE = 1024, 1025, 2048, 3072
"""Keys, section 7.5."""
PROJECTED, GEOGRAPHIC, POINTS = 1, 2, 2
"""Values of the model's and the raster's type."""
MAX_TURN = 1e-6
"""Largest shift of a row's end across it, in shares of its length, that is not called rotated."""
ALLOWED = "it takes EPSG:4326, EPSG:3857, or UTM on WGS84, EPSG:326XX and 327XX; gdalwarp -t_srs EPSG:3857 makes one"


def placed_geotiff(where: str, image: Any) -> PlacedPicture:
    """A GeoTIFF with its place.

    Args:
        where: Its file, for messages.
        image: The image of Pillow.

    Raises:
        ParameterError: It has no place, is rotated, is not in metres or degrees, or has another projection.
    """
    tags = image.tag_v2
    if unit := foreign_unit(tags.get(GEO_KEYS, ())):
        raise ParameterError(f"{where}: the GeoTIFF has {unit}; {ALLOWED}")
    projection, is_points = _system(where, tags.get(GEO_KEYS, ()))
    matrix = _matrix(where, tags)
    (across, turn, west), (lean, down, north) = matrix[0, [0, 1, 3]], matrix[1, [0, 1, 3]]
    if abs(turn) > MAX_TURN * abs(down) or abs(lean) > MAX_TURN * abs(across) or across <= 0.0 or down >= 0.0:
        raise ParameterError(
            f"{where}: the GeoTIFF is rotated or mirrored; a map has north up: gdalwarp makes such a one"
        )
    shift = 0.5 if is_points else 0.0
    return PlacedPicture(
        where, image, projection, west - shift * across, north - shift * down, (across, -down)
    )


def _system(where: str, keys: tuple[int, ...]) -> tuple[Projection, bool]:
    """The projection, and whether coordinates are those of the pixels' middles."""
    rows = [keys[i : i + 4] for i in range(4, len(keys) - 3, 4)]
    said = {row[0]: row[3] for row in rows if row[1] == 0}
    kinds = {PROJECTED: PROJECTED_CODE, GEOGRAPHIC: GEOGRAPHIC_CODE}
    code = said.get(kinds.get(said.get(MODEL_TYPE, 0), 0))
    if code is None:
        raise ParameterError(
            f"{where}: the TIFF does not say where it lies (it has no GeoTIFF keys); give its bounds, or a GeoTIFF: {ALLOWED}"
        )
    if (projection := projection_of(code)) is None:
        raise ParameterError(f"{where}: the GeoTIFF has the projection EPSG:{code}; {ALLOWED}")
    return projection, said.get(RASTER_TYPE) == POINTS


def _matrix(where: str, tags: Any) -> np.ndarray:
    """From column, row, 0, 1 to coordinates, (4, 4)."""
    scale, tie = (np.array(tags.get(tag, ()), float) for tag in (PIXEL_SCALE, TIE_POINT))
    matrix = np.array(tags.get(TRANSFORMATION, ()), float)
    if len(scale) >= 2 and len(tie) == 6:
        matrix = np.diag([scale[0], -scale[1], 1.0, 1.0])
        matrix[:2, 3] = tie[3:5] - np.array([scale[0], -scale[1]]) * tie[:2]
    elif len(matrix) == 16:
        matrix = matrix.reshape(4, 4)
    else:
        raise ParameterError(
            f"{where}: the GeoTIFF has neither a pixel scale with one tie point nor a transformation, so it has no place"
        )
    if not np.isfinite(matrix).all():
        raise ParameterError(f"{where}: the GeoTIFF's place is not finite")
    return matrix
