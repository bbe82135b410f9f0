"""Eight doubles in one SIMD register, as a value type inside kernels.

A kernel that treats eight agents as lanes writes `dx = x - own_x` and `total += choose(inside, dx, 0.0)` for all
eight at once. Every operation is the plain IEEE one per lane, in the order written, so a lane's bits do not depend on its
neighbours or on the CPU: LLVM only picks the register width (one AVX-512 register, two AVX ones, four SSE ones).

Relying on the loop vectoriser instead was slower by a factor of three: it keeps accumulators in memory between candidates.

With the compiler off the same functions work on NumPy arrays of 8.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache, update_wrapper
from pathlib import Path
from typing import Any

import numpy as np

from tussle.neighbors.lane_count import LANES, RSQRT_MAGIC
from tussle.numeric.kernel import device


@cache
def generators() -> str:
    """Digest of the code generators: machine code made by others must not be taken from the cache."""
    return hashlib.blake2b(
        Path(__file__).with_name("lanes_codegen.py").read_bytes(), digest_size=16
    ).hexdigest()


class LaneFunction:
    """A function on lanes: NumPy when called from Python, a few instructions inside a kernel.

    The code generators, and Numba with them, are imported when a kernel is first compiled that names such a function.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self.py_func = function
        update_wrapper(self, function)

    @property
    def targetoptions(self) -> dict[str, str]:
        """What the machine code depends on besides the Python code: part of the key of every kernel that uses the function."""
        return {"generators": generators()}

    @property
    def _numba_type_(self) -> Any:
        from tussle.neighbors.lanes_codegen import type_of

        return type_of(self.py_func)

    def __call__(self, *args: Any) -> Any:
        return self.py_func(*args)


@LaneFunction
def splat(value: Any) -> Any:
    """Eight copies of one number."""
    return np.full(LANES, value)


@LaneFunction
def load(array: Any, start: int) -> Any:
    """Elements start ... start + 7 of a contiguous float64 array; no bounds check, so the array has LANES spare elements."""
    found = array[start : start + LANES]
    return np.concatenate([found, np.zeros(LANES - len(found))])


@LaneFunction
def store(array: Any, start: int, lanes: Any) -> None:
    """Write eight lanes to elements start ... start + 7 of a contiguous float64 array; no bounds check."""
    array[start : start + LANES] = lanes


@LaneFunction
def load_some(array: Any, start: int, count: int) -> Any:
    """As load, but lanes from `count` on are 0 and not read: for the end of an array."""
    return load(array[: start + count], start)


@LaneFunction
def store_some(array: Any, start: int, count: int, lanes: Any) -> None:
    """As store, but lanes from `count` on are not written."""
    array[start : start + count] = lanes[:count]


@LaneFunction
def choose(mask: Any, yes: Any, no: Any) -> Any:
    """Per lane `yes` where the mask holds, else `no`; what is not chosen may be NaN."""
    return np.where(mask, yes, no)


@LaneFunction
def truth(lanes: Any) -> Any:
    """Per lane whether the number is not 0; NaN is not."""
    return lanes != 0.0


@LaneFunction
def number(mask: Any) -> Any:
    """Per lane 1 where the mask holds, else 0."""
    return mask.astype(np.float64)


@LaneFunction
def joined(a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any) -> Any:
    """Lanes of eight numbers."""
    return np.array([a, b, c, d, e, f, g, h])


@LaneFunction
def bits(mask: Any) -> int:
    """The mask as an integer, lane 0 in the lowest bit."""
    return int(np.packbits(mask, bitorder="little")[0])


@LaneFunction
def lane_of(lanes: Any, lane: int) -> float:
    """One lane's number."""
    return float(lanes[lane])


@LaneFunction
def below(count: int) -> Any:
    """Mask of the first `count` lanes."""
    return np.arange(LANES) < count


@LaneFunction
def lowest(hits: int) -> int:
    """Number of the lowest bit that is set; `hits` is not 0. `hits &= hits - 1` then clears it."""
    return (hits & -hits).bit_length() - 1


@LaneFunction
def ones(hits: int) -> int:
    """How many bits are set."""
    return hits.bit_count()


@LaneFunction
def lanes_sqrt(lanes: Any) -> Any:
    """Correctly rounded square root per lane."""
    return np.sqrt(lanes)


@LaneFunction
def lanes_abs(lanes: Any) -> Any:
    """Absolute value per lane."""
    return np.abs(lanes)


@LaneFunction
def rsqrt_guess(lanes: Any) -> Any:
    """1 / sqrt within 3.5 percent by integer arithmetic on the exponent: exact to reproduce on every machine."""
    return (np.int64(RSQRT_MAGIC) - (lanes.view(np.int64) >> 1)).view(np.float64)


@device
def inverse_sqrt(square: Any) -> Any:
    """1 / sqrt(square) per lane within 3 ulp; finite at 0.

    Four Newton steps from an integer guess. Only multiplications and subtractions: a quarter of the time of a square root and
    a division, and unlike the CPU's own estimate instruction the same bits everywhere.
    """
    half = 0.5 * square
    root = rsqrt_guess(square)
    root = root * (1.5 - half * root * root)
    root = root * (1.5 - half * root * root)
    root = root * (1.5 - half * root * root)
    return root * (1.5 - half * root * root)
