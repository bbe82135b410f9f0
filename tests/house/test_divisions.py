"""A plugin that divides by the difference of two parameters refuses a range without a width."""

from __future__ import annotations

import ast

import pytest
from tree import parsed, python_files, relative

from tussle.api import Plugin
from tussle.errors import ParameterError
from tussle.plugins import stock

HARMLESS = {
    (
        "sphere_of_influence",
        "minimum_range",
    ): "of distances between the two, of which there are none without a width",
}


def differences(tree: ast.AST) -> set[tuple[str, str]]:
    """Names of which a difference is a divisor: (upper, lower)."""

    def name(node: ast.expr) -> str:
        return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""

    return {
        (name(node.right.left), name(node.right.right))
        for node in ast.walk(tree)
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div | ast.FloorDiv | ast.Mod)
        if isinstance(node.right, ast.BinOp) and isinstance(node.right.op, ast.Sub)
    }


def plugins_that_divide() -> list[tuple[type[Plugin], str, str]]:
    """Plugins, and two parameters by whose difference their module divides."""
    by_file = {relative(path): differences(parsed(path)) for path in python_files("src")}
    found = []
    for plugin in map(stock.load, stock.manifest()):
        file = f"src/{plugin.__module__.replace('.', '/')}.py"
        for upper, lower in by_file.get(file, ()):
            if {upper, lower} <= set(plugin.params()) and (upper, lower) not in HARMLESS:
                found.append((plugin, upper, lower))
    return found


def test_there_are_some():
    assert {plugin.__name__ for plugin, *_ in plugins_that_divide()} >= {
        "FixedWing6DOF",
        "MultirotorControllerOmega",
    }


def test_a_range_without_width_is_refused():
    for plugin, upper, lower in plugins_that_divide():
        least = plugin().values[lower]
        with pytest.raises(ParameterError, match=f"{lower} must be smaller than {upper}"):
            plugin(**{upper: least})
