"""Counter-based random numbers: a draw depends only on its key and counter, so no other draw can change it.

Threefry2x64-20 (Salmon, Moraes, Dror, Shaw 2011, "Parallel Random Numbers: As Easy as 1, 2, 3", section 4.2). The key
is the world's seed and the stream (a hash of block, plugin instance and label), the counter is the index within the
block, the step, the substep and the draw. Adding a plugin, a block, more entities or more worlds changes no other
draw. Uses integer arithmetic and `tussle.numeric` only: portable.

In jitted code all six numbers that identify a draw are uint64; from Python use `uniform` and `normal`.
"""

from __future__ import annotations

import hashlib
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tussle.numeric import log, sincos
from tussle.numeric.kernel import device, kernel

Floats = NDArray[np.float64]

PARITY = np.uint64(0x1BD11BDAA9FC1A22)
TAU = 6.283185307179586
TWO_TO_MINUS_53 = 2.0**-53
MAX_INDEX = 2**32  # index and step share a word of the counter
MAX_SUBSTEP = 2**16


def stream_key(*names: str) -> int:
    """64-bit key of the stream with these names (block, plugin instance, label), the same in every process and version."""
    texts = [name.encode() for name in names]
    # Lengths distinguish ("ab", "c") and ("a", "bc").
    data = b"".join([len(text).to_bytes(8, "little") + text for text in texts])
    return int.from_bytes(hashlib.blake2b(data, digest_size=8).digest(), "little")


@device
def mix(a, b, rotation):
    """One round: add, rotate left, exclusive or; all uint64."""
    a = a + b
    b = (b << rotation) | (b >> (np.uint64(64) - rotation))
    return a, a ^ b


@device
def four_rounds_even(a, b):
    """Rounds 1 to 4 of every eight."""
    a, b = mix(a, b, np.uint64(16))
    a, b = mix(a, b, np.uint64(42))
    a, b = mix(a, b, np.uint64(12))
    return mix(a, b, np.uint64(31))


@device
def four_rounds_odd(a, b):
    """Rounds 5 to 8 of every eight."""
    a, b = mix(a, b, np.uint64(16))
    a, b = mix(a, b, np.uint64(32))
    a, b = mix(a, b, np.uint64(24))
    return mix(a, b, np.uint64(21))


@device
def threefry(key0, key1, counter0, counter1):
    """The two words of Threefry2x64 with 20 rounds; all uint64."""
    key2 = PARITY ^ key0 ^ key1
    a = counter0 + key0
    b = counter1 + key1
    a, b = four_rounds_even(a, b)
    a, b = a + key1, b + key2 + np.uint64(1)
    a, b = four_rounds_odd(a, b)
    a, b = a + key2, b + key0 + np.uint64(2)
    a, b = four_rounds_even(a, b)
    a, b = a + key0, b + key1 + np.uint64(3)
    a, b = four_rounds_odd(a, b)
    a, b = a + key1, b + key2 + np.uint64(4)
    a, b = four_rounds_even(a, b)
    return a + key2, b + key0 + np.uint64(5)


@device
def random_bits(seed, stream, index, step, substep, draw):
    """Two random words; index and step below 2**32, substep below 2**16, draw below 2**48; all uint64."""
    high = (np.uint64(index) << np.uint64(32)) | np.uint64(step)
    low = (np.uint64(substep) << np.uint64(48)) | np.uint64(draw)
    return threefry(np.uint64(seed), np.uint64(stream), high, low)


@device
def to_uniform(bits):
    """The upper 53 bits as a number in [0, 1)."""
    return np.float64(np.int64(bits >> np.uint64(11))) * TWO_TO_MINUS_53


@device
def uniform2(seed, stream, index, step, substep, draw):
    """Two independent numbers in [0, 1), with 53 bits each."""
    a, b = random_bits(seed, stream, index, step, substep, draw)
    return to_uniform(a), to_uniform(b)


@device
def uniform01(seed, stream, index, step, substep, draw):
    """A number in [0, 1) with 53 bits: the first of `uniform2`."""
    return uniform2(seed, stream, index, step, substep, draw)[0]


@device
def normal2(seed, stream, index, step, substep, draw):
    """Two independent standard normal numbers (Box and Muller 1958)."""
    a, b = uniform2(seed, stream, index, step, substep, draw)
    radius = math.sqrt(-2.0 * log(1.0 - a))  # 1 - a lies in (0, 1]
    s, c = sincos(TAU * b)
    return radius * c, radius * s


