"""`tussle new`: write a working plugin, its test, and a mission that uses it."""

from __future__ import annotations

import keyword
import re
import shlex
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from rich.text import Text

from tussle.cli.play_options import NewOptions
from tussle.cli.progress import compiling
from tussle.cli.scaffold.copied import class_renamed, merged
from tussle.cli.scaffold.played import example_text, mission_text
from tussle.cli.tables import fact_list, indented
from tussle.cli.terminal import put
from tussle.errors import MissionError, ParameterError, listed, nearest_name
from tussle.folders import whole_file
from tussle.plugins import stock

TEMPLATES = Path(__file__).parent / "templates"
KINDS = ("autonomy", "motion", "controller", "sensor", "interaction", "metric", "network")
EASY_KINDS = ("autonomy", "controller", "sensor", "interaction", "metric")
"""Kinds with an easy mode. The autonomy template always uses easy mode."""

TEST = '''"""{name} passes the conformance checks, and its mission can be played."""

from pathlib import Path

from {module} import {name}

from tussle import Simulation
from tussle.testing import check_plugin
from tussle.mission import read_mission

HERE = Path(__file__).parent


def test_conformance() -> None:
    check_plugin({name})


def test_mission_reaches_its_end_time() -> None:
    loaded = read_mission(HERE / "{module}.xml", plugin_files=[HERE / "{module}.py"])
    (result,) = Simulation(loaded.mission, seeds=1).run()
    assert result.end == "time"
'''


def new(options: NewOptions) -> None:
    """Write the files, and print their names and commands to try next."""
    with compiling():
        files, next_steps = write_plugin(
            options.kind, options.name, options.origin, options.directory, options.easy
        )
    put(fact_list((str(path), what) for path, what in files.items()))
    put(indented(Text(next_steps, "bold")), "")


def write_plugin(
    kind: str, name: str, origin: str | None, directory: Path, is_easy: bool = False
) -> tuple[dict[Path, str], str]:
    """Write NAME.py, test_NAME.py and NAME.xml.

    Args:
        kind: "autonomy", "motion", "controller", "sensor", "interaction", "metric" or "network".
        name: Name of the class, such as "MyBoids"; the file names derive from it.
        origin: Stock plugin to copy, or None to use the template.
        directory: Directory for the files, created if necessary.
        is_easy: Use the easy mode: code for one entity or one world at a time.

    Returns:
        Description of each file by its path, and commands to try next.

    Raises:
        ParameterError: The kind or the plugin to copy is unknown, the name is no class name, or the kind has no easy mode.
        MissionError: A file exists already or cannot be written.
    """
    _check_names(kind, name)
    if is_easy and (kind not in EASY_KINDS or origin):
        other = f"--from {origin}" if origin else f"the kind {kind}; allowed kinds: {', '.join(EASY_KINDS)}"
        raise ParameterError(f"--easy is not allowed with {other}")
    source, mission = (
        _from_template(kind, name, is_easy) if origin is None else _from_stock(kind, name, origin)
    )
    module = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()
    texts = {
        directory / f"{module}.py": (source, f"the {kind}"),
        directory / f"test_{module}.py": (TEST.format(name=name, module=module), "its test"),
        directory / f"{module}.xml": (mission, "a mission that uses it"),
    }
    _write({path: text for path, (text, _) in texts.items()})
    at = directory / module
    commands = (
        ["tussle", "run", f"{at}.xml", "--plugin-path", f"{at}.py"],
        ["pytest", str(directory / f"test_{module}.py")],
    )
    steps = "\n".join(shlex.join(command) for command in commands)
    return {path: what for path, (_, what) in texts.items()}, steps


def _check_names(kind: str, name: str) -> None:
    if kind not in KINDS:
        raise ParameterError(f"unknown kind of plugin {kind!r}{nearest_name(kind, KINDS)}; {listed(KINDS)}")
    if not re.fullmatch(r"[A-Z][A-Za-z0-9]*", name) or keyword.iskeyword(name):
        raise ParameterError(
            f"{name!r} is not a plugin name; use letters and digits, starting with a capital letter, such as MyBoids"
        )
    if name in stock.manifest():
        raise ParameterError(f"a stock plugin is named {name!r}; choose another name, such as My{name}")


def _from_template(kind: str, name: str, is_easy: bool) -> tuple[str, str]:
    template = f"easy_{kind}" if is_easy and kind != "autonomy" else kind
    text = (TEMPLATES / f"{template}.py").read_text(encoding="utf-8")
    return class_renamed(text, "New", name), mission_text(kind, name)


def _from_stock(kind: str, name: str, origin: str) -> tuple[str, str]:
    cls: Any = stock.load(origin)
    if cls.kind != kind:
        raise ParameterError(f"--from {origin}: the kind of this plugin is {cls.kind}, not {kind}")
    return class_renamed(merged(cls), cls.__name__, name), example_text(origin, cls.__name__, name)


def _write(texts: dict[Path, str]) -> None:
    for path in texts:
        if path.exists():
            raise MissionError(f"{path}: the file exists already; choose another name, or remove the file")
    try:
        with ExitStack() as files:  # all of them or none
            for path, text in texts.items():
                path.parent.mkdir(parents=True, exist_ok=True)
                files.enter_context(whole_file(path)).write_text(text, encoding="utf-8")
    except OSError as error:
        raise MissionError(f"{path}: the file cannot be written: {error.strerror or error}") from error
