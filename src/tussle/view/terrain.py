"""The terrain of a scene, as it is drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tussle.view.shapes import Mesh
from tussle.world.rays.surfaces import MeshPart
from tussle.world.scene import HeightField

MAX_DRAWN = 40_000
"""Largest number of heights that are drawn: 80,000 triangles."""


@dataclass(frozen=True, eq=False)
class Terrain:
    """Heights of the ground on a grid.

    Attributes:
        x: East of the columns [m], (nx,), ascending.
        y: North of the rows [m], (ny,), ascending.
        height: z of the ground [m], (ny, nx).
        texture: Image over it, red, green, blue, (h, w, 3), uint8, from its north-western corner; None for none.
    """

    x: np.ndarray
    y: np.ndarray
    height: np.ndarray
    texture: np.ndarray | None = None

    @classmethod
    def of(cls, field: HeightField) -> Terrain:
        """The terrain of a height field."""
        ny, nx = field.height.shape
        x, y = field.west + field.cell * np.arange(nx), field.south + field.cell * np.arange(ny)
        return cls(x, y, field.height, field.texture)

    def thinned(self, most: int = MAX_DRAWN) -> Terrain:
        """Every k-th column and row, with the least k that leaves at most this number of heights."""
        stride = 1
        while len(self.x[::stride]) * len(self.y[::stride]) > most:
            stride += 1
        return Terrain(self.x[::stride], self.y[::stride], self.height[::stride, ::stride], self.texture)

    def mesh(self, most: int = MAX_DRAWN) -> Mesh:
        """Two triangles between each four neighbours, of at most this number of heights."""
        thin = self.thinned(most)
        nx, ny = len(thin.x), len(thin.y)
        east, north = np.meshgrid(thin.x, thin.y)
        corner = (np.arange(ny - 1)[:, None] * nx + np.arange(nx - 1)).ravel()
        below = np.stack([corner, corner + 1, corner + nx + 1], 1)
        above = np.stack([corner, corner + nx + 1, corner + nx], 1)
        vertices = np.stack([east.ravel(), north.ravel(), thin.height.ravel()], 1)
        return Mesh(vertices, np.concatenate([below, above]))

    def part(self, most: int = MAX_DRAWN) -> MeshPart | None:
        """The surface with its image, of at most this number of heights; None without an image."""
        if self.texture is None:
            return None
        mesh = self.mesh(most)
        return MeshPart.draped(mesh.vertices, mesh.faces, self.texture)
