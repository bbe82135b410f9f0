"""How the batch was made."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from typing import Any

from tussle.batch.report.parts import Column, Section, Table
from tussle.batch.report.subject import Subject
from tussle.batch.report.words import count, number, seconds
from tussle.batch.sampling import method_for
from tussle.batch.selection import written
from tussle.batch.variables import Range, Variable

METHODS = {
    "lhs": "a Latin hypercube",
    "sobol": "a scrambled Sobol sequence",
    "saltelli": "Saltelli's rows for variance-based indices",
    "grid": "all combinations of the values",
    "list": "values taken together, one after another",
    "product": "all choices at each point of a Latin hypercube of the ranges",
}


def making(subject: Subject) -> Section:
    """How the batch was made."""
    results = subject.results
    facts = tuple((name, text) for name, text in _facts(subject.results.info) if text)
    tables = (_variables(subject),) if results.variables else ()
    return Section("making", "How this was made", tables=tables, facts=facts)


def _facts(info: dict[str, Any]) -> Iterator[tuple[str, str]]:
    command = [str(part) for part in info.get("command") or ()]
    yield "command", shlex.join(command)
    about = info.get("mission") or {}
    yield "mission", str(about.get("file") or "made in Python")
    settings = about.get("settings") or {}
    yield "settings", ", ".join(f"{name}={value}" for name, value in settings.items())
    yield (
        "game",
        f"steps of {number(float(info['dt']))} s, from {number(float(info['start']))} s to {number(float(info['end']))} s",
    )
    yield "seeds", _seeds(info)
    yield "played until", str(info.get("until") or "")
    timings = info.get("timings") or {}
    yield "played", str(timings.get("began") or "").replace("T", " ").replace("+00:00", " UTC")
    yield "took", seconds(float(timings["wall_s"])) if timings.get("wall_s") else ""
    yield "versions", ", ".join(f"{name} {version}" for name, version in (info.get("versions") or {}).items())
    yield "fingerprint", str(info.get("fingerprint") or "")


def _seeds(info: dict[str, Any]) -> str:
    first, n = int(info["first_seed"]), int(info["n_seeds"])
    if info.get("independent"):
        n = int(info["n_runs"])
    text = f"{first} to {first + n - 1}" if n > 1 else str(first)
    if int(info["n_points"]) == 1:
        return text
    return f"{text}, {'one for each game' if info.get('independent') else 'the same at each point'}"


def _variables(subject: Subject) -> Table:
    results = subject.results
    info = results.info
    method = method_for(results.variables, str(info.get("sample") or ""))
    caption = f"{count(len(subject.points), 'point')}: {METHODS[method]}"
    if subject.is_drawn:
        caption += f", drawn with seed {info.get('sample_seed', 0)}"
    rows = tuple((v.name, *_of_variable(v)) for v in results.variables)
    return Table("What varied", (Column("name", "code"), Column("values", "text")), rows, caption + ".")


def _of_variable(variable: Variable) -> tuple[str]:
    if not isinstance(variable, Range):
        shown = [written(value) for value in variable.values[:12]]
        more = len(variable.values) - len(shown)
        return (", ".join(shown) + (f" and {count(more)} more" if more > 0 else ""),)
    text = f"{variable.low:g} to {variable.high:g} {variable.unit}".rstrip()
    words = ["whole numbers"] if variable.is_int else []
    words += ["evenly by the logarithm"] if variable.is_log else []
    words += [f"{variable.levels} values"] if variable.levels else []
    return (", ".join([text, *words]),)
