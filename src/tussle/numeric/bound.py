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

    Args:
        kernel: The kernel.
        *arguments: Its arguments.
        is_checked: Whether it has been called with them.

    Attributes:
        entry: Address of the code to call with the address of the words, see `call_bound`.
        words: Address of the kernel, its results and its arguments, (k,).
        at: First word of each argument; a tuple of words for a tuple.

    Raises:
        TypeError: An argument does not match the kernel's signature.
    """

    def __init__(self, kernel: Kernel, *arguments: Any, is_checked: bool = False) -> None:
        self._kernel, self._arguments = kernel, arguments  # their memory is used
        words = [kernel.address, *([0] * len(kernel.results))]
        self.at: list[Any] = []
        for code, value in zip(kernel.arguments, arguments, strict=True):
            if not is_checked and (wrong := mismatch(code, value)):
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

    It is written in the compiler's intermediate language, as text, and not optimized, which takes one or two milliseconds.
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
    found, error, *arguments = kernel_type.args
    word = ir.IntType(64)
    kinds = [word, *(word if isinstance(each, ir.PointerType) else each for each in arguments)]
    places = [ADDRESS, *range(RESULTS + len(results), RESULTS + len(results) + len(arguments))]
    own_type = ir.FunctionType(ir.IntType(32), [found, error, *kinds[1:]])
    name = f"tussle_entry_{len(_engines)}"
    lines = [f"define i32 @{name}({word} %unused, {error} %error, {word} %words) {{"]
    for place, kind in zip(places, kinds, strict=True):
        lines += [
            f"%at{place} = add {word} %words, {8 * place}",
            f"%to{place} = inttoptr {word} %at{place} to {kind.as_pointer()}",
            f"%word{place} = load {kind}, {kind.as_pointer()} %to{place}",
        ]
    given = ", ".join(f"{kind} %word{place}" for place, kind in zip(places[1:], kinds[1:], strict=True))
    lines += [
        f"%code = inttoptr {word} %word{ADDRESS} to {own_type.as_pointer()}",
        f"%first = add {word} %words, {8 * RESULTS}",
        f"%found = inttoptr {word} %first to {found}",
        f"%status = call i32 %code({', '.join([f'{found} %found', f'{error} %error', given])})",
        "ret i32 %status",
        "}",
    ]
    compiled = binding.parse_assembly("\n".join(lines))
    machine = binding.Target.from_default_triple().create_target_machine(opt=0)
    engine = binding.create_mcjit_compiler(compiled, machine)
    engine.finalize_object()
    _engines.append(engine)
    return int(engine.get_function_address(name))


_engines: list[Any] = []
"""They own the code of the entries."""
