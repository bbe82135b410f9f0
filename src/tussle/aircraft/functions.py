"""Functions and tables of aircraft files as expressions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from tussle.aircraft.code import Code
from tussle.aircraft.node import AircraftError, Element
from tussle.errors import clipped, listed, nearest_name

TEXTS = ("description", "documentation")
SAME = {"p": "property", "v": "value", "t": "table", "fn": "function"}
CALLS = {"sin": "sin", "cos": "cos", "tan": "tan", "asin": "asin", "acos": "acos", "atan": "arctangent", "exp": "exp", "ln": "log",
         "sqrt": "math.sqrt", "abs": "abs", "floor": "math.floor", "ceil": "math.ceil", "sign": "sign", "integer": "whole"}  # fmt: skip
PAIRS = {"quotient": "quotient", "pow": "power", "atan2": "atan2", "fmod": "remainder", "mod": "remainder"}
COMPARISONS = {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "nq": "!="}
SUMS = {"product": " * ", "sum": " + ", "difference": " - "}
KEYS = ("row", "column", "table", "axis4")
OTHERS = ("avg", "ifthen", "and", "or", "not", "min", "max", "pi", "todegrees", "toradians", "log2", "log10", "fraction",
          "interpolate1d", "switch", "property", "value", "table", "function")  # fmt: skip
MAX_CELLS = 200_000


def content(node: Element) -> list[Element]:
    """The children that are not documentation."""
    return [each for each in node if each.tag not in TEXTS]


def only(node: Element) -> Element:
    """The single operand of a function.

    Raises:
        AircraftError: There is none.
    """
    found = content(node)
    if not found:
        raise node.error("it is empty")
    return found[0]


def emit_function(code: Code, node: Element, prefix: str = "") -> str:
    """Emit a <function>, write its property if it has a name, and return its value."""
    result = expression(code, only(node))
    if node.get("name"):
        result = code.temporary(result) if not result.isidentifier() else result
        name = node.get("name")
        code.write(f"{prefix}{name}" if prefix else name, result)
    return result


def expression(code: Code, node: Element) -> str:
    """Return the expression of an operand.

    Raises:
        AircraftError: It is not supported, or has the wrong number of operands.
    """
    tag = SAME.get(node.tag, node.tag)
    match tag:
        case "property":
            if node.get("value"):
                code.initial.setdefault(node.text, node.attribute_number("value", 0.0))
            return code.value(node.text, node)
        case "value":
            return repr(node.number())
        case "table":
            return table(code, node)
        case "pi":
            return repr(math.pi)
        case "function":
            return emit_function(code, node)
    operands = [code.short(expression(code, each)) for each in content(node)]
    return code.short(_operation(node, tag, operands))


def _operation(node: Element, tag: str, a: list[str]) -> str:
    known = (*CALLS, *PAIRS, *COMPARISONS, *SUMS, *OTHERS)
    if tag not in known:
        raise node.error(f"function not supported{nearest_name(tag, known)}; {listed(known)}")
    wants = 2 if tag in PAIRS or tag in COMPARISONS else 3 if tag == "ifthen" else 1
    exact = tag in CALLS or tag in PAIRS or tag in COMPARISONS or tag == "ifthen"
    if len(a) < wants or (exact and len(a) != wants):
        raise node.error(f"it has {len(a)} operands and needs {wants}")
    if tag in SUMS:
        return f"({SUMS[tag].join(a)})"
    if tag in CALLS:
        return f"{CALLS[tag]}({a[0]})"
    if tag in PAIRS:
        return f"{PAIRS[tag]}({a[0]}, {a[1]})"
    if tag in COMPARISONS:
        return f"(1.0 if {a[0]} {COMPARISONS[tag]} {a[1]} else 0.0)"
    match tag:
        case "min" | "max":
            return a[0] if len(a) == 1 else f"{tag}({', '.join(a)})"
        case "ifthen":
            return f"({a[1]} if {a[0]} != 0.0 else {a[2]})"
        case "and" | "or":
            return f"(1.0 if {f' {tag} '.join(f'{each} != 0.0' for each in a)} else 0.0)"
        case "not":
            return f"(0.0 if {a[0]} != 0.0 else 1.0)"
        case "avg":
            return f"(({' + '.join(a)}) / {len(a)}.0)"
        case "todegrees":
            return f"({a[0]} * {180.0 / math.pi!r})"
        case "toradians":
            return f"({a[0]} * {math.pi / 180.0!r})"
        case "log2" | "log10":
            return f"(log({a[0]}) / {math.log(2.0 if tag == 'log2' else 10.0)!r})"
        case "fraction":
            return f"({a[0]} - whole({a[0]}))"
    raise node.error("function not supported")


# -- tables -------------------------------------------------------------------------------------------------------------------


def table(code: Code, node: Element, keys: Sequence[str] = ()) -> str:
    """Store a <table> and return the expression of its value.

    Args:
        code: Where it is stored.
        node: The table.
        keys: Expressions of row, column and further keys in place of its independent variables.

    Raises:
        AircraftError: It is not well formed.
    """
    keys = list(keys) or _keys(code, node)
    data = [each for each in node if each.tag == "tableData"]
    if not data or not 1 <= len(keys) <= 4:
        raise node.error("a table needs <tableData> and one to four keys")
    keys = [code.short(key) for key in keys]
    if len(keys) == 1:
        return table_of_pairs(code, _numbers(data[0]), keys[0], data[0])
    if len(keys) == 2:
        at, rows, columns = _grid(code, data[0])
        return f"table_2(tables, {at}, {rows}, {columns}, {keys[0]}, {keys[1]})"
    if len(keys) == 3:
        at, n = _layers(code, data)
        return f"table_3(tables, {at}, {n}, {', '.join(keys)})"
    outer = node.find_all("tableData")
    numbers: list[float] = [_break(each) for each in outer]
    for each in outer:
        numbers += _layers(code, each.find_all("tableData"))
    _rising(numbers[: len(outer)], node)
    return f"table_4(tables, {code.constant(numbers)}, {len(outer)}, {', '.join(keys)})"


def _keys(code: Code, node: Element) -> list[str]:
    found = {
        each.get("lookup") or KEYS[min(k, 3)]: each for k, each in enumerate(node.find_all("independentVar"))
    }
    unknown = [name for name in found if name not in KEYS]
    if unknown:
        raise node.error(f"lookup {clipped(unknown[0])!r} is not known; {listed(KEYS)}")
    return [code.value(found[name].text, found[name]) for name in KEYS if name in found]


def table_of_pairs(code: Code, numbers: list[float], key: str, node: Element) -> str:
    """Store key, value, key, value ... and return the expression of the value at a key.

    Raises:
        AircraftError: The numbers are not pairs with rising keys.
    """
    if len(numbers) < 2 or len(numbers) % 2:
        raise node.error(f"a table of pairs has an even count of numbers, not {len(numbers)}")
    keys, values = numbers[::2], numbers[1::2]
    _rising(keys, node)
    return f"table_1(tables, {code.constant(keys + values)}, {len(keys)}, {key})"


def _rising(keys: list[float], node: Element) -> None:
    if any(not a < b for a, b in pairwise(keys)):
        raise node.error("the keys of a table must rise")


def _break(node: Element) -> float:
    if not node.get("breakPoint"):
        raise node.error("it needs a breakPoint")
    return node.attribute_number("breakPoint", 0.0)


def _numbers(node: Element) -> list[float]:
    words = "".join(node.chunks).split()
    if len(words) > MAX_CELLS:
        raise node.error(f"the table has more than {MAX_CELLS} numbers")
    try:
        numbers = [float(word) for word in words]
    except ValueError as reason:
        raise node.error(str(reason)) from None
    if not all(map(math.isfinite, numbers)):
        raise node.error("a number is not finite")
    return numbers


def _grid(code: Code, node: Element) -> tuple[int, int, int]:
    """Store a 2-D table: a line of column keys, then lines of a row key and values. Returns place, rows and columns."""
    numbers = _numbers(node)
    first = next((line for line in "".join(node.chunks).splitlines() if line.strip()), "")
    columns = len(first.split())
    body = numbers[columns:]
    if not columns or not body or len(body) % (columns + 1):
        raise node.error(f"{len(body)} numbers do not fill lines of {columns + 1}")
    rows = [body[k : k + columns + 1] for k in range(0, len(body), columns + 1)]
    _rising(numbers[:columns], node)
    _rising([row[0] for row in rows], node)
    values = [value for row in rows for value in row[1:]]
    return code.constant([row[0] for row in rows] + numbers[:columns] + values), len(rows), columns


def _layers(code: Code, data: list[Element]) -> tuple[int, int]:
    """Store a 3-D table. Returns place and number of keys."""
    keys = [_break(each) for each in data]
    numbers = list(keys)
    for each in data:
        numbers += _grid(code, each)
    if not data:
        raise AircraftError("a table of three keys has no <tableData>")
    _rising(keys, data[0])
    return code.constant(numbers), len(data)


__all__ = ["content", "emit_function", "expression", "only", "table", "table_of_pairs"]
