"""Reads the source of a plugin's functions for what is not the same on every machine."""

from __future__ import annotations

import ast
import builtins
import types
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.numeric.fingerprint import package

if TYPE_CHECKING:
    from tussle.engine.conformance_grade import Scan

REDUCTIONS = frozenset({"sum", "mean", "prod", "std", "var", "dot", "trace", "cumprod"})
WHOLE_NAMES = """
    searchsorted flatnonzero nonzero argsort lexsort bincount count_nonzero isin isfinite isnan isinf
    logical_and logical_or logical_not argmax argmin any all digitize signbit
"""
WHOLE = frozenset(WHOLE_NAMES.split())


class Reader(ast.NodeVisitor):
    """Reads one function's source for one `Scan`."""

    def __init__(
        self, scan: Scan, function: types.FunctionType, tree: ast.AST, place: str, before: int
    ) -> None:
        self.scan, self.function, self.tree = scan, function, tree
        self._place, self._before = place, before
        closure = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
        self.names = {**vars(builtins), **function.__globals__}
        for name, cell in closure:
            try:
                self.names[name] = cell.cell_contents
            except ValueError:  # not filled yet
                continue
        self.local = set(function.__code__.co_varnames)
        self.whole = self._whole_names()

    def read(self) -> None:
        """Visit the body; decorators and annotations are not run in a step."""
        definition = self.tree.body[0]  # type: ignore[attr-defined]
        for statement in getattr(definition, "body", [definition]):
            self.visit(statement)

    def place(self, node: ast.AST) -> str:
        return self._place.format(getattr(node, "lineno", 0) + self._before)

    def resolve(self, node: ast.AST) -> Any:
        """What a name or a chain of attributes of modules and classes stands for; None where that shows only when it runs."""
        if isinstance(node, ast.Name):
            return None if node.id in self.local else self.names.get(node.id)
        if isinstance(node, ast.Attribute):
            owner = self.resolve(node.value)
            if isinstance(owner, (types.ModuleType, type, np.ufunc)):
                return getattr(owner, node.attr, None)
        return None

    def visit_Name(self, node: ast.Name) -> None:
        self._judge(node)

    def visit_Attribute(self, node: ast.Attribute) -> None:
        value, owner = self.resolve(node), self.resolve(node.value)
        if isinstance(owner, np.ufunc):
            self._judge(node.value)
            if node.attr in {"reduce", "reduceat"} and owner.__name__ not in {
                "minimum",
                "maximum",
                "logical_and",
                "logical_or",
            }:
                self.scan.found.append(
                    f"{self.place(node)} uses np.{owner.__name__}.{node.attr}, whose order of adding depends on the number of rows"
                )
        elif isinstance(owner, types.ModuleType) and isinstance(value, types.ModuleType):
            return
        elif value is None:
            self.generic_visit(node)
        else:
            self._judge(node)

    def _judge(self, node: ast.AST) -> None:
        value = self.resolve(node)
        if value is not None and not isinstance(value, types.ModuleType) and not self._is_reduction(value):
            self.scan.follow(value, self.place(node))

    def _is_reduction(self, value: Any) -> bool:
        return package(value) == "numpy" and getattr(value, "__name__", "") in REDUCTIONS

    def visit_BinOp(self, node: ast.BinOp) -> None:
        if isinstance(node.op, ast.MatMult):
            self.scan.found.append(
                f"{self.place(node)} uses @, whose order of adding depends on the number of rows and the machine"
            )
        if isinstance(node.op, ast.Pow) and not self._is_exact_power(node):
            self.scan.found.append(
                f"{self.place(node)} uses ** with something else than 2, whose last bits are the machine's; multiply out"
            )
        self.generic_visit(node)

    def _is_exact_power(self, node: ast.BinOp) -> bool:
        if (
            isinstance(node.right, ast.Constant)
            and node.right.value == 2
            and isinstance(node.right.value, int)
        ):
            return True
        return all(
            not any(isinstance(n, (ast.Name, ast.Attribute, ast.Call)) for n in ast.walk(side))
            for side in (node.left, node.right)
        )

    def visit_Call(self, node: ast.Call) -> None:
        called = node.func
        function = self.resolve(called)
        if function is builtins.sum:
            if not (node.args and self._is_whole(node.args[0])):
                self.scan.found.append(
                    f"{self.place(node)} uses sum(), which adds floats otherwise in Python 3.12 than before"
                )
        elif function is not None and self._is_reduction(function):
            self._reduction(node, node.args[0] if node.args else None, node.args[1:], function.__name__)
        elif isinstance(called, ast.Attribute) and called.attr in REDUCTIONS and function is None:
            # near.sum(values) adds one by one in a fixed order; array.sum() and array.sum(axis) do not.
            is_method = (
                not node.args or isinstance(node.args[0], (ast.Constant, ast.UnaryOp)) or called.attr == "dot"
            )
            if is_method:
                self._reduction(node, called.value, node.args, called.attr)
        self.generic_visit(node)

    def _reduction(self, node: ast.Call, value: ast.AST | None, rest: list[ast.expr], name: str) -> None:
        axis = next((k.value for k in node.keywords if k.arg == "axis"), rest[0] if rest else None)
        over_components = isinstance(axis, ast.Constant) and axis.value == 0
        if name == "sum" and (over_components or (value is not None and self._is_whole(value))):
            return
        self.scan.found.append(
            f"{self.place(node)} uses {name}, whose order of adding depends on the number of rows; near.{name} adds in a fixed one, "
            "components are added with +"
        )

    # -- whole numbers, whose sums are exact in any order ---------------------------------------------------------------------------

    def _whole_names(self) -> set[str]:
        given: dict[str, list[ast.expr]] = {}
        for node in ast.walk(self.tree):
            if isinstance(node, ast.Assign):
                for target in node.targets:
                    self._pair(given, target, node.value)
        names: set[str] = set()
        self.whole = names
        for _ in range(3):  # a name may be made of another one that is defined further down
            names |= {name for name, values in given.items() if all(self._is_whole(v) for v in values)}
        return names

    def _pair(self, given: dict[str, list[ast.expr]], target: ast.expr, value: ast.expr) -> None:
        if isinstance(target, ast.Name):
            given.setdefault(target.id, []).append(value)
        elif (
            isinstance(target, ast.Tuple)
            and isinstance(value, ast.Tuple)
            and len(target.elts) == len(value.elts)
        ):
            for t, v in zip(target.elts, value.elts, strict=True):
                self._pair(given, t, v)

    def _is_whole(self, node: ast.AST) -> bool:
        if isinstance(node, ast.Constant):
            return isinstance(node.value, int)
        if isinstance(node, ast.Name):
            return node.id in self.whole
        if isinstance(node, (ast.Compare, ast.BoolOp)) or (
            isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.Not, ast.Invert))
        ):
            return True
        if isinstance(node, ast.UnaryOp):
            return self._is_whole(node.operand)
        if isinstance(node, ast.BinOp):
            bitwise = isinstance(node.op, (ast.BitAnd, ast.BitOr, ast.BitXor))
            return bitwise or (
                not isinstance(node.op, ast.Div) and self._is_whole(node.left) and self._is_whole(node.right)
            )
        if isinstance(node, (ast.GeneratorExp, ast.ListComp)):
            return self._is_whole(node.elt)
        if isinstance(node, ast.Subscript):
            return self._is_whole(node.value)
        return isinstance(node, ast.Call) and self._is_whole_call(node)

    def _is_whole_call(self, node: ast.Call) -> bool:
        function = self.resolve(node.func)
        name = getattr(function, "__name__", "")
        if function in {len, int, bool, round}:
            return True
        if function is np.where:
            return len(node.args) == 3 and all(self._is_whole(a) for a in node.args[1:])
        if isinstance(node.func, ast.Attribute) and node.func.attr == "astype":
            return bool(node.args) and self.resolve(node.args[0]) in {int, bool, np.int64, np.bool_}
        return package(function) == "numpy" and name in WHOLE
