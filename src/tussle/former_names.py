"""Modules under their former names. They still import, with a warning, until version 0.2."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
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
        present = _present_name(former)
        text = f"{former} is {present} now; the former name goes in version {GOES_IN}"
        warnings.warn(text, DeprecationWarning, stacklevel=2)
        found = import_module(present)
        is_plugin = former.startswith("tussle.stock.") and not former.endswith(".plugin")
        if (is_plugin or _is_historic(former)) and not hasattr(found, "__path__"):
            vars(module).update({name: value for name, value in vars(found).items() if name[:2] != "__"})
            module.__path__ = []  # of the folder that it was, whose modules are asked for next
        else:
            sys.modules[former] = found


def _present_name(former: str) -> str:
    name = former.removeprefix("tussle.")
    present = f"tussle.{FORMER[name.partition('.')[0]]}.{name}"
    if _is_module(present):
        return present
    if name.endswith(".plugin"):
        return present.removesuffix(".plugin")
    return "tussle.plugins.historic" if _is_historic(former) else present


def _is_historic(former: str) -> bool:
    """Whether it was a module of plugins with SCRIMMAGE's laws: they had the names of the modules of stock plugins."""
    room, _, name = former.removeprefix("tussle.").partition(".")
    return room == "historic" and _is_module(f"tussle.plugins.stock.{name}")


def _is_module(name: str) -> bool:
    try:
        return find_spec(name) is not None
    except ModuleNotFoundError:  # what the name says is its package is not one
        return False


def install() -> None:
    """Let former names be imported."""
    # First, since a package by its former name has the folder of the present one, in which others would find its modules once more.
    if not any(isinstance(each, FormerNames) for each in sys.meta_path):
        sys.meta_path.insert(0, FormerNames())
