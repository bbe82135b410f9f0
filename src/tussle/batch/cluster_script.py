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

from tussle.batch.tasks import Package
from tussle.errors import BatchError
from tussle.mission import PluginFile

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
    file = PluginFile.of(path) if is_script and path.suffix == ".py" and path.is_file() else None
    module = file.module if file else getattr(spec, "name", "")
    found: dict[str, None] = {}
    missions = tuple(_renamed(package.mission(i), module, found) for i in range(len(package.missions)))
    if not found:  # some text says "__main__"
        return package
    if is_script:
        _check_script(file, next(iter(found)))
    return Package(missions, (*package.plugin_files, *((file,) if file else ())))


def _check_script(file: PluginFile | None, name: str) -> None:
    """A script can be loaded without doing what it is for.

    Raises:
        BatchError: It cannot, or there is none.
    """
    if file is None:
        raise BatchError(
            f"{name} is defined at a prompt, which workers do not have; put it into a file and give that as plugin_files"
        )
    statements = ast.parse(file.texts[file.name]).body
    if not any(isinstance(node, ast.If) and _names_itself(node.test) for node in statements):
        raise BatchError(
            f"{name} is defined in {file.name}, which workers load to have it; what the script does must stand under "
            f'`if __name__ == "__main__":`, or {name} in a file that is given as plugin_files'
        )


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
