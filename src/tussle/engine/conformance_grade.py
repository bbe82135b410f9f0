"""A rule of the conformance kit: the source keeps what the plugin's grade promises of its bits."""

from __future__ import annotations

import ast
import inspect
import sys
import textwrap
import types
from typing import Any

import numpy as np

from tussle.api import Plugin
from tussle.api.laws import NeighborLaw
from tussle.engine.conformance_declarations import own_classes
from tussle.engine.conformance_source import Reader
from tussle.errors import ConformanceError
from tussle.numeric.fingerprint import EXACT, libm_names, package

RULE = "grade"
# Shapes, choices and exact arithmetic; what IEEE 754 rounds correctly, and sums that go one by one.
NUMPY_NAMES = """
    array asarray ascontiguousarray atleast_1d atleast_2d empty zeros ones full empty_like zeros_like ones_like
    full_like arange eye identity concatenate stack vstack hstack column_stack where take take_along_axis choose
    select flatnonzero nonzero argwhere argsort lexsort sort partition argpartition unique searchsorted bincount
    repeat tile broadcast_to broadcast_arrays broadcast_shapes reshape ravel transpose moveaxis swapaxes
    expand_dims squeeze flip roll clip round any all max min amax amin argmax argmin ptp cumsum diff digitize
    isin intersect1d setdiff1d union1d count_nonzero ix_ indices meshgrid nan_to_num copyto copy put nanmin
    nanmax shape ndim size result_type iinfo finfo dtype errstate shares_memory array_equal logical_and
    logical_or float64 int64 int32 uint64 uint8 bool_ ndarray generic floating integer number isscalar mod
    divmod conjugate cross
"""
NUMPY = EXACT | frozenset(NUMPY_NAMES.split())
CHANCE = ("random", "numpy.random", "secrets", "uuid", "time", "datetime")
TRUSTED = {"tussle", "numba", "llvmlite"}


def check_grade(cls: type[Plugin]) -> None:
    """The plugin's Python and kernels use only what is repeatable, and for "portable" what is the same on every machine.

    Raises:
        ConformanceError: They use something else.
    """
    if cls.grade == "external":
        return
    scan = Scan(cls)
    found = scan.chance or (scan.found if cls.grade == "portable" else [])
    if found:
        raise ConformanceError(cls.__name__, RULE, f"it says {cls.grade!r}, but {found[0]}")


class Scan:
    """A walk over the functions of a class and all those of its package that they call.

    Attributes:
        found: What is not the same on every machine, in words with file and line.
        chance: Draws and clocks that are not the simulation's.
    """

    def __init__(self, cls: type[Plugin]) -> None:
        self.home = cls.__module__.partition(".")[0]
        self.folder = cls.__module__.rpartition(".")[0] or cls.__module__
        self.found: list[str] = []
        self.chance: list[str] = []
        self._seen: set[int] = set()
        for base in own_classes(cls):
            for name, value in vars(base).items():
                if isinstance(value, NeighborLaw):
                    for law in (*value.laws, *([value.where] if value.where else [])):
                        self._compiled(law.function, f"{base.__name__}.{law.function.__name__}")
                elif name == "derivative":
                    self._compiled(getattr(base, name), f"{base.__name__}.derivative")
                else:
                    self._object(value, f"{base.__name__}.{name}")

    def _object(self, value: Any, label: str) -> None:
        for part in (getattr(value, "fget", None), getattr(value, "__func__", None), value):
            if isinstance(getattr(part, "py_func", None), types.FunctionType):
                self._compiled(part, label)
            elif isinstance(part, types.FunctionType):
                self._function(part)

    def _compiled(self, function: Any, label: str) -> None:
        if function is not None and id(function) not in self._seen:
            self._seen.add(id(function))
            for name in libm_names(getattr(function, "py_func", function)):
                self.found.append(
                    f"the compiled {label} uses {name}, whose last bits are the machine's; take it from tussle.numeric"
                )

    def _function(self, function: types.FunctionType) -> None:
        if id(function) in self._seen:
            return
        self._seen.add(id(function))
        try:
            tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
        except (OSError, TypeError, SyntaxError):  # written by a machine, such as the methods of a dataclass
            return
        file = function.__code__.co_filename.rpartition("/")[2]
        Reader(self, function, tree, f"{file}:{{}}", function.__code__.co_firstlineno - 1).read()

    def follow(self, value: Any, place: str) -> None:
        """Judge what a function's names stand for, and go into it where it belongs to the plugin."""
        name = getattr(value, "__name__", type(value).__name__)
        if isinstance(getattr(value, "py_func", None), types.FunctionType):
            if package(value.py_func) == self.home or package(value.py_func) not in TRUSTED:
                self._compiled(value, f"{name} ({place})")
        elif is_chance(value):
            self.chance.append(
                f"{place} uses {value.__module__ or 'numpy.random'}.{name}; draws come from g.uniform and g.normal, time from g.t"
            )
        elif isinstance(value, np.ufunc) or package(value) == "numpy":
            if name not in NUMPY and not isinstance(value, type):
                advice = "take it from tussle.numeric, or say grade = 'machine'"
                self.found.append(
                    f"{place} uses np.{name}, whose last bits are not the same on every machine; {advice}"
                )
        elif package(value) in {"math", "cmath"} and callable(value):
            if name not in EXACT:
                self.found.append(
                    f"{place} uses math.{name}, whose last bits are the machine's; take it from tussle.numeric"
                )
        elif isinstance(value, types.FunctionType):
            self._python(value, name, place)

    def _python(self, value: types.FunctionType, name: str, place: str) -> None:
        module = value.__module__ or ""
        if (
            module == self.folder
            or module.startswith(self.folder + ".")
            or (package(value) == self.home and self.home != "tussle")
        ):
            self._function(value)
        elif package(value) not in TRUSTED and package(value) not in {"builtins", *sys.stdlib_module_names}:
            self.found.append(
                f"{place} uses {module}.{name}, of which nobody has promised that it is the same on every machine"
            )


def is_chance(value: Any) -> bool:
    """Whether a function draws random numbers or reads a clock that is not the simulation's."""
    module = getattr(value, "__module__", None) or type(getattr(value, "__self__", None)).__module__
    return (
        callable(value)
        and any(module == m or module.startswith(m + ".") for m in CHANCE)
        and not isinstance(value, type)
    )
