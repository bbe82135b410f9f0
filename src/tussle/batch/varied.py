"""Variables in the forms in which Python callers give them, and as `batch.json` keeps them."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from tussle.batch.variables import Choice, Range, Variable, parse_values, parse_variable
from tussle.documents import several
from tussle.errors import ParameterError
from tussle.mission.codecs import written


def as_variables(vary: Mapping[str, Any] | Iterable[str | Variable]) -> list[Variable]:
    """The variables that a caller gives.

    Args:
        vary: Texts as on the command line and variables; or by name a text ("20:30:log"), (low, high), or a list of choices.

    Raises:
        ParameterError: One of them has another form, or a name is there twice.
    """
    if isinstance(vary, Mapping):
        return [_of(name, value) for name, value in vary.items()]
    variables = [parse_variable(v) if isinstance(v, str) else v for v in several(vary)]
    for variable in variables:
        if not isinstance(variable, Range | Choice):
            raise ParameterError(
                f"{variable!r} is no variable; write a text such as 'prey_speed=20:30', a Range or a Choice"
            )
    for name, n in Counter(v.name for v in variables).items():
        if n > 1:
            raise ParameterError(f"{name} varies twice; give it once")
    return variables


def _of(name: str, value: Any) -> Variable:
    if isinstance(value, (Range, Choice)):
        return dataclasses.replace(value, name=name)
    if isinstance(value, str):
        return parse_values(name, value)
    if isinstance(value, tuple) and len(value) == 2:
        return Range(name, value[0], value[1])
    if isinstance(value, Sequence):
        return Choice(name, tuple(value))
    raise ParameterError(f"{name}: {value!r} is not allowed; give (low, high), a list of choices, or a text")


def variable_entry(variable: Variable) -> dict[str, Any]:
    """The entry of a variable in `batch.json`."""
    kind = "range" if isinstance(variable, Range) else "choice"
    return {"kind": kind, **dataclasses.asdict(variable)}


def variable_of(entry: Mapping[str, Any]) -> Variable:
    """The variable of an entry of `batch.json` that its schema allows.

    Raises:
        ParameterError: Its values are not allowed.
    """
    if entry["kind"] == "choice":
        return Choice(entry["name"], tuple(entry["values"]), entry["is_text"])
    fields = ("name", "low", "high", "is_int", "is_log", "levels", "unit", "is_text")
    return Range(**{name: entry.get(name) for name in fields})  # type: ignore[arg-type]


def entries_text(variables: Iterable[Mapping[str, Any]]) -> str:
    """Entries of `batch.json` as the command line writes them."""
    return "; ".join(f"{v['name']}={_values_text(v)}" for v in variables) or "nothing"


def _values_text(variable: Mapping[str, Any]) -> str:
    if variable["kind"] == "choice":
        return ",".join(map(written, variable["values"]))
    parts = [
        f"{variable['low']:g}",
        f"{variable['high']:g}{' ' if variable['unit'] else ''}{variable['unit']}",
    ]
    parts += [word for word in ("int", "log") if variable[f"is_{word}"]]
    return ":".join([*parts, *([] if variable["levels"] is None else [str(variable["levels"])])])
