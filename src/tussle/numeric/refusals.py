"""What is said about functions of authors that cannot be compiled."""

from __future__ import annotations

import operator
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


def misread(annotation: Any) -> str:
    """What the compiler reads otherwise than Python in a function whose types it has found, with its line; "" if nothing.

    A negative power of a whole number is a whole number to it, mostly 0, and `range` cuts real numbers off, and to 32 bits.
    """
    from numba.core.ir import Assign
    from numba.core.types import Float, Integer, Literal

    negative = {
        each.target.name
        for block in annotation.blocks.values()
        for each in block.body
        if isinstance(each, Assign)
        and getattr(each.value, "op", "") == "unary"
        and each.value.fn is operator.neg  # type: ignore[attr-defined]
    }

    def is_negative(power: Any) -> bool:
        kind = annotation.typemap[power.name]
        return power.name in negative or (isinstance(kind, Literal) and kind.literal_value < 0)  # type: ignore[attr-defined]

    for each in annotation.calltypes:
        if getattr(each, "op", "") in ("binop", "inplace_binop") and each.fn in (operator.pow, operator.ipow):
            kinds = [annotation.typemap[side.name] for side in (each.lhs, each.rhs)]
            if all(isinstance(kind, Integer) for kind in kinds) and is_negative(each.rhs):
                return f"line {each.loc.line}: a negative power of a whole number would be a whole number: write 2.0 ** -k, not 2 ** -k"
        elif getattr(each, "op", "") == "call":
            called = getattr(annotation.typemap[each.func.name], "typing_key", None)
            if called is range and any(isinstance(annotation.typemap[a.name], Float) for a in each.args):
                return f"line {each.loc.line}: range takes whole numbers: write range(int(x))"
    return ""
