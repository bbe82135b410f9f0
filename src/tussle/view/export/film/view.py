"""From where a picture is seen."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

ANGLE = math.radians(32.0)
"""Height of the picture as the eye sees it: a long lens, which keeps who is far comparable to who is near."""


@dataclass(frozen=True, eq=False)
class View:
    """Where the eye is, and what it looks at.

    Attributes:
        eye: Its place [m], (3,).
        target: What is in the middle of the picture [m], (3,).
        up: What points up in the picture, (3,).
        half_height: Half of the height that is seen at the target's distance [m].
        is_parallel: Nothing looks smaller for being farther away.
        model_length: Length of the shortest that a model is drawn [m].
    """

    eye: np.ndarray
    target: np.ndarray
    up: np.ndarray
    half_height: float
    is_parallel: bool = False
    model_length: float = 1.0

    @property
    def distance(self) -> float:
        """From the eye to the target [m]."""
        return float(np.linalg.norm(self.eye - self.target))

    def axes(self) -> np.ndarray:
        """Unit vectors to the right, up and toward the eye, (3, 3), by rows."""
        back = (self.eye - self.target) / self.distance
        right = np.cross(self.up, back)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(back, right), back])

    def project(self, points: np.ndarray, size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
        """Where points are in the picture.

        Args:
            points: [m], (n, 3).
            size: Width and height of the picture [pixels].

        Returns:
            Pixels to the right of its left edge and below its upper one, (n, 2), and distances in front of the eye [m], (n,);
            pixels of points behind the eye mean nothing.
        """
        right, up, back = self.axes() @ (np.asarray(points, float) - self.eye).T
        depth = -back
        shrink = 1.0 if self.is_parallel else self.distance / np.maximum(depth, 1e-9)
        scale = 0.5 * size[1] / self.half_height * shrink
        return np.stack([0.5 * size[0] + scale * right, 0.5 * size[1] - scale * up], axis=1), depth
