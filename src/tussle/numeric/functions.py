"""Public elementary functions, callable in compiled code on numbers and in Python on floats and arrays, with the same bits."""

from __future__ import annotations

import functools
import operator
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tussle.numeric import elementary
from tussle.numeric.kernel import Device, Kernel, kernel
from tussle.numeric.source import define


def kernel_over_columns(scalar: Device, sizes: Sequence[int], n_out: int) -> Kernel:
    """Kernel that calls a device function for each column of 2-D arrays: one input per item of `sizes`, then the output.

    Args:
        scalar: The device function; takes the components of all inputs.
        sizes: Number of rows of each input.
        n_out: Number of rows of the output.
    """
    names = [f"input_{k}" for k in range(len(sizes))]
    values = [f"{name}[{row}, i]" for name, size in zip(names, sizes, strict=True) for row in range(size)]
    results = [f"out[{row}, i]" for row in range(n_out)]
    lines = [
        f"def columns({', '.join(names)}, out):",
        "    for i in range(out.shape[1]):",
        f"        {', '.join(results)} = scalar({', '.join(values)})",
    ]
    columns = define(lines, {"scalar": scalar}, scalar.__module__, f"{scalar.__qualname__}_columns")
    return kernel(" ".join([*["F2"] * len(sizes), "F2w"]))(columns)


def clip(values: ArrayLike, low: ArrayLike, high: ArrayLike) -> NDArray[np.float64]:
    """The nearest values within bounds, which broadcast. `np.clip` may return zeros of another sign for one entity than for several."""
    raised = np.where(np.less(values, low), low, values)
    return np.where(np.greater(raised, high), high, raised)


class Elementwise(Device):
    """A function of numbers; in Python also of arrays, which broadcast.

    Args:
        scalar: The device function that computes it.
        n_in: Number of arguments.
        n_out: Number of results.
    """

    def __init__(self, scalar: Device, n_in: int = 1, n_out: int = 1) -> None:
        super().__init__(scalar.py_func)
        self._one = kernel(f"{'f8 ' * n_in}->{' f8' * n_out}")(scalar.py_func)
        self._columns = kernel_over_columns(scalar, (1,) * n_in, n_out)
        self._n_out = n_out

    def __call__(self, *values: Any) -> Any:
        if isinstance(values[0], (float, int)) and isinstance(values[-1], (float, int)):
            return self._one(*values)
        arrays = [np.asarray(value, dtype=np.float64) for value in values]
        if arrays[0].shape != arrays[-1].shape:
            arrays = list(np.broadcast_arrays(*arrays))
        shape = arrays[0].shape
        if not shape:
            return self._one(*map(float, arrays))
        out = np.empty((self._n_out, arrays[0].size))
        self._columns(*[np.ascontiguousarray(array).reshape(1, -1) for array in arrays], out)
        results = out.reshape(self._n_out, *shape)
        return results[0] if self._n_out == 1 else tuple(results)


sin = Elementwise(elementary.sin)
cos = Elementwise(elementary.cos)
sincos = Elementwise(elementary.sincos, n_out=2)
tan = Elementwise(elementary.tan)
asin = Elementwise(elementary.asin)
acos = Elementwise(elementary.acos)
exp = Elementwise(elementary.exp)
log = Elementwise(elementary.log)
wrap = Elementwise(elementary.wrap)
atan2 = Elementwise(elementary.atan2, n_in=2)


def total(values: Iterable[float]) -> float:
    """Return the sum of values, added from left to right. Python's `sum` compensates for rounding since 3.12: it has other bits there."""
    return functools.reduce(operator.add, values, 0.0)
