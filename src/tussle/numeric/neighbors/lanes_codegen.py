"""Numba types, typing rules and LLVM code generation of the functions on lanes."""

# Numba has no type annotations.
# mypy: disable-error-code="no-untyped-call,attr-defined"

from __future__ import annotations

import operator
from collections import defaultdict
from collections.abc import Callable
from functools import cache
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel import models, register_default
from numba.core.registry import cpu_target
from numba.extending import lower_builtin

from tussle.numeric.neighbors.lane_count import LANES, RSQRT_MAGIC
from tussle.numeric.operator_types import rule

_DOUBLES = ir.VectorType(ir.DoubleType(), LANES)
_LONGS = ir.VectorType(ir.IntType(64), LANES)
_BITS = ir.VectorType(ir.IntType(1), LANES)


class LanesType(types.Type):
    """Numba type of eight doubles."""

    def __init__(self) -> None:
        super().__init__(name="Lanes8")


class MaskType(types.Type):
    """Numba type of eight booleans."""

    def __init__(self) -> None:
        super().__init__(name="Mask8")


LANES_TYPE = LanesType()
MASK_TYPE = MaskType()


@register_default(LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, numba_type: Any) -> None:
        super().__init__(manager, numba_type, _DOUBLES)


@register_default(MaskType)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, numba_type: Any) -> None:
        super().__init__(manager, numba_type, _BITS)


_BY_NAME: dict[str, list[tuple[Any, tuple[Any, ...], Any]]] = defaultdict(list)
"""Function name -> result type, argument types and code generator of each overload."""


@cache
def type_of(function: Callable[..., Any]) -> Any:
    """Register the code generators of a function on lanes and return its Numba type."""
    for result, arguments, generate in _BY_NAME[function.__name__]:
        _implement(function, result, *arguments)(generate)
    cpu_target.typing_context.refresh()
    cpu_target.target_context.refresh()
    return cpu_target.typing_context.resolve_value_type(function)


def _implement(function: Any, result: Any, *arguments: Any) -> Callable[[Any], Any]:
    """Decorator that registers a code generator of `function(*arguments) -> result`; functions given by name register on first use."""

    def register(generate: Any) -> Any:
        if isinstance(function, str):
            _BY_NAME[function].append((result, arguments, generate))
            return generate

        rule(function).ways.append((result, arguments))
        lower_builtin(function, *arguments)(generate)
        return generate

    return register


def _splat(builder: Any, value: Any, lanes: Any = _DOUBLES) -> Any:
    zero = ir.Constant(ir.IntType(32), 0)
    one = builder.insert_element(ir.Constant(lanes, ir.Undefined), value, zero)
    places = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(one, ir.Constant(lanes, ir.Undefined), places)


def _as_lanes(builder: Any, value: Any) -> Any:
    return value if value.type == _DOUBLES else _splat(builder, value)


def _pointer(context: Any, builder: Any, array_type: Any, array: Any, start: Any) -> Any:
    data = context.make_array(array_type)(context, builder, value=array).data
    return builder.bitcast(builder.gep(data, [start]), _DOUBLES.as_pointer())


def _call_llvm(builder: Any, name: str, result: Any, arguments: list[Any]) -> Any:
    function_type = ir.FunctionType(result, [a.type for a in arguments])
    return builder.call(cgutils.get_or_insert_function(builder.module, function_type, name), arguments)


def _register_arithmetic() -> None:
    for function, name in (
        (operator.add, "fadd"),
        (operator.sub, "fsub"),
        (operator.mul, "fmul"),
        (operator.truediv, "fdiv"),
    ):
        inplace = getattr(operator, "i" + function.__name__)
        for left, right in (
            (LANES_TYPE, LANES_TYPE),
            (LANES_TYPE, types.float64),
            (types.float64, LANES_TYPE),
        ):

            def generate(context: Any, builder: Any, sig: Any, args: Any, name: str = name) -> Any:
                return getattr(builder, name)(_as_lanes(builder, args[0]), _as_lanes(builder, args[1]))

            _implement(function, LANES_TYPE, left, right)(generate)
            _implement(inplace, LANES_TYPE, left, right)(generate)


