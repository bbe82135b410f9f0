"""All contacts of a step, found and solved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.world.contacts.bodies import kernels as bodies_kernels
from tussle.world.contacts.boxes.kernels import CONTACT
from tussle.world.contacts.impulses import kernels as impulses_kernels
from tussle.world.contacts.solids import StaticSolids
from tussle.world.contacts.surfaces import kernels as surfaces_kernels

SLOTS = impulses_kernels.SLOTS
Split = Callable[[int, Callable[[int, int], Any]], Any]


@dataclass(frozen=True)
class ContactList:
    """Contacts, ordered by world.

    Attributes:
        row: Row of the first body, (m,).
        other: Row of the second body, (m,); -1 for the scene.
        numbers: Unit normal from the second to the first, arms [m], gap [m] and feature, (m, CONTACT).
        starts: First contact of each world, and the end, (n_worlds + 1,).
    """

    row: np.ndarray
    other: np.ndarray
    numbers: np.ndarray
    starts: np.ndarray

    def __len__(self) -> int:
        return len(self.row)

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the arrays as kernels take them."""
        return self.row, self.other, self.numbers


def place(
    pos: np.ndarray, quat: np.ndarray, radius: np.ndarray, block: np.ndarray, shapes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Items (n, ITEM), and distance of the furthest point from the centre and size of each body [m], (2, n); see `place_shapes`."""
    items, sizes = np.empty((len(radius), bodies_kernels.ITEM)), np.empty((2, len(radius)))
    bodies_kernels.place_shapes((pos, quat, radius), block, shapes, items, sizes)
    return items, sizes


def find(
    shapes: tuple[np.ndarray, np.ndarray],
    pairs: tuple[np.ndarray, np.ndarray],
    motion: tuple[np.ndarray, float, np.ndarray],
    scene: StaticSolids,
    n_worlds: int,
) -> ContactList:
    """The contacts of all worlds.

    Args:
        shapes: Items and sizes of the bodies.
        pairs: Rows of the pairs that may touch, in the order in which they are solved, (m,) each.
        motion: Velocities [m/s], (3, n), length of a step [s], and world of each body, (n,).
        scene: The static scene.
        n_worlds: Number of worlds.
    """
    vel, dt, world = motion
    (items, sizes), n, moving = shapes, len(world), motion
    if len(scene.balls):
        shapes, pairs, vel = _with_balls(shapes, pairs, (vel, dt), scene.balls)
    bodies = items, np.ascontiguousarray(sizes[0])
    size, m, space = 0, 2 * len(pairs[0]) + 16, 4 * n
    while size < m:  # until there is room for all
        size = m + space
        ints, numbers = np.empty((size, 3), np.int64), np.empty((size, CONTACT))
        m = n_pairs = bodies_kernels.find_pairs(shapes, pairs, (vel, dt), ints, numbers)
        if m <= size and not scene.is_empty:
            m += surfaces_kernels.find_surfaces(
                bodies, moving, scene.planes, scene.tree, scene.field, ints[m:], numbers[m:]
            )
    ints, numbers = ints[:m], numbers[:m]
    ints[:n_pairs, 1] = np.where(ints[:n_pairs, 1] < n, ints[:n_pairs, 1], -1)
    own = world[ints[:, 0]]
    if n_worlds > 1:
        order = np.argsort(own, kind="stable")
        ints, numbers, own = ints[order], numbers[order], own[order]
    starts = np.searchsorted(own, np.arange(n_worlds + 1))
    row, other = np.ascontiguousarray(ints[:, 0]), np.ascontiguousarray(ints[:, 1])
    return ContactList(row, other, numbers, starts)


def _with_balls(
    shapes: tuple[np.ndarray, np.ndarray],
    pairs: tuple[np.ndarray, np.ndarray],
    motion: tuple[np.ndarray, float],
    balls: np.ndarray,
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray], np.ndarray]:
    """Bodies, pairs and velocities with those of balls that do not move, as further rows."""
    (items, sizes), (vel, dt), n = shapes, motion, len(shapes[0])
    row, other = list(pairs[:1]), list(pairs[1:])
    speed = np.sqrt(vel[0] * vel[0] + vel[1] * vel[1] + vel[2] * vel[2])
    for k, ball in enumerate(balls):
        x, y, z = items[:, :3].T - ball[:3, None]
        near = np.flatnonzero(np.sqrt(x * x + y * y + z * z) <= 1.02 * (sizes[0] + ball[3]) + dt * speed)
        row.append(near)
        other.append(np.full(len(near), n + k))
    ball_sizes = np.stack([balls[:, 3], balls[:, 3]])
    return (
        (np.concatenate([items, balls]), np.concatenate([sizes, ball_sizes], axis=1)),
        (np.concatenate(row), np.concatenate(other)),
        np.concatenate([vel, np.zeros((3, len(balls)))], axis=1),
    )


def entered(
    mass: np.ndarray,
    inertia: np.ndarray,
    quat: np.ndarray,
    motion: tuple[np.ndarray, np.ndarray],
    moves: np.ndarray,
) -> np.ndarray:
    """Velocities and inverse masses of bodies for the solver, (n, BODY); see `enter_bodies`."""
    bodies = np.empty((len(mass), impulses_kernels.BODY))
    impulses_kernels.enter_bodies((mass, inertia, quat), motion, moves, bodies)
    return bodies


def recalled(
    contacts: ContactList, ids: np.ndarray, sizes: np.ndarray, memory: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Impulses of the last step [N s], (m, 3), and which contacts are of bodies that did not touch in it, (m,)."""
    impulses, is_new = np.empty((len(contacts), 3)), np.empty(len(contacts), bool)
    impulses_kernels.recall(contacts.arrays, (ids, sizes), memory, impulses, is_new)
    return impulses, is_new


def remembered(
    contacts: ContactList, ids: np.ndarray, sizes: np.ndarray, impulses: np.ndarray, memory: np.ndarray
) -> np.ndarray:
    """Return True for contacts that touch, (m,); write their impulses to the memory, (4 SLOTS, n)."""
    touches = np.empty(len(contacts), bool)
    impulses_kernels.remember(contacts.arrays, (ids, sizes), impulses, memory, touches)
    return touches


def solve(
    contacts: ContactList,
    bodies: tuple[np.ndarray, np.ndarray],
    materials: tuple[np.ndarray, np.ndarray, np.ndarray],
    steps: tuple[float, int],
    guess: tuple[np.ndarray, np.ndarray],
    split: Split,
) -> np.ndarray:
    """Change velocities so that bodies neither approach where they touch nor slide where friction holds them.

    Args:
        contacts: The contacts.
        bodies: Numbers of bodies, (n, BODY), of which the velocities are changed; sizes [m], (2, n).
        materials: Restitution, friction, and speed from which bodies bounce [m/s], by world.
        steps: Length of a step [s], and number of iterations.
        guess: First guess of the impulses [N s], (m, 3), replaced by the result, and which contacts are new, (m,).
        split: Calls a function for parts of the worlds, in threads.

    Returns:
        Shifts and small rotations [m rad] that undo overlaps, (n, 6).
    """
    (moves, sizes), (impulses, is_new) = bodies, guess
    shifts = np.zeros((len(moves), 6))
    split(
        len(contacts.starts) - 1,
        lambda *part: impulses_kernels.solve_worlds(
            (moves, shifts, sizes),
            (*contacts.arrays, is_new),
            materials,
            *steps,
            contacts.starts,
            impulses,
            part,
        ),
    )
    return shifts
