"""Hash of everything a kernel's machine code depends on: bytecode, constants and global values of all functions it reaches.

Numba's disk cache checks one source file only: it runs outdated machine code after a callee or an imported constant has
changed. Here a function is hashed by its bytecode and constants (without line numbers, comments and docstring) and by all
objects that its names refer to, through plain functions, jitted functions, closures, module attributes and overloads.
"""

from __future__ import annotations

import builtins
import dis
import hashlib
import os
import sys
import sysconfig
import types
from collections.abc import Callable, Iterator
from enum import Enum
from functools import cache, lru_cache
from typing import Any

import numpy as np

# The code of these packages changes only with versions that are part of every key.
FIXED_PACKAGES = frozenset({"numba", "llvmlite", "numpy", "builtins"}) | sys.stdlib_module_names
STANDARD_LIBRARY = sysconfig.get_paths()["stdlib"] + os.sep


class Fingerprint:
    """Hash of all objects that a function reaches.

    Attributes:
        digest: The hash, as hexadecimal digits.
        holders: Reached objects with a `py_func` (devices, kernels, Numba's dispatchers).
        opaque: Descriptions of reached objects that cannot be hashed. Code that depends on them must not be cached.

    Args:
        function: The function.
        passes_tussle: Whether functions of tussle, which do not change while a process runs, are hashed with what they reach.
    """

    def __init__(self, function: Callable[..., Any], passes_tussle: bool = True) -> None:
        self._passes_tussle = passes_tussle
        self.holders: list[Any] = []
        self.opaque: list[str] = []
        self._hash = hashlib.blake2b(digest_size=16)
        self._seen: dict[tuple[int, frozenset[str]], int] = {}
        self._kept: list[Any] = []
        self._visit(function, frozenset())
        self.digest = self._hash.hexdigest()

    def _write(self, *parts: str) -> None:
        for part in parts:
            data = part.encode("utf-8", "surrogatepass")
            self._hash.update(b"%d:" % len(data) + data)

    def _visit(self, value: Any, names: frozenset[str]) -> None:
        text = constant(value)
        if text is not None:
            self._write("constant", text)
            return
        # A module is visited once for each set of names that functions look up in it.
        mark = (id(value), names) if isinstance(value, types.ModuleType) else (id(value), frozenset())
        if mark in self._seen:
            self._write("seen", str(self._seen[mark]))
            return
        self._seen[mark] = len(self._seen)
        self._kept.append(value)  # keeps the object alive, so that its id stays unique
        if isinstance(value, types.FunctionType):
            self._visit_function(value)
        elif isinstance(getattr(value, "py_func", None), types.FunctionType):
            self.holders.append(value)
            options = getattr(value, "targetoptions", getattr(value, "options", None))
            self._write("jitted", repr(sorted(options.items())) if isinstance(options, dict) else "")
            self._visit(value.py_func, names)
        elif isinstance(value, types.ModuleType):
            self._visit_module(value, names)
        elif isinstance(value, (tuple, list)):
            self._write(type(value).__name__, str(len(value)))
            for item in value:
                self._visit(item, names)
        elif isinstance(getattr(value, "_defn", None), types.FunctionType):  # numba.extending.intrinsic
            self._write("intrinsic")
            self._visit(value._defn, names)
        else:
            self._visit_other(value)

    def _visit_function(self, function: types.FunctionType) -> None:
        if is_fixed(function) or not (self._passes_tussle or package(function) != "tussle"):
            self._write("fixed", f"{function.__module__}.{function.__qualname__}")
            return
        code = function.__code__
        self._write("function", code_text(code, function.__doc__))
        if lines := self._lines(code, package(function)):
            self._write("lines", lines)
        self._visit(function.__defaults__, frozenset())
        self._write(repr(sorted(function.__kwdefaults__ or ())))
        self._visit(tuple((function.__kwdefaults__ or {}).values()), frozenset())
        names = names_of(code)
        for name in sorted(names & function.__globals__.keys()):
            self._write("global", name)
            self._visit(function.__globals__[name], names)
        for name, cell in zip(code.co_freevars, function.__closure__ or (), strict=True):
            self._write("cell", name)
            try:
                contents = cell.cell_contents
            except ValueError:  # not assigned yet
                continue
            self._visit(contents, names)
        for implementation in overloads_of(function):
            self._write("overload")
            self._visit(implementation, frozenset())

    def _lines(self, code: types.CodeType, owner: str) -> str:
        """Lines that the machine code of a function holds."""
        return lines_of_errors(code, owner)

    def _visit_module(self, module: types.ModuleType, names: frozenset[str]) -> None:
        # Visits every name of the function that is an attribute of the module, even if the function reads it elsewhere. This may
        # visit too many objects, but never too few.
        self._write("module", module.__name__)
        for name in sorted(names & vars(module).keys()):
            self._write("attribute", name)
            self._visit(vars(module)[name], names)

    def _visit_other(self, value: Any) -> None:
        name = f"{getattr(value, '__module__', '')}.{getattr(value, '__qualname__', getattr(value, '__name__', ''))}"
        if isinstance(value, np.ufunc):
            self._write("ufunc", value.__name__)
        elif isinstance(value, np.dtype):
            self._write("dtype", repr(value))
        elif isinstance(value, np.ndarray) and not value.dtype.hasobject:
            self._write("array", repr(value.dtype), repr(value.shape), repr(value.flags.f_contiguous))
            self._hash.update(value.tobytes())
        elif isinstance(value, type) and issubclass(value, Enum):
            self._write("enum", name, repr([(member.name, member.value) for member in value]))
        elif isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "_fields"):
            self._write("fields", name, repr(value._fields))
        elif package(value) in FIXED_PACKAGES or package(type(value)) in {"numba", "numpy"}:
            self._write("fixed", name, repr(value) if package(type(value)) == "numba" else "")
        else:
            self._write("opaque", name)
            self.opaque.append(f"{type(value).__qualname__} {name.strip('.')}".strip())


