"""How large files and functions may grow, and what they may not be called or hold."""

from __future__ import annotations

import ast

import pytest
from tree import SOURCE_TREES, parsed, python_files, relative

MOST_LINES_OF_A_FILE = 600
MOST_LINES_OF_A_FUNCTION = 80
NAMES_THAT_SAY_NOTHING = {"util", "utils", "common", "helper", "helpers", "manager", "managers", "misc"}


def functions(tree: ast.Module) -> list[ast.FunctionDef | ast.AsyncFunctionDef]:
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]


def lines_of_code(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function without its docstring, which is to say as much as there is to say."""
    first = function.body[0]
    has_docstring = ast.get_docstring(function) is not None
    docstring = (first.end_lineno or 0) - first.lineno + 1 if has_docstring else 0
    return (function.end_lineno or 0) - function.lineno + 1 - docstring


@pytest.mark.parametrize("path", python_files("src"), ids=relative)
def test_file_is_short(path):
    n_lines = len(path.read_text().splitlines())
    assert n_lines <= MOST_LINES_OF_A_FILE, (
        f"{relative(path)} has {n_lines} lines; give its second idea a file of its own"
    )


@pytest.mark.parametrize("path", python_files("src"), ids=relative)
def test_functions_are_short(path):
    for function in functions(parsed(path)):
        n_lines = lines_of_code(function)
        place = f"{relative(path)}:{function.lineno}: {function.name}"
        assert n_lines <= MOST_LINES_OF_A_FUNCTION, f"{place} has {n_lines} lines; give a part of it a name"


@pytest.mark.parametrize("path", python_files(*SOURCE_TREES), ids=relative)
def test_module_has_a_name_that_says_something(path):
    parts = {part.strip("_").lower() for part in (*path.parent.parts, path.stem)}
    assert not parts & NAMES_THAT_SAY_NOTHING


@pytest.mark.parametrize("path", python_files("src"), ids=relative)
def test_module_changes_no_globals_and_leaves_nothing_unimplemented(path):
    for node in ast.walk(parsed(path)):
        place = f"{relative(path)}:{getattr(node, 'lineno', 0)}"
        assert not isinstance(node, ast.Global), (
            f"{place}: a module variable changes; two simulations would share it"
        )
        is_stub = isinstance(node, ast.Name) and node.id == "NotImplementedError"
        assert not is_stub, f"{place}: an abstract method is abstract (abc.abstractmethod)"
