"""Modules under their former names. They still import, with a warning, until version 0.2."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

GOES_IN = "0.2"
FORMER = {
    **dict.fromkeys(("columns", "comms", "displays", "lists", "messages", "texts", "units"), "declare"),
    **dict.fromkeys(("contacts", "geodesy", "prism", "rays", "scene", "shapes"), "world"),
    **dict.fromkeys(("neighbors", "rng"), "numeric"),
    **dict.fromkeys(("historic", "plan", "stock"), "plugins"),
    **dict.fromkeys(("autopilots", "ros", "rpc"), "plugins.links"),
    "bridges": "cli",
    "event_texts": "record",
    "serve": "view",
}
"""Former name of a package or module below `tussle`, and the package that it has moved to."""
DOORWAYS = frozenset({"historic", "messages", "plan", "scene", "serve", "stock"})
"""Public modules of today that have kept their names."""


class FormerNames(MetaPathFinder, Loader):
    """Finds modules by their former names: `tussle.columns` is `tussle.declare.columns`, the same object."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return a spec if the name is a former one."""
        root, _, name = fullname.partition(".")
        if root != "tussle" or name.partition(".")[0] not in FORMER or name in DOORWAYS:
            return None
        return ModuleSpec(fullname, self)

    def exec_module(self, module: ModuleType) -> None:
        """Import the module by its present name, and put it in the place of the former one."""
        former = module.__name__
        name = former.removeprefix("tussle.")
        present = f"tussle.{FORMER[name.partition('.')[0]]}.{name}"
        package, _, last = present.rpartition(".")
        if last == "plugin" and not hasattr(import_module(package), "__path__"):
            present = package  # a plugin that was a folder and is a file now
        text = f"{former} is {present} now; the former name goes in version {GOES_IN}"
        warnings.warn(text, DeprecationWarning, stacklevel=2)
        found = import_module(present)
        if former.startswith("tussle.stock.") and not hasattr(found, "__path__") and last != "plugin":
            vars(module).update({name: value for name, value in vars(found).items() if name[:2] != "__"})
            module.__path__ = []  # of the folder that it was, whose modules are asked for next
        else:
            sys.modules[former] = found


def install() -> None:
    """Let former names be imported."""
    # First, since a package by its former name has the folder of the present one, in which others would find its modules once more.
    if not any(isinstance(each, FormerNames) for each in sys.meta_path):
        sys.meta_path.insert(0, FormerNames())
