"""Plugins by name: shipped plugins, those of installed packages, and those of plugin files."""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache, partial
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from tussle.api import Autonomy, Behavior, Controller, Interaction, Metric, MotionModel, Network, Sensor
from tussle.api.plugin import Plugin
from tussle.documents import several
from tussle.errors import MissionError, clipped, nearest_name
from tussle.mission.laws import shipped
from tussle.mission.plugin_files import PluginFile
from tussle.plugins import stock

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
"""Tag -> kind of the plugin that it names."""


@cache
def historic() -> dict[str, Any]:
    """Return names and attributes of SCRIMMAGE's plugins."""
    return tomllib.loads((Path(stock.__file__).parent / "historic.toml").read_text(encoding="utf-8"))


@cache
def missing() -> dict[str, str]:
    """Map each plugin of SCRIMMAGE that tussle lacks to the reason: "not yet: needs ROS", "dropped: ..."."""
    file = Path(stock.__file__).parents[1] / "historic" / "differences.toml"
    return dict(tomllib.loads(file.read_text(encoding="utf-8"))["missing"])


class AbsentPluginError(MissionError):
    """A plugin of SCRIMMAGE that tussle does not have yet."""


@dataclass(frozen=True)
class PluginSource:
    """Source of a plugin class.

    Attributes:
        place: Description for messages.
        load: Returns the class.
    """

    place: str
    load: Callable[[], Any]


class Catalogue:
    """Finds plugin classes by name. Plugin files take precedence over installed packages, and these over shipped plugins.

    Args:
        plugin_files: Python files with further plugins; later files take precedence.
        compat: Laws of the shipped plugins: "" for tussle's, "scrimmage" for SCRIMMAGE's where they differ.

    Attributes:
        names: Names of all plugins, sorted.

    Raises:
        MissionError: A file cannot be imported, or defines no plugin and no Task; or there are no such laws.
    """

    def __init__(self, plugin_files: Iterable[str | Path | PluginFile] = (), compat: str = "") -> None:
        self._sources: dict[str, list[PluginSource]] = {
            name: [PluginSource("that ships", load)] for name, load in shipped(compat).items()
        }
        for point in installed():
            place = f"of the package {point.dist.name if point.dist else '?'} ({point.value})"
            self._sources.setdefault(point.name, []).append(PluginSource(place, point.load))
        for item in several(plugin_files):
            file = item if isinstance(item, PluginFile) else PluginFile.of(item)
            found = file.load()
            for name in found:
                source = PluginSource(f"of {file.path}", partial(found.__getitem__, name))
                others = [s for s in self._sources.get(name, ()) if s.place != source.place]
                self._sources[name] = [*others, source]
        self.names = sorted(self._sources)

    def load(self, name: str) -> type[Plugin]:
        """Return the plugin class with this name.

        Raises:
            AbsentPluginError: It is a plugin of SCRIMMAGE that tussle does not have yet.
            MissionError: There is no such plugin, or it cannot be imported.
        """
        name = self.present_name(name)
        if name not in self._sources:
            if name in historic()["plugins"]["names"]:
                kind, _, why = missing()[name].partition(": ")
                raise AbsentPluginError(
                    f"{name} is {'dropped' if kind == 'dropped' else 'not in tussle yet'}: {why}"
                )
            if now := historic()["replaced"].get(name):
                raise MissionError(
                    f"{name} is a plugin of former versions of SCRIMMAGE; {now} is the nearest one now"
                )
            if name in historic()["nowhere"]["names"]:
                raise AbsentPluginError(
                    f"{name} is nowhere: SCRIMMAGE does not have it either; --plugin-path FILE adds yours"
                )
            raise MissionError(
                f"there is no plugin {clipped(name)!r}{nearest_name(name, self.names)}; `tussle plugins` lists them, "
                "and --plugin-path FILE adds those of a file"
            )
        source = self._sources[name][-1]
        try:
            found = source.load()
        except (Exception, SystemExit) as error:
            text = f"{type(error).__name__}: {' '.join(str(error).split())}"
            raise MissionError(f"plugin {name!r} {source.place} cannot be imported: {text}") from error
        if not (isinstance(found, type) and issubclass(found, Plugin)):
            raise MissionError(f"plugin {name!r} {source.place} is {found!r}, which is not a plugin class")
        return found

    def present_name(self, name: str) -> str:
        """Return the name of the plugin that has the law of this former one; the same name for all others."""
        return name if name in self._sources else historic()["former"].get(name, name)

    def adapter(self, cls: type[Plugin], name: str) -> type[Plugin]:
        """Return the plugin that runs a class or a function of a plugin file.

        Args:
            cls: The plugin of the mission, such as PyAutonomy.
            name: Its name.

        Raises:
            MissionError: No plugin file has it.
        """
        prefix = f"{cls.__name__}_"
        if prefix + name in self._sources:
            return self.load(prefix + name)
        if name and name == cls.historic_attributes.chosen_default:
            return cls
        found = [known.removeprefix(prefix) for known in self.names if known.startswith(prefix)]
        raise MissionError(
            f"{cls.__name__}: no plugin file has a {cls.historic_attributes.chosen_kind.format(repr(name[:80]))}"
            f"{nearest_name(name, found)}; give its file with --plugin-path"
        )

    def hides(self, name: str) -> str:
        """Return a note on which of several plugins with this name is used, or on its present name; "" if there is only one."""
        now = self.present_name(name)
        if now != name:
            return f"{name} is the former name of {now}"
        *others, winner = (f"the one {source.place}" for source in self._sources[name])
        return f"{name} is {winner}; it hides {' and '.join(others)}" if others else ""


def installed() -> tuple[EntryPoint, ...]:
    """Return the entry points `tussle.plugins` of installed packages, in reverse order of the import path, so that the first one wins."""
    return _installed(tuple(sys.path))


@cache
def _installed(_path: tuple[str, ...]) -> tuple[EntryPoint, ...]:
    """Return the entry points, cached per import path: searching the packages takes longer than reading a mission."""
    return tuple(reversed(tuple(entry_points(group="tussle.plugins"))))
