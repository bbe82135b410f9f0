"""Plugin files: Python files with plugins, and the files in the same folder that they import.

A folder with plugin files is a separate package, named by a hash of its path, so two folders may each have a `geometry.py`. In a
plugin file, `from . import geometry` and, as in a script, plain `import geometry` import the neighbour: the files run with their
own `__import__`, which looks in their folder first. `sys.path` and the imports of other modules do not change.
"""

from __future__ import annotations

import ast
import builtins
import hashlib
import importlib
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib.abc import ExecutionLoader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import spec_from_loader
from pathlib import Path, PurePosixPath
from types import ModuleType
from typing import Any

from tussle.api.plugin import Plugin
from tussle.errors import MissionError, listed
from tussle.folders import real_path
from tussle.plugins import stock

PREFIX = "tussle_plugins_"
"""Prefix of the package names of folders with plugin files."""
DIGEST = "__plugin_file_digest__"
"""Attribute of a file's module: hash of the texts that it was made from, its own and those that it imports."""
INIT = "__init__"
STANDS_ALONE = "_stands_alone"
"""Attribute of classes, such as tasks of learners, that a file may define without a plugin."""
BINDINGS = "scrimmage"
"""Module of SCRIMMAGE's Python interface, which plugin files import from tussle."""


@dataclass(frozen=True)
class PluginFile:
    """A Python file with plugins, and all files in its folder that it imports, as they were when they were read.

    Attributes:
        folder: The folder.
        name: The file's name.
        texts: Path within the folder -> text, of the file and its neighbours.
    """

    folder: str
    name: str
    texts: Mapping[str, str]

    @classmethod
    def of(cls, path: str | Path) -> PluginFile:
        """Read the file without running it.

        Raises:
            MissionError: It does not exist, cannot be read, or is not a Python file.
        """
        file = Path(path).expanduser()
        if file.is_dir():
            inside = sorted(each.name for each in file.glob("*.py"))
            raise MissionError(
                f"{path}: it is a folder; a plugin file is one Python file; in the folder {listed(inside)}"
            )
        if not file.is_file():
            raise MissionError(f"{path}: there is no such plugin file")
        if file.suffix != ".py":
            raise MissionError(f"{path}: it is not a Python file (the name must end with .py)")
        file = real_path(file)
        return cls(
            str(file.parent), file.name, _with_imports(file.name, lambda name: _read(file.parent / name))
        )

    @property
    def path(self) -> str:
        return str(Path(self.folder, self.name))

    @cached_property
    def package(self) -> str:
        """Name of the folder's package."""
        return PREFIX + hashlib.blake2b(self.folder.encode(), digest_size=4).hexdigest()

    @property
    def module(self) -> str:
        """Name of the file's module; unique, so that plugins of two files with the same name can be pickled."""
        return self._module(self.name)

    def load(self) -> dict[str, type[Plugin]]:
        """Import the file and return the plugins that it defines, by class name.

        Files that have not changed since they were loaded are not run again, so their classes stay the same. Nothing is read from
        disk, so the plugins can be loaded on a machine that does not have the files.

        Raises:
            MissionError: It cannot be imported, or defines no plugin and no Task; the message has the file's line.
        """
        module = self.imported()
        classes = {
            key: value
            for key, value in vars(module).items()
            if isinstance(value, type) and value.__module__ == self.module
        }
        found = {key: value for key, value in classes.items() if issubclass(value, Plugin)}
        if not found and not any(hasattr(value, STANDS_ALONE) for value in classes.values()):
            raise MissionError(
                f"{self.path}: it defines no plugin (a class derived from Autonomy, MotionModel, ...) and no Task"
            )
        return found

    def imported(self) -> ModuleType:
        """Import the file, whatever it defines.

        Raises:
            MissionError: It cannot be imported; the message has the file's line.
        """
        self._register()
        try:
            return importlib.import_module(self.module)
        except (Exception, SystemExit) as error:
            sys.modules.pop(self.module, None)
            raise MissionError(
                f"{self._line(error)}: it cannot be imported: {type(error).__name__}: {error}"
            ) from error

    def _module(self, name: str) -> str:
        parts = PurePosixPath(name).with_suffix("").parts
        parts = parts[:-1] if len(parts) > 1 and parts[-1] == INIT else parts
        return ".".join((self.package, *(part.replace(".", "_") for part in parts)))

    def _register(self) -> None:
        """Make the modules importable, and remove modules that were made from other texts."""
        finder = _finder()
        loaders: dict[str, _Loader] = {}
        for folder in {parent for name in self.texts for parent in PurePosixPath(name).parents}:
            path = str(folder / f"{INIT}.py")  # a folder without one is an empty package
            module = self._module(path) if folder.parts else self.package
            loaders[module] = _Loader(str(Path(self.folder, path)), "", "", True, self.package)
        for name, text in self.texts.items():
            texts = _with_imports(name, self.texts.get)
            digest = hashlib.blake2b(repr(sorted(texts.items())).encode(), digest_size=16).hexdigest()
            is_package = name.endswith(f"/{INIT}.py")
            path = str(Path(self.folder, name))
            loaders[self._module(name)] = _Loader(path, text, digest, is_package, self.package)
        stale = {self._module(name) for own, text in self.texts.items() for name in _imported(own, text)}
        for module in (stale | loaders.keys()) & sys.modules.keys():
            if module not in loaders or vars(sys.modules[module]).get(DIGEST) != loaders[module].digest:
                del sys.modules[module]
                parent, _, last = module.rpartition(".")
                if parent in sys.modules:  # where `from . import` would find it
                    vars(sys.modules[parent]).pop(last, None)
        for module in stale - loaders.keys():
            finder.loaders.pop(module, None)
        finder.loaders.update(loaders)

    def _line(self, error: BaseException) -> str:
        """Return the last line of the file, or of a neighbour, in the error's traceback."""
        if isinstance(error, SyntaxError) and error.lineno:
            return f"{error.filename or self.path}:{error.lineno}"
        files = {str(Path(self.folder, name)) for name in self.texts}
        own = [f for f in traceback.extract_tb(error.__traceback__) if f.filename in files]
        return f"{own[-1].filename}:{own[-1].lineno}" if own else self.path


