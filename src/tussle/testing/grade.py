"""A rule of the conformance kit: what says "portable" computes nothing by the machine's mathematical library."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from tussle.api import Plugin
from tussle.api.laws import NeighborLaw
from tussle.errors import ConformanceError
from tussle.numeric.fingerprint import libm_names
from tussle.testing.declarations import own_classes


def check_grade(cls: type[Plugin]) -> None:
    """The functions of a portable plugin, and all that they call by name, take sines and powers from `tussle.numeric`.

    Sums whose order depends on the number of rows show in the stacks instead.

    Raises:
        ConformanceError: One takes them from NumPy or from `math`.
    """
    if cls.grade != "portable":
        return
    for name, function in _functions(cls):
        found = libm_names(function)
        if found:
            text = f"it says 'portable', but {name} uses {found[0]}, whose last bits are the machine's; take it from tussle.numeric"
            raise ConformanceError(cls.__name__, "grade", text)


def _functions(cls: type[Plugin]) -> Iterator[tuple[str, Callable[..., Any]]]:
    for base in own_classes(cls):
        for name, value in vars(base).items():
            if isinstance(value, NeighborLaw):
                for law in (*value.laws, *([value.where] if value.where else [])):
                    yield f"{name}: {law.function.__name__}", law.function
                continue
            function = getattr(value, "fget", None) or getattr(value, "__func__", value)
            function = getattr(function, "py_func", function)
            if hasattr(function, "__code__"):
                yield name, function
