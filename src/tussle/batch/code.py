"""The code of plugins: what the runs of a batch depend on besides the mission, and what other machines must have too."""

from __future__ import annotations

import hashlib
import platform
import sys
import types
from collections.abc import Iterable, Iterator, Mapping
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from typing import Any

from tussle.mission import Mission
from tussle.mission.plugin_files import PREFIX
from tussle.numeric.fingerprint import FIXED_PACKAGES, Fingerprint, package
from tussle.record.run_file import version, versions

SOURCE = "source of "
"""Begins the names of hashes of packages."""
_PYTHON = ".".join(platform.python_version_tuple()[:2])


def code_of(mission: Mission) -> dict[str, str]:
    """Return the facts on which results depend: versions, and hashes of the source of tussle and of packages with plugins.

    Plugin files and scripts are left out: they are sent with the mission.
    """
    packages = {package(c) for c in _classes([mission])}
    return code_here({"tussle", *(p for p in packages if p != "__main__" and not p.startswith(PREFIX))})


def code_here(packages: Iterable[str]) -> dict[str, str]:
    """Versions and hashes of the source of packages, as this process has them.

    Raises:
        ImportError: A package is missing.
    """
    found = {name: versions()[name] for name in ("tussle", "numpy", "numba")}
    return found | {"python": _PYTHON} | {f"{SOURCE}{name}": _source(name) for name in sorted(packages)}


def plugin_code(missions: Iterable[Mission]) -> dict[str, str]:
    """Hashes of the code of the plugin classes of missions, by name, and the version of Python, whose bytecode it is.

    The plugins of tussle are left out, whose version stands for them, and those of plugin files, whose texts are known.
    """
    classes = [c for c in _classes(missions) if not package(c).startswith(PREFIX)]
    found = {
        f"{c.__module__}.{c.__qualname__}".removeprefix("__main__."): _Reached(c).digest for c in classes
    }
    return dict(sorted(found.items())) | ({"python": _PYTHON} if found else {})


def _classes(missions: Iterable[Mission]) -> list[type]:
    """Classes of the plugins of missions and of those inside them, with their bases; without those of tussle."""
    plugins = (p for m in missions for p in (*m.world_plugins, *(p for b in m.blocks for p in b.plugins)))
    kinds = {type(inner): None for plugin in plugins for inner in plugin.walk()}
    return [c for c in dict.fromkeys(c for kind in kinds for c in kind.__mro__) if not _is_fixed(package(c))]


def _is_fixed(name: str) -> bool:
    """The code of a package is that of a version which is known."""
    return name in FIXED_PACKAGES or name == "tussle"


@cache
def _source(name: str) -> str:
    """Hash of the code of a package: its version changes only with a release."""
    module = import_module(name)
    folders = [Path(folder) for folder in getattr(module, "__path__", ())]
    file = getattr(module, "__file__", None)
    files = [(path, folder) for folder in folders for path in folder.rglob("*.py")]
    files += [(Path(file), Path(file).parent)] if file and not folders else []
    digest = hashlib.blake2b(digest_size=8)
    for path, folder in sorted(files):
        digest.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


class _Reached(Fingerprint):
    """Hash of a class, and of all functions, classes and values that its methods reach outside tussle; the same in every process.

    Of packages that are installed, other than that of the class, only the versions count.
    """

    def __init__(self, cls: type) -> None:
        self._own = package(cls)
        super().__init__(cls, passes_tussle=False)

    def _visit_function(self, function: types.FunctionType) -> None:
        if self._is_installed(function, function.__code__.co_filename):
            self._write(
                "installed", f"{function.__module__}.{function.__qualname__}", version(package(function))
            )
        else:
            super()._visit_function(function)

    def _is_installed(self, value: Any, file: str) -> bool:
        return package(value) != self._own and "-packages" in file

    def _lines(self, code: types.CodeType, owner: str) -> str:
        return ""  # where an error was raised is no part of a result

    def _visit_other(self, value: Any) -> None:
        of_value = package(type(value))
        if isinstance(value, (staticmethod, classmethod)):
            self._visit(value.__func__, frozenset())
        elif isinstance(value, property):
            self._visit((value.fget, value.fset), frozenset())
        elif isinstance(value, partial):
            self._visit((value.func, value.args, value.keywords), frozenset())
        elif hasattr(value, "__wrapped__"):  # by functools.cache
            self._visit(value.__wrapped__, frozenset())
        elif isinstance(value, dict):
            self._members(value)
        elif isinstance(value, (set, frozenset)):
            self._write("set", *sorted(map(repr, value)))
        elif isinstance(value, type) and not _is_fixed(package(value)):
            module = sys.modules.get(value.__module__)
            if self._is_installed(value, str(getattr(module, "__file__", ""))):
                self._write("installed", f"{value.__module__}.{value.__qualname__}", version(package(value)))
                return
            self._write("class", value.__qualname__, *(base.__qualname__ for base in value.__mro__))
            self._members(dict(_of_class(value)))
        elif of_value == "tussle" and not isinstance(value, type):  # a column, a law
            self._write(type(value).__qualname__)
            self._members(
                {
                    name: each
                    for name, each in _attributes(value)
                    if name != "doc" and not name.startswith("_")
                }
            )
        else:
            super()._visit_other(value)

    def _members(self, members: Mapping[Any, Any]) -> None:
        self._write("members", str(len(members)))
        for name, each in members.items():
            self._write(repr(name))
            self._visit(each, frozenset())


def _of_class(cls: type) -> Iterator[tuple[str, Any]]:
    """What its author wrote in a class, without what Python and tussle add, some of it when it is used."""
    for name, value in vars(cls).items():
        is_added = name.startswith("__") and not isinstance(
            value, (types.FunctionType, classmethod, staticmethod)
        )
        if not (is_added or (isinstance(value, type) and _is_fixed(package(value)))):
            yield name, value


def _attributes(value: Any) -> Iterator[tuple[str, Any]]:
    slots = (name for cls in type(value).__mro__ for name in vars(cls).get("__slots__", ()))
    yield from ((name, getattr(value, name)) for name in slots if hasattr(value, name))
    yield from getattr(value, "__dict__", {}).items()
