"""Kernel decorators: one explicit signature, strict IEEE arithmetic, nothing compiled at import."""

from __future__ import annotations

from collections.abc import Callable
from functools import update_wrapper
from typing import Any


def codes() -> dict[str, Any]:
    """Numba's type of each code of a kernel signature."""
    from numba import boolean, float64, int64, types, uint64

    table: dict[str, Any] = {"f8": float64, "i8": int64, "b1": boolean, "u8": uint64}
    for letter, dtype in {"F": float64, "I": int64, "B": boolean, "U": uint64}.items():
        for ndim, digit in ((1, ""), (2, "2")):
            table[letter + digit] = types.Array(dtype, ndim, "C", readonly=True)
            table[letter + digit + "w"] = types.Array(dtype, ndim, "C")
    return table


class Device:
    """A small function that kernels call; compiled into its callers, without a cache of its own."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.py_func = function
        self._dispatcher: Any = None
        update_wrapper(self, function)

    @property
    def dispatcher(self) -> Any:
        if self._dispatcher is None:
            from numba import njit

            self._dispatcher = njit(error_model="numpy", forceinline=True)(self.py_func)
        return self._dispatcher

    @property
    def _numba_type_(self) -> Any:
        # Numba asks every unknown object for its type under this name: in jitted code the device is its dispatcher.
        return self.dispatcher._numba_type_

    def __call__(self, *args: Any) -> Any:
        return self.dispatcher(*args)


def device(function: Callable[..., Any]) -> Any:
    """Mark a small function that kernels call; it is compiled into its callers."""
    return Device(function)


class Kernel:
    def __init__(self, function: Callable[..., Any], signature: str) -> None:
        self.py_func = function
        self.signature = signature
        self._call: Any = None
        update_wrapper(self, function)

    @property
    def types(self) -> Any:
        from numba import types

        table = codes()
        arguments, _, result = self.signature.partition("->")
        results = [table[code] for code in result.split()]
        returned = types.void if not results else results[0] if len(results) == 1 else types.Tuple(results)
        return returned(*[table[code] for code in arguments.split()])

    def __call__(self, *args: Any) -> Any:
        if self._call is None:
            from numba import njit

            self._call = njit(self.types, error_model="numpy", nogil=True)(self.py_func)
        return self._call(*args)


def kernel(signature: str) -> Callable[[Callable[..., Any]], Kernel]:
    """Compile a function with one explicit signature, on its first call."""
    return lambda function: Kernel(function, signature)
