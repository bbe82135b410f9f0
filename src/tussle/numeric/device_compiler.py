"""Numba's compiler for functions that kernels call: their code is optimized and made into machine code as a part of each kernel only.

Numba itself does both for every function, with all that it calls, and then again for its callers. Where functions call each other over
several levels, that takes half of the compile time.
"""

from __future__ import annotations

from functools import cache
from typing import Any


@cache
def device_compiler() -> Any:
    """Numba's compiler that leaves optimization and machine code to the kernels that a function becomes part of."""
    from numba.core.codegen import JITCodeLibrary
    from numba.core.compiler import CompilerBase, DefaultPassBuilder
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

    class DeviceCompiler(CompilerBase):
        """Numba's compiler with another lowering."""

        def define_pipelines(self) -> list[Any]:
            """The passes."""
            self.state.flags.no_compile = True
            passes = DefaultPassBuilder.define_nopython_pipeline(self.state)  # type: ignore[no-untyped-call]
            passes.passes = [
                (DeviceLowering if each is NativeLowering else each, text) for each, text in passes.passes
            ]
            passes.finalize()
            return [passes]

    return DeviceCompiler


def share_constants(dispatcher: Any) -> None:
    """Let calls with constant integers and truths use the function that is compiled for variables; constants come with inlining.

    Numba would compile one for each constant. It does so still where that is needed, as for an index of a tuple of several types.
    """
    from numba.core.errors import NumbaError
    from numba.core.types import BooleanLiteral, IntegerLiteral, unliteral

    template_of = dispatcher.get_call_template

    def variable(kind: Any) -> Any:
        return unliteral(kind) if isinstance(kind, (IntegerLiteral, BooleanLiteral)) else kind

    def get_call_template(args: tuple[Any, ...], kws: dict[str, Any]) -> Any:
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
