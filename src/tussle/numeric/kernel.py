"""Kernel decorators: one explicit signature, strict IEEE arithmetic, compiled on the first call, cached on disk by content.

Signature codes: f8 i8 b1 u8 are numbers; F I B U S are read-only 1-D contiguous arrays of float64, int64, bool, uint64, float32, and
Fw Iw Bw Uw Sw writable ones; F2 F2w ... are 2-D C-contiguous. (F F I) is one argument, a tuple, for arrays that belong together; it costs
0.03 us per array more than separate arguments. Results follow "->"; several results are returned as a tuple.
"""

from __future__ import annotations

import gc
import hashlib
import re
import sys
import threading
import types
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, cached_property, update_wrapper
from typing import Any, ClassVar, Self
from weakref import WeakKeyDictionary, WeakSet

import numpy as np

from tussle.errors import DeclarationError
from tussle.numeric import processor, store
from tussle.numeric.device_compiler import device_compiler, set_environments, share_constants
from tussle.numeric.fingerprint import Fingerprint, of_author, package
from tussle.numeric.operator_types import type_numbers
from tussle.numeric.refusals import compiler_errors, label, misread, refusal
from tussle.numeric.source import GENERATED

Code = str | tuple[str, ...]
FORMAT = 4  # version of the file format, part of every key
LETTERS = {"F": np.float64, "I": np.int64, "B": np.bool_, "U": np.uint64, "S": np.float32}
NUMBERS: dict[str, tuple[type, ...]] = {
    "f8": (float, int, np.floating, np.integer),
    "i8": (int, np.integer),
    "u8": (int, np.integer),
    "b1": (bool, np.bool_),
}


@dataclass
class Stats:
    """Numbers of kernels that this process has compiled and loaded from disk.

    Attributes:
        compiled: Number of kernels compiled.
        loaded: Number of kernels loaded from disk.
        ready: Number of kernels whose machine code has been made available, whether they still exist or not.
        interpreted: Number of calls of kernels that ran as Python.
        on_compile: Called with a kernel's name before it is compiled, e.g. to show progress.
    """

    compiled: int = 0
    loaded: int = 0
    ready: int = 0
    interpreted: int = 0
    on_compile: Callable[[str], None] | None = None


WORD = re.compile(r"[^\s()]+")
stats = Stats()
ready: WeakSet[Kernel] = WeakSet()
"""Kernels whose machine code exists."""
_of_authors: WeakKeyDictionary[Device, str] = WeakKeyDictionary()
"""Kernels outside tussle, and devices, whose machine code Python calls -> what it depends on."""
_lock = threading.RLock()


@cache
def codes() -> dict[str, Any]:
    """Signature code -> Numba type."""
    from numba import boolean, float32, float64, int64, uint64
    from numba.core.types import Array

    table: dict[str, Any] = {"f8": float64, "i8": int64, "b1": boolean, "u8": uint64}
    for letter, dtype in {"F": float64, "I": int64, "B": boolean, "U": uint64, "S": float32}.items():
        for ndim, digit in ((1, ""), (2, "2")):
            table[letter + digit] = Array(dtype, ndim, "C", readonly=True)
            table[letter + digit + "w"] = Array(dtype, ndim, "C")
    return table


