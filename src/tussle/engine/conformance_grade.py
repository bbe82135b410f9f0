"""A rule of the conformance kit: the source keeps what the plugin's grade promises of its bits."""

from __future__ import annotations

import ast
import builtins
import dis
import inspect
import sys
import textwrap
import types
from collections.abc import Iterator
from typing import Any

import numpy as np

from tussle.api import Plugin
from tussle.engine.conformance_declarations import own_classes
from tussle.errors import ConformanceError
from tussle.numeric.fingerprint import EXACT, Fingerprint, codes_of, has_power, package

RULE = "grade"
# Shapes, choices and exact arithmetic; what IEEE 754 rounds correctly, and sums that go one by one.
NUMPY = EXACT | frozenset(
    ["array", "asarray", "ascontiguousarray", "atleast_1d", "atleast_2d", "empty", "zeros", "ones", "full", "empty_like", "zeros_like", "ones_like", "full_like", "arange", "eye", "identity", "concatenate", "stack", "vstack", "hstack", "column_stack", "where", "take", "take_along_axis", "choose", "select", "flatnonzero", "nonzero", "argwhere", "argsort", "lexsort", "sort", "partition", "argpartition", "unique", "searchsorted", "bincount", "repeat", "tile", "broadcast_to", "broadcast_arrays", "broadcast_shapes", "reshape", "ravel", "transpose", "moveaxis", "swapaxes", "expand_dims", "squeeze", "flip", "roll", "clip", "round", "any", "all", "max", "min", "amax", "amin", "argmax", "argmin", "ptp", "cumsum", "diff", "digitize", "isin", "intersect1d", "setdiff1d", "union1d", "count_nonzero", "ix_", "indices", "meshgrid", "nan_to_num", "copyto", "copy", "put", "nanmin", "nanmax", "shape", "ndim", "size", "result_type", "iinfo", "finfo", "dtype", "errstate", "shares_memory", "array_equal", "logical_and", "logical_or", "float64", "int64", "int32", "uint64", "uint8", "bool_", "ndarray", "generic", "floating", "integer", "number", "isscalar", "mod", "divmod", "conjugate", "cross"]
)
REDUCTIONS = frozenset({"sum", "mean", "prod", "std", "var", "dot", "trace", "cumprod"})
WHOLE = frozenset(
    ["searchsorted", "flatnonzero", "nonzero", "argsort", "lexsort", "bincount", "count_nonzero", "isin", "isfinite", "isnan", "isinf", "logical_and", "logical_or", "logical_not", "argmax", "argmin", "any", "all", "digitize", "signbit"]
)
CHANCE = ("random", "numpy.random", "secrets", "uuid", "time", "datetime")
TRUSTED = {"tussle", "numba", "llvmlite"}


def check_grade(cls: type[Plugin]) -> None:
    """The plugin's Python and kernels use only what is repeatable, and for "portable" what is the same on every machine.

    Raises:
        ConformanceError: They use something else.
    """
    if cls.grade == "external":
        return
    scan = Scan(cls)
    found = scan.chance or (scan.found if cls.grade == "portable" else [])
    if found:
        raise ConformanceError(cls.__name__, RULE, f"it says {cls.grade!r}, but {found[0]}")


