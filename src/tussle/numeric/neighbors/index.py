"""Spatial index: the positions of one instant, sorted into cells, separately for each world."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tussle.numeric.neighbors import kernels
from tussle.numeric.neighbors.lane_count import LANES

Floats = NDArray[np.float64]
Longs = NDArray[np.int64]
Split = Callable[[int, Callable[[int, int], Any]], Any]

RINGS = 2
"""Cells per reach of a world; 2 is the fastest of 1 to 3 for 2000 entities."""

SIZES = np.array([0.5, 0.5946035575013605, 0.7071067811865476, 0.8408964152537145, 1.0, np.inf])
"""Four sizes per octave, powers of 2^(1/4): an index for the next one has at most 1.4 times the candidates in a plane."""

SPARSE_WORLD = 400
"""Below this number of entities, one cell per reach is faster (1.0 instead of 1.3 us per entity with 110, equal with 500)."""


@dataclass(slots=True)
class Blocks:
    """Groups of up to LANES nearby query rows, each with the spans of places that contain its neighbours.

    Block b holds queries[block_first[b] : block_first[b + 1]]; its candidates are the places span_start[s] to span_end[s] - 1 for s
    from span_first[b] to span_last[b] - 1. The blocks of a world do not depend on the stack.

    Attributes:
        cuts: queries, block_first, block_strip, span_first, span_last, (5, n + 1); queries are the n places of the query rows.
        spans: span_start and span_end, (2, number of spans or more).
        points: Positions of the queries [m], (3, n + LANES); the padding may be read.
        n_blocks: Number of blocks.
        most: Largest number of candidates of a block.
        built: Number of the index build that the blocks belong to.
    """

    cuts: Longs
    spans: Longs
    points: Floats
    n_blocks: int = 0
    most: int = 0
    built: int = -1

    @classmethod
    def of(cls, n: int) -> Blocks:
        """Allocate blocks for n rows; `spans` may need to grow later."""
        return cls(
            np.empty((5, n + 1), np.int64), np.empty((2, 2 * n + 64), np.int64), np.zeros((3, n + LANES))
        )


def next_size(reach: float | Floats) -> Any:
    """Return the next one of a few sizes that is not smaller than a reach, for reaches that change from call to call."""
    mantissa, exponent = np.frexp(np.maximum(reach, 0.0))
    return np.ldexp(SIZES[np.minimum(np.searchsorted(SIZES, mantissa), len(SIZES) - 1)], exponent)


def padded(n: int) -> Floats:
    """Return n zeros that are padded, so that they can be read in groups of LANES."""
    return np.zeros(n + LANES)[:n]


class Index:
    """Spatial index of all rows of all worlds at one instant; results in a world do not depend on other worlds.

    After `layout` and `build`: `order` (N,) row of each place; `place` (N,) its inverse; `points` (3, N + LANES) positions by
    place [m]. `built` counts the builds. `inverse_cell` (n_worlds,) [1/m] is 0 where a world is one cell. World w holds places
    world_start[w] to world_start[w + 1] - 1, and members[world_start[w] + k] is its k-th row by id. `columns` are the arrays in the
    order of the places that the owner of the table keeps; they belong to the index, so that whoever holds it has its own.
    """

    def __init__(self) -> None:
        self._keys = np.zeros(0, np.int64)
        self._ids = np.zeros(0, np.int64)
        self.world_start: Longs = np.zeros(1, np.int64)
        self.row_world = self.row_id = np.zeros(1, np.int64)
        self.built = 0
        self.columns: dict[str, Any] = {}
        self._blocks: dict[tuple[int, int], Blocks] = {}
        self.layout(np.zeros(0, np.int64), np.zeros(0, np.int64), 0)

    def layout(self, world: Longs, ids: Longs, n_worlds: int) -> None:
        """Set the rows: `world` (N,) and `ids` (N,), unique within a world. Call `build` afterwards."""
        n = len(world)
        same_worlds = n_worlds == len(self.world_start) - 1
        if same_worlds and np.array_equal(world, self.row_world) and np.array_equal(ids, self.row_id):
            return
        old_start = self.world_start if same_worlds else np.zeros(n_worlds + 1, np.int64)
        self.world_start = np.zeros(n_worlds + 1, np.int64)
        self.members = np.zeros(n, np.int64)
        fresh, new_ids, self._scratch = (np.zeros(n, np.int64) for _ in range(3))
        sequence = np.zeros(max(n, len(self._keys), n_worlds), np.int64)
        rows = np.ascontiguousarray(world, np.int64), np.ascontiguousarray(ids, np.int64)
        kernels.arrange(
            rows, (old_start, self._ids, self._keys), (self.world_start, self.members, new_ids, fresh),
            (self._scratch, sequence), n_worlds,
        )  # fmt: skip
        self._keys, self._ids = fresh, new_ids
        self.row_world, self.row_id = np.array(world, np.int64), np.array(ids, np.int64)
        self._placed = np.zeros((2, n), np.int64)
        self.order, self.place = self._placed
        self.points = np.zeros((3, n + LANES))
        self._strips = np.zeros((2, n + 1), np.int64)
        self._world_strip = np.zeros(n_worlds + 1, np.int64)
        self.inverse_cell = np.zeros(n_worlds)
        self.reach = np.zeros(n_worlds)
        self._rings = np.where(self.world_start[1:] - self.world_start[:-1] < SPARSE_WORLD, 1.0, RINGS)
        self._fixed = False
        self._given: Floats | None = None
        self.built = 0
        self.columns.clear()
        self._blocks.clear()

    @property
    def n_worlds(self) -> int:
        return len(self.reach)

    @property
    def table(self) -> tuple[Longs, Longs, Longs, Longs, Floats, Floats]:
        """Arrays for the kernels of `search`: world_start, keys, strips, world_strip, inverse_cell, points."""
        return self.world_start, self._keys, self._strips, self._world_strip, self.inverse_cell, self.points

    def build(self, x: Floats, y: Floats, z: Floats, reach: Floats, split: Split | None = None) -> None:
        """Sort positions x, y, z (N,) [m] into cells; blocks find all neighbours up to `reach` (n_worlds,) [m].

        `split` calls a function for parts of the places in several threads. With an infinite reach, a world has one cell, in order
        of id; if all reaches are infinite, the order depends only on the layout.
        """
        if reach is not self._given and (not np.array_equal(reach, self.reach) or not self.built):
            self._given, self.reach = reach, np.array(reach, np.float64)
            self.inverse_cell = self._rings / np.where(self.reach > 0.0, self.reach, 1.0)
            self._blocks.clear()
            self._fixed = bool(np.isinf(self.reach).all())
        self.built += 1
        if split is None:
            kernels.build(*self.building(x, y, z))
        else:  # rows lie anywhere in memory: what takes time is to fetch them
            *arrays, (_, _, n) = self.building(x, y, z)
            split(n, lambda *part: kernels.build(*arrays, (kernels.KEYS + kernels.PART, *part)))
            kernels.build(*arrays, (kernels.SORT, 0, n))
            split(n, lambda *part: kernels.build(*arrays, (kernels.PLACES, *part)))

    def building(self, x: Floats, y: Floats, z: Floats) -> tuple[Any, ...]:
        """Arguments of `kernels.build` for the positions of all places."""
        worlds, work = (self.world_start, self.members), (self._keys, self._scratch)
        strips, part = (
            (self._strips, self._world_strip),
            (kernels.KEYS + kernels.SORT + kernels.PLACES, 0, len(self.order)),
        )
        return (x, y, z), self.inverse_cell, worlds, work, self._placed, self.points, strips, part

    def update(self, first: int, last: int, x: Floats, y: Floats, z: Floats) -> None:
        """Update the positions x, y, z (N,) [m] of rows [first, last). Only if all reaches are infinite."""
        kernels.update(first, last, x, y, z, self.place, self.points)

    def gather(self, column: Floats) -> Floats:
        """Return a float column of the table by place, (N,), padded by LANES elements."""
        out = padded(len(column))
        kernels.gather(column, self.order, out)
        return out

    def blocks(self, first: int, last: int, split: Split | None = None) -> Blocks:
        """Return the blocks of rows [first, last) of the table, valid until the next build; one object per range.

        `split` calls a function for parts of the blocks in several threads.
        """
        blocks = self._blocks.get((first, last))
        if blocks is None:
            blocks = self._blocks[first, last] = Blocks.of(last - first)
        elif self._fixed:
            kernels.query_positions(blocks.cuts[0], self.points, blocks.points, (0, last - first))
            return blocks
        elif blocks.built == self.built:
            return blocks
        while not self._cut(blocks, (first, last), split):
            blocks.spans = np.empty((2, 2 * blocks.spans.shape[1]), np.int64)
        blocks.built = self.built
        return blocks

    @property
    def is_fixed(self) -> bool:
        """Whether all reaches are infinite: places and blocks depend only on the rows."""
        return self._fixed

    def cutting(self, rows: tuple[int, int], blocks: Blocks) -> tuple[Any, ...]:
        """Arguments of `kernels.cut_blocks` for rows [first, last), without the part to do."""
        index = self.order, self._strips, self._world_strip, self.world_start, self._keys
        cells, arrays = (self.inverse_cell, self.reach), (blocks.cuts, blocks.spans)
        return index, rows, self.points, cells, arrays, blocks.points

    def _cut(self, blocks: Blocks, rows: tuple[int, int], split: Split | None) -> bool:
        """Cut blocks and find their spans. Return whether the spans fit."""
        room, arrays = blocks.spans.shape[1], self.cutting(rows, blocks)
        if split is None:
            part = kernels.GROUP + kernels.SPANS, 0, -1, 0, room
            blocks.n_blocks, used, blocks.most = kernels.cut_blocks(*arrays, part)
            return bool(used <= room)
        n, _, _ = kernels.cut_blocks(*arrays, (kernels.GROUP, 0, 0, 0, 0))
        made: list[tuple[bool, int]] = []

        def find(begin: int, end: int) -> None:
            part = kernels.SPANS, begin, end, room * begin // max(n, 1), room * end // max(n, 1)
            _, used, most = kernels.cut_blocks(*arrays, part)
            made.append((used <= part[-1], most))

        split(n, find)
        blocks.n_blocks, blocks.most = n, max((most for _, most in made), default=0)
        return all(fits for fits, _ in made)
