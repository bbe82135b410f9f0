"""What a plugin class writes over: names of columns that hide something, and methods that could not be called."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Iterator
from types import FunctionType
from typing import Any

from tussle.declare.columns import Column
from tussle.errors import DeclarationError
from tussle.numeric.refusals import label

OURS = "tussle.api."


def check_names(cls: Any, reserved: Iterable[str]) -> None:
    """Check that no column of a plugin class hides an attribute of its kind, and that nothing hides a column.

    Raises:
        DeclarationError: One does.
    """
    for name, column in cls.columns.items():
        where, kind = f"{cls.__name__}.{name}", type(column).__name__
        owners = [base for base in cls.__mro__ if name in vars(base)]
        hidden = [
            b for b in owners if b.__module__.startswith(OURS) and not isinstance(vars(b)[name], Column)
        ]
        if name in reserved or name.startswith("_"):
            raise DeclarationError(f"{where}: the name is reserved; choose another name for this {kind}")
        if hidden:
            what = "a method" if callable(getattr(hidden[0], name)) else "an attribute"
            raise DeclarationError(
                f"{where}: {hidden[0].__name__} has {what} of this name; choose another name for this {kind}"
            )
        value = vars(owners[0])[name]
        if not isinstance(value, Column):
            first = next(base for base in owners if isinstance(vars(base)[name], Column))
            way = (
                f"declare it again, {name} = {kind}({value!r:.60}, ...), for another default"
                if kind == "Param"
                else "choose another name"
            )
            raise DeclarationError(f"{where} = {value!r:.60} hides the {kind} of {first.__name__}; {way}")


def check_overrides(cls: Any) -> None:
    """Check that each method that the engine calls takes what it is called with, and does its work when it is called.

    Raises:
        DeclarationError: One does not.
    """
    for function, called in _overrides(cls):
        given = [
            name
            for name, each in inspect.signature(called).parameters.items()
            if each.kind is each.POSITIONAL_OR_KEYWORD
        ]
        try:
            inspect.signature(function).bind(*given)
        except TypeError:
            takes = ", ".join(inspect.signature(function).parameters)
            raise DeclarationError(
                f"{label(function)} takes ({takes}); it is called with ({', '.join(given)})"
            ) from None
        waits = inspect.iscoroutinefunction(function) or inspect.isasyncgenfunction(function)
        if waits or (
            inspect.isgeneratorfunction(function) and called.__annotations__.get("return") == "None"
        ):
            word = "async def" if waits else "yield"
            raise DeclarationError(
                f"{label(function)}: with `{word}` a call does nothing; write a method that does its work when it is called"
            )


def _overrides(cls: Any) -> Iterator[tuple[FunctionType, FunctionType]]:
    """Each method of a class with that of its kind that it replaces."""
    for name, function in vars(cls).items():
        called = next(
            (vars(b)[name] for b in cls.__mro__[1:] if b.__module__.startswith(OURS) and name in vars(b)),
            None,
        )
        if (
            isinstance(function, FunctionType)
            and isinstance(called, FunctionType)
            and not name.startswith("__")
        ):
            yield function, called
