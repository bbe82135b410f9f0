"""The plugins that ship, by name: `from tussle.stock import Boids`. Each loads when it is asked for first."""

from __future__ import annotations

import importlib
import tomllib
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

from tussle.errors import ParameterError, listed, nearest_name

ALWAYS_THERE = ("GlobalNetwork", "LocalNetwork")
"""Networks of every mission: from everyone to everyone, which carries what names no other, and within one entity."""
UNMOVED = "Still"
"""The motion model of an entity that a mission file gives none."""


@cache
def manifest() -> dict[str, str]:
    """Name -> "module:class" of every plugin that ships."""
    text = (Path(__file__).parent / "manifest.toml").read_text(encoding="utf-8")
    return dict(tomllib.loads(text)["plugins"])


def load(name: str) -> Any:
    """A plugin class that ships, by its name.

    Raises:
        ParameterError: There is none of this name.
    """
    if name not in manifest():
        raise ParameterError(
            f"there is no plugin {name!r}{nearest_name(name, manifest())}; {listed(manifest())}"
        )
    module, _, attribute = manifest()[name].partition(":")
    return getattr(importlib.import_module(module), attribute)


def advise_controllers(offered: Iterable[str], needed: Iterable[str]) -> list[str]:
    """Controllers that take only offered channels and write all needed ones."""
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


def __getattr__(name: str) -> Any:
    if not name.startswith("_") and name in manifest():
        return load(name)
    raise AttributeError(
        f"module {__name__!r} has no attribute {name!r}{nearest_name(name, manifest()) if not name.startswith('_') else ''}"
    )


def __dir__() -> list[str]:
    return sorted({*globals(), *manifest()})
