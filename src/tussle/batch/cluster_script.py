"""Plugins that are defined in the script itself, made to travel: its file becomes a plugin file of its own."""

from __future__ import annotations

import ast
import importlib
import io
import pickle
import sys
from pathlib import Path
from types import FunctionType
from typing import Any

from tussle.batch.tasks import Package, PluginFile
from tussle.errors import BatchError
from tussle.mission.catalogue import module_of_plugin_file

MAIN = "__main__"


def travelling(package: Package) -> Package:
    """A package that another process understands, whatever has been started there.

    Raises:
        BatchError: A plugin is defined at a prompt, or in a script that does its work when it is imported.
    """
    if not any(MAIN.encode() in mission for mission in package.missions):
        return package
    main = sys.modules[MAIN]
    spec: Any = getattr(main, "__spec__", None)  # of what `python -m` runs
    path = Path(getattr(main, "__file__", None) or "?")
    is_script = spec is None
    module = module_of_plugin_file(path) if is_script else spec.name
    found: dict[str, None] = {}
    missions = tuple(_renamed(package.mission(i), module, found) for i in range(len(package.missions)))
    if not found:  # some text says "__main__"
        return package
    files = package.plugin_files
    if is_script:
        files += (PluginFile(str(path.resolve()), module, _text_of(path, next(iter(found)))),)
    return Package(missions, files)


def _text_of(path: Path, name: str) -> str:
    """The script, which can be loaded without doing what it is for."""
    try:
        text = path.read_text(encoding="utf-8")
        statements = ast.parse(text).body
    except (OSError, SyntaxError, ValueError):
        raise BatchError(
            f"{name} is defined at a prompt, which workers do not have; put it into a file and give that as plugin_files"
        ) from None
    if not any(isinstance(node, ast.If) and _names_itself(node.test) for node in statements):
        raise BatchError(
            f"{name} is defined in {path.name}, which workers load to have it; what the script does must stand under "
            f'`if __name__ == "__main__":`, or {name} in a file that is given as plugin_files'
        )
    return text


def _names_itself(test: ast.expr) -> bool:
    return any(isinstance(node, ast.Name) and node.id == "__name__" for node in ast.walk(test))


def _renamed(mission: Any, module: str, found: dict[str, None]) -> bytes:
    """The mission pickled, with what is of the script as of a module; its names are noted."""
    stream = io.BytesIO()
    _Pickler(stream, module, found).dump(mission)
    return stream.getvalue()


class _Pickler(pickle.Pickler):
    def __init__(self, stream: io.BytesIO, module: str, found: dict[str, None]) -> None:
        super().__init__(stream)
        self.module, self.found = module, found

    def reducer_override(self, obj: Any) -> Any:
        if isinstance(obj, (type, FunctionType)) and obj.__module__ == MAIN:
            self.found[obj.__qualname__] = None
            return named, (self.module, obj.__qualname__)
        return NotImplemented


def named(module: str, qualname: str) -> Any:
    """What a module calls so."""
    found: Any = importlib.import_module(module)
    for name in qualname.split("."):
        found = getattr(found, name)
    return found
