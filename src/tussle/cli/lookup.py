"""Find plugins by name."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from tussle.api import Plugin
from tussle.cli.terminal import say_note
from tussle.errors import MissionError, nearest_name
from tussle.mission import Catalogue, PluginFile, shipped_missions


def all_plugins(files: Iterable[Path]) -> tuple[dict[str, type[Plugin]], list[str], list[str]]:
    """Return all plugins by name, the errors of those that cannot be loaded, and notes on names that hide others."""
    found: dict[str, type[Plugin]] = {}
    good, wrong = list[PluginFile](), list[str]()
    for path in files:
        try:
            file = PluginFile.of(path)
            file.load()
            good.append(file)
        except MissionError as error:
            wrong.append(str(error))
    catalogue = Catalogue(good)
    for name in catalogue.names:
        try:
            found[name] = catalogue.load(name)
        except MissionError as error:
            wrong.append(str(error))
    return found, wrong, [text for name in found if (text := catalogue.hides(name))]


def plugin_named(name: str, files: Iterable[Path]) -> type[Plugin] | None:
    """Return the plugin of this name, or None if the name is that of a mission.

    Raises:
        MissionError: No plugin or mission has this name.
    """
    catalogue = Catalogue(files)
    if name in catalogue.names:
        if hides := catalogue.hides(name):
            say_note(hides)
        return catalogue.load(name)
    if name in shipped_missions() or Path(name).exists() or Path(name).suffix == ".xml":
        return None
    known = [*shipped_missions(), *catalogue.names]
    raise MissionError(
        f"no mission or plugin is named {name!r}{nearest_name(name, known)}; "
        f"`tussle missions` and `tussle plugins` list all names, and the name of a mission file ends with .xml"
    )
