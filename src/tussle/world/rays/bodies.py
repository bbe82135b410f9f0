"""A tree over bodies, for rays."""

from __future__ import annotations

import numpy as np

from tussle.world.rays import kernels
from tussle.world.rays.solids import grow


class BodyTree:
    """A tree over the bodies of each world, at one instant.

    Args:
        states: Positions [m], (3, n), attitudes (4, n) and radii [m], (n,).
        boxed: Block of each body (n,), and lengths of the boxes of each block [m], (n_blocks, 3); 0 for spheres.
        members: Rows of the bodies, world by world, (n,).
        world_start: First place of each world in `members`, and the end, (n_worlds + 1,).
    """

    def __init__(
        self,
        states: tuple[np.ndarray, ...],
        boxed: tuple[np.ndarray, np.ndarray],
        members: np.ndarray,
        world_start: np.ndarray,
    ) -> None:
        n = len(members)
        self.items, around = np.empty((n, kernels.BODY)), np.empty((n, 6))
        kernels.place_bodies(states, boxed, (self.items, around))
        bounds, links, roots, order = grow(around, world_start, members.copy())
        self.tree, self.places = (bounds, links, roots, order), self.items[order]

    def normal(self, rows: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Outward unit normals of bodies at points of their surfaces, (3, m)."""
        items = self.items[rows].T
        offset = points - items[:3]
        x, y, z = offset
        length = np.sqrt(x * x + y * y + z * z)
        normal: np.ndarray = offset / np.where(length > 0.0, length, 1.0)
        boxed = np.flatnonzero(items[3] == 0.0)
        axes = items[7:, boxed].reshape(3, 3, -1)
        x, y, z = offset[:, boxed]
        local = axes[:, 0] * x + axes[:, 1] * y + axes[:, 2] * z
        depth = np.abs(local) - items[4:7, boxed]
        face, column = depth.argmax(axis=0), np.arange(len(boxed))
        normal[:, boxed] = axes[face, :, column].T * np.sign(local[face, column])
        return normal
