"""A vector of eight doubles as a value type in kernels, and a mask of eight booleans.

A kernel that treats eight agents as lanes writes `dx = x - own_x` and `total += choose(inside, dx, 0.0)` for all eight at once.
Every operation is the IEEE operation per lane, in the order written, so the bits of a lane do not depend on the other lanes or on
the CPU. LLVM only selects the register width (one AVX-512 register, two AVX registers, four SSE registers).

Rejected: the loop vectoriser. It was three times slower because it keeps accumulators in memory between candidates.

Outside compiled code the same functions work on NumPy arrays of length 8.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache, update_wrapper
from pathlib import Path
from typing import Any

import numpy as np

from tussle.numeric.kernel import device
from tussle.numeric.neighbors.lane_count import LANES, RSQRT_MAGIC


@cache
def generators() -> str:
    """Digest of the code generators; part of cache keys, so that machine code of another version is not loaded."""
    return hashlib.blake2b(
        Path(__file__).with_name("lanes_codegen.py").read_bytes(), digest_size=16
    ).hexdigest()


class LaneFunction:
    """A function on lanes: NumPy code when called from Python, a few instructions in a kernel.

    Numba and the code generators are imported when the first kernel that uses such a function is compiled.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self.py_func = function
        update_wrapper(self, function)

    @property
    def targetoptions(self) -> dict[str, str]:
        """Return the target's options; they are part of the cache key of every kernel that uses the function."""
        return {"generators": generators()}

    @property
    def _numba_type_(self) -> Any:
        from tussle.numeric.neighbors.lanes_codegen import type_of

        return type_of(self.py_func)

    def __call__(self, *args: Any) -> Any:
        return self.py_func(*args)


@LaneFunction
def splat(value: Any) -> Any:
    """Eight copies of one number."""
    return np.full(LANES, value)


@LaneFunction
def load(array: Any, start: int) -> Any:
    """Load elements start to start + 7 of a contiguous float64 array, or of an int64 array for `unlike`.

    No bounds check: allocate LANES spare elements.
    """
    found = array[start : start + LANES]
    return np.concatenate([found, np.zeros(LANES - len(found))])


@LaneFunction
def store(array: Any, start: int, lanes: Any) -> None:
    """Store eight lanes to elements start to start + 7 of a contiguous float64 array. No bounds check."""
    array[start : start + LANES] = lanes


@LaneFunction
def load_some(array: Any, start: int, count: int) -> Any:
    """Like `load` for the end of an array: lanes from `count` on are not read and are 0."""
    return load(array[: start + count], start)


@LaneFunction
def store_some(array: Any, start: int, count: int, lanes: Any) -> None:
    """Like `store`, but lanes from `count` on are not written."""
    array[start : start + count] = lanes[:count]


@LaneFunction
def choose(mask: Any, yes: Any, no: Any) -> Any:
    """Select per lane `yes` where the mask is true, else `no`; a NaN in the other operand does not propagate."""
    return np.where(mask, yes, no)


@LaneFunction
def truth(lanes: Any) -> Any:
    """Mask of the lanes that are not 0; NaN counts as true."""
    return lanes != 0.0


@LaneFunction
def number(mask: Any) -> Any:
    """Convert a mask to numbers: 1 where true, else 0."""
    return mask.astype(np.float64)


@LaneFunction
def joined(a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any) -> Any:
    """Make lanes of eight numbers."""
    return np.array([a, b, c, d, e, f, g, h])


@LaneFunction
def bits(mask: Any) -> int:
    """Convert a mask to an integer, lane 0 in the lowest bit."""
    return int(np.packbits(mask, bitorder="little")[0])


@LaneFunction
def lane_of(lanes: Any, lane: int) -> float:
    """Number in one lane."""
    return float(lanes[lane])


@LaneFunction
def below(count: int) -> Any:
    """Mask of the first `count` lanes."""
    return np.arange(LANES) < count


@LaneFunction
def lowest(hits: int) -> int:
    """Index of the lowest set bit of `hits`, which must not be 0. `hits &= hits - 1` clears that bit."""
    return (hits & -hits).bit_length() - 1


@LaneFunction
def ones(hits: int) -> int:
    """Number of set bits."""
    return hits.bit_count()


@LaneFunction
def unlike(lanes: Any, whole: int) -> Any:
    """Mask of the lanes, loaded from an int64 array, that are not equal to a whole number."""
    return lanes != whole


@LaneFunction
def pack(array: Any, n: int, start: int, hits: int) -> int:
    """Write start + k for each set bit k of `hits` to an int64 array from element n on. Returns the next n.

    No bounds check, and up to LANES elements are written to: allocate as many spare ones.
    """
    for k in range(LANES):
        array[n] = start + k
        n += (hits >> k) & 1
    return n


@LaneFunction
def lanes_sqrt(lanes: Any) -> Any:
    """Correctly rounded square root per lane."""
    return np.sqrt(lanes)


@LaneFunction
def lanes_abs(lanes: Any) -> Any:
    """Absolute value per lane."""
    return np.abs(lanes)


@LaneFunction
def tagged(lanes: Any, tag: int, n_bits: int) -> Any:
    """Replace the lowest n_bits bits of each number by `tag`; of numbers >= 0, the order stays but for these bits."""
    integers = lanes.view(np.int64)
    return ((integers >> n_bits << n_bits) | tag).view(np.float64)


@LaneFunction
def rsqrt_guess(lanes: Any) -> Any:
    """Approximate 1 / sqrt within 3.5 percent by integer arithmetic on the bits, with the same result on every machine."""
    return (np.int64(RSQRT_MAGIC) - (lanes.view(np.int64) >> 1)).view(np.float64)


@device
def inverse_sqrt(square: Any) -> Any:
    """1 / sqrt(square) per lane within 3 ulp; finite at 0.

    Four Newton steps from `rsqrt_guess`. It takes a quarter of the time of a square root and a division, and unlike the CPU's
    estimate instruction gives the same bits on every machine.
    """
    half = 0.5 * square
    root = rsqrt_guess(square)
    root = root * (1.5 - half * root * root)
    root = root * (1.5 - half * root * root)
    root = root * (1.5 - half * root * root)
    return root * (1.5 - half * root * root)
