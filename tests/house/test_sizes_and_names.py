"""How large files and functions may grow, and what they may not be called or hold."""

from __future__ import annotations

import ast
from collections import defaultdict

from tree import SOURCE_TREES, parsed, python_files, relative

MAX_LINES_OF_A_FILE = 600
MAX_LINES_OF_A_FUNCTION = 80
NAMES_THAT_SAY_NOTHING = {"util", "utils", "common", "helper", "helpers", "manager", "managers", "misc"}


def functions(tree: ast.Module) -> list[ast.FunctionDef | ast.AsyncFunctionDef]:
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]


def lines_of_code(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function without its docstring, which is to say as much as there is to say."""
    first = function.body[0]
    has_docstring = ast.get_docstring(function) is not None
    docstring = (first.end_lineno or 0) - first.lineno + 1 if has_docstring else 0
    return (function.end_lineno or 0) - function.lineno + 1 - docstring


def test_files_are_short():
    lengths = {relative(path): len(path.read_text().splitlines()) for path in python_files("src")}
    too_long = [f"{name} has {n} lines" for name, n in lengths.items() if n > MAX_LINES_OF_A_FILE]
    assert not too_long, "give the second idea of each a file of its own"


def test_functions_are_short():
    too_long = [
        f"{relative(path)}:{function.lineno}: {function.name} has {lines_of_code(function)} lines"
        for path in python_files("src")
        for function in functions(parsed(path))
        if lines_of_code(function) > MAX_LINES_OF_A_FUNCTION
    ]
    assert not too_long, "give a part of each a name"


def test_modules_have_names_that_say_something():
    parts = {path: (*path.parent.parts, path.stem) for path in python_files(*SOURCE_TREES)}
    assert not [
        relative(path)
        for path, names in parts.items()
        if NAMES_THAT_SAY_NOTHING & {name.strip("_").lower() for name in names}
    ]


def test_public_classes_have_names_of_their_own():
    places = defaultdict(list)
    for path in python_files("src"):
        # Not those of the plugins that `tussle new` writes, and of those that have the names of stock plugins.
        if not {"templates", "historic"} & set(path.parts):
            for node in parsed(path).body:
                if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                    places[node.name].append(f"{relative(path)}:{node.lineno}")
    assert not {name: at for name, at in places.items() if len(at) > 1}


def test_modules_change_no_globals_and_leave_nothing_unimplemented():
    """Two simulations would share a global that changes; an abstract method is abstract (abc.abstractmethod)."""
    assert not [
        f"{relative(path)}:{node.lineno}"
        for path in python_files("src")
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.Global) or (isinstance(node, ast.Name) and node.id == "NotImplementedError")
    ]
