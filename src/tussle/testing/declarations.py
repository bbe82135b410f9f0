"""Rules of the conformance kit that need no game: declarations and overridden methods of a class."""

from __future__ import annotations

import math
import pickle
from collections.abc import Iterator
from types import FunctionType
from typing import Any

import numpy as np

from tussle.api import Interaction, Metric, MotionModel, Plugin
from tussle.api.motion import WRITABLE
from tussle.declare import units
from tussle.declare.columns import Column, Input, Numbers, Output, Param, State
from tussle.engine.wiring import BELIEF
from tussle.errors import ConformanceError, TussleError, listed, slip_of

RULE = "declarations"
HOOKS_NAMES = """
    spawn spawn_one step step_one start start_one result result_one route regions named_regions named_blocks needed_services walls terrain
    rejects from_body to_body mass_properties derivative advance active_inputs reads_all grade passthrough alters_sensors abstract kind
    historic_attributes transmit losses unused_states state_size range_kernel check_values reads_start_positions waits_for_traffic
    awaits awaited with_files named_files named_teams stand_in only_calls_kernels
"""
HOOKS = frozenset(HOOKS_NAMES.split())
MACHINERY = frozenset(
    {"columns", "services", "row_laws", "neighbor_laws", "me_type", "world_types", "__signature__"}
)
MUTABLE = (list, dict, set, bytearray, np.ndarray)
MAGIC_NAMES = """
    __init__ __new__ __setattr__ __getattr__ __getattribute__ __delattr__ __eq__ __hash__ __reduce__
    __getstate__
"""
MAGIC = frozenset(MAGIC_NAMES.split())


def own_classes(cls: type) -> Iterator[type]:
    """The class and its bases outside `tussle.api`, the class first."""
    return (
        base for base in cls.__mro__ if base is not object and not base.__module__.startswith("tussle.api.")
    )


def check_declarations(cls: type[Plugin]) -> None:
    """The class is documented, holds no mutable values, overrides only hooks, and has valid columns.

    Raises:
        ConformanceError: It breaks one of these rules.
    """
    problem = next(_problems(cls), None)
    if problem:
        raise ConformanceError(cls.__name__, RULE, problem)


def _problems(cls: type[Plugin]) -> Iterator[str]:
    if not (vars(cls).get("__doc__") or "").strip():
        yield "the class has no docstring, which its page begins with"
    yield from _attributes(cls)
    yield from _hooks(cls)
    for name, column in cls.columns.items():
        yield from _column(name, column)
        if issubclass(cls, MotionModel) and name in WRITABLE:
            yield f"{name} is a column of the body table, which to_body writes as body.{name}; give the model's column another name"
    yield from _beliefs(cls)
    yield from _as_data(cls)


def _attributes(cls: type[Plugin]) -> Iterator[str]:
    for base in own_classes(cls):
        for name, value in vars(base).items():
            if name in MACHINERY or isinstance(value, Column):
                continue
            if isinstance(value, MUTABLE) and not name.startswith("__"):
                yield f"{name} is a {type(value).__name__} on the class, which all simulations share; declare a column, or make it a tuple"
            yield from _method(cls, name, value)
            if name in MAGIC and not (name == "__hash__" and value is None):
                yield f"it defines {name}; only hooks may be defined ({listed(sorted(HOOKS & set(dir(cls))))})"
            kind = next(
                (b for b in cls.__mro__ if b.__module__.startswith("tussle.api.") and name in vars(b)), None
            )
            if kind is not None and name not in HOOKS and not name.startswith("__"):
                yield f"it overrides {kind.__name__}.{name}, which is not a hook ({listed(sorted(HOOKS & set(dir(cls))))})"


def _method(cls: type[Plugin], name: str, value: Any) -> Iterator[str]:
    """Finds methods that remember in a default, and those whose name is nearly that of a hook, which are not called."""
    function = getattr(value, "__func__", value)
    if not isinstance(function, FunctionType):
        return
    for default in (*(function.__defaults__ or ()), *(function.__kwdefaults__ or {}).values()):
        if isinstance(default, MUTABLE):
            yield f"an argument of {name} has a {type(default).__name__} as its default, which all calls share; declare a column"
    hook = slip_of(name, sorted(HOOKS & set(dir(cls))))
    if hook is not None and name not in (*HOOKS, *cls.services, *_called(cls)):
        yield f"{name} is not a hook, and never called (did you mean {hook!r}?)"


def _called(cls: type[Plugin]) -> Iterator[str]:
    """Names that the methods of a class use."""
    for base in own_classes(cls):
        for value in vars(base).values():
            yield from getattr(getattr(value, "__code__", None), "co_names", ())


def _hooks(cls: type[Plugin]) -> Iterator[str]:
    """Finds a class without any hook that does work; the engine reports missing required hooks when the kit's game is built."""
    if issubclass(cls, MotionModel):
        if not cls.derivative and cls.advance is MotionModel.advance and not cls.row_laws:
            yield "it has neither derivative nor row laws nor advance"
    elif issubclass(cls, (Interaction, Metric)) and all(
        getattr(cls, k, cls.step).__module__.startswith("tussle.api.")
        for k in (
            "start",
            "step",
            "result",
            "start_one",
            "step_one",
            "result_one",
            "regions",
            "walls",
            "terrain",
        )
    ):
        yield "it has neither start nor step nor result, and defines no regions, walls or terrain"


def _column(name: str, column: Column) -> Iterator[str]:
    if not isinstance(column, Numbers):
        return
    if isinstance(column, Param):
        for unit, text_unit in zip(column.units, column.text_units, strict=True):
            if units.unit_of(unit).dimension != units.unit_of(text_unit).dimension:
                yield f"{name} has unit {unit!r} but text_unit {text_unit!r}, which has another dimension"
    elif isinstance(column, (State, Input, Output)):
        default: Any = column.default
        parts = default if isinstance(default, tuple) else (default,)
        if isinstance(default, tuple) and len(parts) != len(column.fields):
            yield f"{name} has {len(column.fields)} fields and {len(parts)} defaults"
        if any(isinstance(v, float) and math.isnan(v) for v in parts):
            yield f"{name} has the default NaN, which cannot be distinguished from an error"


def _beliefs(cls: type[Plugin]) -> Iterator[str]:
    for name, (body, k, unit) in BELIEF.items():
        column = cls.outputs().get(name)
        if column is not None and not all(units.compatible(u, unit) for u in column.units):
            yield f"{name} is the entity's belief of its {body}; it needs {k} channels in {unit or 'no unit'}"


def _as_data(cls: type[Plugin]) -> Iterator[str]:
    try:
        plugin = cls()
    except TussleError as error:
        yield f"{cls.__name__}() fails: {error}"
        return
    if plugin != cls() or plugin.replace() != plugin:
        yield f"two {cls.__name__}() are not equal, so some parameter does not compare by value"
    if "<locals>" not in cls.__qualname__ and pickle.loads(pickle.dumps(plugin)) != plugin:  # noqa: S301 - our own bytes
        yield "it is not equal to its pickled copy"
