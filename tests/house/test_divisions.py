"""Ranges of parameters: none without a width where a plugin divides by it, and no lower limit above its upper one."""

from __future__ import annotations

import ast
import math

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


UNSET = {("CPA", "min_time_s"): "-1 is no limit"}
"""Lower limits that may be above the upper ones, by plugin and parameter."""


def limits() -> list[tuple[type[Plugin], str, str]]:
    """Plugins with a lower and an upper limit of one quantity, which their names tell."""
    words = (("minimum", "maximum"), ("min", "max"), ("lower", "upper"), ("least", "most"))
    return [
        (plugin, lower, upper)
        for plugin in map(stock.load, stock.manifest())
        for lower, param in plugin.params().items()
        for low, high in words
        if (upper := lower.replace(low, high)) != lower and upper in plugin.params()
        if param.dtype is float and (plugin.__name__, lower) not in UNSET
    ]


def test_a_lower_limit_above_the_upper_one_is_refused():
    found = limits()
    assert len(found) > 20
    for plugin, lower, upper in found:
        least, most = (plugin().values[name] for name in (lower, upper))
        least, most = (least, most) if math.isfinite(most - least) else (0.0, 1.0)
        with pytest.raises(ParameterError, match=f"{lower} must (not be larger|be smaller) than {upper}"):
            plugin(**{lower: most, upper: 0.5 * (least + most)})
