"""Public elementary functions, callable in compiled code on numbers and in Python on floats and arrays, with the same bits."""

from __future__ import annotations

from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tussle.numeric import elementary
from tussle.numeric.kernel import Device, kernel

Floats = NDArray[np.float64]


def rows_of(value: ArrayLike) -> Floats:
    """Convert to a contiguous float64 array, without a copy if it already is one."""
    return np.ascontiguousarray(value, dtype=np.float64)


class Unary(Device):
    """A function of one number.

    Args:
        scalar: The device function that computes it.
    """

    def __init__(self, scalar: Device) -> None:
        super().__init__(scalar.py_func)

        @kernel("f8 -> f8")
        def one(x):  # type: ignore[no-untyped-def]
            return scalar(x)

        @kernel("F Fw")
        def each(x, out):  # type: ignore[no-untyped-def]
            for i in range(x.shape[0]):
                out[i] = scalar(x[i])

        name_kernels(scalar, one, each)
        self._one = one
        self._each = each

    @overload
    def __call__(self, x: float) -> float: ...
    @overload
    def __call__(self, x: ArrayLike) -> Any: ...
    def __call__(self, x: Any) -> Any:
        if isinstance(x, (float, int)):
            return self._one(float(x))
        values = np.asarray(x, dtype=np.float64)
        if values.ndim == 0:
            return self._one(float(values))
        flat = rows_of(values).reshape(-1)
        out = np.empty_like(flat)
        self._each(flat, out)
        return out.reshape(values.shape)


class Pair(Device):
    """A function of one number that returns two."""

    def __init__(self, scalar: Device) -> None:
        super().__init__(scalar.py_func)

        @kernel("f8 -> f8 f8")
        def one(x):  # type: ignore[no-untyped-def]
            return scalar(x)

        @kernel("F Fw Fw")
        def each(x, first, second):  # type: ignore[no-untyped-def]
            for i in range(x.shape[0]):
                first[i], second[i] = scalar(x[i])

        name_kernels(scalar, one, each)
        self._one = one
        self._each = each

    @overload
    def __call__(self, x: float) -> tuple[float, float]: ...
    @overload
    def __call__(self, x: ArrayLike) -> tuple[Any, Any]: ...
    def __call__(self, x: Any) -> Any:
        if isinstance(x, (float, int)):
            return self._one(float(x))
        values = np.asarray(x, dtype=np.float64)
        if values.ndim == 0:
            return self._one(float(values))
        flat = rows_of(values).reshape(-1)
        first, second = np.empty_like(flat), np.empty_like(flat)
        self._each(flat, first, second)
        return first.reshape(values.shape), second.reshape(values.shape)


class Binary(Device):
    """A function of two numbers; arrays broadcast."""

    def __init__(self, scalar: Device) -> None:
        super().__init__(scalar.py_func)

        @kernel("f8 f8 -> f8")
        def one(y, x):  # type: ignore[no-untyped-def]
            return scalar(y, x)

        @kernel("F F Fw")
        def each(y, x, out):  # type: ignore[no-untyped-def]
            for i in range(y.shape[0]):
                out[i] = scalar(y[i], x[i])

        name_kernels(scalar, one, each)
        self._one = one
        self._each = each

    @overload
    def __call__(self, y: float, x: float) -> float: ...
    @overload
    def __call__(self, y: ArrayLike, x: ArrayLike) -> Any: ...
    def __call__(self, y: Any, x: Any) -> Any:
        if isinstance(y, (float, int)) and isinstance(x, (float, int)):
            return self._one(float(y), float(x))
        ys, xs = np.asarray(y, dtype=np.float64), np.asarray(x, dtype=np.float64)
        if ys.shape != xs.shape:
            shape = np.broadcast_shapes(ys.shape, xs.shape)
            ys, xs = np.broadcast_to(ys, shape), np.broadcast_to(xs, shape)
        if ys.ndim == 0:
            return self._one(float(ys), float(xs))
        out = np.empty(ys.size)
        self._each(rows_of(ys).reshape(-1), rows_of(xs).reshape(-1), out)
        return out.reshape(ys.shape)


def name_kernels(scalar: Device, *kernels: Any) -> None:
    """Name generated kernels after their function, for cache file names and error messages."""
    for each in kernels:
        each.__name__ = f"{scalar.py_func.__name__}_{each.py_func.__name__}"
        each.__qualname__ = each.__name__
        each.__module__ = scalar.py_func.__module__


sin = Unary(elementary.sin)
cos = Unary(elementary.cos)
sincos = Pair(elementary.sincos)
tan = Unary(elementary.tan)
asin = Unary(elementary.asin)
acos = Unary(elementary.acos)
exp = Unary(elementary.exp)
log = Unary(elementary.log)
wrap = Unary(elementary.wrap)
atan2 = Binary(elementary.atan2)
