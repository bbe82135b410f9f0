"""Arguments that are checked by their annotations: fields of declarations before they are used, and those of a call that fails."""

from __future__ import annotations

import builtins
import functools
import inspect
import numbers
import sys
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields
from types import NoneType, UnionType
from typing import Any, ClassVar, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from tussle.documents import is_whole
from tussle.errors import DeclarationError, ParameterError, TussleError, clipped, listed, nearest_name

Decorated = TypeVar("Decorated", bound=Callable[..., Any])
Array = np.ndarray | Sequence[Any] | float
"""What NumPy takes for an array of numbers."""
NOUNS = {
    int: "a whole number",
    float: "a number",
    bool: "true or false",
    str: "a text",
    NoneType: "None",
    Any: "anything",
    Iterable: "a list",
    Callable: "a function",
    np.ndarray: "an array",
    Mapping: "values by name",
}
PYTHON_ERRORS = (TypeError, AttributeError, ValueError, LookupError)
"""What Python and NumPy raise where a value of another type is used."""


def check_fields(given: Any) -> None:
    """Check the fields of a dataclass by their annotations.

    Raises:
        ParameterError: A value is of another type.
    """
    cls: Any = type(given)
    kinds = kinds_of(cls)
    for each in fields(given):
        check_kind(f"{cls.__name__}: {each.name}", getattr(given, each.name), kinds[each.name])


def check_kind(name: str, value: Any, kind: Any, error: type[TussleError] = ParameterError) -> None:
    """Check a value by its annotation.

    Raises:
        TussleError: As `error`: it is of another type.
    """
    if get_origin(kind) is Mapping and isinstance(value, Mapping):
        for key, item in value.items():
            check_kind(f"{name}: {clipped(repr(key))}", key, get_args(kind)[0], error)
            check_kind(f"{name} of {key!r}", item, get_args(kind)[1], error)
    elif not _is_of(value, kind):
        raise error(f"{name} = {clipped(repr(value))} is not allowed; it takes {_noun(kind)}")


def explained(function: Decorated) -> Decorated:
    """A function whose Python errors name the argument that is of another type than its annotation, and say what it takes.

    The types are looked at where a call has failed; a call that succeeds costs nothing more. A class stands for its public methods and
    its making. An `__init__` alone, which is that of a declaration, raises a `DeclarationError`.
    """
    if isinstance(function, type):
        for name, each in vars(function).copy().items():
            inner = each.__func__ if isinstance(each, staticmethod | classmethod) else each
            if inspect.isfunction(inner) and (name == "__init__" or not name.startswith("_")):
                checked = _explained(inner, ParameterError)
                setattr(function, name, checked if inner is each else type(each)(checked))
        return function
    return _explained(function, DeclarationError if function.__name__ == "__init__" else ParameterError)


def _explained(function: Decorated, error: type[TussleError]) -> Decorated:
    """One function of `explained`."""

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        try:
            return function(*args, **kwargs)
        except PYTHON_ERRORS as reason:
            is_python = not isinstance(reason, TussleError) or hasattr(reason, "is_of_inner_call")
            if is_python and (better := _better(function, args, kwargs, error)):
                better.is_of_inner_call = True  # type: ignore[attr-defined]
                raise better from None
            raise

    return call  # type: ignore[return-value]


def checked(*names: str) -> Callable[[Decorated], Decorated]:
    """Decorator of a function whose arguments with these names are checked by their annotations before it runs.

    It is for what would be noticed late or never: truth values, and what is used later. Calls raise a `ParameterError`.
    """

    def decorate(function: Decorated) -> Decorated:
        signature = inspect.signature(function)

        @functools.wraps(function)
        def call(*args: Any, **kwargs: Any) -> Any:
            try:
                given = signature.bind(*args, **kwargs).arguments
            except TypeError:
                return function(*args, **kwargs)  # which raises it
            for each in names:
                if each in given:
                    check_kind(f"{_called(function, args)}: {each}", given[each], kinds_of(function)[each])
            return function(*args, **kwargs)

        return call  # type: ignore[return-value]

    return decorate


def _called(function: Callable[..., Any], args: tuple[Any, ...]) -> str:
    """Name of a function, or of the class that it makes, for messages."""
    return type(args[0]).__name__ if function.__name__ == "__init__" else function.__name__


def _better(
    function: Callable[..., Any], args: Any, kwargs: Any, error: type[TussleError]
) -> TussleError | None:
    """A better error, if an argument explains why a call failed."""
    name = _called(function, args)
    signature = inspect.signature(function)
    known = [each for each in signature.parameters if each not in ("self", "cls")]
    try:
        given = signature.bind(*args, **kwargs).arguments
    except TypeError as wrong:
        unknown = next((each for each in kwargs if each not in known), "")
        return error(f"{name}: {wrong}{nearest_name(unknown, known)}; {listed(known)}")
    kinds = kinds_of(function)
    try:
        for each, value in given.items():
            check_kind(f"{name}: {each}", value, kinds.get(each, Any), error)
    except TussleError as wrong:
        return wrong
    return None


@functools.cache
def kinds_of(of: Any) -> dict[str, Any]:
    """Types of the annotations of a function or a class; any, where they need a module that is not imported."""
    known = defaultdict(lambda: Any, {**vars(builtins), **vars(sys.modules[of.__module__])})
    found = get_type_hints(of, localns=known)
    return {name: get_args(kind)[0] if get_origin(kind) is ClassVar else kind for name, kind in found.items()}


def _is_of(value: Any, kind: Any) -> bool:
    """Whether a value is of an annotated type. A number of NumPy is a number, and an array is a sequence; other arrays are not checked."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return any(_is_of(value, one) for one in inner)
    if kind in (int, float):
        is_number = isinstance(value, numbers.Real) and not isinstance(value, bool)
        return is_number and (kind is float or is_whole(value))
    if kind is bool:
        return isinstance(value, bool | np.bool_)
    if origin is Callable:
        return callable(value)
    if origin is Mapping:
        return isinstance(value, Mapping) and all(
            _is_of(item, one) for items in value.items() for item, one in zip(items, inner, strict=True)
        )
    if origin in (Sequence, list, tuple):
        if isinstance(value, str) or not isinstance(value, Sequence | np.ndarray):
            return False
        is_open = origin is not tuple or inner[-1] is ...
        each = [inner[0]] * len(value) if is_open else inner
        return len(value) == len(each) and all(map(_is_of, value, each))
    kind = origin or kind
    if kind is np.ndarray:
        return hasattr(value, "__array__") or isinstance(value, numbers.Number | list | tuple)
    is_checked = isinstance(kind, type) and not getattr(kind, "_is_protocol", False)
    return kind is Any or not is_checked or isinstance(value, kind)


def _noun(kind: Any) -> str:
    """What a type is called in messages."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        names = [_noun(one) for one in inner]
        return " or ".join(names)
    if origin in (Sequence, list, tuple):
        if origin is not tuple or inner[-1] is ...:
            return "a list" if inner[0] is Any else f"a list, each {_noun(inner[0])}"
        return f"{len(inner)} values: {', '.join(map(_noun, inner))}"
    return NOUNS.get(origin or kind) or f"a {kind.__name__}"


__all__ = ["Array", "check_fields", "check_kind", "checked", "explained", "kinds_of"]
