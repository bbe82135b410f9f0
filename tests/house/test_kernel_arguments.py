"""No kernel takes more than eight arguments: what belongs together comes as a tuple, or as the rows of one array."""

from __future__ import annotations

import ast

from tree import parsed, python_files, relative

MOST = 8


def test_no_kernel_takes_more_than_eight_arguments():
    found = {}
    for path in python_files("src"):
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.FunctionDef) and any(
                "kernel(" in ast.unparse(d) for d in node.decorator_list
            ):
                found[f"{relative(path)}:{node.lineno} {node.name}"] = len(node.args.args)
    assert len(found) > 40
    assert not [name for name, n in found.items() if n > MOST]


def test_nor_does_the_walk_that_is_written_for_neighbour_laws():
    text = next(path for path in python_files("src") if path.name == "walk_text.py").read_text()
    assert len(text.split('"def walk(')[1].split(")")[0].split(",")) <= MOST
