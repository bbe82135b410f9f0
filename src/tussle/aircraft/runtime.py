"""Functions that generated code calls: tables, kinematics, atmosphere."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from tussle.numeric import atan2, exp, log
from tussle.numeric.kernel import Device, device
from tussle.numeric.rng import normal2, uniform2


class Outlined(Device):
    """A device function that LLVM may leave out of line: where there are a hundred calls of it, inlining costs seconds of compiling."""

    options: ClassVar[dict[str, Any]] = {"error_model": "numpy"}


def outlined(function: Any) -> Any:
    """Decorator for `Outlined`."""
    return Outlined(function)


@outlined
def table_1(tables, at, n, key):
    """Linear interpolation in one dimension, held at the ends: n keys from `at`, then n values."""
    if not key > tables[at]:
        return tables[at + n]
    if key >= tables[at + n - 1]:
        return tables[at + 2 * n - 1]
    r = 1
    while tables[at + r] < key:
        r += 1
    low = tables[at + r - 1]
    share = (key - low) / (tables[at + r] - low)
    first = tables[at + n + r - 1]
    return share * (tables[at + n + r] - first) + first


@outlined
def table_2(tables, at, rows, columns, row, column):
    """Bilinear interpolation, held at the ends: row keys, column keys, then values by rows."""
    values = at + rows + columns
    if columns == 1:
        return table_1_of(tables, at, values, rows, row)
    c, r = 1, 1
    while c < columns - 1 and tables[at + rows + c] < column:
        c += 1
    left = tables[at + rows + c - 1]
    across = min(max((column - left) / (tables[at + rows + c] - left), 0.0), 1.0)
    if rows == 1:
        return across * (tables[values + c] - tables[values + c - 1]) + tables[values + c - 1]
    while r < rows - 1 and tables[at + r] < row:
        r += 1
    low = tables[at + r - 1]
    up = min(max((row - low) / (tables[at + r] - low), 0.0), 1.0)
    below, above = values + (r - 1) * columns + c, values + r * columns + c
    a = up * tables[above - 1] + (1.0 - up) * tables[below - 1]
    b = up * tables[above] + (1.0 - up) * tables[below]
    return across * (b - a) + a


@device
def table_1_of(tables, keys, values, n, key):
    """`table_1` with keys and values in separate places."""
    if not key > tables[keys]:
        return tables[values]
    if key >= tables[keys + n - 1]:
        return tables[values + n - 1]
    r = 1
    while tables[keys + r] < key:
        r += 1
    low = tables[keys + r - 1]
    return (key - low) / (tables[keys + r] - low) * (tables[values + r] - tables[values + r - 1]) + tables[
        values + r - 1
    ]


@device
def between(tables, at, n, key):
    """Number, from 1, of the table before a key, and the share of the next one; n keys begin at `at`."""
    k = 1
    if not key > tables[at]:
        share = 0.0
    elif key >= tables[at + n - 1]:
        k, share = n, 0.0
    else:
        while tables[at + k] < key:
            k += 1
        share = (key - tables[at + k - 1]) / (tables[at + k] - tables[at + k - 1])
    return k, share


@outlined
def table_3(tables, at, n, row, column, key):
    """Linear between n 2-D tables: from `at` n keys, then place, rows and columns of each table."""
    k, share = between(tables, at, n, key)
    here = at + n + 3 * (k - 1)
    first = table_2(tables, int(tables[here]), int(tables[here + 1]), int(tables[here + 2]), row, column)
    if share == 0.0:
        return first
    second = table_2(tables, int(tables[here + 3]), int(tables[here + 4]), int(tables[here + 5]), row, column)
    return first + share * (second - first)


@outlined
def table_4(tables, at, n, row, column, key, last):
    """Linear between n 3-D tables: from `at` n keys, then place and number of keys of each table."""
    k, share = between(tables, at, n, last)
    here = at + n + 2 * (k - 1)
    first = table_3(tables, int(tables[here]), int(tables[here + 1]), row, column, key)
    if share == 0.0:
        return first
    second = table_3(tables, int(tables[here + 2]), int(tables[here + 3]), row, column, key)
    return first + share * (second - first)


@device
def quotient(a, b):
    """Quotient a / b, infinite where b is 0."""
    return a / b if b != 0.0 else math.inf


@outlined
def power(x, y):
    """Power x ** y by the portable exponential and logarithm; of a negative x for whole y only."""
    if y == 0.0 or x == 1.0:
        return 1.0
    if x == 0.0:
        return 0.0 if y > 0.0 else math.inf
    if x > 0.0:
        return exp(y * log(x))
    if y != math.floor(y):
        return math.nan
    size = exp(y * log(-x))
    return size if y == 2.0 * math.floor(0.5 * y) else -size


@device
def sign(x):
    """-1 below 0, else 1."""
    return -1.0 if x < 0.0 else 1.0


@device
def remainder(x, y):
    """Remainder of the truncated division, with the sign of x."""
    return x - y * float(math.trunc(x / y)) if y != 0.0 else math.nan


@device
def seek(value, target, up, down, dt):
    """Move a value to a target, at most `up` or `down` per second."""
    if value > target:
        return max(value - dt * down, target)
    return min(value + dt * up, target)


@outlined
def kinematic(wanted, position, dt, tables, at, n):
    """Move a position to the wanted one through n detents: from `at` the detents, then the time to reach each from the last [s]."""
    wanted = min(max(wanted, tables[at]), tables[at + n - 1])
    for _ in range(4 * n):
        if not (dt > 0.0 and abs(wanted - position) > 1e-12 * max(abs(wanted), abs(position))):
            break
        i = 1
        while i < n - 1 and (tables[at + i] < position if wanted < position else tables[at + i] <= position):
            i += 1
        if tables[at + n + i] <= 0.0 or tables[at + i] == tables[at + i - 1]:
            return wanted
        rate = (tables[at + i] - tables[at + i - 1]) / tables[at + n + i]
        reached = min(max(wanted, tables[at + i - 1]), tables[at + i])
        needed = abs((reached - position) / rate)
        if dt < needed:
            return position + dt * rate if position < wanted else position - dt * rate
        position = reached
        dt -= needed
    return position


@device
def arctangent(x):
    """Arctangent [rad]."""
    return atan2(x, 1.0)


@device
def whole(x):
    """The whole part of x."""
    return float(math.trunc(x))


@device
def heading(y, x):
    """Angle of a direction in [0, 2 pi)."""
    angle = atan2(y, x)
    return angle if angle >= 0.0 else angle + 2.0 * math.pi


@outlined
def noise_normal(seed, count, stream):
    """A standard normal number, the same for the same whole numbers."""
    zero = np.uint64(0)
    return normal2(np.uint64(seed), np.uint64(stream), zero, np.uint64(count), zero, zero)[0]


@outlined
def noise_uniform(seed, count, stream):
    """A uniform number in [-1, 1), the same for the same whole numbers."""
    zero = np.uint64(0)
    return 2.0 * uniform2(np.uint64(seed), np.uint64(stream), zero, np.uint64(count), zero, zero)[0] - 1.0
