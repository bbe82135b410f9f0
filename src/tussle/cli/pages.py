"""What can be known without playing: the plugins there are, the missions that ship, a plugin's page, a mission's plan."""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from rich import box
from rich.console import RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from tussle.api import Plugin
from tussle.cli.terminal import out, put
from tussle.columns import Channel, Numbers, Param, Publish
from tussle.engine.simulation import Simulation
from tussle.mission import Mission, shipped_missions

NAME_WIDTH = 26
KINDS = ("autonomy", "behavior", "controller", "motion", "sensor", "interaction", "network", "metric")


def show(*parts: RenderableType) -> None:
    """Print parts of a page, set off by empty lines; a table brings its own."""
    put(*(line for part in parts for line in _set_off(part)), "")


def _set_off(part: RenderableType) -> list[RenderableType]:
    if isinstance(part, Text):
        return ["", Padding(part, (0, 0, 0, 1))]
    return [part]


def table(*columns: str) -> Table:
    """A table without lines but the one under its head; its last column takes what is left and wraps."""
    made = Table(box=box.SIMPLE_HEAD, header_style="bold cyan", pad_edge=False, padding=(0, 1))
    for name in columns[:-1]:
        made.add_column(name, overflow="fold")
    made.add_column(columns[-1], overflow="fold", ratio=1)
    return made


def first_sentence(cls: type[Any]) -> str:
    """The first sentence of a class's docstring, without marks."""
    text = " ".join((inspect.getdoc(cls) or "").split("\n\n")[0].split()).replace("`", "")
    return re.split(r"(?<=[.;:]) (?=\S)", text)[0].rstrip(".;:")


# -- lists ------------------------------------------------------------------------------------------------------------------


def show_plugins(found: dict[str, type[Plugin]]) -> None:
    """Plugins by kind."""
    by_kind: dict[str, list[str]] = {}
    for name, cls in sorted(found.items()):
        by_kind.setdefault(getattr(cls, "kind", "plugin"), []).append(name)
    lines = Text()
    for kind in sorted(by_kind, key=lambda k: KINDS.index(k) if k in KINDS else len(KINDS)):
        lines.append(f"\n{kind}\n", "bold cyan")
        for name in by_kind[kind]:
            _append_entry(lines, name, first_sentence(found[name]))
    lines.rstrip()
    show(lines, Text("tussle describe NAME shows a plugin's parameters and channels.", "dim"))


def _append_entry(lines: Text, name: str, about: str) -> None:
    """A name and what it is, in two columns; a long name has a line to itself."""
    wrapped = textwrap.wrap(about, out().width - NAME_WIDTH)
    if len(name) + 4 > NAME_WIDTH:
        wrapped = ["", *wrapped]
    for i, line in enumerate(wrapped or [""]):
        lines.append(f"  {name}".ljust(NAME_WIDTH) if i == 0 else " " * NAME_WIDTH, "bold" if i == 0 else "")
        lines.append(f"{line}\n")


def show_missions() -> None:
    """The missions that ship."""
    page = table("mission", "what it is")
    for name, (_, title) in sorted(shipped_missions().items()):
        page.add_row(name, title)
    show(page, Text("tussle run NAME plays one; tussle describe NAME says what is in it.", "dim"))


def show_written(files: Mapping[Path, str], next_steps: str) -> None:
    """What `tussle new` has written, and what to type next."""
    page = Table.grid(padding=(0, 2))
    for path, what in files.items():
        page.add_row(f" {path}", Text(what, "dim"))
    show(page, Text(next_steps, "bold"))


# -- a plugin ---------------------------------------------------------------------------------------------------------------


def show_plugin(name: str, cls: type[Plugin]) -> None:
    """A plugin's page, from its declarations."""
    kind = getattr(cls, "kind", "plugin")
    head = Text.assemble((name, "bold"), (f"\n{kind} · grade {cls.grade}\n{_where(cls)}", "dim"))
    parts: list[RenderableType] = [head, Text(_filled(inspect.getdoc(cls) or ""))]
    if cls.params():
        params = table("parameter", "default", "")
        for key, column in cls.params().items():
            params.add_row(key, _default(column), _about(column.doc, _takes(column)))
        parts.append(params)
    for title, columns in (("reads", cls.inputs()), ("writes", cls.outputs())):
        if columns:
            channels = table(title, "unit", "")
            for channel in columns.values():
                optional = "may be left out" if getattr(channel, "optional", False) else ""
                channels.add_row(*_channel(channel), _about(channel.doc, optional))
            parts.append(channels)
    if cls.topics():
        messages = table("messages", "")
        for topic in cls.topics().values():
            messages.add_row(
                "sends" if isinstance(topic, Publish) else "hears",
                _about(topic.message.__name__, topic.doc.rstrip(".")),
            )
        parts.append(messages)
    show(*parts)