def of_author(function: Callable[..., Any]) -> str:
    """Hash of what a function outside tussle reaches and can change in this process."""
    return Fingerprint(function, passes_tussle=False).digest


def constant(value: Any) -> str | None:
    """Unique text for an immutable constant; None for any other object."""
    if isinstance(value, Enum):
        return f"{type(value).__qualname__}.{value.name}={value.value!r}"
    if value is None or value is Ellipsis or isinstance(value, (bool, int, float, complex, str, bytes)):
        return f"{type(value).__name__} {value!r}"
    if isinstance(value, np.generic):
        return f"{value.dtype!r} {value.tobytes().hex()}"
    if isinstance(value, frozenset):
        items = [constant(item) for item in value]
        return None if None in items else f"frozenset {sorted(map(str, items))}"
    if type(value) is tuple:
        items = [constant(item) for item in value]
        return None if None in items else f"tuple {items}"
    return None


def codes_of(code: types.CodeType) -> Iterator[types.CodeType]:
    """Yield a code object and all code objects nested in it."""
    yield code
    for value in code.co_consts:
        if isinstance(value, types.CodeType):
            yield from codes_of(value)


@cache
def names_of(code: types.CodeType) -> frozenset[str]:
    """All global and attribute names in the code."""
    return frozenset(name for each in codes_of(code) for name in each.co_names)


@cache
def code_text(code: types.CodeType, doc: str | None) -> str:
    """Text of everything in a code object that compilation can depend on, without file, line numbers and docstring."""
    constants = list(code.co_consts)
    if doc is not None and constants and constants[0] == doc:
        constants[0] = None
    parts: list[Any] = [
        code.co_code.hex(),
        code.co_names,
        code.co_varnames,
        code.co_freevars,
        code.co_cellvars,
    ]
    parts += [code.co_argcount, code.co_kwonlyargcount, code.co_posonlyargcount, code.co_flags]
    parts.append(getattr(code, "co_exceptiontable", b"").hex())
    for value in constants:
        parts.append(
            code_text(value, None) if isinstance(value, types.CodeType) else constant(value) or repr(value)
        )
    return repr(parts)


@cache
def lines_of_errors(code: types.CodeType, owner: str) -> str:
    """Text of the file and lines that errors of an author's function name, which its machine code holds; "" if it raises none."""
    raises = any(dis.opmap["RAISE_VARARGS"] in each.co_code[::2] for each in codes_of(code))
    if owner == "tussle" or not raises:
        return ""
    return f"{code.co_filename} {code.co_firstlineno} {code.co_linetable.hex()}"


def is_fixed(function: types.FunctionType) -> bool:
    """Return True if a Python function belongs to a package whose version is part of every key."""
    if package(function) in {"numba", "llvmlite", "numpy"}:
        return True
    # Checks the file, because a user's module may have the name of a standard library module.
    file = function.__code__.co_filename
    return file.startswith("<frozen ") or (file.startswith(STANDARD_LIBRARY) and "-packages" not in file)


def package(value: Any) -> str:
    """Top-level package that defines a function, class or object."""
    module = getattr(value, "__module__", None)
    if module is None and isinstance(value, types.BuiltinFunctionType):
        module = builtins.__name__
    return str(module or "").partition(".")[0]


def overloads_of(function: types.FunctionType) -> list[Any]:
    """Implementations of a plain function registered with numba.extending.overload."""
    templates = sys.modules.get("numba.core.typing.templates")
    if templates is None:
        return []
    return overload_table(len(templates.builtin_registry.globals)).get(id(function), [])


@lru_cache(maxsize=1)
def overload_table(n_entries: int) -> dict[int, list[Any]]:
    """Registered implementations by id of the function; rebuilt when Numba's registry has grown."""
    table: dict[int, list[Any]] = {}
    registry = sys.modules["numba.core.typing.templates"].builtin_registry
    for value, kind in registry.globals[:n_entries]:
        for template in getattr(kind, "templates", ()):
            implementation = getattr(template, "_overload_func", None)
            if implementation is not None:
                table.setdefault(id(value), []).append(implementation)
    return table
