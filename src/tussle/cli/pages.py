"""What can be known without playing: the plugins there are, the missions that ship, a plugin's page, a mission's plan."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from tussle import stock
from tussle.api import Plugin
from tussle.cli.terminal import out
from tussle.columns import Numbers, Param
from tussle.engine.simulation import Simulation
from tussle.mission import Mission, shipped_missions

KINDS = ("autonomy", "behavior", "controller", "motion", "sensor", "interaction", "network", "metric")


def show(*parts: RenderableType) -> None:
    """Print parts of a page, an empty line before each and behind the last."""
    for part in parts:
        out().print()
        out().print(part)
    out().print()


def table(*columns: str, title: str = "") -> Table:
    """An airy table; its last column wraps, the others do not."""
    made = Table(box=box.SIMPLE_HEAD, header_style="bold", pad_edge=False, padding=(0, 1), title=title or None, title_justify="left", title_style="bold")
    for name in columns[:-1]:
        made.add_column(name, no_wrap=True)
    made.add_column(columns[-1], overflow="fold", ratio=1)
    return made


def first_line(cls: type[Any]) -> str:
    """The first sentence of a class's docstring."""
    text = inspect.getdoc(cls) or ""
    return " ".join(text.split("\n\n")[0].split())


# -- lists ------------------------------------------------------------------------------------------------------------------


def show_plugins(loaded: dict[str, type[Plugin]]) -> None:
    """All plugins by kind, those of other packages and of plugin files too."""
    found = {name: stock.load(name) for name in (*stock.manifest(), *stock.others())} | loaded
    by_kind: dict[str, list[str]] = {}
    for name, cls in sorted(found.items()):
        by_kind.setdefault(cls.kind, []).append(name)
    page = table("", "", "")
    page.show_header = False
    for kind in sorted(by_kind, key=lambda k: KINDS.index(k) if k in KINDS else len(KINDS)):
        page.add_row(Text(kind, "bold"), "", "")
        for name in by_kind[kind]:
            page.add_row(f"  {name}", Text(found[name].grade, "dim"), first_line(found[name]))
    show(page, Text("tussle describe NAME shows a plugin's parameters and channels.", "dim"))


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
    show(page, Text("\n".join(f" {line}" for line in next_steps.splitlines()), "bold"))


# -- a plugin ---------------------------------------------------------------------------------------------------------------


def show_plugin(name: str, cls: type[Plugin]) -> None:
    """A plugin's page, from its declarations."""
    head = Text.assemble((name, "bold"), f" · {getattr(cls, 'kind', '')} · grade {cls.grade}\n", (_where(cls), "dim"))
    parts: list[RenderableType] = [head, Text(inspect.getdoc(cls) or "")]
    if cls.params():
        params = table("parameter", "default", "unit", "takes", "")
        for key, column in cls.params().items():
            params.add_row(key, _default(column), _units(column), _takes(column), column.doc)
        parts.append(params)
    for title, columns in (("reads", cls.inputs()), ("writes", cls.outputs())):
        if columns:
            channels = table(title, "unit", "")
            for channel in columns.values():
                optional = "may be left out" if getattr(channel, "optional", False) else ""
                about = ". ".join(t.rstrip(".") for t in (channel.doc, optional) if t)
                channels.add_row("\n".join(channel.channels), _units(channel), about)
            parts.append(channels)
    topics = [f"{type(c).__name__.lower()}es {c.message.__name__}".replace("subscribees", "subscribes to") for c in cls.topics().values()]
    if topics:
        parts.append(Text("\n".join(f" {line}" for line in topics)))
    show(*parts)


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
    if column.ragged:
        return "none" if not column.default else str(column.default)
    values = column.default if isinstance(column.default, tuple) else (column.default,)
    return " ".join(f"{v:g}" if isinstance(v, float) else str(v).lower() if isinstance(v, bool) else str(v) for v in values)


def _units(column: Numbers) -> str:
    names = list(dict.fromkeys(column.units))
    return names[0] if len(names) == 1 else " ".join(u or "1" for u in column.units)


def _takes(column: Param) -> str:
    if column.choices:
        return " | ".join(str(choice) for choice in column.choices)
    bounds = [(column.ge, ">="), (column.gt, ">"), (column.le, "<="), (column.lt, "<")]
    text = ", ".join(f"{sign} {bound:g}" for bound, sign in bounds if bound is not None)
    kind = "text" if column.is_text else {int: "whole", bool: "true | false"}.get(column.dtype, "")
    fields = " ".join(column.fields)
    lists = "list of " if column.ragged else ""
    return ", ".join(t for t in (f"{lists}{fields}".strip(), kind, text) if t)


# -- a mission --------------------------------------------------------------------------------------------------------------


def show_mission(name: str, path: Path, mission: Mission, simulation: Simulation, seed: int) -> None:
    """A mission: who takes part, what is set, the step as a list."""
    ends = ", ".join(f"time ({mission.end:g} s)" if c == "time" else c for c in mission.end_conditions)
    head = Text.assemble((mission.name or name, "bold"), f" · seed {seed} · dt {mission.dt:g} s · {mission.motion_multiplier} substep(s) · {mission.update}\n", (f"{path}\n", "dim"), f"ends by {ends}")
    blocks = table("block", "team", "count", "plugins")
    for block in mission.blocks:
        blocks.add_row(block.name, str(block.team), str(block.count), _lines(block.plugins))
    world = table("world", "")
    for kind, plugins in (("interactions", mission.interactions), ("metrics", mission.metrics), ("networks", mission.networks)):
        if plugins:
            world.add_row(kind, _lines(plugins))
    steps = Text("\n".join(simulation.describe().splitlines()[1:]))
    show(head, blocks, world, Group(Text("one step", "bold"), Padding(steps, (0, 0, 0, 0))))


def _lines(plugins: Iterable[Any]) -> str:
    return "\n".join(repr(plugin) for plugin in plugins)
