"""Types of the results of operators in kernels, looked up before Numba tries its own rules, which are dozens for each operator."""

from __future__ import annotations

import operator
from collections.abc import Callable
from functools import cache
from typing import Any

ARITHMETIC = (operator.add, operator.sub, operator.mul, operator.iadd, operator.isub, operator.imul)
DIVISIONS = (operator.truediv, operator.itruediv)
ORDERS = (operator.lt, operator.le, operator.gt, operator.ge)
EQUALITIES = (operator.eq, operator.ne)
OPERATORS = (*ARITHMETIC, *DIVISIONS, *ORDERS, *EQUALITIES, bool)


@cache
def rule(function: Callable[..., Any]) -> Any:
    """Return Numba's typing rule of a function; `ways` holds the result and argument types of each overload."""
    from numba.core.types import Function
    from numba.core.typing.templates import AbstractTemplate, infer_global, signature

    class Rule(AbstractTemplate):
        key = function
        metadata = {"target": "cpu"}  # tried before rules for all targets  # noqa: RUF012
        ways: list[tuple[Any, tuple[Any, ...]]] = []  # noqa: RUF012

        def generic(self, args: Any, kws: Any) -> Any:
            for result, arguments in self.ways:
                if len(args) == len(arguments) and all(
                    given == wanted or (isinstance(wanted, type) and isinstance(given, wanted))
                    for given, wanted in zip(args, arguments, strict=True)
                ):
                    return None if kws else signature(result, *args)
            return None

    infer_global(function, Function(Rule))
    return Rule


@cache
def type_numbers() -> None:
    """Add rules for two numbers of the same type and for truths, which give what Numba's own rules give."""
    from numba.core.types import boolean, float64, int64

    for function in OPERATORS[:-1]:
        is_comparison = function in ORDERS + EQUALITIES
        rule(function).ways.append((boolean if is_comparison else float64, (float64, float64)))
        if function not in EQUALITIES:  # of two constants, Numba knows the result
            whole = boolean if is_comparison else float64 if function in DIVISIONS else int64
            rule(function).ways.append((whole, (int64, int64)))
    rule(bool).ways.extend((boolean, (kind,)) for kind in (boolean, int64, float64))
