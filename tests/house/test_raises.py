"""Every error of ours that is raised somewhere is provoked, or at least named, by a test."""

from __future__ import annotations

import ast
import re

from tree import parsed, python_files, relative


def errors_of_ours() -> set[str]:
    """Names of TussleError and of all classes below it, wherever they are defined."""
    bases = {
        node.name: {base.id for base in node.bases if isinstance(base, ast.Name)}
        for path in python_files("src")
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.ClassDef)
    }
    names = {"TussleError"}
    while grown := {name for name, above in bases.items() if above & names} - names:
        names |= grown
    return names


def raised() -> dict[str, str]:
    """Each error of ours that some line makes, with the first such line.

    Making counts, not only raising: a message is often put together by a function whose result is raised.
    """
    ours, found = errors_of_ours(), {}
    for path in python_files("src"):
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ours:
                found.setdefault(node.func.id, f"{relative(path)}:{node.lineno}")
    return found


def test_every_error_is_provoked_by_some_test():
    tests = [
        path.read_text() for path in python_files("tests") if not relative(path).startswith("tests/house")
    ]
    unnamed = [
        f"{name}, raised at {place}"
        for name, place in raised().items()
        if not any(re.search(rf"\b{name}\b", text) for text in tests)
    ]
    assert not unnamed
