"""What varies, in the forms in which Python callers say it, and as `batch.json` keeps it."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from tussle.batch.variables import Choice, Range, Variable, parse_values, parse_variable
from tussle.errors import ParameterError
from tussle.mission.codecs import written


def as_variables(vary: Mapping[str, Any] | Iterable[str | Variable]) -> list[Variable]:
    """The variables that a caller means.

    Args:
        vary: Texts as on the command line and variables; or by name a text ("20:30:log"), (low, high), or a list of choices.

    Raises:
        ParameterError: One of them is written otherwise, or a name stands twice.
    """
    items = (
        [_of(name, value) for name, value in vary.items()]
        if isinstance(vary, Mapping)
        else [_from(v) for v in vary]
    )
    names = [v.name for v in items]
    for name in names:
        if names.count(name) > 1:
            raise ParameterError(f"{name} varies twice; say it once")
    return items


def _from(item: Any) -> Variable:
    if isinstance(item, (Range, Choice)):
        return item
    if isinstance(item, str):
        return parse_variable(item)
    raise ParameterError(
        f"{item!r} does not say what varies; write a text such as 'prey_speed=20:30', a Range or a Choice"
    )


def _of(name: str, value: Any) -> Variable:
    if isinstance(value, (Range, Choice)):
        return dataclasses.replace(value, name=name)
    if isinstance(value, str):
        return parse_values(name, value)
    if isinstance(value, tuple) and len(value) == 2:
        return Range(name, value[0], value[1])
    if isinstance(value, Sequence):
        return Choice(name, tuple(value))
    raise ParameterError(
        f"{name}: {value!r} says nothing of what varies; give (low, high), a list of choices, or a text"
    )


def about(variable: Variable) -> dict[str, Any]:
    """A variable as `batch.json` keeps it."""
    kind = "range" if isinstance(variable, Range) else "choice"
    return {"kind": kind, **dataclasses.asdict(variable)}


def variable_of(said: Mapping[str, Any]) -> Variable:
    """A variable as `batch.json` keeps it, once the document's schema has been checked.

    Raises:
        ParameterError: Its values are not allowed.
    """
    if said["kind"] == "choice":
        return Choice(said["name"], tuple(said["values"]), said["is_text"])
    fields = ("name", "low", "high", "is_int", "is_log", "levels", "unit", "is_text")
    return Range(**{name: said.get(name) for name in fields})  # type: ignore[arg-type]


def said(variables: Iterable[Mapping[str, Any]]) -> str:
    """Variables as `batch.json` keeps them, in the words of the command line."""
    return "; ".join(f"{v['name']}={_values_said(v)}" for v in variables) or "nothing"


def _values_said(variable: Mapping[str, Any]) -> str:
    if variable["kind"] == "choice":
        return ",".join(map(written, variable["values"]))
    parts = [
        f"{variable['low']:g}",
        f"{variable['high']:g}{' ' if variable['unit'] else ''}{variable['unit']}",
    ]
    parts += [word for word in ("int", "log") if variable[f"is_{word}"]]
    return ":".join([*parts, *([] if variable["levels"] is None else [str(variable["levels"])])])
