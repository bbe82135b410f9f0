"""`tussle describe`, `tussle plugins` and `tussle missions`: what can be shown without playing."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from rich.console import RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from tussle.api import Plugin
from tussle.cli.options import PluginOptions
from tussle.cli.play import simulate
from tussle.cli.play_options import DescribeOptions, MissionsOptions
from tussle.cli.progress import compiling
from tussle.cli.tables import indented, text_table, title
from tussle.cli.terminal import WRONG_INPUT, out, put, say_error, say_note
from tussle.declare.columns import Channel, Param, Publish
from tussle.engine.simulation import Simulation
from tussle.errors import MissionError, nearest_name
from tussle.mission import Catalogue, Mission, PluginFile, shipped_missions
from tussle.plugins import stock

NAME_WIDTH = 22
KINDS = ("autonomy", "behavior", "controller", "motion", "sensor", "interaction", "network", "metric")


def describe(options: DescribeOptions) -> None:
    """Show a plugin or a mission.

    Raises:
        MissionError: No plugin or mission has this name, or it has no example.
    """
    found = plugin_named(options.mission, options.plugin_files, options.compat or "")
    if options.example:
        if options.mission not in stock.examples():
            raise MissionError(f"{options.mission} has no example; the plugins that ship have one each")
        text = stock.examples()[options.mission].read_text(encoding="utf-8")
        out().print(Text(text), soft_wrap=True, end="")
        return
    if found is not None:
        show_plugin(options.mission, found)
        return
    loaded, mission, seed = options.read(shows_viewer_notes=True)
    with compiling(), simulate(loaded, mission, seed) as simulation:
        show_mission(loaded.name, loaded.path, mission, simulation, seed)


def plugins(options: PluginOptions) -> int:
    """List all plugins, and report those that cannot be loaded.

    Returns:
        The exit code.
    """
    found, catalogue, wrong = load_plugins(options.plugin_files)
    show_plugins(found)
    for text in filter(None, map(catalogue.hides, found)):
        say_note(text)
    for text in wrong:
        say_error(text)
    return WRONG_INPUT if wrong else 0


def load_plugins(files: Iterable[Path]) -> tuple[dict[str, type[Plugin]], Catalogue, list[str]]:
    """Return all plugins by name, the catalogue that has them, and an error for each plugin and file that cannot be loaded."""
    found: dict[str, type[Plugin]] = {}
    good, wrong = list[PluginFile](), list[str]()
    for path in files:
        try:
            file = PluginFile.of(path)
            file.load()
            good.append(file)
        except MissionError as error:
            wrong.append(str(error))
    catalogue = Catalogue(good)
    for name in catalogue.names:
        try:
            found[name] = catalogue.load(name)
        except MissionError as error:
            wrong.append(str(error))
    return found, catalogue, wrong


def missions(_: MissionsOptions) -> None:
    """List the built-in missions."""
    page = text_table("mission", "title")
    for name, (_file, about) in sorted(shipped_missions().items()):
        page.add_row(name, about)
    show(
        indented(page),
        Text(
            "tussle run NAME plays a mission; tussle describe NAME shows what it contains.\n"
            "The name of a plugin that ships plays its example.",
            "dim",
        ),
    )


def plugin_named(name: str, files: Iterable[Path], compat: str = "") -> type[Plugin] | None:
    """Return the plugin of this name, or None if the name is that of a mission.

    Raises:
        MissionError: No plugin or mission has this name.
    """
    catalogue = Catalogue(files, compat)
    if name in catalogue.names:
        if hides := catalogue.hides(name):
            say_note(hides)
        return catalogue.load(name)
    if name in shipped_missions() or Path(name).exists() or Path(name).suffix == ".xml":
        return None
    known = [*shipped_missions(), *catalogue.names]
    raise MissionError(
        f"no mission or plugin is named {name!r}{nearest_name(name, known)}; "
        f"`tussle missions` and `tussle plugins` list all names, and the name of a mission file ends with .xml"
    )


def show(*parts: RenderableType) -> None:
    """Print parts of a page. A text has an empty line before it; a table brings its own."""
    for part in parts:
        put(*(["", Padding(part, (0, 0, 0, 1))] if isinstance(part, Text) else [part]))
    put("")


def show_plugins(found: dict[str, type[Plugin]]) -> None:
    """List plugins by kind."""
    by_kind: dict[str, list[str]] = {}
    for name, cls in sorted(found.items()):
        by_kind.setdefault(getattr(cls, "kind", "plugin"), []).append(name)
    for kind in sorted(by_kind, key=lambda k: KINDS.index(k) if k in KINDS else len(KINDS)):
        entries = Table.grid(padding=(0, 2))
        entries.add_column(style="bold", min_width=NAME_WIDTH)
        for name in by_kind[kind]:
            entries.add_row(name, first_sentence(found[name]))
        put("", Text(f" {kind}", "bold cyan"), Padding(entries, (0, 0, 0, 3)))
    show(Text("tussle describe NAME shows the parameters and channels of a plugin.", "dim"))


def first_sentence(cls: type[Any]) -> str:
    """Return the first sentence of a class's docstring, without markup."""
    text = " ".join((inspect.getdoc(cls) or "").split("\n\n")[0].split()).replace("`", "")
    return re.split(r"(?<=[.;:]) (?=\S)", text)[0].rstrip(".;:")