def _filled(text: str) -> str:
    """Paragraphs of a docstring as wide as the screen; what is indented or listed stays as it is."""
    filled = []
    for paragraph in text.split("\n\n"):
        is_prose = not any(line.startswith((" ", "* ", "- ")) for line in paragraph.splitlines())
        filled.append(" ".join(paragraph.split()) if is_prose else paragraph)
    return "\n\n".join(filled).replace("`", "")


def _about(doc: str, remark: str) -> str:
    """A line of doc, with a remark in parentheses."""
    return (
        f"{doc.rstrip('.')} ({remark})".strip().replace("`", "")
        if remark
        else doc.rstrip(".").replace("`", "")
    )


def _where(cls: type[Any]) -> str:
    try:
        path = Path(inspect.getfile(cls))
    except (OSError, TypeError):
        return cls.__module__
    try:
        return str(path.relative_to(Path.cwd()))
    except ValueError:
        return str(path)


def _default(column: Param) -> str:
    """The default with its unit; fields of different units get a line each."""
    if column.ragged:
        return str(column.default) if column.default else "none"
    values = [
        _written(v) for v in (column.default if isinstance(column.default, tuple) else (column.default,))
    ]
    if len(set(column.units)) == 1:
        return f"{' '.join(values)} {column.units[0]}".strip()
    lines = zip(column.fields, values, column.units, strict=True)
    return "\n".join(f"{name} {value} {unit}".strip() for name, value, unit in lines)


def _written(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)


def _units(column: Numbers) -> str:
    return "\n".join(column.units) if len(set(column.units)) > 1 else column.units[0]


def _channel(channel: Channel) -> tuple[str, str]:
    """Names and units of a channel column; of a list, those of its fields below it."""
    if channel.ragged:
        names = [channel.channels[0], *(f"  {field}" for field in channel.fields)]
        units = ["list", *channel.units] if channel.fields else [f"list {channel.unit}"]
        return "\n".join(names), "\n".join(units)
    return "\n".join(channel.channels), _units(channel)


def _takes(column: Param) -> str:
    """What a parameter takes beside a number of its unit."""
    bounds = [(column.ge, ">="), (column.gt, ">"), (column.le, "<="), (column.lt, "<")]
    parts = [f"list of {' '.join(column.fields)}"] if column.ragged else []
    if column.fields and not column.ragged and len(set(column.units)) == 1:
        parts.append(" ".join(column.fields))
    parts.append(" | ".join(str(choice) for choice in column.choices))
    parts.append(", ".join(f"{sign} {bound:g}" for bound, sign in bounds if bound is not None))
    bare = [text for text, unit in zip(column.text_units, column.units, strict=True) if text != unit]
    if bare:
        parts.append(f"a bare number in a mission is in {bare[0]}")
    return "; ".join(part for part in parts if part)


# -- a mission --------------------------------------------------------------------------------------------------------------


def show_mission(name: str, path: Path, mission: Mission, simulation: Simulation, seed: int) -> None:
    """A mission: who takes part, what is set, the step as a list."""
    ends = ", ".join(f"time ({mission.end:g} s)" if c == "time" else c for c in mission.end_conditions)
    substeps = f" in {mission.motion_multiplier} substeps" if mission.motion_multiplier > 1 else ""
    facts = f"seed {seed} · steps of {mission.dt:g} s{substeps}, {mission.update} · ends by {ends}"
    head = Text.assemble((name, "bold"), (f"\n{facts}\n{path}", "dim"))
    blocks = table("block", "team", "count", "plugins")
    for block in mission.blocks:
        blocks.add_row(block.name, str(block.team), str(block.count), _lines(block.plugins))
    world = table("world", "plugins")
    for kind, plugins in (
        ("interactions", mission.interactions),
        ("metrics", mission.metrics),
        ("networks", mission.networks),
    ):
        if plugins:
            world.add_row(kind, _lines(plugins))
    show(
        head,
        blocks,
        world,
        Text.assemble(("one step\n", "bold cyan"), "\n".join(simulation.describe().splitlines()[1:])),
    )


def _lines(plugins: Iterable[Any]) -> str:
    return "\n".join(repr(plugin).removesuffix("()") for plugin in plugins)
