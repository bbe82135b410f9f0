"""Rays as arrays, and their hits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from tussle.errors import ParameterError
from tussle.numeric.arrays import unit

MAX_RAY = 1e200
"""Range without a limit [m], for kernels: finite, so that no difference is NaN."""


@dataclass(frozen=True, eq=False)
class Hits:
    """The first hit of each ray.

    Attributes:
        distance: From the origin along the ray [m], (n,); inf where nothing is hit within range.
        id: Id of the entity that is hit, (n,); 0 for the scene and for no hit.
        team: Team of the entity that is hit, (n,); -1 for the scene and for no hit.
        solid: Number of the part of the scene that is hit, (n,), as in `Scene.solids`; -1 for an entity and for no hit.
        points: Where the rays hit [m], (3, n), world frame; inf where they hit nothing.
        normal: Unit normals at the hits, towards the origin of the ray, (3, n); zero where nothing is hit.
    """

    distance: np.ndarray
    id: np.ndarray
    solid: np.ndarray
    origins: np.ndarray = field(repr=False)
    directions: np.ndarray = field(repr=False)
    find_normal: Callable[[Hits], np.ndarray] = field(repr=False)
    code: np.ndarray = field(repr=False)
    team: np.ndarray

    @property
    def points(self) -> np.ndarray:
        is_hit = self.distance < np.inf
        return np.where(is_hit, self.origins + np.where(is_hit, self.distance, 0.0) * self.directions, np.inf)

    @property
    def normal(self) -> np.ndarray:
        normal = self.find_normal(self)
        x, y, z = normal * self.directions
        return np.where(x + y + z > 0.0, -normal, normal)


def checked_vectors(name: str, values: object) -> np.ndarray:
    """Values as float64, (3, n), contiguous.

    Raises:
        ParameterError: They have another shape, or are not finite.
    """
    vectors = np.ascontiguousarray(values, np.float64)
    if vectors.ndim != 2 or len(vectors) != 3:
        raise ParameterError(f"{name} have shape {vectors.shape}; they take (3, n)")
    if not np.isfinite(vectors).all():
        n = int(np.flatnonzero(~np.isfinite(vectors).all(axis=0))[0])
        raise ParameterError(f"{name}: vector {n} is {vectors[:, n].tolist()}; they take finite numbers")
    return vectors


def checked_numbers(name: str, values: object, n: int) -> np.ndarray:
    """Values as float64, (n,), contiguous.

    Raises:
        ParameterError: They have another shape, are NaN or negative.
    """
    numbers = np.asarray(values, np.float64)
    if numbers.shape not in ((), (n,)):
        raise ParameterError(f"{name} has shape {numbers.shape}; it takes one number or ({n},)")
    if not (numbers >= 0.0).all():
        raise ParameterError(
            f"{name} has the value {numbers[~(numbers >= 0.0)].flat[0]:g}; it takes lengths >= 0 m"
        )
    return np.ascontiguousarray(np.broadcast_to(numbers, n))


def new_rays(
    origins: object, directions: object, max_range: object
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Origins [m] and unit directions, (3, n), range as the distance so far [m], and codes without a hit, (n,).

    Raises:
        ParameterError: A shape or value is not allowed.
    """
    start, way = checked_vectors("origins", origins), checked_vectors("directions", directions)
    if start.shape != way.shape:
        raise ParameterError(
            f"there are {start.shape[1]} origins and {way.shape[1]} directions; their numbers must be equal"
        )
    n = start.shape[1]
    limit = np.minimum(checked_numbers("max_range", max_range, n), MAX_RAY)
    way = unit(way)
    limit[(way[0] == 0.0) & (way[1] == 0.0) & (way[2] == 0.0)] = -1.0  # hits nothing
    return start, np.ascontiguousarray(way), limit, np.full(n, np.inf)
