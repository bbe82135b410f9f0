"""Plugins by name: those that ship, those of installed packages, and those of files that were named."""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache, partial
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from tussle import stock
from tussle.api import Autonomy, Behavior, Controller, Interaction, Metric, MotionModel, Network, Sensor
from tussle.api.plugin import Plugin
from tussle.errors import MissionError, nearest_name
from tussle.mission.plugin_files import PluginFile

KINDS: dict[str, type] = {
    "autonomy": Autonomy,
    "controller": Controller,
    "motion_model": MotionModel,
    "sensor": Sensor,
    "entity_interaction": Interaction,
    "metrics": Metric,
    "network": Network,
    "behaviors": Behavior,
}
"""What each tag names."""


@cache
def historic() -> dict[str, Any]:
    """What is known of the existing system's plugins."""
    return tomllib.loads((Path(stock.__file__).parent / "historic.toml").read_text(encoding="utf-8"))


class AbsentPluginError(MissionError):
    """A plugin of the existing system that tussle does not have yet."""


@dataclass(frozen=True)
class Offer:
    """Where a plugin is to be had.

    Attributes:
        place: In words.
        load: Gives the class.
    """

    place: str
    load: Callable[[], Any]


class Catalogue:
    """Finds plugin classes by name. Plugins of files win over those of installed packages, and these over those that ship.

    Args:
        plugin_files: Python files whose plugins can be named too; of two with the same name the later file's wins.

    Attributes:
        names: All that can be named.

    Raises:
        MissionError: A file cannot be imported, or holds no plugin.
    """

    def __init__(self, plugin_files: Iterable[str | Path | PluginFile] = ()) -> None:
        self._offers: dict[str, list[Offer]] = {
            name: [Offer("that ships", partial(stock.load, name))] for name in stock.manifest()
        }
        for point in installed():
            place = f"of the package {point.dist.name if point.dist else '?'} ({point.value})"
            self._offers.setdefault(point.name, []).append(Offer(place, point.load))
        for given in plugin_files:
            file = given if isinstance(given, PluginFile) else PluginFile.of(given)
            found = file.load()
            for name in found:
                offer = Offer(f"of {file.path}", partial(found.__getitem__, name))
                others = [o for o in self._offers.get(name, ()) if o.place != offer.place]
                self._offers[name] = [*others, offer]
        self.names = sorted(self._offers)

    def load(self, name: str) -> type[Plugin]:
        """The class of this name.

        Raises:
            AbsentPluginError: The existing system has it, tussle not yet.
            MissionError: There is none, or its module cannot be imported.
        """
        if name not in self._offers:
            if name in historic()["plugins"]["names"]:
                raise AbsentPluginError(f"{name} is not in tussle yet")
            raise MissionError(
                f"there is no plugin {name[:80]!r}{nearest_name(name[:80], self.names)}; `tussle plugins` lists them, "
                "and --plugin-path FILE brings those of a file"
            )
        offer = self._offers[name][-1]
        try:
            found = offer.load()
        except (Exception, SystemExit) as error:
            text = f"{type(error).__name__}: {' '.join(str(error).split())}"
            raise MissionError(f"plugin {name!r} {offer.place} cannot be imported: {text}") from error
        if not (isinstance(found, type) and issubclass(found, Plugin)):
            raise MissionError(f"plugin {name!r} {offer.place} is {found!r}, which is no plugin class")
        return found

    def hides(self, name: str) -> str:
        """Which plugin a name means that several have, in words; "" where there is one only."""
        *others, winner = (f"the one {offer.place}" for offer in self._offers[name])
        return f"{name} is {winner}; it hides {' and '.join(others)}" if others else ""


def installed() -> tuple[EntryPoint, ...]:
    """What other installed packages offer under the entry point `tussle.plugins`; who is first on the import path comes last."""
    return _installed(tuple(sys.path))


@cache
def _installed(_path: tuple[str, ...]) -> tuple[EntryPoint, ...]:
    """What the packages on an import path offer: looking through them takes longer than reading a mission."""
    return tuple(reversed(tuple(entry_points(group="tussle.plugins"))))
