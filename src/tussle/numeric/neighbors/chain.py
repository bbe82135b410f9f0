"""The way from positions to the contributions of neighbours in one call: index, blocks, columns by place, pair loop."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from tussle.numeric.address import caller
from tussle.numeric.bound import DATA, RESULTS, Bound
from tussle.numeric.kernel import Kernel, kernel
from tussle.numeric.neighbors import kernels
from tussle.numeric.neighbors.index import Blocks, Floats, Index


@cache
def kernel_of_chains() -> Kernel:
    """The kernel (entries, words, cut, walk, places, out) that calls bound kernels, of which the last is a pair loop.

    entries, words: addresses of the bound kernels. cut: words of `cut_blocks`. walk: words of the pair loop. places: places in `walk` of
    the end of the blocks, which the largest number of candidates follows, and of the address of `out`; and the room for spans. If the
    spans need more, the pair loop is not called. Returns whether it was.
    """
    call_bound = caller("i8")

    def run(entries, words, cut, walk, places, out):  # type: ignore[no-untyped-def]
        last = entries.shape[0] - 1
        for k in range(last):
            call_bound(entries[k], words[k])
        if cut[RESULTS + 1] > places[2]:
            return False
        walk[places[0]] = cut[RESULTS]
        walk[places[0] + 1] = cut[RESULTS + 2]
        walk[places[1]] = out.ctypes.data
        call_bound(entries[last], words[last])
        return True

    return kernel("I I Iw Iw (i8 i8 i8) F2w -> b1")(run)


class Chain:
    """Bound kernels of a pair loop and of what it needs, for rows that stay the same.

    Args:
        index: The index.
        pos: Positions of all rows, x, y, z (N,) [m]; their memory is read at each call.
        blocks: Blocks of the rows that ask, with their spans.
        rows: First and last row that asks.
        columns: Kernels that put columns by place, with their arguments.
        walk: Kernel of the pair loop.
        arrays: Its arguments before the results.
        n_out: Number of contributions.
    """

    def __init__(
        self,
        index: Index,
        pos: tuple[Floats, ...],
        blocks: Blocks,
        rows: tuple[int, int],
        columns: Sequence[tuple[Any, ...]],
        walk: Kernel,
        arrays: tuple[Any, ...],
        n_out: int,
    ) -> None:
        self.blocks, self.spans, self._index = blocks, blocks.spans, index
        out = np.empty((n_out, rows[1] - rows[0]))
        room = blocks.spans.shape[1]
        cut = Bound(
            kernels.cut_blocks, *index.cutting(rows, blocks), (kernels.GROUP + kernels.SPANS, 0, -1, 0, room)
        )
        last = Bound(walk, *arrays, out, rows[0], (0, 0), 0)
        puts = [Bound(*call) for call in columns]
        self._bound = [Bound(kernels.build, *index.building(*pos)), cut, *puts, last]
        entries = np.array([each.entry for each in self._bound])
        words = np.array([each.words.ctypes.data for each in self._bound])
        *_, results, _, part, most = last.at
        assert most == part[1] + 1
        self._run = kernel_of_chains()
        _ = self._run.compiled  # now, and not in a step that is recorded
        self._call = entries, words, cut.words, last.words, (part[1], results + DATA, room)
        self._cut, self._shape = cut.words, out.shape

    def run(self) -> Floats | None:
        """Return the contributions, (k, n); None if the blocks need more room, the index is built and the columns are put then too."""
        out = np.empty(self._shape)
        fits = self._run(*self._call, out)
        self._index.built += 1
        if not fits:
            return None
        blocks = self.blocks
        blocks.n_blocks, blocks.most, blocks.built = (
            int(self._cut[RESULTS]),
            int(self._cut[RESULTS + 2]),
            self._index.built,
        )
        return out


@cache
def kernel_of_turns() -> Kernel:
    """The kernel (entries, addresses, firsts, rows, words, place, out) that calls bound kernels of rows that have moved, and a pair loop.

    entries, addresses: of the bound kernels and of their words. firsts: where in `words` the rows of each kernel but the last are, which
    are set to `rows`, first and last. words: all words. place: where in `words` the address of `out` is.
    """
    call_bound = caller("i8")

    def run(entries, addresses, firsts, rows, words, place, out):  # type: ignore[no-untyped-def]
        last = firsts.shape[0]
        for k in range(last):
            words[firsts[k]], words[firsts[k] + 1] = rows
            call_bound(entries[k], addresses[k])
        words[place] = out.ctypes.data
        call_bound(entries[last], addresses[last])

    return kernel("I I I (i8 i8) Iw i8 F2w")(run)


class TurnChain:
    """Bound kernels of a pair loop where entities move one after another: only the rows that have moved are put by place.

    Args:
        moved: Kernels to be called with a range of rows, and their arguments, of which one or two are the range: place of the first one,
            kernel, arguments.
        walk: Kernel of the pair loop.
        arrays: Its arguments before the results.
        rows: First and last row that asks.
        blocks: Their blocks.
        n_out: Number of contributions.
    """

    def __init__(
        self,
        moved: Sequence[tuple[Any, ...]],
        walk: Kernel,
        arrays: tuple[Any, ...],
        rows: tuple[int, int],
        blocks: Blocks,
        n_out: int,
    ) -> None:
        self.points = arrays[1][2]
        out = np.empty((n_out, rows[1] - rows[0]))
        bound = [Bound(*call) for _, *call in moved]
        last = Bound(walk, *arrays, out, rows[0], (0, blocks.n_blocks), blocks.most)
        self._bound, self._shape = [*bound, last], out.shape
        starts = np.cumsum([0, *(len(each.words) for each in self._bound)])
        words = np.concatenate([each.words for each in self._bound])
        firsts = np.array(
            [start + each.at[place] for start, each, (place, *_) in zip(starts, bound, moved, strict=False)]
        )
        entries = np.array([each.entry for each in self._bound])
        self._call = entries, words.ctypes.data + 8 * starts[:-1], firsts
        self._rest = words, int(starts[-2]) + last.at[4] + DATA
        self._run = kernel_of_turns()

    def run(self, rows: tuple[int, int]) -> Floats:
        """Return the contributions, (k, n), after the rows [first, last) have moved."""
        out = np.empty(self._shape)
        self._run(*self._call, rows, *self._rest, out)
        return out