def load_plugin_file(path: str | Path) -> dict[str, type[Plugin]]:
    """Import a Python file and return the plugins that it defines, by class name (see `PluginFile.load`).

    Raises:
        MissionError: It cannot be read or imported, or defines no plugin and no Task.
    """
    return PluginFile.of(path).load()


# -- imported neighbours ------------------------------------------------------------------------------------------------------


def _read(file: Path) -> str | None:
    if not file.is_file():
        return None
    try:
        return file.read_text(encoding="utf-8")
    except OSError as error:
        raise MissionError(f"{file}: it cannot be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise MissionError(f"{file}: it cannot be read: {error}") from error


def _with_imports(first: str, read: Callable[[str], str | None]) -> dict[str, str]:
    """Path within the folder -> text, of a file and of all files there that it imports, directly or indirectly."""
    found: dict[str, str] = {}
    names = [first]
    while names:
        name = names.pop()
        text = read(name) if name not in found else None
        if text is not None:
            found[name] = text
            names += _imported(name, text)
    return found


@lru_cache(maxsize=1000)
def _imported(name: str, text: str) -> tuple[str, ...]:
    """Paths within the folder that import statements of a file may refer to, whether or not they exist."""
    try:
        statements = list(ast.walk(ast.parse(text)))
    except (SyntaxError, ValueError):  # reported with its line when the file is run
        return ()
    own, found = PurePosixPath(name).parent.parts, list[str]()
    for node in statements:
        if isinstance(node, ast.Import):
            dotted = [(0, alias.name) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            dotted = [(node.level, f"{node.module or ''}.{alias.name}".strip(".")) for alias in node.names]
        else:
            continue
        for level, words in dotted:
            parts = (*(own[: len(own) - level + 1] if level else ()), *words.split("."))
            for i in range(1, len(parts) + 1) if parts[0] != "tussle" else ():
                found += [f"{'/'.join(parts[:i])}.py", f"{'/'.join(parts[:i])}/{INIT}.py"]
    return tuple(found)


# -- importing ----------------------------------------------------------------------------------------------------------------


def _finder() -> _Finder:
    """Return the finder of this process. It is installed on first use."""
    found = next((f for f in sys.meta_path if isinstance(f, _Finder)), None)
    if found is None:
        found = _Finder({})
        sys.meta_path.insert(0, found)
    return found


def _adapt_python_autonomies(module: ModuleType) -> None:
    """Add a plugin to a module for each class of SCRIMMAGE's Python interface that it defines."""
    for plugin in stock.adapters(vars(module)):
        vars(module)[plugin.__name__] = plugin


@dataclass(frozen=True)
class _Finder(MetaPathFinder):
    """Finds the modules of plugin files; one in a process, on `sys.meta_path`."""

    loaders: dict[str, _Loader]

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        loader = self.loaders.get(fullname)
        spec = None if loader is None else spec_from_loader(fullname, loader)
        if spec is not None and spec.submodule_search_locations is not None:
            spec.submodule_search_locations.clear()  # do not search the disk, which differs on another machine
        return spec


@dataclass(frozen=True)
class _Loader(ExecutionLoader):
    """Executes the text of one module.

    Attributes:
        path: Path of the file, which need not exist.
        text: The text.
        digest: See `DIGEST`.
        is_folder: Whether the module is a package.
        package: Package of the folder.
    """

    path: str
    text: str
    digest: str
    is_folder: bool
    package: str

    def get_filename(self, fullname: str) -> str:
        return self.path

    def get_source(self, fullname: str) -> str:
        return self.text

    def is_package(self, fullname: str) -> bool:
        return self.is_folder

    def exec_module(self, module: ModuleType) -> None:
        vars(module).update(
            {DIGEST: self.digest, "__builtins__": {**vars(builtins), "__import__": self._import}}
        )
        super().exec_module(module)
        _adapt_python_autonomies(module)

    def _import(
        self,
        name: str,
        globals: Any = None,  # noqa: A002 - as those of builtins.__import__
        locals: Any = None,  # noqa: A002
        fromlist: Any = (),
        level: int = 0,
    ) -> Any:
        """Import a module for the file's statements: a plain name is looked up in its folder first."""
        head = name.partition(".")[0]
        neighbour = f"{self.package}.{head}"
        if level == 0 and neighbour in _finder().loaders:
            found = builtins.__import__(f"{self.package}.{name}", globals, locals, fromlist)
            return found if fromlist else sys.modules[neighbour]
        if level == 0 and head == BINDINGS:
            return importlib.import_module("tussle.plugins.stock.autonomy.py_autonomy.bindings")
        return builtins.__import__(name, globals, locals, fromlist, level)