# -- a plugin ---------------------------------------------------------------------------------------------------------------


def show_plugin(name: str, cls: type[Plugin]) -> None:
    """Show a plugin: its docstring, parameters, channels and messages."""
    head = title(name, f"{getattr(cls, 'kind', 'plugin')} · grade {cls.grade}", _file_of(cls))
    put("", head)
    parts: list[RenderableType] = [Text(_filled(inspect.getdoc(cls) or ""))]
    if cls.params():
        params = text_table("parameter", "default", "")
        for key, column in cls.params().items():
            params.add_row(key, default_text(column), _about(column.doc, allowed_text(column)))
        parts.append(indented(params))
    for heading, columns in (("reads", cls.inputs()), ("writes", cls.outputs())):
        if columns:
            channels = text_table(heading, "unit", "")
            for channel in columns.values():
                optional = "optional" if getattr(channel, "optional", False) else ""
                channels.add_row(*_channel(channel), _about(channel.doc, optional))
            parts.append(indented(channels))
    if cls.topics():
        messages = text_table("messages", "")
        for topic in cls.topics().values():
            kind = "sends" if isinstance(topic, Publish) else "receives"
            messages.add_row(kind, _about(topic.message.__name__, topic.doc.rstrip(".")))
        parts.append(indented(messages))
    if name in stock.manifest() and cls is stock.load(name):
        text = f"example: tussle run {name} plays it, tussle describe {name} --example prints it"
        parts.append(Text(text, "dim"))
    show(*parts)


def _filled(text: str) -> str:
    """Join the lines of each paragraph of a docstring; indented texts and lists stay as they are."""
    filled = []
    for paragraph in text.split("\n\n"):
        is_prose = not any(line.startswith((" ", "* ", "- ")) for line in paragraph.splitlines())
        filled.append(" ".join(paragraph.split()) if is_prose else paragraph)
    return "\n\n".join(filled).replace("`", "")


def _about(doc: str, remark: str) -> str:
    """Return a line of doc, with a remark in parentheses."""
    return f"{doc.rstrip('.')}{f' ({remark})' if remark else ''}".strip().replace("`", "") or " "


def _file_of(cls: type[Any]) -> str:
    try:
        path = Path(inspect.getfile(cls))
    except (OSError, TypeError):
        return cls.__module__
    return str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)


def default_text(column: Param) -> str:
    """Return the default of a parameter with its unit; components with different units have one line each."""
    if column.ragged:
        return str(column.default) if column.default else "none"
    given = column.default if isinstance(column.default, tuple) else (column.default,)
    values = [
        str(v).lower() if isinstance(v, bool) else f"{v:g}" if isinstance(v, float) else str(v) for v in given
    ]
    if len(set(column.units)) == 1:
        return f"{' '.join(values)} {column.units[0]}".strip()
    lines = zip(column.fields, values, column.units, strict=True)
    return "\n".join(f"{name} {value} {unit}".strip() for name, value, unit in lines)


def _channel(channel: Channel) -> tuple[str, str]:
    """Return names and units of a channel column; for a list, those of its fields below it."""
    if channel.ragged:
        names = [channel.channels[0], *(f"  {field}" for field in channel.fields)]
        units = ["list", *channel.units] if channel.fields else [f"list {channel.unit}"]
        return "\n".join(names), "\n".join(units)
    is_mixed = len(set(channel.units)) > 1
    return "\n".join(channel.channels), "\n".join(channel.units) if is_mixed else channel.units[0]


def allowed_text(column: Param) -> str:
    """Return what a parameter takes, apart from a number of its unit."""
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
    """Show a mission: its blocks, its plugins, and the step as a list."""
    ends = ", ".join(f"time ({mission.end:g} s)" if c == "time" else c for c in mission.end_conditions)
    substeps = f" in {mission.motion_multiplier} substeps" if mission.motion_multiplier > 1 else ""
    facts = f"seed {seed} · steps of {mission.dt:g} s{substeps}, {mission.update} · ends by {ends}"
    blocks = text_table("block", "team", "count", "plugins")
    for block in mission.blocks:
        blocks.add_row(block.name, str(block.team), str(block.count), _lines(block.plugins))
    world = text_table("world", "plugins")
    for kind in ("interactions", "metrics", "networks"):
        if getattr(mission, kind):
            world.add_row(kind, _lines(getattr(mission, kind)))
    put("", title(name, facts, str(path)))
    steps = "\n".join(simulation.describe().splitlines()[1:])
    show(indented(blocks), indented(world), Text.assemble(("one step\n", "bold cyan"), steps))


def _lines(plugins: Iterable[Any]) -> str:
    return "\n".join(repr(plugin).removesuffix("()") for plugin in plugins)
