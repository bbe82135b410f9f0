"""Compiles functions of one row into a kernel over all rows, which processes the rows in blocks."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.errors import DeclarationError
from tussle.numeric.address import caller
from tussle.numeric.fingerprint import package
from tussle.numeric.kernel import Device, device, kernel
from tussle.numeric.refusals import compiler_errors, label, refusal
from tussle.numeric.source import define, indented

BLOCK = 128
"""Rows per block: the values of a block fit into the first-level cache."""


@dataclass(frozen=True)
class Number:
    """A number of the row, identified by its key."""

    key: Hashable


@dataclass(frozen=True)
class Text:
    """Source text of a value that is the same for all rows ("dt", "substeps", a constant), or "_" for an unused result."""

    text: str


Item = Number | Text
Value = Item | tuple[Item, ...]


@dataclass(frozen=True)
class RowCall:
    """A call of a function of one row. It takes and returns numbers and tuples of numbers."""

    function: Callable[..., Any]
    arguments: tuple[Value, ...]
    results: tuple[Value, ...]

    def replaced(self, argument: Callable[[Item], Item], result: Callable[[Item], Item]) -> RowCall:
        """Return the call with replaced arguments and results."""

        def each(change: Callable[[Item], Item], values: Iterable[Value]) -> tuple[Value, ...]:
            return tuple(tuple(map(change, v)) if isinstance(v, tuple) else change(v) for v in values)

        return RowCall(self.function, each(argument, self.arguments), each(result, self.results))


@dataclass(frozen=True)
class BlockCall:
    """A call of a kernel for all rows of a block, between functions of one row.

    Attributes:
        kernel: Name of the argument of the row kernel that holds the address of the kernel, and names of those it is called with before
            the range of rows.
        codes: Codes of all arguments of the kernel.
        after: Source text of its arguments after the range of rows.
        arguments: Numbers that are stored to their columns before, since the kernel reads them there.
        state: Name of a 2-D array that the kernel writes.
        results: Its first rows, loaded afterwards.
    """

    kernel: tuple[str, ...]
    codes: str
    after: str
    arguments: tuple[Number, ...]
    state: str
    results: tuple[Number, ...]

    def replaced(self, argument: Callable[[Item], Item], result: Callable[[Item], Item]) -> BlockCall:
        """Return the call as it is."""
        return self


def numbers_of(values: Iterable[Value]) -> Iterator[Number]:
    """Yield the numbers of the row in arguments or results."""
    for value in values:
        if isinstance(value, tuple):
            yield from numbers_of(value)
        elif isinstance(value, Number):
            yield value


class RowKernel:
    """A kernel that makes a sequence of calls for each row, once per substep.

    All numbers of a block of rows are lines of one scratch array. LLVM can then prove that the lines do not overlap, and vectorizes
    over the rows.

    Args:
        calls: The calls.
        given: Values to load: name of an argument, a 2-D array or a tuple of columns (n,), -> its numbers.
        kept: Values to store, likewise. Numbers of one argument must be consecutive lines of the scratch array.
        head: Signature, arguments, and the source texts of the row range and of the number of substeps.

    Raises:
        DeclarationError: On the first call: a function cannot be compiled, or does not return the declared results.
    """

    def __init__(
        self,
        calls: Sequence[RowCall | BlockCall],
        given: Mapping[str, Sequence[Number]],
        kept: Mapping[str, Sequence[Number]],
        head: tuple[str, str, str, str],
    ) -> None:
        self.calls = calls
        signature, arguments, rows, times = head
        every = [*(each for part in (given, kept) for numbers in part.values() for each in numbers)]
        every += [each for call in calls for each in numbers_of((*call.arguments, *call.results))]
        self._line = {each: place for place, each in enumerate(dict.fromkeys(every))}
        functions = [call.function for call in calls if isinstance(call, RowCall)]
        scope: dict[str, Any] = {"np": np, "BLOCK": BLOCK}
        for place, call in enumerate(calls):
            if isinstance(call, BlockCall):
                scope[f"call_{place}"] = caller(call.codes)
            else:
                own = call.function
                scope[f"call_{place}"] = own if isinstance(own, Device) else device(own)
        lines = [f"def row_kernel({arguments}):", *self._lines(given, kept, rows, times)]
        # A kernel with a function of a plugin author belongs to the author's module, and so may run as Python.
        module = next((f for f in functions if package(f) != "tussle"), functions[0]).__module__
        name = "+".join(dict.fromkeys(f.__qualname__ for f in functions))
        self.kernel = kernel(signature)(define(lines, scope, module, name))

    def _text(self, value: Value) -> str:
        """Return the source text of an argument or result."""
        if isinstance(value, tuple):
            return f"({''.join(f'{self._text(each)}, ' for each in value)})"
        return value.text if isinstance(value, Text) else f"work[{self._line[value]}, l]"

    def _lines(self, given: Any, kept: Any, rows: str, times: str) -> Iterator[str]:
        yield f"    begin, end = {rows}"
        yield f"    work = np.empty(({len(self._line)}, BLOCK))"
        yield "    for start in range(begin, end, BLOCK):"
        yield "        m = min(BLOCK, end - start)"
        for name, numbers in given.items():
            yield from self._copies(name, numbers, "work[{line} + k, l] = column[start + l]")
        yield f"        for _ in range({times}):"
        for place, call in enumerate(self.calls):
            if isinstance(call, BlockCall):
                yield from self._block_call(place, call, kept)
                continue
            yield "            for l in range(m):"
            results = ", ".join(map(self._text, call.results))
            yield f"                {results} = call_{place}({', '.join(map(self._text, call.arguments))})"
        for name, numbers in kept.items():
            yield from self._copies(name, numbers, "column[start + l] = work[{line} + k, l]")

    def _block_call(self, place: int, call: BlockCall, kept: Mapping[str, Sequence[Number]]) -> Iterator[str]:
        for number in call.arguments:
            name, at = next(
                (name, list(every).index(number)) for name, every in kept.items() if number in every
            )
            yield f"            column = {name}[{at}]"
            yield "            for l in range(m):"
            yield f"                column[start + l] = {self._text(number)}"
        yield f"            call_{place}({', '.join(call.kernel)}, start, start + m, {call.after})"
        yield from indented(
            1, self._copies(call.state, call.results, "work[{line} + k, l] = column[start + l]")
        )

    def _copies(self, name: str, numbers: Sequence[Number], copy: str) -> Iterator[str]:
        if not numbers:
            return
        line = self._line[numbers[0]]
        assert [self._line[each] for each in numbers] == list(range(line, line + len(numbers)))
        yield f"        for k in range({len(numbers)}):"
        yield f"            column = {name}[k]"
        yield "            for l in range(m):"
        yield f"                {copy.format(line=line)}"

    def _functions(self) -> Iterator[RowCall]:
        return (call for call in self.calls if isinstance(call, RowCall))

    def __call__(self, *arguments: Any) -> None:
        try:
            self.kernel(*arguments)
        except Exception as error:
            self._explain(error)
            raise

    def _explain(self, error: Exception) -> None:
        for call in self._functions():
            function = getattr(call.function, "py_func", call.function)
            ones = [(1.0,) * len(each) if isinstance(each, tuple) else 1.0 for each in call.arguments]
            wanted = shape_of(call.results[0] if len(call.results) == 1 else call.results)
            try:
                found = shape_of(function(*ones))
            except Exception:  # noqa: BLE001 - it may reject ones
                found = wanted
            if found != wanted:
                raise DeclarationError(
                    f"{label(function)} returns {found}; its results are {wanted}"
                ) from error
        if isinstance(error, compiler_errors()):
            of_author = [each for each in self._functions() if package(each.function) != "tussle"]
            names = ", ".join(label(call.function) for call in of_author or self._functions())
            raise DeclarationError(f"{names} cannot be compiled: {refusal(error)}") from error


def shape_of(value: Any) -> str:
    """Describe the structure of a returned value for messages."""
    if not isinstance(value, tuple):
        return "a number"
    return f"({', '.join(shape_of(each) for each in value)})"


def read_first(calls: Iterable[RowCall | BlockCall]) -> list[Number]:
    """Return the numbers that a call reads before any call has written them."""
    found: dict[Number, None] = {}
    written: set[Number] = set()
    for call in calls:
        found |= dict.fromkeys(each for each in numbers_of(call.arguments) if each not in written)
        written.update(numbers_of(call.results))
    return list(found)
