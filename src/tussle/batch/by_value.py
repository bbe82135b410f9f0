"""Pickles missions. Classes and functions of a script or prompt are pickled with their code, as other processes do not have the script."""

from __future__ import annotations

import io
import linecache
import pickle
from collections.abc import Callable
from types import CodeType, FunctionType
from typing import Any
from weakref import WeakSet

from tussle.api.laws import NeighborLaw
from tussle.numeric.kernel import Device, Kernel

MAIN = "__main__"


def dumps(value: Any) -> bytes:
    """Pickle a value.

    Raises:
        pickle.PicklingError, TypeError, AttributeError: A part of it cannot be pickled.
    """
    try:
        plain = pickle.dumps(value)
    except (pickle.PicklingError, AttributeError, TypeError):
        plain = b""  # a class that a function defines, for example
    if plain and MAIN.encode() not in plain:
        return plain
    stream = io.BytesIO()
    sources = _dump(value, stream)
    return pickle.dumps(_WithSource(stream.getvalue(), sources))


def loads(data: bytes) -> Any:
    """The value that was pickled."""
    found = pickle.loads(data)  # noqa: S301 - made by `dumps` in the process that runs the batch
    return found.loads() if isinstance(found, _WithSource) else found


class _WithSource:
    """A pickled value, and the source lines of the files that its functions come from: neighbour laws are read from source."""

    def __init__(self, data: bytes, sources: dict[str, list[str]]) -> None:
        self.data, self.sources = data, sources

    def loads(self) -> Any:
        for file, lines in self.sources.items():
            linecache.cache.setdefault(file, (sum(map(len, lines)), None, lines, file))
        return pickle.loads(self.data)  # noqa: S301 - as in `loads`


def _dump(value: Any, stream: io.BytesIO) -> dict[str, list[str]]:
    """Pickle by value; returns the source lines of each file."""
    import cloudpickle

    files: set[str] = set()

    class Pickler(cloudpickle.Pickler):  # type: ignore[misc]  # defined here: most batches do not need cloudpickle
        def reducer_override(self, obj: Any) -> Any:
            if isinstance(obj, FunctionType) and obj.__module__ == MAIN:
                files.add(obj.__code__.co_filename)
            if isinstance(obj, NeighborLaw):  # without the plans that it has compiled here
                return NeighborLaw, (obj.laws, obj.where, obj.names)
            if isinstance(obj, Kernel) and obj.__module__ == MAIN:
                return Kernel, (obj.py_func, obj.signature)
            if isinstance(obj, Device) and obj.__module__ == MAIN:
                return type(obj), (obj.py_func,)
            if isinstance(obj, CodeType):  # whose file name cloudpickle 3.1.3 leaves out
                return _code_of, (obj.co_filename, *self.dispatch_table[CodeType](obj))
            made = super().reducer_override(obj)
            if isinstance(obj, type) and isinstance(made, tuple) and len(made) == 6:  # a class by value
                _AT_HOME.add(obj)
                make, arguments, state, items, pairs, fill = made
                return make, arguments, (fill, state), items, pairs, _fill
            return made

    Pickler(stream).dump(value)
    return {file: linecache.getlines(file) for file in files}


_AT_HOME: WeakSet[type] = WeakSet()
"""Classes that were pickled in this process. To unpickle one here gives the class itself."""


def _fill(cls: type, given: tuple[Callable[[type, Any], object], Any]) -> None:
    """Give a class its attributes, unless it is at home: its methods would then have copies of their globals, which stay as they are."""
    fill, state = given
    if cls not in _AT_HOME:
        fill(cls, state)


def _code_of(file: str, make: Callable[..., CodeType], values: tuple[Any, ...]) -> CodeType:
    return make(*values).replace(co_filename=file)
