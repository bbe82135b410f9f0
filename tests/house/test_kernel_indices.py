"""No kernel indexes with a number from a column: machine code checks no bounds, and a column can hold any number.

Numbers read from the engine's own index arrays are in range by construction. An id becomes a row through `row_of`, which checks it.
The kernels of `tussle.numeric.neighbors` read index arrays, and positions, which `cell_of` brings into range; those of `tussle.world.rays`
read trees of their own and bring cells and bins into range; those of `tussle.plugins.plan` a hash table of their own. They are left out.
"""

from __future__ import annotations

import ast
import textwrap

import pytest
from tree import parsed, python_files, relative

ENGINE_INDICES = {
    *("order", "place", "places", "queries", "index"),
    *(
        "world",
        "row_world",
        "target_row",
        "claim_place",
        "mates",
        "near",
        "row",
        "wanted",
        "other",
        "ids",
        "fresh",
        "source",
    ),
    *("id_start", "block_first", "span_first", "span_last", "span_start", "span_end"),
}
"""Arrays that the engine fills with rows, places and offsets of its own tables."""

CHECKED = {"row_of", "range", "len", "min"}
"""Functions whose results are in range whatever they are given (`min` bounds by the other argument)."""


def tainted(node: ast.AST, names: set[str]) -> bool:
    """Whether a value depends on a number from a column."""
    if isinstance(node, ast.Call):
        called = node.func.id if isinstance(node.func, ast.Name) else ""
        return called not in CHECKED and any(tainted(a, names) for a in node.args)
    if isinstance(node, ast.Subscript):
        base = node.value
        while isinstance(base, (ast.Subscript, ast.Attribute)):
            base = base.value
        is_shape = isinstance(node.value, ast.Attribute) and node.value.attr == "shape"
        return not is_shape and not (isinstance(base, ast.Name) and base.id in ENGINE_INDICES)
    if isinstance(node, ast.Name):
        return node.id in names
    if isinstance(node, ast.Compare):
        return False
    return any(tainted(child, names) for child in ast.iter_child_nodes(node))


def offences(function: ast.FunctionDef) -> list[int]:
    """Lines that index with a number from a column."""
    names: set[str] = set()
    assigned = [n for n in ast.walk(function) if isinstance(n, (ast.Assign, ast.AugAssign))]
    for _ in range(len(assigned) + 1):
        before = len(names)
        for statement in assigned:
            targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
            for target in targets:
                pairs = [(target, statement.value)]
                if isinstance(target, ast.Tuple) and isinstance(statement.value, ast.Tuple):
                    pairs = list(zip(target.elts, statement.value.elts, strict=True))
                for to, value in pairs:
                    if isinstance(to, ast.Name) and _is_number(value) and tainted(value, names):
                        names.add(to.id)
        if len(names) == before:
            break
    return [
        node.lineno
        for node in ast.walk(function)
        if isinstance(node, ast.Subscript)
        for part in (node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice])
        if tainted(part, names)
    ]


def _is_number(value: ast.AST) -> bool:
    """Not a row or slice of a 2-D array, which is an array itself and no index."""
    if isinstance(value, ast.Subscript):
        parts = value.slice.elts if isinstance(value.slice, ast.Tuple) else [value.slice]
        return not any(isinstance(p, (ast.Slice, ast.Constant)) for p in parts)
    return True


def compiled_functions(tree: ast.Module) -> list[ast.FunctionDef]:
    """Functions that are decorated as kernels or devices."""
    return [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
        and any("kernel" in ast.unparse(d) or "device" in ast.unparse(d) for d in node.decorator_list)
    ]


def test_no_kernel_indexes_with_a_number_from_a_column():
    found = []
    n_functions = 0
    for path in python_files("src"):
        if path.parent.name in ("neighbors", "plan", "rays"):
            continue
        for function in compiled_functions(parsed(path)):
            n_functions += 1
            found += [f"{relative(path)}:{line} in {function.name}" for line in offences(function)]
    assert n_functions > 80
    assert not found


@pytest.mark.parametrize(
    ("body", "is_bad"),
    [
        ("row = id_row[id_start[w] + target[i]]", True),
        ("t = target[i]\nout[i] = x[t]", True),
        ("t, u = target[i], 0\nv = t + 1\nout[i] = x[v]", True),
        ("out[int(goal[i])] = 1.0", True),
        ("row = row_of(w, target[i], id_row, id_start)\nout[i] = x[row]", False),
        ("row = order[i]\nout[i] = x[row]", False),
    ],
)
def test_the_rule_sees_it(body, is_bad):
    function = ast.parse(f"def f():\n{textwrap.indent(body, ' ')}").body[0]
    assert bool(offences(function)) is is_bad
