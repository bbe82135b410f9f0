"""Numba's compiler for kernels and for functions that they call, without work that has no effect on the machine code of kernels.

Functions are optimized and made into machine code as a part of each kernel only. Numba itself does both for every function, with all
that it calls, and then again for its callers. Where functions call each other over several levels, that takes half of the compile time.
"""

from __future__ import annotations

from functools import cache
from types import CodeType
from typing import Any

LOOKED_FOR = {"array", "reduce", "stencil"}
"""Names of functions whose calls Numba rewrites before it knows types, as it does those of nested functions."""

MAKING = {"binop", "call", "inplace_binop", "unary"}
"""Expressions that may make an array of others."""


@cache
def kernel_compiler() -> Any:
    """Numba's compiler without its searches for what a function does not have: each takes as long as finding the types of all variables."""
    from numba.core import ir, types
    from numba.core.compiler import CompilerBase, DefaultPassBuilder
    from numba.core.compiler_machinery import register_pass
    from numba.core.typed_passes import NopythonRewrites
    from numba.core.untyped_passes import InlineClosureLikes

    @register_pass(mutates_CFG=True, analysis_only=False)
    class ArrayRewrites(NopythonRewrites):
        """Numba's rewriting of expressions whose results are arrays, and of texts as indices."""

        _name = "array_rewrites"

        def run_pass(self, state: Any) -> bool:
            """Rewrite the expressions of a function, if it may have any."""
            made = (each for block in state.func_ir.blocks.values() for each in block.find_insts(ir.Assign))
            arrays = (
                isinstance(each.value, ir.Expr)
                and each.value.op in MAKING
                and isinstance(state.typemap[each.target.name], types.Array)
                for each in made
            )
            has_text = any(isinstance(kind, types.StringLiteral) for kind in state.typemap.values())
            return (has_text or any(arrays)) and bool(super().run_pass(state))

    class KernelCompiler(CompilerBase):
        """Numba's compiler with fewer passes."""

        def define_pipelines(self) -> list[Any]:
            """The passes."""
            code = self.state.func_id.code
            is_flat = LOOKED_FOR.isdisjoint(code.co_names) and not any(
                isinstance(c, CodeType) for c in code.co_consts
            )
            passes = DefaultPassBuilder.define_nopython_pipeline(self.state)  # type: ignore[no-untyped-call]
            passes.passes = [
                (ArrayRewrites if each is NopythonRewrites else each, text)
                for each, text in passes.passes
                if not (is_flat and each is InlineClosureLikes)
            ]
            passes.finalize()
            return [passes]

    return KernelCompiler


@cache
def device_compiler() -> Any:
    """Numba's compiler that leaves optimization and machine code to the kernels that a function becomes part of."""
    from numba.core.codegen import JITCodeLibrary
    from numba.core.compiler_machinery import register_pass
    from numba.core.typed_passes import NativeLowering

    class DeviceLibrary(JITCodeLibrary):
        """Intermediate code of a function and of those that it calls."""

        def _optimize_final_module(self) -> None:
            pass  # the kernel does

        def _finalize_final_module(self) -> None:
            self._finalize_dynamic_globals()
            self._finalized = True

    @register_pass(mutates_CFG=True, analysis_only=False)
    class DeviceLowering(NativeLowering):
        """Numba's lowering without machine code at its end."""

        _name = "device_lowering"

        def run_pass(self, state: Any) -> bool:
            """Lower a function."""
            state.library = DeviceLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
            super().run_pass(state)
            state.library.finalize()
            # Numba knows a compiled function by a built-in one of its own, which Python does not call.
            own = list[Any]().append
            state.targetctx.insert_user_function(own, state.cr.fndesc, [state.library])
            state.cr = state.cr._replace(cfunc=own)
            return True

    class DeviceCompiler(kernel_compiler()):  # type: ignore[misc]
        """The compiler of kernels with another lowering."""

        def define_pipelines(self) -> list[Any]:
            """The passes."""
            self.state.flags.no_compile = True
            (passes,) = super().define_pipelines()
            passes.passes = [
                (DeviceLowering if each is NativeLowering else each, text) for each, text in passes.passes
            ]
            passes.finalize()
            return [passes]

    return DeviceCompiler


def share_constants(dispatcher: Any) -> None:
    """Let calls with constant integers and truths use the function that is compiled for variables.

    Numba would compile one for each constant. It does so still where that is needed, as for an index of a tuple of several types.
    """
    from numba.core.errors import NumbaError
    from numba.core.types import BooleanLiteral, IntegerLiteral, unliteral

    template_of = dispatcher.get_call_template

    def get_call_template(args: tuple[Any, ...], kws: dict[str, Any]) -> Any:
        def variable(kind: Any) -> Any:
            return unliteral(kind) if isinstance(kind, (IntegerLiteral, BooleanLiteral)) else kind

        try:
            return template_of(
                tuple(map(variable, args)), {name: variable(kind) for name, kind in kws.items()}
            )
        except NumbaError:
            return template_of(args, kws)

    dispatcher.get_call_template = get_call_template


def set_environments(library: Any) -> None:
    """Tell the machine code of a kernel the environments of all functions in it: what they print, for example."""
    from numba.core.environment import lookup_environment

    for variable in library._final_module.global_variables:
        if variable.name.startswith("_ZN08NumbaEnv"):
            environment = lookup_environment(variable.name)
            if environment is not None:
                library.codegen.set_env(variable.name, environment)
