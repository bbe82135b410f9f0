"""Bodies that are held back on their way: they move to what is in the way, and slide along it."""

from __future__ import annotations

import numpy as np

from tussle.world.contacts import found
from tussle.world.contacts.boxes.kernels import CONTACT
from tussle.world.contacts.solids import StaticSolids
from tussle.world.contacts.ways.kernels import shorten

KEPT_OVERLAP = 0.02
"""Overlap at the end of a way, in sizes of the smaller body: enough to be found as a contact, too little to be pushed to the far side."""
FAST = 0.05
"""Ways longer than this, in sizes of the body, are followed; contacts push shorter ones back."""
PIECE, MAX_PIECES = 4.0, 64
"""Ways are followed in pieces of this length, in sizes of the body, for which there is room for all contacts; longer ones if there are
more than so many."""
MAX_SEARCHES = 8
"""Searches for what is in the way. A body whose way is then still blocked, between walls that meet, stays where it was."""
PASSES = 20


def rounded(items: np.ndarray, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Items and sizes with boxes replaced by the spheres and capsules along the x axis that fit inside: boxes are not followed."""
    items, sizes = items.copy(), sizes.copy()
    boxes = np.flatnonzero(items[:, 3] == 0.0)
    size = items[boxes, 4:7].min(axis=1)
    items[boxes, 3], items[boxes, 4], items[boxes, 5:7] = size, items[boxes, 4] - size, 0.0
    sizes[0, boxes] = items[boxes, 3] + items[boxes, 4]
    return items, sizes


def held_ways(
    shapes: tuple[np.ndarray, np.ndarray],
    pairs: tuple[np.ndarray, np.ndarray],
    ways: np.ndarray,
    share: np.ndarray,
    world: np.ndarray,
    scene: StaticSolids,
) -> np.ndarray:
    """Ways that lead neither through the scene nor through other bodies.

    Args:
        shapes: Items (n, ITEM) and sizes (2, n) of the bodies at the begin of their ways, see `found.place`.
        pairs: Rows of the pairs that may meet, in the order in which they are solved, (m,) each.
        ways: Ways [m], (3, n).
        share: Part of each body in a change of its way, 0 for one whose way is kept, (n,).
        world: World of each body, (n,).
        scene: The static scene.

    Returns:
        The ways [m], (3, n); those that are free are the same to the bit.
    """
    shapes = rounded(*shapes)
    sizes = shapes[1]
    x, y, z = ways
    far = np.sqrt(x * x + y * y + z * z)
    n_pieces = np.ones(int(world.max(initial=-1)) + 1)
    np.maximum.at(n_pieces, world, np.minimum(np.ceil(far / (PIECE * sizes[1])), MAX_PIECES))
    place, is_held = np.zeros((len(far), 3)), np.zeros(len(far), bool)
    piece = (ways / n_pieces[world]).T
    for k in range(int(n_pieces.max(initial=0.0))):
        rows = np.flatnonzero(n_pieces[world] > k)
        bodies = *_of_rows(rows, shapes, pairs), piece[rows], share[rows], world[rows]
        made = _held_piece(*bodies, scene)
        is_held[rows] |= (made != piece[rows]).any(axis=1)
        place[rows] += made
        shapes[0][rows, :3] += made
    return np.where(is_held, place.T, ways)


def _of_rows(
    rows: np.ndarray, shapes: tuple[np.ndarray, np.ndarray], pairs: tuple[np.ndarray, np.ndarray]
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Items and sizes of all bodies of some worlds, at `rows`, (m,), and their pairs."""
    (items, sizes), (row, other) = shapes, pairs
    place = np.full(len(items), -1)
    place[rows] = np.arange(len(rows))
    kept = place[row] >= 0
    return (items[rows], np.ascontiguousarray(sizes[:, rows])), (place[row[kept]], place[other[kept]])


def _held_piece(
    shapes: tuple[np.ndarray, np.ndarray],
    pairs: tuple[np.ndarray, np.ndarray],
    piece: np.ndarray,
    share: np.ndarray,
    world: np.ndarray,
    scene: StaticSolids,
) -> np.ndarray:
    """Pieces of ways, (n, 3), that lead through nothing; see `held_ways`. Only worlds with a way that is not free are searched again."""
    sizes, made, n_worlds = shapes[1], np.array(piece), int(world.max(initial=-1)) + 1
    rows = np.arange(len(piece))
    row, other, numbers = np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, CONTACT))
    for _ in range(MAX_SEARCHES):
        part = found.find(
            *_of_rows(rows, shapes, pairs),
            (np.ascontiguousarray(made[rows].T), 1.0, world[rows]),
            scene,
            n_worlds,
        )
        row = np.concatenate([row, rows[part.row]])
        other = np.concatenate([other, np.where(part.other < 0, -1, rows[part.other])])
        numbers = np.concatenate([numbers, part.numbers])
        smaller = np.where(other < 0, sizes[1, row], np.minimum(sizes[1, row], sizes[1, other]))
        is_blocked = np.zeros(len(piece), bool)
        shorten((row, other, numbers, KEPT_OVERLAP * smaller), share, PASSES, made, is_blocked)
        if not is_blocked.any():
            return made
        goes_on = np.isin(world, world[is_blocked])
        rows, kept = np.flatnonzero(goes_on), goes_on[row]
        row, other, numbers = row[kept], other[kept], numbers[kept]
    made[goes_on & (made != piece).any(axis=1)] = 0.0
    return made