@cache
def environment() -> str:
    """Return everything that machine code depends on besides its source: versions, processor, compiler settings."""
    import llvmlite
    import numba
    import numba.core.config

    names = ("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "BOUNDSCHECK", "DEBUGINFO_DEFAULT")
    settings = [str(getattr(numba.core.config, name)) for name in names]
    versions = [sys.implementation.cache_tag, numba.__version__, llvmlite.__version__, np.__version__]
    return repr((FORMAT, versions, processor.target(), settings))


@cache
def built() -> dict[tuple[str, str], tuple[Any, Any]]:
    """(name, key) -> dispatcher and compile result of this process, shared by kernels of the same content.

    The compiler never frees machine code. Without sharing, kernels that are created repeatedly, such as the derivative of a motion
    model in each simulation, would leak memory.
    """
    return {}


def renamed(function: Any, key: str) -> types.FunctionType:
    """Copy a function under a qualified name that includes the key.

    Symbols in machine code consist of the qualified name and a counter of the process. Without the key, functions of the same name
    from cache files of different processes could have the same symbol.
    """
    copy = types.FunctionType(
        function.__code__,
        function.__globals__,
        function.__name__,
        function.__defaults__,
        function.__closure__,
    )
    copy.__kwdefaults__ = function.__kwdefaults__
    copy.__module__ = (
        function.__module__ or "generated"
    )  # without a module, Numba would store the globals in the file
    copy.__qualname__ = f"{function.__qualname__}_{key}"
    return copy


def is_interpreted(function: Callable[..., Any]) -> bool:
    """Return True if NUMBA_DISABLE_JIT is set and the function runs as Python, for a debugger. Functions of tussle stay compiled."""
    if package(function) == "tussle":
        return False
    from numba.core import config

    return bool(vars(config)["DISABLE_JIT"])


@contextmanager
def compiling() -> Iterator[None]:
    """Let Numba compile regardless of NUMBA_DISABLE_JIT."""
    from numba.core import config

    settings = vars(config)
    setting, settings["DISABLE_JIT"] = settings["DISABLE_JIT"], 0
    try:
        yield
    finally:
        settings["DISABLE_JIT"] = setting


def jitted(function: Callable[..., Any], **options: Any) -> Any:
    """Numba's dispatcher of a function."""
    from numba import njit

    processor.choose()
    with compiling():
        return njit(**options)(function)


@contextmanager
def collecting_later() -> Iterator[None]:
    """Disable garbage collection. The compiler creates almost no garbage, and collection takes a tenth of the compile time."""
    is_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if is_enabled:
            gc.enable()


class Device:
    """A small function that kernels call; compiled into its callers, without a cache file of its own.

    Args:
        function: The Python function, available as `py_func`.
        options: Compiler options that differ from those of the class; None leaves one out.
    """

    options: ClassVar[dict[str, Any]] = {"error_model": "numpy", "forceinline": True}
    __name__: str
    __qualname__: str

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        self.py_func = function
        if options:
            chosen = {**self.options, **options}
            self.options = {name: value for name, value in chosen.items() if value is not None}  # type: ignore[misc]
        self._dispatcher: Any = None
        self._for_python: Any = None
        self._digest = ""
        update_wrapper(self, function)

    def refresh(self) -> None:
        """Discard the compiled code if anything it depends on has changed, e.g. a global redefined in an interactive shell."""
        if self._dispatcher is not None and Fingerprint(self.py_func).digest != self._digest:
            self._dispatcher = self._for_python = None

    def _note(self) -> None:
        """Note what the code of an author depends on, for `refresh_kernels`."""
        if package(self.py_func) != "tussle" and self.py_func.__code__.co_filename != GENERATED:
            _of_authors[self] = of_author(self.py_func)

    def discard(self) -> None:
        """Forget the machine code."""
        self._dispatcher = self._for_python = None

    @property
    def dispatcher(self) -> Any:
        """Numba's dispatcher for kernels that call the function, created on first access. Python cannot call it."""
        if self._dispatcher is None:
            self._digest = Fingerprint(self.py_func).digest
            self._dispatcher = jitted(
                renamed(self.py_func, self._digest),
                no_cpython_wrapper=True,
                no_cfunc_wrapper=True,
                pipeline_class=device_compiler(),
                **self.options,
            )
            if self.options.get("forceinline"):  # a larger function may be the faster for a constant
                share_constants(self._dispatcher)
        return self._dispatcher

    @property
    def _numba_type_(self) -> Any:
        # Numba reads this attribute of unknown objects: in compiled code the device is its dispatcher.
        return self.dispatcher._numba_type_

    def __call__(self, *args: Any, **named: Any) -> Any:
        if is_interpreted(self.py_func):
            return self.py_func(*args, **named)
        if self._for_python is None:
            self._for_python = jitted(renamed(self.py_func, Fingerprint(self.py_func).digest), **self.options)
            self._note()
        with compiling():  # argument types may be new
            return self._for_python(*args, **named)


def device(function: Callable[..., Any]) -> Any:
    """Decorator for a small function that kernels call; it is compiled into its callers."""
    return Device(function)


def lean_device(function: Callable[..., Any]) -> Any:
    """Like `device`, for functions that create no arrays: compiled without counting references to those that they get.

    Where such a function has branches, the compiler does not remove the counting: two atomic operations for each array and call.
    """
    return Device(function, _nrt=False)


def lean_routine(function: Callable[..., Any]) -> Any:
    """Like `lean_device`, for larger functions: compiled once for each kernel, not into each caller, which takes less time."""
    return Device(function, forceinline=None, _nrt=False)


class Kernel(Device):
    """A function over arrays with one explicit signature, compiled or loaded from disk on the first call.

    Args:
        function: The Python function, available as `py_func`.
        signature: Codes of the arguments, then "->" and codes of the results if there are any.

    Raises:
        ValueError: The signature has an unknown code, or its number of arguments differs from the function's.
    """

    options: ClassVar[dict[str, Any]] = {"error_model": "numpy"}

    def __new__(cls, *args: Any) -> Self:
        # Each kernel gets its own class: `__call__` is looked up on the class and is replaced by Numba's dispatcher once that
        # exists, so that a call costs little more than a call of the dispatcher.
        return super().__new__(type("Kernel", (cls,), {"__slots__": ()}))

    def __init__(self, function: Callable[..., Any], signature: str) -> None:
        super().__init__(function)
        arguments, arrow, results = signature.partition("->")
        self.signature = signature
        self.arguments = grouped(arguments)
        self.results = tuple(results.split())
        known = set(NUMBERS) | {letter + rest for letter in LETTERS for rest in ("", "w", "2", "2w")}
        wrong = [code for code in (*WORD.findall(arguments), *self.results) if code not in known]
        if wrong or (arrow and not self.results):
            raise ValueError(
                f"kernel {self.name}: unknown code {wrong} in signature {signature!r}; known codes: {', '.join(sorted(known))}"
            )
        n_arguments = self.py_func.__code__.co_argcount
        if n_arguments != len(self.arguments):
            raise ValueError(
                f"kernel {self.name} has {n_arguments} arguments, but its signature {signature!r} has {len(self.arguments)}"
            )
        self._compiled: Any = None
        self._main: Any = None

    @property
    def name(self) -> str:
        """Module and qualified name."""
        return f"{self.__module__ or 'generated'}.{self.__qualname__}"

    @property
    def types(self) -> Any:
        """The signature in Numba's types."""
        from numba.core.types import Tuple, void

        table = codes()
        results = [table[code] for code in self.results]
        returned = void if not results else results[0] if len(results) == 1 else Tuple(results)
        arguments = [
            table[code] if isinstance(code, str) else Tuple([table[each] for each in code])
            for code in self.arguments
        ]
        return returned(*arguments)

    @property
    def compiled(self) -> Any:
        """Numba's compile result, loaded or compiled on first access."""
        if self._compiled is None:
            self._build()
        return self._compiled

    @cached_property
    def address(self) -> int:
        """Address of the machine code, for Numba's calling convention."""
        result = self.compiled
        return int(result.library.get_pointer_to_function(result.fndesc.llvm_func_name))

    def key(self) -> str:
        """Hash of everything the machine code depends on."""
        return self._key(Fingerprint(self.py_func))

    def _key(self, reached: Fingerprint) -> str:
        text = repr(
            (reached.digest, self.arguments, self.results, sorted(self.options.items()), environment())
        )
        return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()

    def assembly(self) -> str:
        """Assembly text of the machine code that runs, from its optimized intermediate code."""
        with _lock:
            library = self.compiled.library
            return str(library.codegen._tm.emit_assembly(library._get_module_for_linking()))

    def _new_dispatcher(self, key: str) -> Any:
        return jitted(renamed(self.py_func, key), nogil=True, no_cfunc_wrapper=True, **self.options)

    def _build(self) -> None:
        from numba.core.compiler_lock import global_compiler_lock

        with _lock, global_compiler_lock:
            if self._compiled is not None:  # by another thread
                return
            reached = Fingerprint(self.py_func)
            key = self._key(reached)
            main, result = built().get((self.name, key)) or self._made(key, reached)
            if not reached.opaque:
                built()[self.name, key] = main, result
            self._main = main
            self._compiled = result
            self._note()
            self.call_by(main)
            ready.add(self)
            stats.ready += 1

    def discard(self) -> None:
        """Forget the machine code: the next call makes it anew."""
        with _lock:
            super().discard()
            self._compiled = self._main = None
            self.__dict__.pop("address", None)
            del type(self).__call__
            ready.discard(self)

    @property
    def machine_code(self) -> Callable[..., Any]:
        """The function that Python calls for the machine code, which exists."""
        return self._main  # type: ignore[no-any-return]

    def call_by(self, function: Callable[..., Any] | None) -> None:
        """Let calls from Python run a function; by default the machine code."""
        type(self).__call__ = staticmethod(function or self._main)  # type: ignore[method-assign]

    def _made(self, key: str, reached: Fingerprint) -> tuple[Any, Any]:
        """Load or compile. Returns Numba's dispatcher and its compile result."""
        main = self._new_dispatcher(key)
        result = None if reached.opaque else load(self.name, key, main.targetctx)
        if result is None and not reached.opaque:
            with store.compile_lock(self.name, key):
                result = load(self.name, key, main.targetctx)
                if result is None:
                    save(self.name, key, self._compile(main, reached))
        elif result is None:
            self._compile(main, reached)
        if result is not None:
            main.add_overload(result)
            stats.loaded += 1
        main._compile_for_args = self._accept
        return main, next(iter(main.overloads.values()))

    def _compile(self, main: Any, reached: Fingerprint) -> Any:
        """Compile with a dispatcher. Returns Numba's compile result."""
        if stats.on_compile is not None:
            stats.on_compile(self.name)
        for holder in reached.holders:
            if isinstance(holder, Device):
                holder.refresh()
        type_numbers()
        try:
            with compiling(), collecting_later():
                main.compile(self.types)
        except compiler_errors() as error:
            authors = [self.py_func]
            if self.py_func.__code__.co_filename == GENERATED:
                authors = vars(self.py_func).get("authors", [])
                if not authors:  # who has generated it knows of whom
                    raise
            raise DeclarationError(
                f"{', '.join(map(label, authors))} cannot be compiled: {refusal(error)}"
            ) from error
        stats.compiled += 1
        self._check(main, reached)
        result = next(iter(main.overloads.values()))
        set_environments(result.library)
        return result

    def _check(self, main: Any, reached: Fingerprint) -> None:
        """Refuse functions of authors that the compiler reads otherwise than Python."""
        devices = [each for each in reached.holders if isinstance(each, Device)]
        for each, dispatcher in [(self, main), *((each, each.dispatcher) for each in devices)]:
            if package(each.py_func) == "tussle" or each.py_func.__code__.co_filename == GENERATED:
                continue
            for result in dispatcher.overloads.values():
                if result.type_annotation is not None and (why := misread(result.type_annotation)):
                    raise DeclarationError(f"{label(each.py_func)} cannot be compiled: {why}")

    def _accept(self, *args: Any) -> Any:
        """Called by the dispatcher for new argument types: register them if they match the signature. Never compiles."""
        from numba import typeof

        names = self.py_func.__code__.co_varnames
        for name, code, value in zip(names, self.arguments, args, strict=False):
            wrong = mismatch(code, value)
            if wrong:
                raise TypeError(
                    f"kernel {self.name}: argument {name!r} must be {expected(code)}, not {wrong}"
                )
        self._main._insert([typeof(value)._code for value in args], self._compiled.entry_point, False)
        return self._compiled.entry_point

    def __call__(self, *args: Any, **named: Any) -> Any:
        if is_interpreted(self.py_func):
            stats.interpreted += 1
            return self.py_func(*args, **named)
        self._build()
        return self._main(*args, **named)

    def __reduce__(self) -> str:
        return self.__qualname__  # pickled by name, like a function


def grouped(arguments: str) -> tuple[Code, ...]:
    """Split the argument part of a signature into codes; a group in parentheses becomes a tuple."""
    return tuple(
        code or tuple(group.split()) for group, code in re.findall(r"\(([^()]*)\)|([^\s()]+)", arguments)
    )


def refresh_kernels() -> None:
    """Discard machine code of functions outside tussle if what they reach has changed, e.g. a global redefined in an interactive shell."""
    for each, known in list(_of_authors.items()):
        if of_author(each.py_func) != known:
            del _of_authors[each]
            each.discard()


def kernel(signature: str) -> Callable[[Callable[..., Any]], Kernel]:
    """Decorator that compiles a function for one explicit signature on its first call and caches it on disk."""
    return lambda function: Kernel(function, signature)


def expected(code: Code) -> str:
    """Description of a code for error messages."""
    if isinstance(code, tuple):
        return f"a tuple of {len(code)}: {', '.join(expected(each) for each in code)}"
    if code in NUMBERS:
        return {"f8": "a number", "i8": "an integer", "u8": "an unsigned integer", "b1": "a bool"}[code]
    ndim = "2-D C-contiguous" if "2" in code else "1-D contiguous"
    return f"a {'writable ' if code.endswith('w') else ''}{ndim} {np.dtype(LETTERS[code[0]])} array"


def mismatch(code: Code, value: Any) -> str:
    """Description of a value that does not match a code; "" if it matches."""
    if isinstance(code, tuple):
        if not isinstance(value, tuple) or len(value) != len(code):
            return f"{type(value).__name__} of {len(value) if isinstance(value, tuple) else 1}"
        wrong = [mismatch(each, item) for each, item in zip(code, value, strict=True)]
        return next((f"{text} at place {place}" for place, text in enumerate(wrong) if text), "")
    if code in NUMBERS:
        return "" if isinstance(value, NUMBERS[code]) else f"{type(value).__name__} {value!r:.60}"
    if not isinstance(value, np.ndarray):
        return f"{type(value).__name__} {value!r:.60}"
    flags = value.flags
    good = (
        value.dtype == LETTERS[code[0]]
        and value.ndim == (2 if "2" in code else 1)
        and flags.c_contiguous
        and flags.aligned
    )
    if good and (flags.writeable or not code.endswith("w")):
        return ""
    layout = "" if flags.c_contiguous else "non-contiguous "
    return f"a {'' if flags.writeable else 'read-only '}{layout}{value.dtype} array of shape {value.shape}"


def save(name: str, key: str, result: Any) -> None:
    """Save a compile result to disk, unless it contains addresses of this process."""
    from numba.core.serialize import dumps

    if result.library.has_dynamic_globals or result.lifted:
        return
    library, description, main, signature, _, _, _, reload_init, referenced = result._reduce()
    if reload_init:
        return
    # Numba would store the module name and import the module on loading. A generated or user module may not be importable, and
    # its globals are only needed in object mode.
    environments = [(each.consts, each.env_name) for each in (main, *referenced)]
    module = result.library._final_module
    symbols = [
        each.name
        for each in (*module.functions, *module.global_variables)
        if each.is_declaration and not each.name.startswith("llvm.")
    ]
    store.save(name, key, dumps((library, description, signature, environments, symbols)))


def load(name: str, key: str, target_context: Any) -> Any:
    """Load a compile result from disk; None if there is none."""
    from llvmlite import binding
    from numba.core.compiler import CompileResult
    from numba.core.runtime.nrt import rtsys

    content = store.load(name, key)
    if content is None:
        return None
    rtsys.initialize(target_context)
    library, description, signature, environments, symbols = content
    if not all(map(binding.address_of_symbol, symbols)):
        # Numba's own functions on arrays, such as those of linear algebra. To load all of Numba takes half a second.
        target_context.refresh()
    main, *referenced = [restored_environment(consts, env_name) for consts, env_name in environments]
    parts = (library, description, main, signature, False, (), "", (), tuple(referenced))
    return CompileResult._rebuild(target_context, *parts)


def restored_environment(consts: list[Any], name: str) -> Any:
    """Numba environment with the constants of loaded machine code."""
    from numba.core.environment import Environment, lookup_environment

    existing = lookup_environment(name)
    if existing is not None:
        return existing
    restored = Environment({})
    restored.consts[:] = consts
    restored.env_name = name
    return restored