def _register_comparisons() -> None:
    for function, sign in (
        (operator.lt, "<"),
        (operator.le, "<="),
        (operator.gt, ">"),
        (operator.ge, ">="),
        (operator.eq, "=="),
        (operator.ne, "!="),
    ):
        for right in (LANES_TYPE, types.float64):

            def generate(context: Any, builder: Any, sig: Any, args: Any, sign: str = sign) -> Any:
                compare = builder.fcmp_unordered if sign == "!=" else builder.fcmp_ordered
                return compare(sign, args[0], _as_lanes(builder, args[1]))

            _implement(function, MASK_TYPE, LANES_TYPE, right)(generate)


_register_arithmetic()
_register_comparisons()


@_implement(operator.and_, MASK_TYPE, MASK_TYPE, MASK_TYPE)
def _mask_and(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.and_(*args)


@_implement(operator.or_, MASK_TYPE, MASK_TYPE, MASK_TYPE)
def _mask_or(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.or_(*args)


@_implement(operator.invert, MASK_TYPE, MASK_TYPE)
def _mask_invert(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.not_(args[0])


@_implement(operator.neg, LANES_TYPE, LANES_TYPE)
def _negative(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.fneg(args[0])


@_implement("truth", MASK_TYPE, LANES_TYPE)
def _generate_truth(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.fcmp_unordered("!=", args[0], ir.Constant(_DOUBLES, [0.0] * LANES))


@_implement("number", LANES_TYPE, MASK_TYPE)
def _generate_number(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    one, zero = ir.Constant(_DOUBLES, [1.0] * LANES), ir.Constant(_DOUBLES, [0.0] * LANES)
    return builder.select(args[0], one, zero)


@_implement("joined", LANES_TYPE, *[types.float64] * LANES)
def _generate_joined(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    lanes = ir.Constant(_DOUBLES, ir.Undefined)
    for k, value in enumerate(args):
        lanes = builder.insert_element(lanes, value, ir.Constant(ir.IntType(32), k))
    return lanes


@_implement("lanes_abs", LANES_TYPE, LANES_TYPE)
def _generate_abs(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return _call_llvm(builder, f"llvm.fabs.v{LANES}f64", _DOUBLES, [args[0]])


@_implement("splat", LANES_TYPE, types.float64)
def _generate_splat(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return _splat(builder, args[0])


@_implement("load", LANES_TYPE, types.Array, types.int64)
def _generate_load(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.load(_pointer(context, builder, sig.args[0], *args), align=8)


@_implement("store", types.void, types.Array, types.int64, LANES_TYPE)
def _generate_store(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    builder.store(args[2], _pointer(context, builder, sig.args[0], args[0], args[1]), align=8)
    return context.get_dummy_value()


def _first_lanes(builder: Any, count: Any) -> Any:
    """Mask of the lanes below `count`."""
    numbers = ir.Constant(_LONGS, list(range(LANES)))
    return builder.icmp_signed("<", numbers, _splat(builder, count, _LONGS))


@_implement("load_some", LANES_TYPE, types.Array, types.int64, types.int64)
def _generate_load_some(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    pointer = _pointer(context, builder, sig.args[0], args[0], args[1])
    align = ir.Constant(ir.IntType(32), 8)
    rest = ir.Constant(_DOUBLES, [0.0] * LANES)
    arguments = [pointer, align, _first_lanes(builder, args[2]), rest]
    return _call_llvm(builder, f"llvm.masked.load.v{LANES}f64.p0", _DOUBLES, arguments)


@_implement("store_some", types.void, types.Array, types.int64, types.int64, LANES_TYPE)
def _generate_store_some(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    pointer = _pointer(context, builder, sig.args[0], args[0], args[1])
    align = ir.Constant(ir.IntType(32), 8)
    arguments = [args[3], pointer, align, _first_lanes(builder, args[2])]
    _call_llvm(builder, f"llvm.masked.store.v{LANES}f64.p0", ir.VoidType(), arguments)
    return context.get_dummy_value()


def _generate_choose(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.select(args[0], _as_lanes(builder, args[1]), _as_lanes(builder, args[2]))


for _yes, _no in (
    (LANES_TYPE, LANES_TYPE),
    (LANES_TYPE, types.float64),
    (types.float64, LANES_TYPE),
    (types.float64, types.float64),
):
    _implement("choose", LANES_TYPE, MASK_TYPE, _yes, _no)(_generate_choose)


@_implement("choose", MASK_TYPE, MASK_TYPE, MASK_TYPE, MASK_TYPE)
def _choose_mask(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.select(*args)


@_implement("bits", types.int64, MASK_TYPE)
def _generate_bits(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.zext(builder.bitcast(args[0], ir.IntType(LANES)), ir.IntType(64))


@_implement("unlike", MASK_TYPE, LANES_TYPE, types.int64)
def _generate_unlike(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.icmp_signed("!=", builder.bitcast(args[0], _LONGS), _splat(builder, args[1], _LONGS))


@_implement("lane_of", types.float64, LANES_TYPE, types.int64)
def _generate_lane_of(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.extract_element(*args)


@_implement("below", MASK_TYPE, types.int64)
def _generate_below(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return _first_lanes(builder, args[0])


@_implement("lowest", types.int64, types.int64)
def _generate_lowest(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return _call_llvm(builder, "llvm.cttz.i64", ir.IntType(64), [args[0], ir.Constant(ir.IntType(1), 1)])


@_implement("ones", types.int64, types.int64)
def _generate_ones(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return _call_llvm(builder, "llvm.ctpop.i64", ir.IntType(64), [args[0]])


@_implement("pack", types.int64, types.Array, types.int64, types.int64, types.int64)
def _generate_pack(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    array, n, start, hits = args
    rows = cgutils.global_constant(
        builder, "packed_lanes", ir.Constant(ir.ArrayType(ir.IntType(64), 256), _packed())
    )
    zero = ir.Constant(ir.IntType(64), 0)
    row = builder.bitcast(builder.load(builder.gep(rows, [zero, hits])), ir.VectorType(ir.IntType(8), LANES))
    places = builder.add(builder.zext(row, _LONGS), _splat(builder, start, _LONGS))
    pointer = _pointer(context, builder, sig.args[0], array, n)
    builder.store(places, builder.bitcast(pointer, _LONGS.as_pointer()), align=8)
    return builder.add(n, _call_llvm(builder, "llvm.ctpop.i64", ir.IntType(64), [hits]))


def _packed() -> list[int]:
    """For each mask of eight bits, the numbers of the bits that are set, one in each byte from the lowest on."""
    return [int.from_bytes(bytes(k for k in range(8) if mask >> k & 1), "little") for mask in range(256)]


@_implement("lanes_sqrt", LANES_TYPE, LANES_TYPE)
def _generate_sqrt(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return _call_llvm(builder, f"llvm.sqrt.v{LANES}f64", _DOUBLES, [args[0]])


@_implement("tagged", LANES_TYPE, LANES_TYPE, types.int64, types.int64)
def _generate_tagged(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    lanes, tag, n_bits = args
    mask = builder.shl(ir.Constant(ir.IntType(64), -1), n_bits)
    kept = builder.and_(builder.bitcast(lanes, _LONGS), _splat(builder, mask, _LONGS))
    return builder.bitcast(builder.or_(kept, _splat(builder, tag, _LONGS)), _DOUBLES)


@_implement("rsqrt_guess", LANES_TYPE, LANES_TYPE)
def _generate_guess(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    magic = ir.Constant(_LONGS, [RSQRT_MAGIC] * LANES)
    half = builder.lshr(builder.bitcast(args[0], _LONGS), ir.Constant(_LONGS, [1] * LANES))
    return builder.bitcast(builder.sub(magic, half), _DOUBLES)
