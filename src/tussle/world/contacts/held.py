"""Bodies that are held back on their way: they move to what is in the way, and slide along it."""

from __future__ import annotations

import numpy as np

from tussle.world.contacts import found
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
    n_pieces = min(int(np.ceil((far / (PIECE * sizes[1])).max(initial=1.0))), MAX_PIECES)
    place, is_held = np.zeros((len(far), 3)), np.zeros(len(far), bool)
    piece = ways.T / n_pieces
    for _ in range(n_pieces):
        made = _held_piece((shapes[0], sizes), pairs, piece, share, world, scene)
        is_held |= (made != piece).any(axis=1)
        place += made
        shapes[0][:, :3] += made
    return np.where(is_held, place.T, ways)


def _held_piece(
    shapes: tuple[np.ndarray, np.ndarray],
    pairs: tuple[np.ndarray, np.ndarray],
    piece: np.ndarray,
    share: np.ndarray,
    world: np.ndarray,
    scene: StaticSolids,
) -> np.ndarray:
    """Pieces of ways, (n, 3), that lead through nothing; see `held_ways`."""
    sizes, made, n_worlds = shapes[1], np.array(piece), int(world.max(initial=-1)) + 1
    parts: list[found.ContactList] = []
    for _ in range(MAX_SEARCHES):
        parts.append(found.find(shapes, pairs, (np.ascontiguousarray(made.T), 1.0, world), scene, n_worlds))
        row, other = (np.concatenate([getattr(part, name) for part in parts]) for name in ("row", "other"))
        smaller = np.where(other < 0, sizes[1, row], np.minimum(sizes[1, row], sizes[1, other]))
        numbers = np.concatenate([part.numbers for part in parts])
        if not shorten((row, other, numbers, KEPT_OVERLAP * smaller), share, PASSES, made) > 0.0:
            return made
    made[(made != piece).any(axis=1)] = 0.0
    return made