@kernel("U u8 I I i8 i8 F2w")
def fill_uniform(seeds, stream, index, step, substep, k, out):
    """Fill out (k, n) with numbers in [0, 1); seeds, index and step are per column. Rows 2 j and 2 j + 1 are draw j."""
    n = out.shape[1]
    for j in range(k // 2):
        first = out[2 * j]
        second = out[2 * j + 1]
        for i in range(n):
            first[i], second[i] = uniform2(seeds[i], stream, index[i], step[i], substep, j)
    if k % 2 == 1:
        last = out[k - 1]
        for i in range(n):
            last[i] = uniform2(seeds[i], stream, index[i], step[i], substep, k // 2)[0]


@kernel("U u8 I I i8 i8 F2w")
def fill_normal(seeds, stream, index, step, substep, k, out):
    """Fill out (k, n) with standard normal numbers; seeds, index and step are per column. Rows 2 j and 2 j + 1 are draw j."""
    n = out.shape[1]
    for j in range(k // 2):
        first = out[2 * j]
        second = out[2 * j + 1]
        for i in range(n):
            first[i], second[i] = normal2(seeds[i], stream, index[i], step[i], substep, j)
    if k % 2 == 1:
        last = out[k - 1]
        for i in range(n):
            last[i] = normal2(seeds[i], stream, index[i], step[i], substep, k // 2)[0]


def uniform(
    seeds: ArrayLike, stream: int, index: ArrayLike, step: ArrayLike, substep: int = 0, k: int = 1
) -> Floats:
    """Random numbers in [0, 1), (k, n). A row does not depend on k, and a column does not depend on the other columns.

    Args:
        seeds: Seeds of the worlds, per column or one for all.
        stream: From `stream_key`.
        index: Index of the entity within its block, below 2**32, per column or one for all.
        step: Number of the step, below 2**32, per column or one for all.
        substep: Number of the substep in the step, below 2**16.
        k: How many numbers per column.

    Raises:
        ValueError: Index, step or substep is out of range, or k is negative.
    """
    words, indices, steps = columns(seeds, index, step, substep, k)
    out = np.empty((k, words.size))
    fill_uniform(words, np.uint64(stream), indices, steps, substep, k, out)
    return out


def normal(
    seeds: ArrayLike, stream: int, index: ArrayLike, step: ArrayLike, substep: int = 0, k: int = 1
) -> Floats:
    """Standard normal random numbers, (k, n); arguments and errors as `uniform`."""
    words, indices, steps = columns(seeds, index, step, substep, k)
    out = np.empty((k, words.size))
    fill_normal(words, np.uint64(stream), indices, steps, substep, k, out)
    return out


def columns(
    seeds: ArrayLike, index: ArrayLike, step: ArrayLike, substep: int, k: int
) -> tuple[NDArray[np.uint64], NDArray[np.int64], NDArray[np.int64]]:
    """Seeds, index and step as arrays of one length. Values out of range are refused: they would repeat another entity's draw."""
    words = np.asarray(seeds, dtype=np.uint64)
    indices, steps = np.asarray(index, dtype=np.int64), np.asarray(step, dtype=np.int64)
    for name, values in (("index", indices), ("step", steps)):
        if values.view(np.uint64).max(initial=0) >= MAX_INDEX:  # negative numbers are large ones
            raise ValueError(
                f"random numbers: {name} must be in 0 ... {MAX_INDEX - 1}, not {values.min()} ... {values.max()}"
            )
    if not 0 <= substep < MAX_SUBSTEP:
        raise ValueError(f"random numbers: substep must be in 0 ... {MAX_SUBSTEP - 1}, not {substep}")
    if k < 0:
        raise ValueError(f"random numbers: k must not be negative, but is {k}")
    if (
        not words.shape == indices.shape == steps.shape or not words.ndim
    ):  # np.broadcast_to takes longer than a draw
        shape = np.broadcast_shapes((1,), words.shape, indices.shape, steps.shape)
        words, indices, steps = (
            np.broadcast_to(words, shape),
            np.broadcast_to(indices, shape),
            np.broadcast_to(steps, shape),
        )
    return np.ascontiguousarray(words), np.ascontiguousarray(indices), np.ascontiguousarray(steps)
