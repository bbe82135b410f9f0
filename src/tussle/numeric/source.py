"""Functions that are generated as source text; nothing else in tussle runs text as code.

Who generates text puts names into it that it has made or checked itself; code of plugin authors is only called, through `scope`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from types import FunctionType
from typing import Any

INDENT = "    "
GENERATED = "<generated>"
"""File of generated functions in tracebacks."""


def indented(depth: int, lines: Iterable[str]) -> Iterator[str]:
    """Indent lines."""
    return (INDENT * depth + line for line in lines)


def define(
    lines: Iterable[str], scope: Mapping[str, Any], module: str, qualname: str, file: str = GENERATED
) -> FunctionType:
    """Return the function that the lines define; the first is its `def`.

    Args:
        lines: Its source.
        scope: Its global names.
        module: Module that it belongs to: that of an author's function makes it run as Python under NUMBA_DISABLE_JIT.
        qualname: Its name in messages, in the kernels' cache and in symbols of machine code.
        file: Name in tracebacks.
    """
    text = "\n".join(lines) + "\n"
    names = dict(scope)
    exec(compile(text, file, "exec"), names)  # noqa: S102 - see the head of this module
    made: FunctionType = names[text[len("def ") : text.index("(")]]
    made.__module__, made.__qualname__ = module, qualname
    return made
