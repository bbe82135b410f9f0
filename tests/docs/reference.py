"""The reference page, made from signatures, docstrings and declarations."""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Iterator, Mapping
from functools import cache
from types import FunctionType
from typing import Any

from pages import ROOT

from tussle.api import Plugin
from tussle.cli import pages as terminal
from tussle.declare.columns import Column, Numbers, Param, Publish, Subscribe
from tussle.messages import Message

PAGE = ROOT / "docs" / "reference.md"
PARTS = {
    "tussle": "Missions, simulations, runs",
    "tussle.api": "What plugins are made of",
    "tussle.messages": "Messages",
    "tussle.stock": "Plugins that ship",
    "tussle.numeric": "Functions with the same bits everywhere",
    "tussle.scene": "Scenes",
    "tussle.mission": "Mission files",
    "tussle.record": "Recordings",
    "tussle.batch": "Batches and searches",
    "tussle.view": "Views",
    "tussle.rl": "Learning",
    "tussle.plan": "Planning",
    "tussle.testing": "Tests of plugins",
    "tussle.errors": "Errors",
}
HOOKS = (
    "step",
    "step_one",
    "spawn",
    "spawn_one",
    "start",
    "start_one",
    "result",
    "result_one",
    "result_of",
    "regions",
    "walls",
    "rejects",
    "route",
    "from_body",
    "to_body",
    "advance",
    "derivative",
)
"""Methods that the engine calls: they stand with the kinds of plugins and not with each plugin."""
HEAD = """# Reference

All public names, from their docstrings and declarations. This page is written by `python tests/docs/rewrite.py`.

"""
SECTION = re.compile(r"^(Args|Attributes|Raises|Returns|Yields):$", re.MULTILINE)


@cache
def public(module: str) -> dict[str, Any]:
    """Names of a module that are public, with what they name, in alphabetical order."""
    found = importlib.import_module(module)
    if module == "tussle.stock":
        names = list(found.manifest())
    else:
        names = getattr(found, "__all__", None) or [
            name
            for name, value in vars(found).items()
            if getattr(value, "__module__", "") == module and name[0] != "_"
        ]
    return {name: getattr(found, name) for name in sorted(names, key=str.lower)}


def reference() -> str:
    """The page."""
    parts = [HEAD]
    for module, title in PARTS.items():
        parts.append(f"## {title}: `{module}`\n\n")
        if module == "tussle.stock":
            parts.append("Each has [a page of its own](plugins/index.md).\n\n")
            continue
        parts += [entry(name, value) for name, value in public(module).items()]
    return "".join(parts).rstrip() + "\n"


def entry(name: str, value: Any) -> str:
    """What is said of one name."""
    if name == "__version__":
        return f"**{name}**: version of the installation, a text\n\n"
    if not (inspect.isclass(value) or callable(value)):
        shown = repr(value).replace("pathlib._local.", "pathlib.")  # as Python 3.13 calls it
        return f"**{name}**: {', '.join(value) if isinstance(value, Mapping) else shown}\n\n"
    lines = [f"### {name}\n"]
    if not is_declared(value):
        lines.append(f"`{name}{signature(value)}`\n")
    lines.append(described(inspect.getdoc(value) or ""))
    if inspect.isclass(value):
        lines += [*declared(value), *members(value)]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)).rstrip() + "\n\n"


def is_declared(value: Any) -> bool:
    """A plugin or message type, whose declarations say what it takes."""
    return inspect.isclass(value) and issubclass(value, (Plugin, Message)) and bool(columns(value))


def columns(cls: Any) -> dict[str, Column]:
    """The declarations of a plugin or message type."""
    return dict(getattr(cls, "columns", None) or getattr(cls, "fields", {}))


def signature(value: Any) -> str:
    """Arguments without their types, which the text says in words and units."""
    try:
        found = inspect.signature(value)
    except (TypeError, ValueError):
        return ""
    plain = [
        p.replace(annotation=p.empty) for p in found.parameters.values() if p.name not in ("self", "cls")
    ]
    return re.sub(r"<[^<>]*>|\w+\([^()]*\)", "...", str(inspect.Signature(plain)))


def described(doc: str) -> str:
    """A docstring as Markdown: sections become lists."""
    text, *sections = SECTION.split(doc)
    lines = [text.strip(), ""]
    for title, body in zip(sections[::2], sections[1::2], strict=True):
        items = re.split(r"\n(?=    \S)", "\n" + body.strip("\n"))[1:]
        lines += [f"{title}:", "", *(f"- {' '.join(item.split())}" for item in items), ""]
    return "\n".join(lines)


def declared(cls: type) -> Iterator[str]:
    """A line for each declaration of a plugin or message."""
    if is_declared(cls):
        yield from (f"- `{name}`: {about(column)}" for name, column in columns(cls).items())
        yield ""


def about(column: Column) -> str:
    """Kind, unit, default, bounds and line of doc of a declaration."""
    kind = type(column).__name__
    if isinstance(column, (Publish, Subscribe)):
        return f"{kind} {column.message.__name__}. {column.doc}".strip()
    if not isinstance(column, Numbers):
        return f"{kind}. {column.doc}".strip()
    names = " list of" if column.ragged else ""
    names += f" `{' '.join(column.fields)}`" if column.fields else ""
    units = list(dict.fromkeys(column.units))
    unit = f" [{' '.join(units)}]" if any(units) else ""
    takes = terminal.allowed_text(column) if isinstance(column, Param) else ""
    default = f" = {terminal.default_text(column)}" if isinstance(column, Param) else unit
    return f"{kind}{names}{default}{f' ({takes})' if takes else ''}. {column.doc}".replace("\n", ", ").strip()


@cache
def documented_classes() -> set[type]:
    """Public classes, but for the plugins that ship, which have a page each."""
    modules = (module for module in PARTS if module != "tussle.stock")
    return {value for module in modules for value in public(module).values() if inspect.isclass(value)}


def own_bases(cls: type) -> Iterator[type]:
    """A class, and those of its bases in tussle that have no entry of their own."""
    yield cls
    for base in cls.__mro__[1:]:
        if base.__module__.startswith("tussle") and base not in documented_classes():
            yield base


def members_with_docs(cls: type) -> Iterator[tuple[str, str]]:
    """Public names of a class that are declarations, methods or properties, and their text."""
    for name, value in vars(cls).items():
        is_member = isinstance(value, (property, classmethod, staticmethod, FunctionType))
        doc = about(value) if isinstance(value, Column) else is_member and inspect.getdoc(value)
        if doc and name[0] != "_":
            yield name, doc


def inherited(value: Any) -> list[str]:
    """Public names that a class has from bases that have no entry of their own."""
    if not inspect.isclass(value):
        return []
    found = {name for base in own_bases(value) for name, _ in members_with_docs(base)}
    return sorted(found - {*vars(value)})


def members(cls: type) -> Iterator[str]:
    """Public methods and properties, those of base classes of ours included."""
    seen = set() if cls.__module__.startswith("tussle.api") else set(HOOKS)
    for base in own_bases(cls):
        for name, value in vars(base).items():
            function = getattr(value, "__func__", value)
            if name[0] == "_" or name in seen or isinstance(value, Column):
                continue
            seen.add(name)
            doc = (inspect.getdoc(function) or "").split("\n\n")[0]
            if not doc:
                continue
            if isinstance(value, property):
                yield f"- `{name}`: {' '.join(doc.split())}"
            elif inspect.isfunction(function):
                yield f"- `{name}{signature(function)}`: {' '.join(doc.split())}"
