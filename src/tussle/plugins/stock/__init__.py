"""Stock plugins, imported by name: `from tussle.stock import Boids`. A plugin's module is imported on first use."""

from __future__ import annotations

import importlib
import tomllib
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any

from tussle.errors import ParameterError, listed, nearest_name

ALWAYS_THERE = ("GlobalNetwork", "LocalNetwork")
"""Networks that every mission has. GlobalNetwork is the default network of a message."""
UNMOVED = "Still"
"""Motion model of an entity for which the mission file names none."""


@cache
def manifest() -> dict[str, str]:
    """Map the name of each stock plugin to "module:class"."""
    return read_manifest(Path(__file__).parent)


def read_manifest(folder: Path) -> dict[str, str]:
    """Map the name of each plugin of a folder's `manifest.toml` to "module:class"."""
    return dict(tomllib.loads((folder / "manifest.toml").read_text(encoding="utf-8"))["plugins"])


def import_class(path: str) -> Any:
    """Return the class of "module:class"."""
    module, _, attribute = path.partition(":")
    return getattr(importlib.import_module(module), attribute)


@cache
def examples() -> dict[str, Path]:
    """Map the name of each stock plugin to its example: a short mission file that shows what the plugin does."""
    modules = {name: path.partition(":")[0].split(".")[3:] for name, path in manifest().items()}
    places = {name: Path(__file__).parent.joinpath(*module) for name, module in modules.items()}
    return {n: p / "example.xml" if p.is_dir() else p.with_suffix(".xml") for n, p in places.items()}


def load(name: str) -> Any:
    """Return a stock plugin class.

    Raises:
        ParameterError: No stock plugin has this name.
    """
    if name not in manifest():
        raise ParameterError(
            f"there is no plugin {name!r}{nearest_name(name, manifest())}; {listed(manifest())}"
        )
    return import_class(manifest()[name])


def advise_controllers(offered: Iterable[str], needed: Iterable[str]) -> list[str]:
    """Return controllers whose required inputs are all offered and whose outputs include all needed channels."""
    offered, needed = set(offered), set(needed)
    found = []
    for name, path in manifest().items():
        if ".controller." in path:
            controller = load(name)
            takes = {
                c for column in controller.inputs().values() for c in column.channels if not column.optional
            }
            gives = {c for column in controller.outputs().values() for c in column.channels}
            if takes and takes <= offered and needed <= gives:
                found.append(name)
    return found


def adapters(module: Mapping[str, Any]) -> list[Any]:
    """Return plugin classes for the classes and actors of SCRIMMAGE's Python interface that a module, given by its names, defines."""
    found: list[Any] = []
    if any(hasattr(value, "step_autonomy") for value in module.values()):
        found += load("PyAutonomy").adapters(module)
    if any(
        isinstance(value, FunctionType) and "action_space" in value.__code__.co_varnames
        for value in module.values()
    ):
        found += [plugin for name in ("RLSimple", "RLConsensus") for plugin in load(name).adapters(module)]
    return found


def __getattr__(name: str) -> Any:
    if name == "__all__":
        return __dir__()  # for `from tussle.stock import *`
    if not name.startswith("_") and name in manifest():
        return load(name)
    raise AttributeError(
        f"module 'tussle.stock' has no attribute {name!r}{nearest_name(name, manifest()) if not name.startswith('_') else ''}"
    )


def __dir__() -> list[str]:
    return sorted(name for name in manifest() if name.isidentifier())