class Scan:
    """A walk over the functions of a class and all those of its package that they call.

    Attributes:
        found: What is not the same on every machine, in words with file and line.
        chance: Draws and clocks that are not the simulation's.
    """

    def __init__(self, cls: type[Plugin]) -> None:
        self.home = cls.__module__.partition(".")[0]
        self.folder = cls.__module__.rpartition(".")[0] or cls.__module__
        self.found: list[str] = []
        self.chance: list[str] = []
        self._seen: set[int] = set()
        for base in own_classes(cls):
            for name, value in vars(base).items():
                if name == "derivative":
                    self._compiled(getattr(base, name), f"{base.__name__}.derivative")
                else:
                    self._object(value, f"{base.__name__}.{name}")

    def _object(self, value: Any, label: str) -> None:
        for part in (getattr(value, "fget", None), getattr(value, "__func__", None), value):
            if isinstance(getattr(part, "py_func", None), types.FunctionType):
                self._compiled(part, label)
            elif isinstance(part, types.FunctionType):
                self._function(part)

    def _compiled(self, function: Any, label: str) -> None:
        if function is not None and id(function) not in self._seen:
            self._seen.add(id(function))
            reached = Fingerprint(getattr(function, "py_func", function)).functions
            for name in sorted({name for each in reached for name in libm_of(each)}):
                self.found.append(
                    f"the compiled {label} uses {name}, whose last bits are the machine's; take it from tussle.numeric"
                )

    def _function(self, function: types.FunctionType) -> None:
        if id(function) in self._seen:
            return
        self._seen.add(id(function))
        try:
            tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
        except (OSError, TypeError, SyntaxError):  # written by a machine, such as the methods of a dataclass
            return
        file = function.__code__.co_filename.rpartition("/")[2]
        Reader(self, function, tree, f"{file}:{{}}", function.__code__.co_firstlineno - 1).read()

    def follow(self, value: Any, place: str) -> None:
        """Judge what a function's names stand for, and go into it where it belongs to the plugin."""
        name = getattr(value, "__name__", type(value).__name__)
        if isinstance(getattr(value, "py_func", None), types.FunctionType):
            if package(value.py_func) == self.home or package(value.py_func) not in TRUSTED:
                self._compiled(value, f"{name} ({place})")
        elif is_chance(value):
            self.chance.append(
                f"{place} uses {value.__module__ or 'numpy.random'}.{name}; draws come from g.uniform and g.normal, time from g.t"
            )
        elif isinstance(value, np.ufunc) or package(value) == "numpy":
            if name not in NUMPY and name not in {"ndarray"} and not isinstance(value, type):
                advice = "take it from tussle.numeric, or say grade = 'machine'"
                self.found.append(
                    f"{place} uses np.{name}, whose last bits are not the same on every machine; {advice}"
                )
        elif package(value) in {"math", "cmath"} and callable(value):
            if name not in EXACT:
                self.found.append(
                    f"{place} uses math.{name}, whose last bits are the machine's; take it from tussle.numeric"
                )
        elif isinstance(value, types.FunctionType):
            self._python(value, name, place)

    def _python(self, value: types.FunctionType, name: str, place: str) -> None:
        module = value.__module__ or ""
        if (
            module == self.folder
            or module.startswith(self.folder + ".")
            or (package(value) == self.home and self.home != "tussle")
        ):
            self._function(value)
        elif package(value) not in TRUSTED and package(value) not in {"builtins", *sys.stdlib_module_names}:
            self.found.append(
                f"{place} uses {module}.{name}, of which nobody has promised that it is the same on every machine"
            )


def libm_of(function: types.FunctionType) -> Iterator[str]:
    """What the machine's mathematical library computes for one compiled function, as "math.cos".

    Read from the bytecode: `Fingerprint.libm` takes every name for an attribute of every module the function mentions, which is right
    for its keys, and finds math.atan2 where tussle.numeric's atan2 stands beside math.sqrt.
    """
    for code in codes_of(function.__code__):
        if has_power(code):
            yield "**"
        value: Any = None
        for instruction in dis.get_instructions(code):
            if instruction.opname == "LOAD_GLOBAL":
                value = function.__globals__.get(instruction.argval)
            elif instruction.opname in {"LOAD_ATTR", "LOAD_METHOD"} and isinstance(value, types.ModuleType):
                value = getattr(value, instruction.argval, None)
            elif instruction.opname not in {"CACHE", "PUSH_NULL"}:
                value = None
            name = getattr(value, "__name__", "")
            if isinstance(value, np.ufunc) and name not in EXACT:
                yield f"numpy.{name}"
            elif package(value) in {"math", "cmath"} and callable(value) and name not in EXACT:
                yield f"math.{name}"


def is_chance(value: Any) -> bool:
    """Whether a function draws random numbers or reads a clock that is not the simulation's."""
    module = getattr(value, "__module__", None) or type(getattr(value, "__self__", None)).__module__
    return (
        callable(value)
        and any(module == m or module.startswith(m + ".") for m in CHANCE)
        and not isinstance(value, type)
    )


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
