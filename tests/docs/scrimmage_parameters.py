"""The parameters of SCRIMMAGE's plugins (2025) and their defaults, and what becomes of each by its laws here.

`scrimmage_parameters.csv` has a line per parameter: the plugin, the parameter, whether the default is that of the plugin's file or that of
the call that reads it, the default, its state here, and for the states `unread`, `differs` and `refused` the reason.
"""

from __future__ import annotations

import csv
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import pytest

from tussle.api.plugin import RESERVED, Plugin
from tussle.errors import TussleError
from tussle.mission.catalogue import historic as attributes
from tussle.plugins import historic, stock

FILE = Path(__file__).with_suffix(".csv")


class Parameter(NamedTuple):
    """A line of the table."""

    plugin: str
    name: str
    source: str
    default: str
    state: str
    reason: str


def table() -> list[Parameter]:
    """All parameters, by plugin and name."""
    with FILE.open(encoding="utf-8") as file:
        return [Parameter(*row) for row in list(csv.reader(file))[1:]]


def state_of(plugin: str, name: str, default: str, law: ModuleType = historic) -> str:
    """Return what becomes of a parameter by the laws of `historic` or `stock`.

    same: It has the same default. differs: It has another one. inside: It is a list of plugins. chosen: It names the plugin, or a class
    or function of a plugin file, or is passed on to it. unread: It is ignored with a note. viewer: It is kept for the viewer. refused: It
    is an error. missing: There is no such plugin.
    """
    if plugin not in stock.manifest():
        return "missing"
    cls = law.load(plugin)
    known, drawn = cls.historic_attributes, attributes()["viewer"]
    parameter = known.renamed.get(name, name)
    for joined, parts in known.joined.items():
        if name in parts:
            ours = cls.params()[joined].default[parts.index(name)]
            return "same" if ours == float(default) else "differs"
    if parameter in cls.children():
        return "inside"
    if parameter in cls.params():
        return "same" if _is_default(cls, parameter, default) else "differs"
    if name in RESERVED or name == known.chosen_by or (known.rest and name not in known.unread):
        return "chosen"
    if name.startswith(tuple(drawn["prefixes"])) or name in drawn["names"]:
        return "viewer"
    return "unread" if name in known.unread or name in attributes()["unread"]["names"] else "refused"


def _is_default(cls: type[Plugin], parameter: str, text: str) -> bool:
    column = cls.params()[parameter]
    if parameter in cls.historic_attributes.least_zero and text.startswith("-"):
        text = "0"
    try:
        value: Any = column.convert(text)
    except TussleError:
        return False
    if isinstance(value, str):
        return value.split() == column.default.split()
    try:
        return value == pytest.approx(column.default, rel=1e-12)
    except TypeError:  # rows of numbers
        return value == column.default
