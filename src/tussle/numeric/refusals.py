"""What is said about functions of authors that cannot be compiled."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from tussle.numeric.source import GENERATED

COLOUR = re.compile(r"\x1b\[[0-9;]*m")
ABOUT_THE_COMPILER = (
    "Failed in nopython",
    "During:",
    "<source missing",
    f'File "{GENERATED}"',
    "Enable logging",
    "This error may",
)
UNTYPED = re.compile(r"Untyped (?:global|freevar) name '(\w+)':.*<class '([\w.]+)'>")


def label(function: Callable[..., Any]) -> str:
    """File, line and name of a function, for messages."""
    plain = getattr(function, "py_func", function)
    code = plain.__code__
    return f"{code.co_filename}:{code.co_firstlineno}: {plain.__qualname__}"


def compiler_errors() -> tuple[type[Exception], ...]:
    """Errors with which the compiler refuses a function; the last is of a module that lacks a name."""
    from numba.core.errors import NumbaError

    return NumbaError, AttributeError


def refusal(error: Exception) -> str:
    """What the compiler says about an author's function, without colours and words about the compiler, and what to do."""
    text = COLOUR.sub("", str(error))
    lines = [
        each.rstrip()
        for each in text.splitlines()
        if each.strip() and not each.strip().startswith(ABOUT_THE_COMPILER)
    ]
    if found := UNTYPED.search(text):
        name, kind = found.groups()
        if kind == "function":
            lines.append(
                f"a compiled function calls other functions if they are marked with @device: mark {name} with it"
            )
        else:
            lines.append(
                f"{name} is a {kind}: compiled functions take numbers, texts, tuples and arrays from outside"
            )
    return "\n".join(lines)
