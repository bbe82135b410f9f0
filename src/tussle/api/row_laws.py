"""Row laws: controllers and motion models as functions of the numbers of one entity."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from tussle.api.bodies import DERIVED, FLOATS
from tussle.api.group import ROWS_PER_THREAD, GroupView
from tussle.api.laws import BODY, components
from tussle.declare.columns import Channel, Numbers, Output, Param, State
from tussle.errors import DeclarationError, listed, nearest_name
from tussle.numeric.refusals import label
from tussle.numeric.row_kernel import (
    BlockCall,
    Item,
    Number,
    RowCall,
    RowKernel,
    Text,
    Value,
    numbers_of,
    read_first,
)

BODY_INPUTS = ("force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z", "mass")
BODY_NUMBERS: dict[str, Value] = {
    **{part: Number(part) for part in BODY},
    **{k: tuple(map(Number, components(k, n))) for k, n in {**FLOATS, **DERIVED}.items() if n > 1},
}
"""Kernel values of body columns and their components: one number for vel_x, three for vel."""


def row_law(*results: str) -> Callable[[Callable[..., Any]], RowLaw]:
    """Declare a function of one row as a law of a controller or a motion model.

    Arguments are matched by name: `dt` [s]; columns of the plugin, as tuples if they have fields; single fields such as `gains_kp`
    (in a motion model `kp`, as in `derivative`); channels; structural parameters. The law of a controller may also take body
    columns of the entity, as the entity believes them (yaw, climb, roll, vel, pos_z ...). The law of a motion model may take
    force_x ... torque_z, mass, and `substeps`; with `substeps` it advances by dt in that many substeps, otherwise in one.

    A law is not called if it takes an inactive input (see `active_inputs`), or if no plugin reads any of its outputs.

    Args:
        *results: Names of the returned values, in order: states, outputs, or channels of outputs; columns with fields are tuples.
            A motion model returns its state and body columns: pos_z, vel, yaw, climb, roll ...

    Raises:
        DeclarationError: No results are named; or, when the plugin class is created, an argument or result is unknown.
    """

    def declare(function: Callable[..., Any]) -> RowLaw:
        return RowLaw(getattr(function, "__func__", function), results)

    return declare


class RowLaw:
    """A function of one row as an attribute of a plugin.

    Attributes:
        function: The function.
        arguments: Names of its arguments.
        results: Names of what it returns.
    """

    def __init__(self, function: Callable[..., Any], results: tuple[str, ...]) -> None:
        self.function, self.results = function, results
        self.arguments = tuple(inspect.signature(function).parameters)
        if not results:
            raise DeclarationError(f"{label(function)}: name the results, such as @row_law('turn_rate')")

    def check(self, cls: Any, name: str) -> None:
        """Check that the plugin class has all arguments and results of the law.

        Raises:
            DeclarationError: An argument or result is unknown.
        """
        kinds = (("argument", self.arguments, arguments_of(cls)), ("result", self.results, results_of(cls)))
        for kind, names, allowed in kinds:
            for each in names:
                if each not in allowed:
                    own = [k for k in allowed if k not in BODY_NUMBERS]
                    place, where = label(self.function), f"{cls.__name__}.{name}"
                    raise DeclarationError(
                        f"{place if place.endswith(where) else f'{place}: {where}'}: {each!r} is no {kind} of a row law{_form(cls, each)}"
                        f"{nearest_name(each, allowed)}; {listed(own)}; and body columns"
                    )

    def call(self, plugin: Any) -> RowCall:
        """Return the law as a call in a kernel, for an unbound or bound plugin."""
        cls: Any = type(plugin)
        takes, gives = arguments_of(cls), results_of(cls)
        arguments = [takes[name] or Text(repr(plugin.values[name])) for name in self.arguments]
        return RowCall(self.function, tuple(arguments), tuple(gives[name] for name in self.results))


def _form(cls: Any, name: str) -> str:
    """What a column is that cannot be what it is in a law, for messages."""
    column = cls.columns.get(name)
    if column is None:
        return ""
    of = (
        ""
        if not isinstance(column, Numbers)
        else " of lists"
        if column.ragged
        else f" of {column.dtype.__name__}"
    )
    return f", as a {type(column).__name__}{of}"


def own_numbers(cls: Any) -> dict[str, tuple[Number, ...]]:
    """Return the numbers of each column of a plugin class."""
    return {
        name: tuple(Number((name, place)) for place in range(len(declared.fields) or 1))
        for name, declared in cls.declared(Numbers).items()
        if not declared.ragged and not (isinstance(declared, Param) and not declared.is_row_data)
    }


@lru_cache(maxsize=256)
def arguments_of(cls: Any) -> dict[str, Value | None]:
    """Return the kernel value of each possible argument; None for structural parameters."""
    is_motion = cls.kind == "motion"
    found: dict[str, Value | None] = {"dt": Text("dt")}
    if is_motion:
        found |= {"substeps": Text("substeps"), **{name: Number(name) for name in BODY_INPUTS}}
    else:
        found |= BODY_NUMBERS
    found |= {name: None for name, column in cls.params().items() if column.structural}
    whole: dict[str, Value | None] = {}
    single: dict[str, Value | None] = {}
    for name, numbers in own_numbers(cls).items():
        column = cls.columns[name]
        whole[name] = numbers if column.fields else numbers[0]
        is_channel = isinstance(column, Channel)
        names = column.channels if is_channel else column.fields
        plain = is_motion or is_channel
        parts = {each if plain else f"{name}_{each}": n for each, n in zip(names, numbers, strict=False)}
        # An input and an output may share a channel; as an argument its name means the input.
        single = {**parts, **single} if isinstance(column, Output) else {**single, **parts}
    return found | whole | single


@lru_cache(maxsize=256)
def results_of(cls: Any) -> dict[str, Value]:
    """Return the kernel value of each possible result."""
    found: dict[str, Value] = dict(BODY_NUMBERS) if cls.kind == "motion" else {}
    for name, numbers in own_numbers(cls).items():
        column = cls.columns[name]
        if isinstance(column, (State, Output)) and column.dtype is float:
            if isinstance(column, Output):
                found |= zip(column.channels, numbers, strict=True)
            found[name] = numbers if column.fields else numbers[0]
    return found


def laws_of(plugin: Any, wired: frozenset[str] | None = None) -> list[RowCall]:
    """Return the calls of the laws that a plugin runs; `wired` names the outputs that other plugins read, None means all."""
    cls = type(plugin)
    inputs = cls.inputs()
    active = plugin.active_inputs() if hasattr(type(plugin), "active_inputs") else inputs
    off = {each for k, c in inputs.items() if k not in active for each in (k, *c.channels)}
    calls = []
    for law in cls.row_laws.values():
        call = law.call(plugin)
        gives = {each.key[0] for each in numbers_of(call.results) if isinstance(each.key, tuple)}
        outputs = gives & cls.outputs().keys()
        is_read = wired is None or not outputs or not wired.isdisjoint(outputs)
        if is_read and off.isdisjoint(law.arguments):
            calls.append(call)
    return calls


class Rows:
    """A kernel that runs row laws over the rows of a view, and the columns that it loads and stores.

    Columns of plugins, whose keys are tuples, are loaded if a law reads them before it writes them, and stored if a law writes them.
    Body columns are loaded; the values that laws return for them are used in later substeps only.

    Args:
        calls: The laws, in order.
        held: Body numbers that stay constant over all substeps.
        more: Codes and names of further arguments of the kernel.
    """

    def __init__(
        self,
        calls: Sequence[RowCall | BlockCall],
        held: Collection[Number] = (),
        more: tuple[str, str] = ("", ""),
    ) -> None:
        read = {each for call in calls for each in numbers_of(call.arguments)} - set(held)

        def needed(item: Item) -> Item:
            is_own = isinstance(item, Number) and isinstance(item.key, tuple)
            return item if is_own or item in read else Text("_")

        calls = [call.replaced(lambda a: Text("1") if a == Text("substeps") else a, needed) for call in calls]
        first = read_first(calls)
        written = dict.fromkeys(
            each for call in calls for each in numbers_of(call.results) if isinstance(each.key, tuple)
        )
        both = [each for each in first if each in written]
        self.given = [*(each for each in first if each not in written), *both]
        self.kept = [*both, *(each for each in written if each not in both)]
        bodies = {BODY[str(each.key)][0] for each in self.given if not isinstance(each.key, tuple)}
        self.derived = sorted(bodies & DERIVED.keys())
        codes = f"({' '.join('F' * len(self.given))}) ({' '.join(['Fw'] * len(self.kept))})"
        further, names = more
        arguments = f"own, out, dt, substeps, {names}part"
        head = f"{codes} f8 i8 {further} (i8 i8)", arguments, "part", "substeps"
        self.kernel = RowKernel(calls, {"own": self.given}, {"out": self.kept}, head)

    def run(
        self, g: GroupView, own: Callable[..., np.ndarray], dt: float, substeps: int, more: tuple[Any, ...] = (),
        rows_per_thread: int = ROWS_PER_THREAD,
    ) -> None:  # fmt: skip
        """Run the laws for all rows of a view, in substeps of dt [s] each; `own` returns the column of a key, (n,)."""
        arrays = g.kept.get(self)
        if arrays is None:
            arrays = self._arrays(g, own)
        for name in self.derived:
            g.column(name)  # computes it again, in place, if the attitudes have changed
        given, kept = arrays
        g.split(self.kernel, given, kept, dt, substeps, *more, least=rows_per_thread)

    def _arrays(self, g: GroupView, own: Callable[..., np.ndarray]) -> tuple[tuple[np.ndarray, ...], ...]:
        """The columns that the kernel loads and stores; kept until rows change, if none had to be converted."""

        def column(number: Number) -> np.ndarray:
            if isinstance(number.key, tuple):
                return own(*number.key)
            name, place = BODY[str(number.key)]
            return np.asarray(np.atleast_2d(g.column(name))[place])

        columns = [*map(column, self.given), *map(column, self.kept)]
        floats, n = tuple(np.asarray(each, float) for each in columns), len(self.given)
        arrays = floats[:n], floats[n:]
        if all(a is b for a, b in zip(columns, floats, strict=True)):
            g.kept[self] = arrays
        return arrays


def step_rows(plugin: Any, g: GroupView) -> None:
    """Run the laws of a bound plugin once for all rows of its view."""
    own = plugin.__dict__
    if "_rows" not in own:
        calls = laws_of(plugin, plugin.wired)
        own["_rows"] = Rows(calls) if calls else None
    if own["_rows"] is not None:
        own["_rows"].run(g, lambda name, place: np.atleast_2d(own[name])[place], g.dt, 1)


def advance_rows(model: Any) -> Callable[..., None]:
    """Return the compiled function (x, u, p, dt, substeps) of a motion model that is written as row laws."""
    cls: Any = type(model)
    arguments, own = arguments_of(cls), own_numbers(cls)
    state = next(k for k, c in model.states().items() if c.fields)
    channels = [*model.input_channels(), *model.body_inputs()]
    x, u = own[state], [arguments[name] for name in channels]
    p = [each for name in model.row_params() for each in own[name]]

    def made(substeps: str, times: str) -> RowKernel:
        calls = [
            call.replaced(
                lambda a: Text(substeps) if a == Text("substeps") else a, lambda r: r if r in x else Text("_")
            )
            for call in laws_of(model)
        ]
        head = "F2w F2 F2 f8 i8", "x, u, p, dt, substeps", "0, x.shape[1]", times
        return RowKernel(calls, {"x": x, "u": u, "p": p}, {"x": x}, head)  # type: ignore[dict-item]

    if any("substeps" in law.arguments for law in cls.row_laws.values()):
        once, many = made("1", "1"), made("substeps", "1")
        return lambda x, u, p, dt, n: (once if n == 1 else many)(x, u, p, dt, n)
    each = made("1", "substeps")
    return lambda x, u, p, dt, n: each(x, u, p, dt / n, n)
