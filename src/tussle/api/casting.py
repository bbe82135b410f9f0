"""Queries of entities: rays, free space and heights among the scene and the other entities of their world."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api.bodies import Bodies
from tussle.api.context import Context
from tussle.errors import ParameterError
from tussle.world.rays import kernels, touching
from tussle.world.rays.hits import MAX_RAY, Hits, checked_numbers, checked_vectors, new_rays

RAYS_PER_THREAD = 1024


def cast(
    context: Context,
    bodies: Bodies,
    rays: tuple[Any, Any, Any],
    world: np.ndarray,
    own: np.ndarray,
    entities: bool,
) -> Hits:
    """The first hits of rays.

    Args:
        context: Scene and threads.
        bodies: The body table.
        rays: Origins [m] and directions, (3, n), and the maximum range [m].
        world: World of each ray, (n,).
        own: Row of the entity that a ray does not meet, (n,); -1 for none.
        entities: Whether rays meet entities.

    Raises:
        ParameterError: A shape does not fit, or a value is not allowed.
    """
    solids = context.scene.caster
    start, way, distance, code = new_rays(*_of_finite(*rays))
    n = start.shape[1]
    _check_worlds(world, n, bodies)

    def split(m: int, run: Any) -> None:
        context.split(m, run, RAYS_PER_THREAD)

    solids.first_hits(start, way, distance, code, split)
    if not (entities and bodies.n):
        return solids.hits(start, way, distance, code)
    tree = bodies.tree(context.boxes)
    around = start, way, np.ascontiguousarray(world, np.int64), np.asarray(own, np.float64)
    found = distance, code, float(solids.n_codes)
    split(n, lambda *part: kernels.cast(tree.tree, tree.places, around, found, part))
    hits = solids.hits(start, way, distance, code)
    is_body = (code >= solids.n_codes) & (code < np.inf)
    rows = code[is_body].astype(np.int64) - solids.n_codes
    hits.id[is_body], hits.team[is_body] = bodies.id[rows], bodies.team[rows]

    def normal(hits: Hits) -> np.ndarray:
        found = solids.normal(hits)
        found[:, is_body] = tree.normal(rows, hits.points[:, is_body])
        return found

    return Hits(hits.distance, hits.id, hits.solid, start, way, normal, code, hits.team)


def free(
    context: Context, bodies: Bodies, points: Any, radius: Any, world: np.ndarray, own: np.ndarray
) -> np.ndarray:
    """Return True if spheres round points neither touch nor lie inside the scene or a body, (m,); see `Group.free`."""
    center = checked_vectors("points", points)
    n = center.shape[1]
    _check_worlds(world, n, bodies)
    reach = np.minimum(checked_numbers("radius", radius, n), MAX_RAY)
    touches = context.scene.caster.touches(center, reach)
    if bodies.n:
        tree = bodies.tree(context.boxes)
        around = center, reach, np.ascontiguousarray(world, np.int64), np.ascontiguousarray(own, np.int64)
        touching.touch_bodies(tree.tree, tree.places, around, touches)
    return ~touches


def height(
    context: Context, bodies: Bodies, x: Any, y: Any, world: np.ndarray, own: np.ndarray
) -> np.ndarray:
    """Height of the highest surface of the scene or a body [m], (m,); see `Group.height`."""
    east, north = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    _check_worlds(world, east.size, bodies)
    half = 0.5 * context.boxes[bodies.block]
    size = np.where(half[:, 0] > 0.0, np.sqrt((half * half).sum(axis=1)), bodies.radius)
    tops, top = np.full(bodies.n_worlds, context.scene.caster.top), bodies.pos[2] + size
    is_sane = np.isfinite(top)
    np.maximum.at(tops, bodies.world[is_sane], top[is_sane])
    start = tops[world] + 1.0
    down = np.repeat([[0.0], [0.0], [-1.0]], len(start), axis=1)
    origins = np.stack([east.ravel(), north.ravel(), start])
    hits = cast(context, bodies, (origins, down, np.inf), world, own, entities=True)
    return np.asarray(start - hits.distance)


def _check_worlds(world: np.ndarray, n: int, bodies: Bodies) -> None:
    if world.shape != (n,):
        raise ParameterError(
            f"there are {n} rays or places and {len(world)} rows or worlds; their numbers must be equal"
        )
    wrong = world[(world < 0) | (world >= bodies.n_worlds)]
    if len(wrong):
        raise ParameterError(f"world {wrong[0]} is not allowed; there are worlds 0 to {bodies.n_worlds - 1}")


def _of_finite(origins: Any, directions: Any, max_range: Any) -> tuple[Any, Any, Any]:
    """The rays; those from or to a state that is not finite, whose world ends at the end of the step, hit nothing."""
    sums = np.sum(origins, axis=0) + np.sum(directions, axis=0)
    is_sane = np.isfinite(sums)
    if is_sane.all():
        return origins, directions, max_range
    ahead = np.array([[1.0], [0.0], [0.0]])
    return (
        np.where(is_sane, origins, 0.0),
        np.where(is_sane, directions, ahead),
        np.where(is_sane, max_range, 0.0),
    )
