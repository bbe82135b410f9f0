"""Plugin files: Python files that are named, with the files beside them that they import.

A folder that holds plugin files is a package of its own, called after a hash of its path, and so two folders may each have a
`geometry.py`. In it `from . import geometry` means the neighbour, and so does a plain `import geometry`, as in a script: the files
are run with an `__import__` of their own, which looks beside them first. Nothing is put on `sys.path`, and nobody else notices.
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
from tussle.errors import MissionError

PREFIX = "tussle_plugins_"
"""Begins the names of the packages that folders with plugin files are."""
DIGEST = "__plugin_file_digest__"
"""In the module of a file: hash of the texts that it was made from, its own and those that it imports."""
INIT = "__init__"


@dataclass(frozen=True)
class PluginFile:
    """A Python file with plugins as it was when it was read, and all in its folder that it imports.

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
        """The file as it is now; nothing of it is run.

        Raises:
            MissionError: It is not there, cannot be read, or is no Python file.
        """
        file = Path(path).expanduser()
        if not file.is_file():
            raise MissionError(f"{path}: there is no such plugin file")
        if file.suffix != ".py":
            raise MissionError(f"{path}: this is not a Python file (its name ends with .py)")
        file = file.resolve()
        return cls(str(file.parent), file.name, _reached(file.name, lambda name: _read(file.parent / name)))

    @property
    def path(self) -> str:
        return str(Path(self.folder, self.name))

    @cached_property
    def package(self) -> str:
        """Name of the package that the folder is."""
        return PREFIX + hashlib.blake2b(self.folder.encode(), digest_size=4).hexdigest()

    @property
    def module(self) -> str:
        """Name of the module that the file is: one of its own, so that plugins of two files called alike pickle."""
        return self._module(self.name)

    def load(self) -> dict[str, type[Plugin]]:
        """The plugins that it defines, by the names of their classes. The file is run, as an import does.

        What has not changed since it was loaded is not run again: its classes stay the same ones. Of the files on the disk nothing
        is read, so that it may be loaded on a machine that does not have them.

        Raises:
            MissionError: It cannot be imported, or defines no plugin; the message has the file's own line.
        """
        self._offer()
        try:
            module = importlib.import_module(self.module)
        except (Exception, SystemExit) as error:
            sys.modules.pop(self.module, None)
            raise MissionError(
                f"{self._line(error)}: it cannot be imported: {type(error).__name__}: {error}"
            ) from error
        found = {
            key: value
            for key, value in vars(module).items()
            if isinstance(value, type) and issubclass(value, Plugin) and value.__module__ == self.module
        }
        if not found:
            raise MissionError(
                f"{self.path}: it defines no plugin (a class derived from Autonomy, MotionModel, ...)"
            )
        return found

    def _module(self, name: str) -> str:
        parts = PurePosixPath(name).with_suffix("").parts
        parts = parts[:-1] if len(parts) > 1 and parts[-1] == INIT else parts
        return ".".join((self.package, *(part.replace(".", "_") for part in parts)))

    def _offer(self) -> None:
        """Have the modules found by imports, and those forgotten that were made from other texts."""
        finder = _finder()
        loaders: dict[str, _Loader] = {}
        for folder in {parent for name in self.texts for parent in PurePosixPath(name).parents}:
            path = str(folder / f"{INIT}.py")  # a folder without one is an empty package
            module = self._module(path) if folder.parts else self.package
            loaders[module] = _Loader(str(Path(self.folder, path)), "", "", True, self.package)
        for name, text in self.texts.items():
            reached = _reached(name, self.texts.get)
            digest = hashlib.blake2b(repr(sorted(reached.items())).encode(), digest_size=16).hexdigest()
            is_package = name.endswith(f"/{INIT}.py")
            path = str(Path(self.folder, name))
            loaders[self._module(name)] = _Loader(path, text, digest, is_package, self.package)
        gone = {self._module(name) for own, text in self.texts.items() for name in _imported(own, text)}
        for module in (gone | loaders.keys()) & sys.modules.keys():
            if module not in loaders or vars(sys.modules[module]).get(DIGEST) != loaders[module].digest:
                del sys.modules[module]
                parent, _, last = module.rpartition(".")
                if parent in sys.modules:  # where `from . import` would find it
                    vars(sys.modules[parent]).pop(last, None)
        for module in gone - loaders.keys():
            finder.loaders.pop(module, None)
        finder.loaders.update(loaders)

    def _line(self, error: BaseException) -> str:
        """The last line of the file, or of a neighbour, that the error passed through."""
        if isinstance(error, SyntaxError) and error.lineno:
            return f"{error.filename or self.path}:{error.lineno}"
        files = {str(Path(self.folder, name)) for name in self.texts}
        own = [f for f in traceback.extract_tb(error.__traceback__) if f.filename in files]
        return f"{own[-1].filename}:{own[-1].lineno}" if own else self.path


def load_plugin_file(path: str | Path) -> dict[str, type[Plugin]]:
    """The plugins that a Python file defines, by the names of their classes (see `PluginFile.load`).

    Raises:
        MissionError: It cannot be read or imported, or defines no plugin.
    """
    return PluginFile.of(path).load()


# -- which files belong together ----------------------------------------------------------------------------------------------


def _read(file: Path) -> str | None:
    if not file.is_file():
        return None
    try:
        return file.read_text(encoding="utf-8")
    except OSError as error:
        raise MissionError(f"{file}: it cannot be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise MissionError(f"{file}: it cannot be read: {error}") from error


def _reached(first: str, read: Callable[[str], str | None]) -> dict[str, str]:
    """Path within the folder -> text, of a file and of all there that it imports, and these in turn."""
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
    """Paths within the folder that import statements of a file may mean, whether or not they are there."""
    try:
        statements = list(ast.walk(ast.parse(text)))
    except (SyntaxError, ValueError):  # told, with its line, when it is run
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


# -- importing them -----------------------------------------------------------------------------------------------------------


def _finder() -> _Finder:
    """The one of this process; put in place when it is asked for first."""
    found = next((f for f in sys.meta_path if isinstance(f, _Finder)), None)
    if found is None:
        found = _Finder({})
        sys.meta_path.insert(0, found)
    return found


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
            spec.submodule_search_locations.clear()  # what is not in the texts would not be there on another machine
        return spec


@dataclass(frozen=True)
class _Loader(ExecutionLoader):
    """Makes one module from its text.

    Attributes:
        path: Of the file, which need not be there.
        text: The text.
        digest: See `DIGEST`.
        is_folder: It is a package.
        package: The package of all neighbours.
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

    def _import(
        self,
        name: str,
        globals: Any = None,  # noqa: A002 - as those of builtins.__import__
        locals: Any = None,  # noqa: A002
        fromlist: Any = (),
        level: int = 0,
    ) -> Any:
        """What an import statement of the file does: a plain name is looked for beside it first."""
        neighbour = f"{self.package}.{name.partition('.')[0]}"
        if level == 0 and neighbour in _finder().loaders:
            found = builtins.__import__(f"{self.package}.{name}", globals, locals, fromlist)
            return found if fromlist else sys.modules[neighbour]
        return builtins.__import__(name, globals, locals, fromlist, level)
