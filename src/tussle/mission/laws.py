"""Choice of laws for a mission: tussle's own, or with `compat` those of SCRIMMAGE where they differ."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from tussle.api.plugin import Plugin
from tussle.errors import MissionError, nearest_name
from tussle.plugins import stock

COMPAT = ("scrimmage",)
"""Names of laws other than tussle's."""


def check_compat(compat: Any) -> None:
    """Check the name of a set of laws; "" selects tussle's own.

    Raises:
        MissionError: There are no such laws.
    """
    if compat != "" and compat not in COMPAT:
        hint = nearest_name(compat, COMPAT) if isinstance(compat, str) else ""
        raise MissionError(f"compat = {compat!r} is not allowed{hint}; allowed is {COMPAT[0]!r}, or nothing")


def shipped(compat: str) -> dict[str, Callable[[], Any]]:
    """Map the name of each shipped plugin to the function that returns its class.

    Raises:
        MissionError: There are no such laws.
    """
    check_compat(compat)
    if not compat:
        return {name: partial(stock.load, name) for name in stock.manifest()}
    from tussle.plugins import historic  # loaded only on demand

    return {name: partial(historic.load, name) for name in {**stock.manifest(), **historic.manifest()}}


def with_laws(owner: Any, names: Iterable[str]) -> dict[str, Any]:
    """Return the plugins of a block or mission by field, with tussle's replaced by SCRIMMAGE's where the laws differ."""
    found = {}
    for name in names:
        plugins = getattr(owner, name)
        found[name] = tuple(map(with_law, plugins)) if isinstance(plugins, tuple) else with_law(plugins)
    return found


def with_law(plugin: Plugin) -> Plugin:
    """Return the plugin with SCRIMMAGE's law and defaults if it is a stock plugin whose law differs.

    The plugins inside it are replaced likewise.
    """
    from tussle.plugins import historic

    cls, values = type(plugin), plugin.stated
    values |= {name: tuple(map(with_law, values[name])) for name in plugin.children() if name in values}
    name = cls.__name__
    if name in historic.manifest() and name in stock.manifest() and cls is stock.load(name):
        cls = historic.load(name)
    if cls is type(plugin) and values == plugin.stated:
        return plugin
    return cls(name=plugin.instance_name, rate=plugin.rate, states=plugin.active_in, **values)
