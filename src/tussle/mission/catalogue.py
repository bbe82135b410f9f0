"""Plugins by name: those that ship, those of installed packages, and those of files that were named."""

from __future__ import annotations

import hashlib
import importlib.util
import sys
import tomllib
import traceback
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType
from typing import Any

from tussle import stock
from tussle.api import Autonomy, Behavior, Controller, Interaction, Metric, MotionModel, Network, Sensor
from tussle.api.plugin import Plugin
from tussle.errors import MissionError, listed, nearest_name

KINDS: dict[str, type] = {
    "autonomy": Autonomy,
    "controller": Controller,
    "motion_model": MotionModel,
    "sensor": Sensor,
    "entity_interaction": Interaction,
    "metrics": Metric,
    "network": Network,
    "behaviors": Behavior,
}
"""What each tag names."""

CONTENT = "__plugin_file_content__"
"""In the module of a plugin file: hash of the text that it was made from."""


@cache
def historic() -> dict[str, Any]:
    """What is known of the existing system's plugins."""
    return tomllib.loads((Path(__file__).parent / "historic.toml").read_text(encoding="utf-8"))


def historic_names() -> set[str]:
    """Names of all plugins of the existing system."""
    return {name for names in historic()["plugins"].values() for name in names}


class AbsentPluginError(MissionError):
    """A plugin of the existing system that tussle does not have yet."""


class Catalogue:
    """Finds plugin classes by name.

    Args:
        plugin_files: Python files whose plugins can be named too; they win over others of the same name.

    Attributes:
        own: The plugins of these files.
        names: All that can be named.

    Raises:
        MissionError: A file cannot be imported, or holds no plugin.
    """

    def __init__(self, plugin_files: Iterable[str | Path | PluginSource] = ()) -> None:
        self.own: dict[str, type[Plugin]] = {}
        for path in plugin_files:
            self.own.update(load_plugin_file(path))
        self.names = sorted({*self.own, *stock.manifest(), *stock.others()})

    def load(self, name: str) -> type[Plugin]:
        """The class of this name.

        Raises:
            AbsentPluginError: The existing system has it, tussle not yet.
            MissionError: There is none, or its module cannot be imported.
        """
        if name in self.own:
            return self.own[name]
        if name not in self.names:
            if name in historic_names():
                raise AbsentPluginError(f"{name} is not in tussle yet")
            raise MissionError(
                f"there is no plugin {name[:80]!r}{nearest_name(name[:80], self.names)}; {listed(self.names)}"
            )
        try:
            found = stock.load(name)
        except Exception as error:
            raise MissionError(
                f"plugin {name!r} cannot be imported: {type(error).__name__}: {error}"
            ) from error
        if not (isinstance(found, type) and issubclass(found, Plugin)):
            raise MissionError(f"plugin {name!r} is {found!r}, which is no plugin class")
        return found


def module_of_plugin_file(path: str | Path) -> str:
    """Name of the module that a plugin file becomes: one of its own, so that plugins of two files called alike pickle."""
    file = Path(path).expanduser()
    digest = hashlib.blake2b(str(file.resolve()).encode(), digest_size=4).hexdigest()
    return f"tussle_plugin_file_{digest}_{file.stem if file.stem.isidentifier() else 'plugin'}"


@dataclass(frozen=True)
class PluginSource:
    """A plugin file as it was when it was read: this is what is run, whatever has become of the file.

    Attributes:
        path: The file.
        data: Its content.
    """

    path: Path
    data: bytes

    @staticmethod
    def read(path: str | Path) -> PluginSource:
        """The file as it is now.

        Raises:
            MissionError: It cannot be read.
        """
        file = Path(path).expanduser()
        if not file.is_file():
            raise MissionError(f"{path}: there is no such plugin file")
        try:
            return PluginSource(file, file.read_bytes())
        except OSError as error:
            raise MissionError(f"{path}: it cannot be read: {error.strerror or error}") from error


class _SourceLoader(SourceFileLoader):
    """Runs a text that has been read, and never the bytecode that lies beside a file and may be of another text."""

    def __init__(self, name: str, source: PluginSource) -> None:
        super().__init__(name, str(source.path.resolve()))
        self._data = source.data

    def get_code(self, fullname: str) -> CodeType:
        """The compiled text."""
        code: CodeType = self.source_to_code(self._data, self.path)
        return code


def load_plugin_file(source: str | Path | PluginSource, module_name: str = "") -> dict[str, type[Plugin]]:
    """The plugins that a Python file defines, by the names of their classes. The file is run, as an import does.

    A file that has not changed since it was loaded is not run again: its classes stay the same ones.

    Args:
        source: The file.
        module_name: Instead of the name that follows from the path.

    Raises:
        MissionError: It cannot be read or imported, or defines no plugin; the message has the file's own line.
    """
    source = source if isinstance(source, PluginSource) else PluginSource.read(source)
    file = source.path
    if file.suffix != ".py":
        raise MissionError(f"{file}: this is not a Python file (its name ends with .py)")
    name = module_name or module_of_plugin_file(file)
    content = hashlib.blake2b(source.data, digest_size=16).hexdigest()
    module = sys.modules.get(name)
    if module is None or vars(module).get(CONTENT) != content:
        loader = _SourceLoader(name, source)
        spec = importlib.util.spec_from_file_location(name, loader.path, loader=loader)
        assert spec is not None
        module = importlib.util.module_from_spec(spec)
        vars(module)[CONTENT] = content
        sys.modules[name] = module
        try:
            loader.exec_module(module)
        except (Exception, SystemExit) as error:
            sys.modules.pop(name, None)
            raise MissionError(
                f"{_line(error, file)}: it cannot be imported: {type(error).__name__}: {error}"
            ) from error
    found = {
        key: value
        for key, value in vars(module).items()
        if isinstance(value, type) and issubclass(value, Plugin) and value.__module__ == name
    }
    if not found:
        raise MissionError(f"{file}: it defines no plugin (a class derived from Autonomy, MotionModel, ...)")
    return found


def _line(error: BaseException, file: Path) -> str:
    """The last line of the file that the error passed through."""
    if isinstance(error, SyntaxError) and error.lineno:
        return f"{error.filename or file}:{error.lineno}"
    own = [f for f in traceback.extract_tb(error.__traceback__) if Path(f.filename) == file.resolve()]
    return f"{file}:{own[-1].lineno}" if own else str(file)
