"""Kernels with their arguments, as numbers in memory: compiled code calls them one after another without returning to Python.

To call a kernel from Python takes 0.3 microseconds and 0.1 more for each array. Arrays that stay the same for many calls are packed
once: each word of 64 bits is one value that the machine code takes.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from tussle.numeric.kernel import Code, Kernel, codes, mismatch
from tussle.numeric.processor import choose

ADDRESS, RESULTS = 0, 1
"""Words of the kernel's address and of its first result; the arguments follow the results."""
DATA = 4
"""Word of the address among those of an array: no owners, size, size of an item, address, lengths, strides."""


class Bound:
    """A kernel and its arguments.

    Attributes:
        entry: Address of the code to call with the address of the words, see `call_bound`.
        words: Address of the kernel, its results and its arguments, (k,).
        at: First word of each argument; a tuple of words for a tuple.

    Raises:
        TypeError: An argument does not match the kernel's signature.
    """

    def __init__(self, kernel: Kernel, *arguments: Any) -> None:
        self._kernel, self._arguments = kernel, arguments  # their memory is used
        words = [kernel.address, *([0] * len(kernel.results))]
        self.at: list[Any] = []
        for code, value in zip(kernel.arguments, arguments, strict=True):
            if wrong := mismatch(code, value):
                raise TypeError(f"kernel {kernel.name}: a bound argument is {wrong}")
            if isinstance(code, tuple):
                places = []
                for one, item in zip(code, value, strict=True):
                    places.append(len(words))
                    words += packed(one, item)
                self.at.append(tuple(places))
            else:
                self.at.append(len(words))
                words += packed(code, value)
        self.words = np.array(words, np.uint64).view(np.int64)
        self.entry = entry(kernel.arguments, kernel.results)


def packed(code: str, value: Any) -> list[int]:
    """The words of one argument, as unsigned numbers."""
    if code == "f8":
        return [int(np.float64(value).view(np.uint64))]
    if not isinstance(value, np.ndarray):
        return [int(value) % 2**64]
    return [0, 0, value.size, value.itemsize, value.ctypes.data, *value.shape, *value.strides]


@cache
def entry(signature: tuple[Code, ...], results: tuple[str, ...]) -> int:
    """Address of machine code that calls a kernel of a signature: int32 (unused, error, address of words).

    It is written in the compiler's intermediate language, which takes a few milliseconds.
    """
    from llvmlite import binding, ir
    from numba.core import types
    from numba.core.registry import cpu_target

    choose()
    table, context = codes(), cpu_target.target_context
    expected = [table[c] if isinstance(c, str) else types.Tuple([table[one] for one in c]) for c in signature]
    returned = [table[each] for each in results]
    result = types.none if not returned else returned[0] if len(returned) == 1 else types.Tuple(returned)
    kernel_type = context.call_conv.get_function_type(result, expected)
    own_type = context.call_conv.get_function_type(types.none, [types.int64])
    module = ir.Module()
    function = ir.Function(module, own_type, f"tussle_entry_{len(_engines)}")
    builder = ir.IRBuilder(function.append_basic_block())
    words = builder.inttoptr(function.args[2], ir.IntType(64).as_pointer())

    def place(k: int, type_: Any) -> Any:
        return builder.bitcast(builder.gep(words, [ir.IntType(64)(k)]), type_.as_pointer())

    first = RESULTS + len(results)
    arguments = [builder.load(place(first + k, type_)) for k, type_ in enumerate(kernel_type.args[2:])]
    code = builder.load(place(ADDRESS, kernel_type.as_pointer()))
    result_at = place(RESULTS, kernel_type.args[0].pointee)
    builder.ret(builder.call(code, [result_at, function.args[1], *arguments]))
    compiled = binding.parse_assembly(str(module))
    machine = binding.Target.from_default_triple().create_target_machine(opt=1)
    engine = binding.create_mcjit_compiler(compiled, machine)
    engine.finalize_object()
    _engines.append(engine)
    return int(engine.get_function_address(function.name))


_engines: list[Any] = []
"""They own the code of the entries."""
