"""Calls of kernels by their address: compiled once, a caller works for all kernels of one signature."""

from __future__ import annotations

from functools import cache
from typing import Any

from tussle.numeric.kernel import codes


@cache
def caller(signature: str) -> Any:
    """Return a function for compiled code: call(address, *arguments) calls the kernel at an address.

    Unboxing a first-class function object would cost microseconds per call, and a direct call would compile the kernel into its caller.

    Args:
        signature: Codes of the kernel's arguments, which has no results.
    """
    from numba import types
    from numba.core import cgutils
    from numba.extending import intrinsic

    expected = [codes()[code] for code in signature.split()]

    @intrinsic
    def call(typingctx, address, *arguments):  # type: ignore[no-untyped-def]
        """Call the kernel at an address."""

        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            kinds = signature.args[1].types
            parts = [
                context.cast(builder, builder.extract_value(args[1], k), kind, wanted)
                for k, (kind, wanted) in enumerate(zip(kinds, expected, strict=True))
            ]
            pointer_type = context.call_conv.get_function_type(types.none, expected)
            pointer = builder.inttoptr(args[0], pointer_type.as_pointer())
            status, _ = context.call_conv.call_function(builder, pointer, types.none, expected, parts)
            with cgutils.if_unlikely(builder, status.is_error):
                context.call_conv.return_status_propagate(builder, status)
            return context.get_dummy_value()

        return types.none(types.uint64, types.StarArgTuple(arguments)), generate

    return call
