"""A page for each stock plugin, made from its docstring, its declarations and its example, and their index."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pages import ROOT
from reference import about, described, members

import tussle
from tussle.api import Plugin
from tussle.cli.pages import KINDS, first_sentence
from tussle.declare.columns import (
    Children,
    Column,
    EntityRef,
    Handle,
    Input,
    Output,
    Param,
    Publish,
    State,
    Subscribe,
)
from tussle.plugins import stock

FOLDER = ROOT / "docs" / "plugins"
INDEX = FOLDER / "index.md"
PARTS: dict[str, type | tuple[type, ...]] = {
    "Parameters": Param,
    "Inner plugins": Children,
    "Reads": Input,
    "Writes": Output,
    "Messages": (Publish, Subscribe),
    "Memory": (State, EntityRef, Handle),
}
"""Kinds of declarations, by the title under which they stand."""
BESIDE = re.compile(r"\$\{folder\}/(\w[\w.]*)\"")
"""File that an example reads."""


def plugin_pages() -> dict[Path, str]:
    """Text of each page, and of the index."""
    found = {name: stock.load(name) for name in sorted(stock.manifest(), key=str.lower)}
    pages = {FOLDER / f"{name}.md": plugin_page(name, cls) for name, cls in found.items()}
    return {INDEX: index(found), **pages}


def index(found: dict[str, Any]) -> str:
    """All plugins by kind, with their first sentences."""
    lines = [
        "# Plugins that ship",
        "",
        "`tussle run NAME` plays the example of a plugin. These pages are written by `python tests/docs/rewrite.py`.",
        "",
    ]
    for kind in KINDS:
        lines += [f"## {kind}", "", "| plugin | |", "|---|---|"]
        lines += [f"| [{n}]({n}.md) | {first_sentence(c)} |" for n, c in found.items() if c.kind == kind]
        lines.append("")
    return "\n".join(lines)


def in_sources(path: str | Path) -> Path:
    """Path of an installed file of the package in the repository."""
    return Path("src") / Path(path).relative_to(Path(tussle.__file__).parents[1])


def plugin_page(name: str, cls: Any) -> str:
    """The page of one plugin."""
    source = in_sources(inspect.getfile(cls))
    lines = [
        f"# {name}",
        "",
        f"{cls.kind} · grade {cls.grade} · [source](../../{source}) · [all plugins](index.md)",
        "",
        described(inspect.getdoc(cls) or ""),
    ]
    for title, kind in PARTS.items():
        lines += part(title, (f"`{key}`: {about(column)}" for key, column in columns(cls, kind)))
    lines += part("Regions and services that it needs", needs(cls))
    methods = {re.match(r"- `(\w+)", line)[1]: line[2:] for line in members(cls)}  # type: ignore[index]
    lines += part("Services", (methods.pop(key) for key in cls.services))
    methods.pop("named_regions", None)
    methods.pop("named_blocks", None)
    lines += part("Methods", iter(methods.values()))
    example = stock.examples()[name]
    text = example.read_text(encoding="utf-8")
    files = (
        f"[{file}](../../{in_sources(example.parent)}/{file})" for file in sorted({*BESIDE.findall(text)})
    )
    beside = "".join(f" It reads {file}." for file in files)
    lines += [
        "## Example",
        "",
        f"`tussle run {name}` plays it, `tussle view {name}` shows it.{beside}",
        "",
        f"```xml\n{text}```\n",
    ]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines))


def columns(cls: Any, kind: type | tuple[type, ...]) -> Iterator[tuple[str, Column]]:
    """The declarations of a kind."""
    return ((name, column) for name, column in cls.columns.items() if isinstance(column, kind))


def part(title: str, items: Iterator[str]) -> list[str]:
    """A section, none if it is empty."""
    lines = [f"- {item}" for item in items]
    return [f"## {title}", "", *lines, ""] if lines else []


def needs(cls: Any) -> Iterator[str]:
    """What a mission must have besides the plugin."""
    if cls.named_regions is not Plugin.named_regions:
        yield (inspect.getdoc(cls.named_regions) or "").removeprefix("Return ").capitalize()
    if cls.named_blocks is not Plugin.named_blocks:
        yield (inspect.getdoc(cls.named_blocks) or "").removeprefix("Return ").capitalize()
    yield from (
        f"A plugin of the same entity that offers the service `{name}`" for name in cls.needed_services
    )
