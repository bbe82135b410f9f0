"""Terrain, read from a file beside the mission."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tussle.errors import ViewError, listed, nearest_name
from tussle.view.shapes import Mesh

SUFFIX = ".asc"
MOST_BYTES = 64_000_000
MOST_CELLS = 4_000_000
"""Largest number of heights in a file."""
MOST_DRAWN = 40_000
"""Largest number of heights that are drawn: 80,000 triangles."""
KEYS = ("ncols", "nrows", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "cellsize", "nodata_value")
NEEDED = ("ncols", "nrows", "cellsize")


@dataclass(frozen=True, eq=False)
class Terrain:
    """Heights of the ground on a grid.

    Attributes:
        x: East of the columns [m], (nx,), ascending.
        y: North of the rows [m], (ny,), ascending.
        height: z of the ground [m], (ny, nx).
    """

    x: np.ndarray
    y: np.ndarray
    height: np.ndarray

    def thinned(self, most: int = MOST_DRAWN) -> Terrain:
        """Every k-th column and row, with the least k that leaves at most this number of heights."""
        stride = 1
        while len(self.x[::stride]) * len(self.y[::stride]) > most:
            stride += 1
        return Terrain(self.x[::stride], self.y[::stride], self.height[::stride, ::stride])

    def mesh(self, most: int = MOST_DRAWN) -> Mesh:
        """Two triangles between each four neighbours, of at most this number of heights."""
        thin = self.thinned(most)
        nx, ny = len(thin.x), len(thin.y)
        east, north = np.meshgrid(thin.x, thin.y)
        corner = (np.arange(ny - 1)[:, None] * nx + np.arange(nx - 1)).ravel()
        below = np.stack([corner, corner + 1, corner + nx + 1], 1)
        above = np.stack([corner, corner + nx + 1, corner + nx], 1)
        vertices = np.stack([east.ravel(), north.ravel(), thin.height.ravel()], 1)
        return Mesh(vertices, np.concatenate([below, above]))


def read_terrain(path: Path) -> Terrain:
    """An ASCII grid as geographic tools write it (Esri's .asc), with its corner and cells in m of the world frame.

    Cells without data are as high as the lowest.

    Raises:
        ViewError: It is not there, or not such a grid.
    """
    try:
        if path.stat().st_size > MOST_BYTES:
            raise ViewError(f"{path}: the terrain has more than {MOST_BYTES // 1_000_000} MB")
        lines = path.read_text(encoding="ascii").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ViewError(f"{path}: the terrain cannot be read: {error}") from error
    head, n_head = _read_head(path, lines)
    nx, ny, cell = int(head["ncols"]), int(head["nrows"]), head["cellsize"]
    if nx < 2 or ny < 2 or nx * ny > MOST_CELLS or not 0.0 < cell < float("inf"):
        raise ViewError(
            f"{path}: a terrain of {nx} x {ny} heights every {cell:g} m is not allowed; it takes 2 x 2 to {MOST_CELLS} heights"
        )
    try:
        values = np.array(" ".join(lines[n_head:]).split(), float)
    except ValueError as error:
        raise ViewError(f"{path}: not all heights are numbers: {error}") from None
    if len(values) != nx * ny:
        raise ViewError(f"{path}: there are {len(values)} heights; needed are {nx} x {ny}")
    height = values.reshape(ny, nx)[::-1]  # the file begins in the north
    missing = (height == head.get("nodata_value", -9999.0)) | ~np.isfinite(height)
    if missing.all():
        raise ViewError(f"{path}: no cell has a height")
    height = np.where(missing, height[~missing].min(), height)
    west = head["xllcenter"] if "xllcenter" in head else head.get("xllcorner", 0.0) + 0.5 * cell
    south = head["yllcenter"] if "yllcenter" in head else head.get("yllcorner", 0.0) + 0.5 * cell
    return Terrain(west + cell * np.arange(nx), south + cell * np.arange(ny), height)


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
            raise ViewError(
                f"{path}:{number}: a terrain has no {words[0][:40]!r}{nearest_name(key, KEYS)}; {listed(KEYS)}"
            )
        try:
            (head[key],) = (float(word) for word in words[1:])
        except ValueError:
            raise ViewError(f"{path}:{number}: {key} takes one number") from None
    for key in NEEDED:
        if key not in head or (key != "cellsize" and not head[key].is_integer()):
            raise ViewError(f"{path}: the terrain has no {key}, or one that is not allowed")
    return head, number


def find_terrain(name: str, folder: Path | None) -> Terrain:
    """Read the terrain that a mission names, from a file in the mission's folder or below it.

    Raises:
        ViewError: The file does not exist or cannot be read.
    """
    if not name.endswith(SUFFIX):
        raise ViewError(
            f"terrain {name[:80]!r}: tussle shows heights from a grid beside the mission, such as 'hills{SUFFIX}'; the pictures and "
            "models of the existing system are not part of it"
        )
    if folder is None:
        raise ViewError(f"terrain {name[:80]!r}: the mission has no folder to look in")
    path = (folder / name).resolve()
    if not path.is_relative_to(folder.resolve()):
        raise ViewError(f"terrain {name[:80]!r}: only files in the mission's folder or below it are read")
    return read_terrain(path)
