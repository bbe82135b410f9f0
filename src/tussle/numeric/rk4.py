"""Fourth-order Runge-Kutta integration with fixed steps; the derivative is a compiled function of one row."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tussle.errors import DeclarationError, listed, nearest_name
from tussle.numeric.address import caller
from tussle.numeric.kernel import Device, Kernel, device, is_interpreted, kernel
from tussle.numeric.refusals import compiler_errors, label, refusal
from tussle.numeric.source import define

Floats = NDArray[np.float64]
DERIVATIVE = "Fw Fw Fw Fw"  # x (m,), u (k,), p (q,), dx (m,)


def compile_derivative(
    function: Callable[..., Any],
    x_names: Sequence[str],
    u_names: Sequence[str],
    p_names: Sequence[str],
    others: Mapping[str, Sequence[str] | str] | None = None,
    constants: Mapping[str, Any] | None = None,
) -> Kernel:
    """Compile a state equation with named arguments to a kernel `void(x, u, p, dx)` over arrays.

    Args:
        function: Takes any of the names, in any order, and returns the time derivative of every state in the order of
            `x_names`, or a number if there is one state. Numba must be able to compile it. Functions of `math` such as
            `math.cos` make results depend on the machine.
        x_names: Names of the states.
        u_names: Names of the inputs.
        p_names: Names of the parameters.
        others: Names of tuples of states, inputs and parameters, and other names of one of them.
        constants: Values that are the same for all rows: numbers, truth values, texts, tuples of them.

    An argument that has a default may be none of the names.

    Raises:
        DeclarationError: An argument is not one of the names, or a name is declared twice.
    """
    where: dict[str, str] = {}
    for array, names in (("x", x_names), ("u", u_names), ("p", p_names)):
        for place, name in enumerate(names):
            if name in where:
                raise DeclarationError(
                    f"{label(function)}: {name!r} is declared twice among states, inputs and parameters"
                )
            where[name] = f"{array}[{place}]"
    for name, parts in (others or {}).items():
        if isinstance(parts, str):
            where.setdefault(name, where[parts])
        elif where.keys() >= set(parts):
            where.setdefault(name, f"({''.join(f'{where[part]}, ' for part in parts)})")
    where = {**{name: repr(value) for name, value in (constants or {}).items()}, **where}
    declared = inspect.signature(function).parameters
    arguments = [name for name, each in declared.items() if name in where or each.default is each.empty]
    for name in arguments:
        if name not in where:
            raise DeclarationError(
                f"{label(function)}: argument {name!r} is not a state, input or parameter"
                f"{nearest_name(name, where)}; {listed(where)}"
            )
    targets = ", ".join(f"dx[{place}]" for place in range(len(x_names)))
    values = ", ".join(f"{name}={where[name]}" for name in arguments)
    scope = {"function": function if isinstance(function, (Device, Kernel)) else device(function)}
    lines = ["def derivative(x, u, p, dx):", f"    {targets} = function({values})"]
    wrapper = define(lines, scope, function.__module__, f"{function.__qualname__}.wrapper")
    wrapper.states = tuple(x_names)  # type: ignore[attr-defined]
    return kernel(DERIVATIVE)(wrapper)


@cache
def driver() -> Kernel:
    """The integration kernel, built on first use because importing this module must not import the compiler."""
    return kernel("u8 F2w F2 F2 f8 i8")(integrating(caller("Fw Fw Fw Fw")))


def integrating(call: Callable[..., Any]) -> Callable[..., Any]:
    """The integration function; `call(derivative, x, u, p, dx)` evaluates the derivative."""

    def rk4_rows(derivative, states, inputs, params, dt, substeps):  # type: ignore[no-untyped-def]
        m, n = states.shape
        h = dt / substeps
        x = np.empty(m)
        y = np.empty(m)
        u = np.empty(inputs.shape[0])
        p = np.empty(params.shape[0])
        k1 = np.empty(m)
        k2 = np.empty(m)
        k3 = np.empty(m)
        k4 = np.empty(m)
        for i in range(n):
            for j in range(m):
                x[j] = states[j, i]
            for j in range(u.shape[0]):
                u[j] = inputs[j, i]
            for j in range(p.shape[0]):
                p[j] = params[j, i]
            for _ in range(substeps):
                call(derivative, x, u, p, k1)
                for j in range(m):
                    y[j] = x[j] + 0.5 * h * k1[j]
                call(derivative, y, u, p, k2)
                for j in range(m):
                    y[j] = x[j] + 0.5 * h * k2[j]
                call(derivative, y, u, p, k3)
                for j in range(m):
                    y[j] = x[j] + h * k3[j]
                call(derivative, y, u, p, k4)
                for j in range(m):
                    x[j] = x[j] + h / 6.0 * (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j])
            for j in range(m):
                states[j, i] = x[j]

    return rk4_rows


def rk4(
    derivative: Kernel, states: Floats, inputs: Floats, params: Floats, dt: float, substeps: int = 1
) -> None:
    """Advance all rows by dt in equal substeps, with constant inputs and parameters.

    Args:
        derivative: Kernel from `compile_derivative`.
        states: States, (m, n), updated in place; one column per row.
        inputs: Inputs, (k, n).
        params: Parameters, (q, n).
        dt: Time to advance [s].
        substeps: Number of Runge-Kutta steps.

    Raises:
        ValueError: The arrays differ in their number of columns, or `substeps` is less than 1.
        DeclarationError: The derivative cannot be compiled.
    """
    if not states.shape[1] == inputs.shape[1] == params.shape[1]:
        raise ValueError(
            f"rk4: states {states.shape}, inputs {inputs.shape} and params {params.shape} must have the same number of columns"
        )
    if substeps < 1:
        raise ValueError(f"rk4: substeps must be at least 1, not {substeps}")
    if is_interpreted(derivative.py_func):
        integrating(lambda each, *arrays: each(*arrays))(derivative, states, inputs, params, dt, substeps)
    else:
        driver()(address_of(derivative), states, inputs, params, dt, substeps)


def address_of(derivative: Kernel) -> int:
    """Address of a compiled derivative.

    Raises:
        DeclarationError: The derivative cannot be compiled.
    """
    try:
        return derivative.address
    except compiler_errors() as error:
        wrapper = derivative.py_func
        function, states = wrapper.__globals__["function"].py_func, wrapper.states  # type: ignore[attr-defined]
        try:
            found = np.atleast_1d(function(*[1.0] * len(inspect.signature(function).parameters)))
        except Exception:  # noqa: BLE001 - a failure for inputs of 1.0 says nothing about the number of results
            found = np.empty(len(states))
        if len(found) != len(states):
            text = (
                f"returns {len(found)} derivatives, but there are {len(states)} states: {', '.join(states)}"
            )
        else:
            text = f"cannot be compiled: {refusal(error)}"
        raise DeclarationError(f"{label(function)} {text}") from error
