"""Tables of several worlds for tests: rows ordered (group, world, id), as the engine keeps them."""

from dataclasses import dataclass

import numpy as np

from tussle.numeric.neighbors import Index


@dataclass
class Stack:
    world: np.ndarray
    ids: np.ndarray
    group: np.ndarray
    source: np.ndarray
    """Which entity of which world each row is: the position in the list that the world was made from."""
    pos: np.ndarray
    n_worlds: int

    def index(self, reach, built=True):
        index = Index()
        index.layout(self.world, self.ids, self.n_worlds)
        if built:
            index.build(*self.pos, np.full(self.n_worlds, float(reach)))
        return index

    def near(self, row, radius):
        """Rows nearer than `radius` to a row, by brute force, and all squared distances."""
        with np.errstate(all="ignore"):
            square = (self.pos - self.pos[:, row : row + 1]) ** 2
            square = square[0] + square[1] + square[2]
            hit = (square < radius * radius) & (self.world == self.world[row])
        hit[row] = False
        return np.flatnonzero(hit), square


def stack(worlds, groups=1, reverse_groups=False):
    """Stack of worlds, each a (3, n) array; entity k has id 3 k + 1 and belongs to group k % groups."""
    rows = []
    for w, pos in enumerate(worlds):
        for k in range(pos.shape[1]):
            group = k % groups
            rows.append((groups - 1 - group if reverse_groups else group, w, 3 * k + 1, k))
    rows.sort()
    table = np.array(rows, np.int64).reshape(-1, 4)
    pos = np.array([worlds[w][:, k] for _, w, _, k in rows]).reshape(-1, 3).T
    return Stack(
        table[:, 1].copy(),
        table[:, 2].copy(),
        table[:, 0].copy(),
        table[:, 3].copy(),
        np.ascontiguousarray(pos),
        len(worlds),
    )


def block_candidates(blocks):
    """Per query place, the candidate places of its block."""
    queries, block_first, _, span_first, span_last = blocks.cuts
    for b in range(blocks.n_blocks):
        runs = [np.arange(*blocks.spans[:, s]) for s in range(span_first[b], span_last[b])]
        candidates = np.concatenate(runs) if runs else np.zeros(0, np.int64)
        for q in range(block_first[b], block_first[b + 1]):
            yield queries[q], candidates
